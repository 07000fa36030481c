"""Contacts for sweeps: one row has all data of a visit, in the order of the visits.

A visit of one contact asks for some forty numbers and changes two bodies. For the frame E, the arms r, s from the
bodies a, b, and impulses p in the frame,

    u = E (v_a + ω_a x r - v_b - ω_b x s),

and v_a changes by f/m_a with f = Eᵀ p, ω_a by I_a⁻¹ (r x f), those of b by as much the other way.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.contact_set import add_scaled, put_vector, row_matrix, subtract
from physics.kernels.multibody.solver.block_lu import ANGULAR_OFFSET
from physics.kernels.multibody.solver.contact_operator import apply_body_inv_inertia

# Columns of `many.sweeps.visit_rows`: frame, arms of both bodies, block and its inverse (00, 01, 02, 11, 12, 22),
# target, μ, λ_max of its tangential part, impulse.
VISIT_ARM_A, VISIT_ARM_B, VISIT_BLOCK, VISIT_INVERSE, VISIT_TARGET, VISIT_MU, VISIT_LAMBDA_MAX, VISIT_IMPULSE = (
    9,
    12,
    15,
    21,
    27,
    30,
    31,
    32,
)

# First number of an inverse that has not been needed yet: that of any block is positive.
NOT_INVERTED = 0.0


@inlined
def _write_visit(i, k, many):
    """Write contact k as visit i."""
    R, B = many.sweeps.visit_rows, many.contacts.block
    for c in range(9):
        R[i, c] = many.contacts.frame[k, c]
    for c in range(6):
        R[i, VISIT_ARM_A + c] = many.contacts.arm[k, c]
    R[i, VISIT_BLOCK], R[i, VISIT_BLOCK + 1], R[i, VISIT_BLOCK + 2] = B[k, 0], B[k, 1], B[k, 2]
    R[i, VISIT_BLOCK + 3], R[i, VISIT_BLOCK + 4], R[i, VISIT_BLOCK + 5] = B[k, 4], B[k, 5], B[k, 8]
    R[i, VISIT_INVERSE] = NOT_INVERTED
    put_vector(R, i, VISIT_TARGET, row_vector(many.contacts.target, k, 0))
    R[i, VISIT_MU], R[i, VISIT_LAMBDA_MAX] = many.contacts.mu[k], 1.0 / many.contacts.step[k]
    put_vector(R, i, VISIT_IMPULSE, row_vector(many.contacts.impulse, k, 0))
    many.sweeps.visit_bodies[i, 0], many.sweeps.visit_bodies[i, 1] = (
        many.contacts.bodies[k, 0],
        many.contacts.bodies[k, 1],
    )


@inlined
def write_visits(first, last, many):
    """Write the contacts `many.islands.contacts[first:last]` as visits 0, 1, 2 ..."""
    for i in range(first, last):
        _write_visit(i - first, many.islands.contacts[i], many)


@inlined
def read_visit_impulses(first, last, many):
    """Copy impulses of the contacts `many.islands.contacts[first:last]` from their visits."""
    for i in range(first, last):
        put_vector(
            many.contacts.impulse,
            many.islands.contacts[i],
            0,
            row_vector(many.sweeps.visit_rows, i - first, VISIT_IMPULSE),
        )


@inlined
def visit_block(i, first, many):
    """Six numbers of visit i: a symmetric matrix."""
    R = many.sweeps.visit_rows
    return (R[i, first], R[i, first + 1], R[i, first + 2], R[i, first + 3], R[i, first + 4], R[i, first + 5])


@inlined
def write_block_inverse(i, W, many):
    """Write the inverse of the contact's own block W (upper triangle)."""
    x, y, z = W[3] * W[5] - W[4] * W[4], W[2] * W[4] - W[1] * W[5], W[1] * W[4] - W[2] * W[3]
    s = 1.0 / (W[0] * x + W[1] * y + W[2] * z)
    put_vector(many.sweeps.visit_rows, i, VISIT_INVERSE, (s * x, s * y, s * z))
    rest = (s * (W[0] * W[5] - W[2] * W[2]), s * (W[1] * W[2] - W[0] * W[4]), s * (W[0] * W[3] - W[1] * W[1]))
    put_vector(many.sweeps.visit_rows, i, VISIT_INVERSE + 3, rest)


@inlined
def visit_velocity_error(i, many):
    """Velocity u of visit i minus its target."""
    t, a, b = many.sweeps.motion, many.sweeps.visit_bodies[i, 0], many.sweeps.visit_bodies[i, 1]
    v = add_scaled(
        row_vector(t, a, 0),
        1.0,
        qt.cross(row_vector(t, a, ANGULAR_OFFSET), row_vector(many.sweeps.visit_rows, i, VISIT_ARM_A)),
    )
    if b >= 0:
        v = subtract(
            v,
            add_scaled(
                row_vector(t, b, 0),
                1.0,
                qt.cross(row_vector(t, b, ANGULAR_OFFSET), row_vector(many.sweeps.visit_rows, i, VISIT_ARM_B)),
            ),
        )
    return subtract(
        qt.matvec(row_matrix(many.sweeps.visit_rows, i), v), row_vector(many.sweeps.visit_rows, i, VISIT_TARGET)
    )


@inlined
def _apply_body_impulse(b, s, f, arm, many):
    """Change the motion of body b by an impulse s f (world frame) at `arm`."""
    t = many.sweeps.motion
    put_vector(t, b, 0, add_scaled(row_vector(t, b, 0), s * many.bodies.inv_mass[b], f))
    put_vector(
        t,
        b,
        ANGULAR_OFFSET,
        add_scaled(row_vector(t, b, ANGULAR_OFFSET), s, apply_body_inv_inertia(b, qt.cross(arm, f), many)),
    )


@inlined
def apply_visit_impulse(i, p, many):
    """Change the motion of both bodies of visit i by an impulse p, given in the contact's frame [N s]."""
    f = qt.transposed_matvec(row_matrix(many.sweeps.visit_rows, i), p)
    _apply_body_impulse(
        many.sweeps.visit_bodies[i, 0], 1.0, f, row_vector(many.sweeps.visit_rows, i, VISIT_ARM_A), many
    )
    if many.sweeps.visit_bodies[i, 1] >= 0:
        _apply_body_impulse(
            many.sweeps.visit_bodies[i, 1], -1.0, f, row_vector(many.sweeps.visit_rows, i, VISIT_ARM_B), many
        )
