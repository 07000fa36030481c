"""Search for the contact mode of a body with sliding contacts, by trials; each trial solves one linear system.

A trial assumes a state for each candidate contact: open, sticking or sliding. The condition that it violates most gives
the next trial.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.contact_law.anisotropic_friction import unstretch_force
from physics.kernels.contact_law.materials import friction_of, may_hold
from physics.kernels.event_driven.contact_candidates import (
    CANDIDATE_OPEN,
    CANDIDATE_SLIDING,
    CANDIDATE_STICKING,
    activate_candidates,
    contact_acceleration,
    is_candidate_sliding,
)
from physics.kernels.event_driven.contact_forces import (
    apply_inverse_inertia,
    assemble_unknowns,
    clear_last_forces,
    recover_contact_forces,
    set_contact_kinematics,
)
from physics.kernels.event_driven.force_system import solve_contact_forces
from physics.kernels.event_driven.guards import cone_excess
from physics.kernels.half_space.contact_point import wall_axes, wall_of
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import as_vector, plus, row_vector

# Accelerations and forces of a trial below this share of the largest free ones are zero.
_EXACT_ZERO_SHARE = 1.0e-11

# Largest number of trials, and of changes of one contact in them.
_MAX_MODE_TRIALS = 60
_MAX_MODE_CHANGES = 6

# A direction in which a contact begins to slide is found when it changes by less than this in a trial [rad].
_SAME_DIRECTION = 1.0e-9


@kernel
def _worst_violation(count, rates, scale, offset_frame, scratch, motion):
    """Find the candidate whose condition a trial violates most: (candidate, its new state); -1 if all conditions hold.

    First a contact that pulls opens, then one outside its friction cone slides. Then an open contact that closes acts,
    and a contact that begins to slide turns or sticks. `rates` are rotation matrix, angular velocity, acceleration and
    angular acceleration of the body in the trial; `scale` is that of accelerations [m/s²].
    """
    body = scratch.body
    candidates, contacts = motion.candidates, motion.contacts
    R, w, a, alpha = rates
    weight = _EXACT_ZERO_SHARE * body.mass * scale
    k = worst = 0
    which, kind = -1, CANDIDATE_OPEN
    deepest = -weight
    for i in range(count):
        if candidates.state[i] != CANDIDATE_OPEN:
            if contacts.normal[k] < deepest:
                deepest, which = contacts.normal[k], i
            k += 1
    if which >= 0:
        return which, CANDIDATE_OPEN
    k = 0
    most = weight
    for i in range(count):
        if candidates.state[i] != CANDIDATE_OPEN:
            if candidates.state[i] == CANDIDATE_STICKING:
                excess = cone_excess(k, scratch, contacts)
                if excess > most:
                    most, which, worst, kind = excess, i, k, CANDIDATE_SLIDING
            k += 1
    if which >= 0:
        axes = wall_axes(scratch.scene.walls, wall_of(candidates.slot[which], scratch.scene))
        n, f = axes[0], unstretch_force(unstretch_force(row_vector(contacts.force, worst, 0), axes, body), axes, body)
        fn = qt.dot(n, f)
        t = (fn * n[0] - f[0], fn * n[1] - f[1], fn * n[2] - f[2])
        size = math.sqrt(qt.dot(t, t))
        if size > 0.0:
            for c in range(3):
                candidates.direction[which, c] = t[c] / size
        candidates.is_fresh[which] = 1
        return which, kind
    for i in range(count):
        an, at = contact_acceleration(i, R, w, a, alpha, offset_frame, scratch, candidates)
        if candidates.state[i] == CANDIDATE_OPEN and an < -_EXACT_ZERO_SHARE * scale:
            holds = candidates.is_fresh[i] != 0 and may_hold(candidates.slot[i], scratch)
            return i, CANDIDATE_STICKING if holds else CANDIDATE_SLIDING
        if candidates.state[i] == CANDIDATE_SLIDING and candidates.is_fresh[i]:
            size = math.sqrt(qt.dot(at, at))
            along = qt.dot(at, row_vector(candidates.direction, i, 0))
            if along < 0.0 and may_hold(candidates.slot[i], scratch):
                return i, CANDIDATE_STICKING
            if size > _EXACT_ZERO_SHARE * scale and size - along > 0.5 * _SAME_DIRECTION * size:
                for c in range(3):
                    candidates.direction[i, c] = at[c] / size
                return i, CANDIDATE_SLIDING
    return -1, CANDIDATE_OPEN


@inlined
def has_last_forces(contacts):
    """True if any contact force is known from an earlier moment."""
    for s in range(contacts.last_force.shape[0]):
        if contacts.last_force[s, 0] != 0.0:
            return True
    return False


@kernel
def search_modes_once(count, y, R, P, w, alpha_free, offset_frame, scratch, motion):
    """Search the contact mode by trials from the sliding velocities in the state y; return whether it was found.

    The last known forces are given parts of the contact forces. The arguments are those of `search_contact_modes`.
    """
    body = scratch.body
    candidates = motion.candidates
    scale = body.acceleration + body.radius * qt.dot(w, w)
    for i in range(count):
        candidates.is_fresh[i] = candidates.changes[i] = 0
        candidates.state[i] = CANDIDATE_SLIDING
        if not is_candidate_sliding(i, y, R, w, offset_frame, scratch, motion):
            candidates.is_fresh[i] = 1
            if friction_of(candidates.slot[i], scratch) > 0.0:
                candidates.state[i] = CANDIDATE_STICKING
    f = as_vector(body.free_acceleration)
    for _ in range(_MAX_MODE_TRIALS):
        activate_candidates(count, motion)
        set_contact_kinematics(y, R, w, alpha_free, offset_frame, scratch, motion)
        m = assemble_unknowns(body.mu, True, scratch, motion)
        F, T = solve_contact_forces(m, P, body, motion.unknowns)
        recover_contact_forces(body.mu, scratch, motion)
        turn = apply_inverse_inertia(P, body.J, T)
        s = 1.0 / body.mass
        a = (f[0] + s * F[0], f[1] + s * F[1], f[2] + s * F[2])
        alpha = plus(alpha_free, turn)
        which, kind = _worst_violation(count, (R, w, a, alpha), scale, offset_frame, scratch, motion)
        if which < 0:
            return True
        if kind != candidates.state[which]:
            candidates.changes[which] += 1
            if candidates.changes[which] > _MAX_MODE_CHANGES:
                return False
        candidates.state[which] = kind
    return False


@kernel
def search_contact_modes(count, y, R, P, w, alpha_free, offset_frame, scratch, motion):
    """Find the contact mode of a body with `count` candidates, some of which slide; return whether it was found.

    The search starts from the last known forces; if it fails, it is repeated without them. y is the state, R and P are
    the rotation matrices of body axes and principal axes, w is the angular velocity, and `alpha_free` the angular
    acceleration without contact. The states of the candidates and the acting contacts are set.
    """
    if search_modes_once(count, y, R, P, w, alpha_free, offset_frame, scratch, motion):
        return True
    if not has_last_forces(motion.contacts):
        return False
    clear_last_forces(motion.contacts)
    return search_modes_once(count, y, R, P, w, alpha_free, offset_frame, scratch, motion)
