"""Contacts of which some slide: which hold, slide and are open, by trials of one linear system each."""

from __future__ import annotations

import math

from physics.kernels.compile.decorators import inlined, kernel
from physics.kernels.contact_law.anisotropic_friction import eased
from physics.kernels.event_driven.contact_candidates import (
    HELD,
    OPEN,
    SLIDING,
    act,
    contact_acceleration,
    sliding_now,
)
from physics.kernels.event_driven.contact_forces import (
    forget_forces,
    list_unknowns,
    load,
    place,
    plus,
    spread,
    turned_by,
    vector,
)
from physics.kernels.event_driven.force_system import solve_unknowns
from physics.kernels.event_driven.guards import cone_excess
from physics.kernels.half_space.contact_point import wall_axes, wall_of
from physics.kernels.math import quaternion as qt

# Accelerations and forces of an exact trial below this share of the largest free ones are zero.
SMALL_EXACT = 1.0e-11

# Trials of a mixture, and how often one contact may change in them.
TRIALS = 60
CHANGES = 6

# Directions of sliding from rest are found when they no longer change by more than this.
SAME_WAY = 1.0e-9


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
        axes = wall_axes(work.walls, wall_of(motion.candidate[which], work))
        n, f = axes[0], eased(eased(vector(motion.force, worst), axes, work), axes, work)
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


@inlined
def has_last(motion):
    """True if any force is known from before."""
    for s in range(motion.last.shape[0]):
        if motion.last[s, 0] != 0.0:
            return True
    return False


@kernel
def try_mixtures(count, y, R, P, w, alpha_free, tilted, work, motion):
    """`mixed_forces` with the last forces as they are."""
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
        m = list_unknowns(work.mu, True, work, motion)
        F, T = solve_unknowns(m, P, work, motion)
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
def mixed_forces(count, y, R, P, w, alpha_free, tilted, work, motion):
    """Kinds of the candidates when some of them slide; whether they were found, with the last forces or without."""
    if try_mixtures(count, y, R, P, w, alpha_free, tilted, work, motion):
        return True
    if not has_last(motion):
        return False
    forget_forces(motion)
    return try_mixtures(count, y, R, P, w, alpha_free, tilted, work, motion)
