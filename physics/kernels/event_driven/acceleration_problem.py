"""Acceleration-level contact problem at one moment, and the contact mode that its solution means.

The solver of impacts solves it, with accelerations in place of velocities and forces in place of impulses.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.contact_law.materials import may_hold
from physics.kernels.contact_solver.sliding_patch import TRY_STICKING
from physics.kernels.event_driven.contact_candidates import (
    CANDIDATE_OPEN,
    CANDIDATE_SLIDING,
    CANDIDATE_STICKING,
    MODE_CONTACT,
    MODE_FLIGHT,
    MODE_IMPACT,
    MODE_INCONSISTENT,
    MODE_REST,
    acceleration_scale,
    activate_candidates,
    contact_acceleration,
    has_closing_contact,
)
from physics.kernels.event_driven.contact_forces import (
    MIN_PATCH_CONTACTS,
    apply_inverse_inertia,
    clear_last_forces,
    free_angular_motion,
)
from physics.kernels.half_space.contact_point import contact_arm_and_rate, feature_of, wall_axes, wall_of
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import as_vector, plus, row_vector, times

# Accelerations and forces of the solver below this share of the largest free ones are zero.
_ZERO_SHARE = 1.0e-8

# If the search has not found the mode of sliding contacts, their sliding is replaced by a tangential acceleration of
# this size, in units of the largest free one. The direction of sliding has then an error of the inverse of it. A normal
# force of _PAINLEVE_PUSH times this size would stop the sliding: then no force is consistent, only an impulse.
_SLIDING_ACCELERATION = 1.0e3
_PAINLEVE_PUSH = 0.03


@inlined
def set_up_contact(i, slot, r, target, contacts):
    """Write contact i of a problem for `solve_contacts`: its slot, arm r and target; its warm start is zero."""
    contacts.slot[i] = slot
    contacts.arm[i, 0], contacts.arm[i, 1], contacts.arm[i, 2] = r
    contacts.target[i, 0], contacts.target[i, 1], contacts.target[i, 2] = target
    contacts.impulse[3 * i] = contacts.impulse[3 * i + 1] = contacts.impulse[3 * i + 2] = 0.0


@kernel
def set_up_resting_problem(count, y, R, w, has_sliding, offset_frame, scratch, candidates):
    """Write the acceleration-level contact problem of `count` candidates in the state y into `scratch`.

    Returns the free acceleration and the moment τ - ω x L, which take the places of velocity and angular momentum in
    `solve_contacts`; forces take that of impulses. The acceleration of a contact by the motion of its arm is part of
    its target. If `has_sliding`, some candidates slide in their `candidates.direction`; this is replaced by a large
    tangential acceleration. R and w are rotation matrix and angular velocity.
    """
    scene, body = scratch.scene, scratch.body
    walls = scene.walls
    scale = acceleration_scale(w, body)
    for i in range(count):
        slot = candidates.slot[i]
        axes = wall_axes(walls, wall_of(slot, scene))
        r, rate = contact_arm_and_rate(
            body.shape, as_vector(body.dims), R, w, axes[0], feature_of(slot, scene), offset_frame, body
        )
        c = qt.cross(w, rate)
        if has_sliding:  # a large acceleration along the sliding, whose direction forces hardly turn
            c = plus(c, times(_SLIDING_ACCELERATION * scale, row_vector(candidates.direction, i, 0)))
        set_up_contact(i, slot, r, (-qt.dot(axes[0], c), -qt.dot(axes[1], c), -qt.dot(axes[2], c)), scratch.contacts)
    scratch.stage.mode = TRY_STICKING
    g, t = qt.cross(w, y[3]), body.torque
    return as_vector(body.free_acceleration), (t[0] - g[0], t[1] - g[1], t[2] - g[2])


@inlined
def has_sliding_direction(way, i):
    """True if row i of `way`, the sliding direction of a contact, is not zero."""
    return way[i, 0] != 0.0 or way[i, 1] != 0.0 or way[i, 2] != 0.0


@inlined
def is_redundant_contact(i, count, width, small, scratch):
    """True if contact i, which has no force, may open because at least three others of its wall push.

    `width` is the number of impulses per contact, `small` the acceleration that counts as zero [m/s²].
    """
    contacts = scratch.contacts
    wall, pushing = wall_of(contacts.slot[i], scratch.scene), 0
    for j in range(count):
        if wall_of(contacts.slot[j], scratch.scene) == wall and contacts.impulse[width * j] > small * scratch.body.mass:
            pushing += 1
    return pushing >= MIN_PATCH_CONTACTS


@inlined
def store_solver_forces(count, width, scratch, contacts):
    """Store the solver's forces of `count` contacts, `width` numbers each, in `contacts.last_force`; others are 0."""
    clear_last_forces(contacts)
    for i in range(count):
        for c in range(width):
            contacts.last_force[scratch.contacts.slot[i], c] = scratch.contacts.impulse[width * i + c]


@kernel
def is_body_at_rest(y, w, acceleration, body, thresholds):
    """True if a body in the state y neither moves nor begins to move, except for rounding.

    `acceleration` bounds the acceleration of its points [m/s²].
    """
    v = y[2]
    speed = math.sqrt(qt.dot(v, v)) + body.radius * math.sqrt(qt.dot(w, w))
    return speed <= 2.0 * thresholds.rest_speed and acceleration <= 4.0 * _ZERO_SHARE * body.acceleration


@kernel
def read_resting_mode(count, y, a, moment, friction, has_sliding, offset_frame, scratch, motion):
    """Read the contact mode from the solution of the problem of `set_up_resting_problem`: a MODE_ code.

    a and `moment` are acceleration and moment with the contact forces. The states of the `count` candidates and the
    acting contacts are set. `has_sliding` is true if some candidates slide.
    """
    body = scratch.body
    candidates = motion.candidates
    R, P, w, _ = free_angular_motion(y, offset_frame, body)
    alpha = apply_inverse_inertia(P, body.J, moment)
    width = 3
    if friction is None:
        width = 1
    scale = acceleration_scale(w, body)
    small = _ZERO_SHARE * scale
    if has_sliding:
        small *= _SLIDING_ACCELERATION
    for i in range(count):
        an, at = contact_acceleration(i, R, w, a, alpha, offset_frame, scratch, candidates)
        size = math.sqrt(qt.dot(at, at))
        push = scratch.contacts.impulse[width * i]
        if has_sliding and push > _PAINLEVE_PUSH * _SLIDING_ACCELERATION * body.mass * scale:
            return MODE_INCONSISTENT
        slides = has_sliding and has_sliding_direction(candidates.direction, i)
        kind = CANDIDATE_SLIDING
        if not push > small * body.mass and (an > small or is_redundant_contact(i, count, width, small, scratch)):
            kind = CANDIDATE_OPEN
        elif friction is not None and not slides and size <= small and may_hold(candidates.slot[i], scratch):
            kind = CANDIDATE_STICKING
        candidates.state[i] = kind
        if slides:
            continue
        for c in range(3):
            candidates.direction[i, c] = at[c] / size if size > small else 0.0
    store_solver_forces(count, width, scratch, motion.contacts)
    activate_candidates(count, motion)
    if has_closing_contact(count, motion):
        return MODE_IMPACT
    if motion.contacts.count == 0:
        return MODE_FLIGHT
    acceleration = math.sqrt(qt.dot(a, a)) + body.radius * math.sqrt(qt.dot(alpha, alpha))
    if is_body_at_rest(y, w, acceleration, body, motion.thresholds):
        return MODE_REST
    return MODE_CONTACT
