"""Which contacts act, and how: the acceleration-level complementarity problem of a moment.

    a_n >= 0,  f_n >= 0,  a_n f_n = 0;    a contact that has no tangential velocity holds (a_t = 0, |f_t| <= μ f_n)
    or starts to slide (f_t = -μ f_n a_t/|a_t|); one that has slides on (f_t = -μ f_n u_t/|u_t|)

When no contact slides, these are the conditions of an impact with accelerations in place of velocities, and the same
solver gives them: exact cones, pivoting behind it. When some slide, contacts change between open, held and sliding
until all conditions hold; each trial is one linear system (`forces`). Where that goes round in circles the solver is
asked again, with a large tangential acceleration in place of each contact's sliding. If it can only stop the sliding
(Painlevé's paradox: a sliding contact may have no force) the velocities have to jump: `hybrid` makes an impulse of it.
"""

from __future__ import annotations

import math

from physics.kernels import quaternion as qt
from physics.kernels.compiler import inlined, kernel
from physics.kernels.contact import wall_normal
from physics.kernels.events.forces import (
    PATCH,
    arm_and_rate,
    free_turning,
    list_unknowns,
    load,
    place,
    plus,
    solve_unknowns,
    spread,
    times,
    turned_by,
    vector,
)
from physics.kernels.events.guards import cone_excess, look_around
from physics.kernels.events.motion import START
from physics.kernels.events.smooth import put_state
from physics.kernels.share import wall_axes
from physics.kernels.slide import HOLD

# What a body does.
FLIES, COLLIDES, MOVES, RESTS, IS_LOST, ASKS, ASKS_SLIDING = range(7)

OPEN, HELD, SLIDING = range(3)

# Accelerations and forces below this share of the largest free ones are zero: of the solver's, and of an exact trial.
SMALL = 1.0e-8
SMALL_EXACT = 1.0e-11

# Trials of a mixture, and how often one contact may change in them.
TRIALS = 60
CHANGES = 6

# Tangential acceleration that stands for sliding where no mixture was found, in largest free ones; the direction of a
# contact that slides is then off by the inverse of it. A push of PARADOX times that would stop the sliding: there is no
# force, only an impulse.
FAST = 1.0e3
PARADOX = 0.03

# Approach of a contact that will leave that is none, in `motion.still`.
UNSEEN_APPROACH = 1.0e-6

# Directions of sliding from rest are found when they no longer change by more than this.
SAME_WAY = 1.0e-9


@kernel
def find_candidates(y, tilted, work, motion):
    """Features that touch and do not leave, into `candidate`: (count, whether one approaches)."""
    put_state(motion, START, y)
    look_around(START, tilted, work, motion)
    count = 0
    for s in range(motion.is_active.shape[0]):
        if motion.gap[START, s] <= motion.touch and count < motion.slot.shape[0]:
            rate = motion.gap_rate[START, s]
            if rate < -motion.still:
                return 0, True
            if rate <= motion.still:
                motion.candidate[count] = s
                count += 1
    return count, False


@kernel
def act(count, work, motion):
    """Let the candidates act that are not open; mark their slots."""
    k = 0
    for s in range(motion.is_active.shape[0]):
        motion.is_active[s] = 0
    for i in range(count):
        if motion.kind[i] != OPEN and k < motion.slot.shape[0]:
            motion.slot[k] = motion.candidate[i]
            motion.is_active[motion.candidate[i]] = 1
            motion.holds[k] = 1 if motion.kind[i] == HELD else 0
            for c in range(3):
                motion.way[k, c] = motion.reference[k, c] = motion.candidate_way[i, c]
            k += 1
    motion.count = k


@inlined
def contact_acceleration(i, y, R, w, a, alpha, tilted, work, motion):
    """Acceleration of candidate i: (normal part, tangential part)."""
    wall = motion.candidate[i] // work.features
    n = wall_normal(work.walls, wall)
    r, rate = arm_and_rate(work.shape, load(work.dims), R, w, n, motion.candidate[i] % work.features, tilted, work)
    b = plus(plus(a, qt.cross(alpha, r)), qt.cross(w, rate))
    bn = qt.dot(n, b)
    return bn, (b[0] - bn * n[0], b[1] - bn * n[1], b[2] - bn * n[2])


@kernel
def sliding_now(i, y, R, w, tilted, work, motion):
    """Whether candidate i slides; its direction into `candidate_way`."""
    wall = motion.candidate[i] // work.features
    n = wall_normal(work.walls, wall)
    r, _ = arm_and_rate(work.shape, load(work.dims), R, w, n, motion.candidate[i] % work.features, tilted, work)
    u = plus(y[2], qt.cross(w, r))
    un = qt.dot(n, u)
    t = (u[0] - un * n[0], u[1] - un * n[1], u[2] - un * n[2])
    speed = math.sqrt(qt.dot(t, t))
    for c in range(3):
        motion.candidate_way[i, c] = 0.0
        if speed > motion.still:
            motion.candidate_way[i, c] = t[c] / speed
    return speed > motion.still


@inlined
def acceleration_scale(w, work):
    """Size of the accelerations of a body's contacts [m/s²]."""
    return work.acceleration + work.radius * qt.dot(w, w)


@inlined
def pose_contact(i, slot, r, target, work):
    """Contact i of a problem for `solve.solve_contacts`, without a warm start."""
    work.slot[i] = slot
    work.arm[i, 0], work.arm[i, 1], work.arm[i, 2] = r
    work.target[i, 0], work.target[i, 1], work.target[i, 2] = target
    work.impulse[3 * i] = work.impulse[3 * i + 1] = work.impulse[3 * i + 2] = 0.0


@kernel
def pose_resting(count, y, R, w, has_sliding, tilted, work, motion):
    """Write the contact problem of candidates that do not slide into `work`: (acceleration, moment) without forces.

    It is that of an impact with the free acceleration for velocity, the moment τ - ω x L for angular momentum and
    forces for impulses; what an arm's own motion adds to a contact's acceleration is asked of it as a target.
    `has_sliding`: some of the candidates slide (`candidate_way`).
    """
    walls, features = work.walls, work.features
    scale = acceleration_scale(w, work)
    for i in range(count):
        slot = motion.candidate[i]
        axes = wall_axes(walls, slot // features)
        r, rate = arm_and_rate(work.shape, load(work.dims), R, w, axes[0], slot % features, tilted, work)
        c = qt.cross(w, rate)
        if has_sliding:  # as if it had accelerated along its sliding for long: no force then turns it
            c = plus(c, times(FAST * scale, vector(motion.candidate_way, i)))
        pose_contact(i, slot, r, (-qt.dot(axes[0], c), -qt.dot(axes[1], c), -qt.dot(axes[2], c)), work)
    work.mode = HOLD
    g, t = qt.cross(w, y[3]), work.torque
    return load(work.free_acceleration), (t[0] - g[0], t[1] - g[1], t[2] - g[2])


@inlined
def is_way(way, i):
    """Whether a contact has a direction of sliding."""
    return way[i, 0] != 0.0 or way[i, 1] != 0.0 or way[i, 2] != 0.0


@inlined
def is_idle(i, count, width, small, work):
    """Whether contact i without a force may be left to the others of its wall: at least three push."""
    wall, pushing = work.slot[i] // work.features, 0
    for j in range(count):
        if work.slot[j] // work.features == wall and work.impulse[width * j] > small * work.mass:
            pushing += 1
    return pushing >= PATCH


@inlined
def keep_forces(count, width, work, motion):
    """Forces of the contacts that act, from the solver's: what a body at rest has is never found otherwise."""
    k = 0
    for i in range(count):
        if motion.kind[i] == OPEN:
            continue
        axes = wall_axes(work.walls, work.slot[i] // work.features)
        for c in range(3):
            motion.force[k, c] = 0.0
            for d in range(width):
                motion.force[k, c] += work.impulse[width * i + d] * axes[d][c]
        k += 1


@inlined
def closes(count, motion):
    """Whether a contact that will leave is still, by a little, on its way in."""
    least = -motion.noise - UNSEEN_APPROACH * motion.still
    for i in range(count):
        if motion.kind[i] == OPEN and motion.gap_rate[START, motion.candidate[i]] < least:
            return True
    return False


@kernel
def is_still(y, w, acceleration, work, motion):
    """Whether the body neither moves nor begins to: what is left is rounding."""
    v = y[2]
    speed = math.sqrt(qt.dot(v, v)) + work.radius * math.sqrt(qt.dot(w, w))
    return speed <= 2.0 * motion.still and acceleration <= 4.0 * SMALL * work.acceleration


@kernel
def read_resting(count, y, a, moment, friction, has_sliding, tilted, work, motion):
    """What the body does by the solution of `pose_resting`'s problem; the contacts that act are set."""
    R, P, w, _ = free_turning(y, tilted, work)
    alpha = turned_by(P, work.J, moment)
    width = 3
    if friction is None:
        width = 1
    scale = acceleration_scale(w, work)
    small = SMALL * scale
    if has_sliding:
        small *= FAST
    for i in range(count):
        an, at = contact_acceleration(i, y, R, w, a, alpha, tilted, work, motion)
        size = math.sqrt(qt.dot(at, at))
        push = work.impulse[width * i]
        if has_sliding and push > PARADOX * FAST * work.mass * scale:
            return IS_LOST
        slides = has_sliding and is_way(motion.candidate_way, i)
        kind = SLIDING
        if not push > small * work.mass and (an > small or is_idle(i, count, width, small, work)):
            kind = OPEN
        elif friction is not None and not slides and size <= small:
            kind = HELD
        motion.kind[i] = kind
        if slides:
            continue
        for c in range(3):
            motion.candidate_way[i, c] = at[c] / size if size > small else 0.0
    act(count, work, motion)
    if closes(count, motion):
        return COLLIDES
    if motion.count == 0:
        return FLIES
    acceleration = math.sqrt(qt.dot(a, a)) + work.radius * math.sqrt(qt.dot(alpha, alpha))
    if is_still(y, w, acceleration, work, motion):
        keep_forces(count, width, work, motion)
        return RESTS
    return MOVES


@kernel
def _change_one(count, y, R, w, a, alpha, scale, tilted, work, motion):
    """The change that a trial asks for most: (candidate, its new kind), -1 when all conditions hold."""
    weight = SMALL_EXACT * work.mass * scale
    k = worst = 0
    which, kind = -1, OPEN
    deepest = -weight
    for i in range(count):
        if motion.kind[i] != OPEN:
            if motion.normal[k] < deepest:
                deepest, which = motion.normal[k], i
            k += 1
    if which >= 0:
        return which, OPEN
    k = 0
    most = weight
    for i in range(count):
        if motion.kind[i] != OPEN:
            if motion.kind[i] == HELD:
                excess = cone_excess(k, work, motion)
                if excess > most:
                    most, which, worst, kind = excess, i, k, SLIDING
            k += 1
    if which >= 0:
        n = wall_normal(work.walls, motion.candidate[which] // work.features)
        f = vector(motion.force, worst)
        fn = qt.dot(n, f)
        t = (fn * n[0] - f[0], fn * n[1] - f[1], fn * n[2] - f[2])
        size = math.sqrt(qt.dot(t, t))
        if size > 0.0:
            for c in range(3):
                motion.candidate_way[which, c] = t[c] / size
        motion.is_fresh[which] = 1
        return which, kind
    for i in range(count):
        an, at = contact_acceleration(i, y, R, w, a, alpha, tilted, work, motion)
        if motion.kind[i] == OPEN and an < -SMALL_EXACT * scale:
            return i, SLIDING if motion.is_fresh[i] == 0 else HELD
        if motion.kind[i] == SLIDING and motion.is_fresh[i]:
            size = math.sqrt(qt.dot(at, at))
            along = qt.dot(at, vector(motion.candidate_way, i))
            if along < 0.0:
                return i, HELD
            if size > SMALL_EXACT * scale and size - along > 0.5 * SAME_WAY * size:
                for c in range(3):
                    motion.candidate_way[i, c] = at[c] / size
                return i, SLIDING
    return -1, OPEN


@kernel
def mixed_forces(count, y, R, P, w, alpha_free, tilted, work, motion):
    """Kinds of the candidates when some of them slide; whether they were found."""
    scale = work.acceleration + work.radius * qt.dot(w, w)
    for i in range(count):
        motion.is_fresh[i] = motion.changes[i] = 0
        motion.kind[i] = SLIDING
        if not sliding_now(i, y, R, w, tilted, work, motion):
            motion.is_fresh[i] = 1
            if work.mu > 0.0:
                motion.kind[i] = HELD
    f = load(work.free_acceleration)
    for _ in range(TRIALS):
        act(count, work, motion)
        place(y, R, w, alpha_free, tilted, work, motion)
        m = list_unknowns(work.mu, work, motion)
        F, T, _ = solve_unknowns(m, P, work, motion)
        spread(work.mu, work, motion)
        turn = turned_by(P, work.J, T)
        s = 1.0 / work.mass
        a = (f[0] + s * F[0], f[1] + s * F[1], f[2] + s * F[2])
        alpha = plus(alpha_free, turn)
        which, kind = _change_one(count, y, R, w, a, alpha, scale, tilted, work, motion)
        if which < 0:
            return True
        if kind != motion.kind[which]:
            motion.changes[which] += 1
            if motion.changes[which] > CHANGES:
                return False
        motion.kind[which] = kind
    return False


@kernel
def find_regime(y, friction, tilted, work, motion):
    """What the body does at y, and the contacts that act: (what, number of candidates, acceleration, moment).

    `ASKS`: none of the candidates slides, and the contact problem with this acceleration and moment, which is posed
    in `work`, decides (`read_resting`). `ASKS_SLIDING`: some do, no mixture was found, and that problem decides for
    them, too.
    """
    zero = (0.0, 0.0, 0.0)
    motion.count = 0
    count, approaches = find_candidates(y, tilted, work, motion)
    for s in range(motion.is_active.shape[0]):
        motion.is_active[s] = 0
    if approaches:
        return COLLIDES, 0, zero, zero
    if count == 0:
        return FLIES, 0, zero, zero
    R, P, w, alpha = free_turning(y, tilted, work)
    slides = False
    if friction is not None:
        for i in range(count):
            slides = sliding_now(i, y, R, w, tilted, work, motion) or slides
    if not slides or not mixed_forces(count, y, R, P, w, alpha, tilted, work, motion):
        if slides:
            for i in range(count):
                sliding_now(i, y, R, w, tilted, work, motion)
        a, moment = pose_resting(count, y, R, w, slides, tilted, work, motion)
        return (ASKS_SLIDING if slides else ASKS), count, a, moment
    if closes(count, motion):
        return COLLIDES, 0, zero, zero
    return (MOVES if motion.count > 0 else FLIES), count, zero, zero
