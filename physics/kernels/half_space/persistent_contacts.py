"""Persistent contacts: contacts that continue from one resting stage to the next.

A resting stage aims at normal velocities of zero at its end, and knows only to first order how its contacts turn until
then. So a stage of length h leaves a contact with a normal speed of order h² and a gap of order h³, of either sign.
These are errors of the scheme, not events. A contact that pushed in the last stage, and that loads and turning still
press against its wall, has neither left the wall nor hit it.
"""

from __future__ import annotations

from physics.compiler.decorators import cold_kernel, inlined, kernel
from physics.kernels.half_space.contact_point import contact_arm_and_rate, feature_of, place_arms, wall_normal, wall_of
from physics.kernels.math import quaternion as qt
from physics.kernels.state.body import angular_velocity, apply_inv_inertia, principal_attitude
from physics.kernels.state.layout import ELLIPSOID

# Row of a body in `memory`: length of its last resting stage [s], number of contacts in that stage, the direct solver
# that succeeded last (`sliding_patch.TRY_STICKING`, `TRY_SLIDING`, `TRY_MIXED`), the slots of these contacts, then
# three impulses [N s] for every possible slot, zero where there was no contact.
WALL_MEMORY_STAGE, WALL_MEMORY_COUNT, WALL_MEMORY_MODE = range(3)
WALL_MEMORY_HEAD = 3


@inlined
def last_normal_impulse(slot, memory, scratch):
    """Normal impulse of the workspace's body at a contact slot in its last stage [N s]; 0 without contact there."""
    return memory[scratch.body.i, WALL_MEMORY_HEAD + scratch.contacts.slot.shape[0] + 3 * slot]


@kernel
def free_gap_acceleration(slot, y, offset_frame, scratch):
    """Acceleration of the gap of a slot's feature without contact impulses, n·(v̇ + ω̇ x r + ω x ṙ) [m/s²].

    It is negative where loads and turning press the feature against its wall. y is the state of the body.
    """
    scene, body = scratch.scene, scratch.body
    _, q, _, L = y
    n, a, torque = wall_normal(scene.walls, wall_of(slot, scene)), body.free_acceleration, body.torque
    dims = (body.dims[0], body.dims[1], body.dims[2])
    R = qt.to_matrix(principal_attitude(q, body, offset_frame))
    w = apply_inv_inertia(R, L, body.J)
    g = qt.cross(L, w)
    alpha = apply_inv_inertia(R, (torque[0] + g[0], torque[1] + g[1], torque[2] + g[2]), body.J)
    r, rate = contact_arm_and_rate(body.shape, dims, qt.to_matrix(q), w, n, feature_of(slot, scene), offset_frame, body)
    b, c = qt.cross(alpha, r), qt.cross(w, rate)
    return n[0] * (a[0] + b[0] + c[0]) + n[1] * (a[1] + b[1] + c[1]) + n[2] * (a[2] + b[2] + c[2])


@cold_kernel
def is_still_pressed(gap, slot, y, h, offset_frame, memory, scratch):
    """True if an ellipsoid pushed in a contact slot in the last stage, and its motion brings it back to the wall.

    It is back at the wall if the gap becomes at most the slop within the time h [s]. The motion starts from the present
    `gap` [m], under the body's loads and spin. `slot` is the slot of the contact in `memory`, and y the state.
    """
    if not (scratch.body.shape == ELLIPSOID and last_normal_impulse(slot, memory, scratch) > 0.0):
        return False
    return gap + 0.5 * h * h * min(free_gap_acceleration(slot, y, offset_frame, scratch), 0.0) <= scratch.body.slop


@inlined
def turning_acceleration(w, body):
    """Bound of the normal acceleration that turning at the angular velocity w gives to a contact point [m/s²].

    For an ellipsoid |n·(ω x ṙ)| <= ω² ρ, with its largest radius of curvature ρ, the square of its largest half-axis
    over its smallest. For a vertex the bound is ω² times its distance from the centre of mass, at most the bounding
    radius. The term n·(ω̇ x r) of free turning is left out; it is at most as large.
    """
    reach = body.radius
    if body.shape == ELLIPSOID:
        reach *= reach / min(body.dims[0], min(body.dims[1], body.dims[2]))
    return qt.dot(w, w) * reach


@kernel
def is_persistent_contact(i, y, h, offset_frame, memory, scratch):
    """True if contact i pushed in the last stage, and its normal speed is small enough to be an error of that stage.

    A stage of length h may leave a sticking contact with at most the speed that loads and turning give within h.
    """
    body = scratch.body
    if not last_normal_impulse(scratch.contacts.slot[i], memory, scratch) > 0.0:
        return False
    w = angular_velocity(y[1], y[3], body, offset_frame)
    return abs(scratch.contacts.speed[i]) <= h * (body.acceleration + turning_acceleration(w, body))


@kernel
def cancel_separation(y, h, offset_frame, memory, scratch):
    """Stop the only contact of the set if it leaves its wall by an error of the last stage: (new state, has_changed).

    The state y changes only if the contact is persistent, is pressed against its wall by loads and turning, but would
    not be back at the wall within h [s].

    Such a contact got a push in the last stage that was too large by u/w, with u its speed and w its mobility. A
    smaller push of the next stage usually makes up for it. Where that push would have to pull, this excess is taken
    back now. At most all of the last push is taken, so that the sum of both stays positive. `contacts.rebound` gets the
    impulse that was taken, as a negative number [N s].
    """
    body, contacts = scratch.body, scratch.contacts
    x, q, v, L = y
    gap, u, slot = contacts.gap[0], contacts.speed[0], contacts.slot[0]
    if not is_persistent_contact(0, y, h, offset_frame, memory, scratch):
        return y, False
    a = free_gap_acceleration(slot, y, offset_frame, scratch)
    if not (a < 0.0 and gap + h * (u + 0.5 * h * a) > 0.0):
        return y, False
    place_arms(1, qt.to_matrix(q), offset_frame, scratch)
    n = wall_normal(scratch.scene.walls, wall_of(slot, scratch.scene))
    r = (contacts.arm[0, 0], contacts.arm[0, 1], contacts.arm[0, 2])
    m = qt.cross(r, n)
    spin = apply_inv_inertia(qt.to_matrix(principal_attitude(q, body, offset_frame)), m, body.J)
    p = min(u / (1.0 / body.mass + qt.dot(m, spin)), last_normal_impulse(slot, memory, scratch))
    s = p / body.mass
    contacts.rebound[0], contacts.rebound[1], contacts.rebound[2] = -p, 0.0, 0.0
    v = (v[0] - s * n[0], v[1] - s * n[1], v[2] - s * n[2])
    return (x, q, v, (L[0] - p * m[0], L[1] - p * m[1], L[2] - p * m[2])), True
