"""Contacts that continue from one resting stage to the next.

A resting stage asks for no normal velocity at its end, and knows how its contacts turn until then to first order. It
leaves of a stage of length h a normal speed of h² and a gap of h³, of either sign. These are errors of the scheme, no
events: a contact that pushed in the last stage, and that the smooth motion presses against its wall still, has neither
left it nor hit it.
"""

from __future__ import annotations

from physics.compiler.decorators import cold_kernel, inlined, kernel
from physics.kernels.half_space.contact_point import contact_arm_and_rate, feature_of, place_arms, wall_normal, wall_of
from physics.kernels.math import quaternion as qt
from physics.kernels.state.body import angular_velocity, apply_inv_inertia, principal_attitude
from physics.kernels.state.layout import ELLIPSOID

# Row of `memory`: length of the last resting stage [s], its contact count, which direct solve worked last
# (`sliding_patch.TRY_STICKING`, `TRY_SLIDING`, `TRY_MIXED`), the slots of its contacts, then the impulses of all slots,
# zero where there is no contact.
WALL_MEMORY_STAGE, WALL_MEMORY_COUNT, WALL_MEMORY_MODE = range(3)
WALL_MEMORY_HEAD = 3


@inlined
def last_normal_impulse(slot, memory, scratch):
    """Normal impulse of a feature in the last stage of its body [N s]; 0 if that was in the air."""
    return memory[scratch.body.i, WALL_MEMORY_HEAD + scratch.contacts.slot.shape[0] + 3 * slot]


@kernel
def free_gap_acceleration(slot, y, offset_frame, scratch):
    """Acceleration of a feature's gap without contact, n·(v̇ + ω̇ x r + ω x ṙ) [m/s²]; negative if it is pressed."""
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
    """True if a round body that pushed in the last stage is still pressed, so that its gap closes."""
    if not (scratch.body.shape == ELLIPSOID and last_normal_impulse(slot, memory, scratch) > 0.0):
        return False
    return gap + 0.5 * h * h * min(free_gap_acceleration(slot, y, offset_frame, scratch), 0.0) <= scratch.body.slop


@inlined
def turning_acceleration(w, body):
    """Largest acceleration that turning at w alone gives to a contact along its normal [m/s²].

    |n·(ω x ṙ)| <= ω² ρ with the largest radius ρ of curvature of an ellipsoid, its largest half-axis squared by its
    smallest; of a vertex ω² times its distance. (n·(α x r) of free turning is at most as much again.)
    """
    reach = body.radius
    if body.shape == ELLIPSOID:
        reach *= reach / min(body.dims[0], min(body.dims[1], body.dims[2]))
    return qt.dot(w, w) * reach


@kernel
def is_persistent_contact(i, y, h, offset_frame, memory, scratch):
    """True if the speed of contact i is an error of the last stage: it pushed then, and is at most that fast.

    A stage of length h may leave a sticking contact with the speed that loads and turning give in h.
    """
    body = scratch.body
    if not last_normal_impulse(scratch.contacts.slot[i], memory, scratch) > 0.0:
        return False
    w = angular_velocity(y[1], y[3], body, offset_frame)
    return abs(scratch.contacts.speed[i]) <= h * (body.acceleration + turning_acceleration(w, body))


@kernel
def cancel_separation(y, h, offset_frame, memory, scratch):
    """State with the one contact of the set at rest along its normal, and whether it has changed.

    The state changes only if the contact continues, but would not be brought back within h.

    A contact that leaves at u after a push p, though it is still pressed against its wall, got u/(n·W n) too much. A
    smaller push of the next stage usually compensates for that. If u is more than the motion without a push can reverse
    within h, this excess is taken back, at most p, so that both pushes together stay positive. `contacts.rebound` holds
    the old impulse.
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
