"""The contact problem of a moment for the impact's solver, and what its solution says that the contacts do."""

from __future__ import annotations

import math

from physics.kernels.compile.decorators import inlined, kernel
from physics.kernels.contact_solver.sliding_patch import HOLD
from physics.kernels.event_driven.contact_candidates import (
    COLLIDES,
    FLIES,
    HELD,
    IS_LOST,
    MOVES,
    OPEN,
    RESTS,
    SLIDING,
    acceleration_scale,
    act,
    closes,
    contact_acceleration,
)
from physics.kernels.event_driven.contact_forces import (
    PATCH,
    arm_and_rate,
    forget_forces,
    free_turning,
    load,
    plus,
    times,
    turned_by,
    vector,
)
from physics.kernels.half_space.contact_point import feature_of, wall_axes, wall_of
from physics.kernels.math import quaternion as qt

# Accelerations and forces of the solver below this share of the largest free ones are zero.
SMALL = 1.0e-8

# Tangential acceleration that stands for sliding where no mixture was found, in largest free ones; the direction of a
# contact that slides is then off by the inverse of it. A push of PARADOX times that would stop the sliding: there is no
# force, only an impulse.
FAST = 1.0e3
PARADOX = 0.03


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
    walls = work.walls
    scale = acceleration_scale(w, work)
    for i in range(count):
        slot = motion.candidate[i]
        axes = wall_axes(walls, wall_of(slot, work))
        r, rate = arm_and_rate(work.shape, load(work.dims), R, w, axes[0], feature_of(slot, work), tilted, work)
        c = qt.cross(w, rate)
        if has_sliding:  # as if it had accelerated along its sliding for long: no force then turns it
            c = plus(c, times(FAST * scale, vector(motion.candidate_way, i)))
        pose_contact(i, slot, r, (-qt.dot(axes[0], c), -qt.dot(axes[1], c), -qt.dot(axes[2], c)), work)
    work.mode = HOLD
    g, t = qt.cross(w, y[3]), work.torque
    return load(work.free_acceleration), (t[0] - g[0], t[1] - g[1], t[2] - g[2])


@inlined
def is_way(way, i):
    """True if a contact has a direction of sliding."""
    return way[i, 0] != 0.0 or way[i, 1] != 0.0 or way[i, 2] != 0.0


@inlined
def is_idle(i, count, width, small, work):
    """True if contact i without a force may be left to the others of its wall: at least three push."""
    wall, pushing = wall_of(work.slot[i], work), 0
    for j in range(count):
        if wall_of(work.slot[j], work) == wall and work.impulse[width * j] > small * work.mass:
            pushing += 1
    return pushing >= PATCH


@inlined
def take_forces(count, width, work, motion):
    """`last`: the solver's forces."""
    forget_forces(motion)
    for i in range(count):
        for c in range(width):
            motion.last[work.slot[i], c] = work.impulse[width * i + c]


@kernel
def is_still(y, w, acceleration, work, motion):
    """True if the body neither moves nor begins to: what is left is rounding."""
    v = y[2]
    speed = math.sqrt(qt.dot(v, v)) + work.radius * math.sqrt(qt.dot(w, w))
    return speed <= 2.0 * motion.still and acceleration <= 4.0 * SMALL * work.acceleration


@kernel
def read_resting(count, y, a, moment, friction, has_sliding, tilted, work, motion):
    """Read the regime from the solution of `pose_resting`'s problem, and set the contacts that act."""
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
    take_forces(count, width, work, motion)
    act(count, work, motion)
    if closes(count, motion):
        return COLLIDES
    if motion.count == 0:
        return FLIES
    acceleration = math.sqrt(qt.dot(a, a)) + work.radius * math.sqrt(qt.dot(alpha, alpha))
    if is_still(y, w, acceleration, work, motion):
        return RESTS
    return MOVES
