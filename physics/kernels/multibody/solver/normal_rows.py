"""Rows of the normals' Jacobian J and of M⁻¹ Jᵀ, for sweeps along normals only.

For the normal n of a contact and the arms r, s from its bodies a, b

    u_n = n·(v_a - v_b) + (r x n)·ω_a - (s x n)·ω_b.

An impulse p changes v_a by p n/m_a and ω_a by p I_a⁻¹ (r x n). It changes v_b by -p n/m_b and ω_b by
-p I_b⁻¹ (s x n). A row of `many.sweeps.normal_rows` has n, r x n, I_a⁻¹ (r x n), s x n and I_b⁻¹ (s x n).
`many.sweeps.motion` has the twists during the sweeps. A vector is stored as three numbers and a zero, and read as
`Lanes`, so that a sum over four lanes is a sum over three numbers. The zero is written each time. Otherwise a NaN from
one world could stay there for all later ones.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined
from physics.compiler.simd import Lanes, lane_sum, load_lanes, store_lanes
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.compliance import plus_give
from physics.kernels.multibody.data.contact_set import put_vector
from physics.kernels.multibody.solver.block_lu import ANGULAR_OFFSET
from physics.kernels.multibody.solver.contact_operator import apply_body_inv_inertia

# First columns of the vectors of a row: n, r x n, I_a⁻¹ (r x n), s x n, I_b⁻¹ (s x n).
ROW_NORMAL, ROW_MOMENT_A, ROW_RESPONSE_A, ROW_MOMENT_B, ROW_RESPONSE_B = range(0, 20, 4)


@inlined
def put_padded(array, i, j, a):
    """Write the vector a, followed by a zero, to row i of an array from column j on."""
    store_lanes(array, i, j, Lanes(a[0], a[1], a[2], 0.0))


@inlined
def _motion_from_twist(b, many):
    put_padded(many.sweeps.motion, b, 0, row_vector(many.bodies.twist, b, 0))
    put_padded(many.sweeps.motion, b, ANGULAR_OFFSET, row_vector(many.bodies.twist, b, 3))


@inlined
def body_twist_from_motion(b, many):
    """Copy the twist of body b from `many.sweeps.motion` to `many.bodies.twist`."""
    put_vector(many.bodies.twist, b, 0, row_vector(many.sweeps.motion, b, 0))
    put_vector(many.bodies.twist, b, 3, row_vector(many.sweeps.motion, b, ANGULAR_OFFSET))


@inlined
def motion_from_twists(first, last, many):
    """Copy twists to `many.sweeps.motion`, for the bodies of the contacts `many.islands.contacts[first:last]`."""
    for i in range(first, last):
        a, b = many.contacts.bodies[many.islands.contacts[i], 0], many.contacts.bodies[many.islands.contacts[i], 1]
        _motion_from_twist(a, many)
        if b >= 0:
            _motion_from_twist(b, many)


@inlined
def twists_from_motion(first, last, many):
    """Copy twists from `many.sweeps.motion`, for the bodies of the contacts `many.islands.contacts[first:last]`."""
    for i in range(first, last):
        a, b = many.contacts.bodies[many.islands.contacts[i], 0], many.contacts.bodies[many.islands.contacts[i], 1]
        body_twist_from_motion(a, many)
        if b >= 0:
            body_twist_from_motion(b, many)


@inlined
def _normal_mobility(k, b, first, moment, many):
    """Share of body b in W_nn of contact k [1/kg]; writes r x n and I⁻¹ (r x n) to `many.sweeps.normal_rows`.

    `first` is the column of the body's arm r in `many.contacts.arm`, `moment` that of r x n in the row.
    """
    g = qt.cross(row_vector(many.contacts.arm, k, first), row_vector(many.contacts.frame, k, 0))
    h = apply_body_inv_inertia(b, g, many)
    put_padded(many.sweeps.normal_rows, k, moment, g)
    put_padded(many.sweeps.normal_rows, k, moment + 4, h)
    return many.bodies.inv_mass[b] + qt.dot(g, h)


@inlined
def assemble_normal_row(k, many):
    """Write row k of `many.sweeps.normal_rows`, and W_nn of contact k to `many.contacts.block[k, 0]`."""
    put_padded(many.sweeps.normal_rows, k, ROW_NORMAL, row_vector(many.contacts.frame, k, 0))
    W = _normal_mobility(k, many.contacts.bodies[k, 0], 0, ROW_MOMENT_A, many)
    if many.contacts.bodies[k, 1] >= 0:
        W += _normal_mobility(k, many.contacts.bodies[k, 1], 3, ROW_MOMENT_B, many)
    many.contacts.block[k, 0] = plus_give(k, W, many)


@inlined
def normal_velocity(k, many):
    """Normal velocity u_n at contact k, from `many.sweeps.motion` [m/s]."""
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
    """Change the motion of both bodies of contact k by an impulse p along its normal [N s]."""
    R, a, b = many.sweeps.normal_rows, many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
    n = load_lanes(R, k, ROW_NORMAL)
    _add_padded(a, 0, (many.bodies.inv_mass[a] * p) * n, many)
    _add_padded(a, ANGULAR_OFFSET, p * load_lanes(R, k, ROW_RESPONSE_A), many)
    if b >= 0:
        _add_padded(b, 0, (-many.bodies.inv_mass[b] * p) * n, many)
        _add_padded(b, ANGULAR_OFFSET, -p * load_lanes(R, k, ROW_RESPONSE_B), many)
