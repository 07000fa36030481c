"""Rows of the normals' Jacobian J and of M⁻¹ Jᵀ, for sweeps along normals; a visit reads them as `lanes`.

For the normal n of a contact and the arms r, s from its bodies

    u_n = n·(v_a - v_b) + (r x n)·ω_a - (s x n)·ω_b,

and an impulse p changes v_a by p n/m_a and ω_a by p I_a⁻¹ (r x n), those of b by as much the other way. A row of
`many.sweeps.normal_rows` has n, r x n, I_a⁻¹ (r x n), s x n and I_b⁻¹ (s x n); `many.sweeps.motion` has the twists
meanwhile. A vector is three numbers and one that is zero: a sum over four lanes is that over three. The zero is written
each time, since what is not a number in one world would stay there for all that come after it.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined
from physics.compiler.simd import Lanes, lane_sum, load_lanes, store_lanes
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.contact_set import put_vector
from physics.kernels.multibody.solver.block_lu import ANGULAR_OFFSET
from physics.kernels.multibody.solver.contact_operator import apply_body_inv_inertia

# Where the vectors begin: normal, its moment about a and that moment's turning, those of b.
ROW_NORMAL, ROW_MOMENT_A, ROW_RESPONSE_A, ROW_MOMENT_B, ROW_RESPONSE_B = range(0, 20, 4)


@inlined
def put_padded(array, i, j, a):
    """Write a vector followed by a zero."""
    store_lanes(array, i, j, Lanes(a[0], a[1], a[2], 0.0))


@inlined
def _motion_from_twist(b, many):
    put_padded(many.sweeps.motion, b, 0, row_vector(many.bodies.twist, b, 0))
    put_padded(many.sweeps.motion, b, ANGULAR_OFFSET, row_vector(many.bodies.twist, b, 3))


@inlined
def body_twist_from_motion(b, many):
    """Twist of body b from `many.sweeps.motion`."""
    put_vector(many.bodies.twist, b, 0, row_vector(many.sweeps.motion, b, 0))
    put_vector(many.bodies.twist, b, 3, row_vector(many.sweeps.motion, b, ANGULAR_OFFSET))


@inlined
def motion_from_twists(first, last, many):
    """`many.sweeps.motion` of the bodies of the contacts `many.islands.contacts[first:last]` from their twists."""
    for i in range(first, last):
        a, b = many.contacts.bodies[many.islands.contacts[i], 0], many.contacts.bodies[many.islands.contacts[i], 1]
        _motion_from_twist(a, many)
        if b >= 0:
            _motion_from_twist(b, many)


@inlined
def twists_from_motion(first, last, many):
    """Twists of the bodies of the contacts `many.islands.contacts[first:last]` from `many.sweeps.motion`."""
    for i in range(first, last):
        a, b = many.contacts.bodies[many.islands.contacts[i], 0], many.contacts.bodies[many.islands.contacts[i], 1]
        body_twist_from_motion(a, many)
        if b >= 0:
            body_twist_from_motion(b, many)


@inlined
def _normal_mobility(k, b, first, moment, many):
    """Share of one end in a contact's W_nn; writes its normal's vectors to `many.sweeps.normal_rows`."""
    g = qt.cross(row_vector(many.contacts.arm, k, first), row_vector(many.contacts.frame, k, 0))
    h = apply_body_inv_inertia(b, g, many)
    put_padded(many.sweeps.normal_rows, k, moment, g)
    put_padded(many.sweeps.normal_rows, k, moment + 4, h)
    return many.bodies.inv_mass[b] + qt.dot(g, h)


@inlined
def assemble_normal_row(k, many):
    """Write the data of contact k's normal: W_nn and its row."""
    put_padded(many.sweeps.normal_rows, k, ROW_NORMAL, row_vector(many.contacts.frame, k, 0))
    W = _normal_mobility(k, many.contacts.bodies[k, 0], 0, ROW_MOMENT_A, many)
    if many.contacts.bodies[k, 1] >= 0:
        W += _normal_mobility(k, many.contacts.bodies[k, 1], 3, ROW_MOMENT_B, many)
    many.contacts.block[k, 0] = W


@inlined
def normal_velocity(k, many):
    """Normal velocity u_n of contact k."""
    R, t, a, b = many.sweeps.normal_rows, many.sweeps.motion, many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
    v = load_lanes(t, a, 0)
    if b >= 0:
        v = v - load_lanes(t, b, 0)
    x = load_lanes(R, k, ROW_NORMAL) * v + load_lanes(R, k, ROW_MOMENT_A) * load_lanes(t, a, ANGULAR_OFFSET)
    if b >= 0:
        x = x - load_lanes(R, k, ROW_MOMENT_B) * load_lanes(t, b, ANGULAR_OFFSET)
    return lane_sum(x)


@inlined
def _add_padded(b, first, x, many):
    store_lanes(many.sweeps.motion, b, first, load_lanes(many.sweeps.motion, b, first) + x)


@inlined
def apply_normal_impulse(k, p, many):
    """Change the motion of both bodies by an impulse p along the normal of contact k [N s]."""
    R, a, b = many.sweeps.normal_rows, many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
    n = load_lanes(R, k, ROW_NORMAL)
    _add_padded(a, 0, (many.bodies.inv_mass[a] * p) * n, many)
    _add_padded(a, ANGULAR_OFFSET, p * load_lanes(R, k, ROW_RESPONSE_A), many)
    if b >= 0:
        _add_padded(b, 0, (-many.bodies.inv_mass[b] * p) * n, many)
        _add_padded(b, ANGULAR_OFFSET, -p * load_lanes(R, k, ROW_RESPONSE_B), many)
