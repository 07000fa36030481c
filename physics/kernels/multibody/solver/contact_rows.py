"""Contact rows for sweeps: all data of one visit side by side, in the order of the visits.

A visit solves one contact alone. It reads some forty numbers and changes the motion of two bodies a and b. For the
contact frame E, the arms r and s from the bodies, and the impulse p in the frame,

    u = E (v_a + ω_a x r - v_b - ω_b x s).

With f = Eᵀ p the impulse changes v_a by f/m_a and ω_a by I_a⁻¹ (r x f). It changes v_b by -f/m_b and ω_b by
-I_b⁻¹ (s x f).
"""

from __future__ import annotations

from physics.compiler.decorators import if_given, inlined
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.contact_set import add_scaled, put_vector, row_matrix, subtract
from physics.kernels.multibody.solver.block_lu import ANGULAR_OFFSET
from physics.kernels.multibody.solver.contact_operator import apply_body_inv_inertia

# Columns of `many.sweeps.visit_rows`: frame (from column 0 on), arms of both bodies, Delassus block and its inverse
# (00, 01, 02, 11, 12, 22), target, μ, λ_max of the block's tangential part, impulse; compliance γ of soft contacts.
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
VISIT_GIVE = 35

# First number of an inverse that is not computed yet; that of any computed inverse is positive.
NOT_INVERTED = 0.0


@if_given("many.compliance")
def _write_give(i, k, many):
    many.sweeps.visit_rows[i, VISIT_GIVE] = many.compliance.give[k]


def _error(i, u, many):
    return u


@if_given("many.compliance", _error)
def _plus_give_velocity(i, u, many):
    """Velocity error u of visit i, with γ p_n added to its normal part."""
    R = many.sweeps.visit_rows
    return (u[0] + R[i, VISIT_GIVE] * R[i, VISIT_IMPULSE], u[1], u[2])


@inlined
def _write_visit(i, k, many):
    """Write the contact row of visit i for contact k."""
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
    _write_give(i, k, many)
    many.sweeps.visit_bodies[i, 0], many.sweeps.visit_bodies[i, 1] = (
        many.contacts.bodies[k, 0],
        many.contacts.bodies[k, 1],
    )


@inlined
def write_visits(first, last, many):
    """Write the contact rows of `many.islands.contacts[first:last]`, for visits 0, 1, 2 and so on."""
    for i in range(first, last):
        _write_visit(i - first, many.islands.contacts[i], many)


@inlined
def read_visit_impulses(first, last, many):
    """Copy the impulses in the contact rows back to the contacts `many.islands.contacts[first:last]`."""
    for i in range(first, last):
        put_vector(
            many.contacts.impulse,
            many.islands.contacts[i],
            0,
            row_vector(many.sweeps.visit_rows, i - first, VISIT_IMPULSE),
        )


@inlined
def visit_block(i, first, many):
    """Read six numbers of visit i from column `first` on: a symmetric matrix (00, 01, 02, 11, 12, 22)."""
    R = many.sweeps.visit_rows
    return (R[i, first], R[i, first + 1], R[i, first + 2], R[i, first + 3], R[i, first + 4], R[i, first + 5])


@inlined
def write_block_inverse(i, W, many):
    """Write the inverse of W, the Delassus block of visit i as (00, 01, 02, 11, 12, 22), into its contact row."""
    x, y, z = W[3] * W[5] - W[4] * W[4], W[2] * W[4] - W[1] * W[5], W[1] * W[4] - W[2] * W[3]
    s = 1.0 / (W[0] * x + W[1] * y + W[2] * z)
    put_vector(many.sweeps.visit_rows, i, VISIT_INVERSE, (s * x, s * y, s * z))
    rest = (s * (W[0] * W[5] - W[2] * W[2]), s * (W[1] * W[2] - W[0] * W[4]), s * (W[0] * W[3] - W[1] * W[1]))
    put_vector(many.sweeps.visit_rows, i, VISIT_INVERSE + 3, rest)


@inlined
def visit_velocity_error(i, many):
    """Velocity u of visit i minus its target, in the contact frame [m/s]."""
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
    u = subtract(
        qt.matvec(row_matrix(many.sweeps.visit_rows, i), v), row_vector(many.sweeps.visit_rows, i, VISIT_TARGET)
    )
    return _plus_give_velocity(i, u, many)


@inlined
def _apply_body_impulse(b, s, f, arm, many):
    """Change the motion of body b by an impulse s f (world frame) at the end of its `arm`."""
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
    """Change the motion of both bodies of visit i by an impulse p, given in the contact frame [N s]."""
    f = qt.transposed_matvec(row_matrix(many.sweeps.visit_rows, i), p)
    _apply_body_impulse(
        many.sweeps.visit_bodies[i, 0], 1.0, f, row_vector(many.sweeps.visit_rows, i, VISIT_ARM_A), many
    )
    if many.sweeps.visit_bodies[i, 1] >= 0:
        _apply_body_impulse(
            many.sweeps.visit_bodies[i, 1], -1.0, f, row_vector(many.sweeps.visit_rows, i, VISIT_ARM_B), many
        )
