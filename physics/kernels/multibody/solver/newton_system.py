"""Linear system of a Newton step in `proximal_newton`, for the twists x of an island's bodies.

Its right side is the defect x - M⁻¹ Jᵀ p(x), its matrix is 1 + M⁻¹ Jᵀ ρ p' J. p(x) are the impulses of the contacts for
the twists x, and p' is the derivative of their projection on the friction cones.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.compiler.simd import Lanes, lane_sums, larger, load_lanes, select_lanes, store_lanes
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.arrays import BLOCK_SIZE, COLUMN_SIZE, NUM_BATCHES
from physics.kernels.multibody.solver import contact_batches as of
from physics.kernels.multibody.solver.block_lu import ANGULAR_OFFSET, TWIST_DOFS, clear_system
from physics.kernels.multibody.solver.contact_batches import BATCH_BLOCK, BATCH_BODY_A, BATCH_BODY_B, BATCH_IS_A_FIRST


@inlined
def project_impulse(y, mu):
    """Impulse y (normal, two tangents) projected on the friction cone with the coefficient `mu`.

    A negative normal part becomes 0, and the tangential part is shortened to `mu` times the normal part.
    """
    normal = larger(y[0], 0.0)
    size, limit = of.planar_length(y[1], y[2]), mu * normal
    s = select_lanes(size > limit, limit / size, 1.0)
    return normal, s * y[1], s * y[2]


@inlined
def subtract_twists(b, a, c, many):
    """Set column b of `many.newton.defect` to the difference a - c of two twists of body b, from arrays (bodies, 6)."""
    D = many.newton.defect
    D[b, 0], D[b, 1], D[b, 2] = a[b, 0] - c[b, 0], a[b, 1] - c[b, 1], a[b, 2] - c[b, 2]
    D[b, ANGULAR_OFFSET], D[b, ANGULAR_OFFSET + 1], D[b, ANGULAR_OFFSET + 2] = (
        a[b, 3] - c[b, 3],
        a[b, 4] - c[b, 4],
        a[b, 5] - c[b, 5],
    )


def _unyielding(g, y, rho, many):
    return y


@if_given("many.compliance", _unyielding)
def _yield_along_normals(g, y, rho, many):
    """Divide the normal part of y = q - ρ u by 1 + ρ γ, which solves p = q - ρ (u + γ p) for compliant contacts."""
    return (y[0] / (1.0 + rho * of.batch_field(g, of.LANE_GIVE, many)), y[1], y[2])


def _same_slope(g, D, rho, many):
    return D


@if_given("many.compliance", _same_slope)
def _slope_of_yielding(g, D, rho, many):
    """Multiply the first column of D, the derivative of a projection, by the factor of `_yield_along_normals`."""
    s = 1.0 / (1.0 + rho * of.batch_field(g, of.LANE_GIVE, many))
    return (s * D[0], D[1], D[2], s * D[3], D[4], D[5], s * D[6], D[7], D[8])


@kernel
def compute_defect(part, rho, all_hold, many):
    """Compute the defect x - M⁻¹ Jᵀ p(x) of an island: (its norm weighted by mass, its largest velocity [m/s]).

    x is the change of the twists by the impulses: `bodies.twist` minus `bodies.free_twist`. p(x) is q - ρ u, for the
    impulses q in the batches and velocity errors u, projected on the friction cones. With `all_hold` it is not
    projected: every contact sticks. The defect is written to `many.newton.defect`, p(x) to the batches. `part` is as in
    `newton_contacts`, `rho` the penalty ρ [kg].
    """
    _, _, begin, end = part
    for i in range(begin, end):
        subtract_twists(many.islands.bodies[i], many.bodies.twist, many.bodies.free_twist, many)
    for g in range(many.counts[NUM_BATCHES]):
        u, q = of.batch_velocity_error(g, many), of.batch_vector(g, of.PROX_IMPULSE, many)
        y = _yield_along_normals(g, (q[0] - rho * u[0], q[1] - rho * u[1], q[2] - rho * u[2]), rho, many)
        of.put_batch_vector(g, of.PROX_ARGUMENT, y, many)
        p = y
        if not all_hold:
            p = project_impulse(y, of.batch_field(g, of.LANE_MU, many))
        of.put_batch_vector(g, of.PROX_PROJECTED, p, many)
        of.apply_batch_impulse(g, (-p[0], -p[1], -p[2]), many.newton.defect, ANGULAR_OFFSET, many)
    total = worst = 0.0
    for i in range(begin, end):
        b = many.islands.bodies[i]
        v, w, r = (
            row_vector(many.newton.defect, b, 0),
            row_vector(many.newton.defect, b, ANGULAR_OFFSET),
            many.bodies.body[b].radius,
        )
        square = qt.dot(v, v) + r * r * qt.dot(w, w)
        total += many.bodies.body[b].mass * square
        worst = max(worst, square)
    return math.sqrt(total), math.sqrt(worst)


@inlined
def _projection_jacobian(y, mu):
    """Derivative of `project_impulse` at y, row by row; 0 unless the normal part of y is positive."""
    size, limit, on = of.planar_length(y[1], y[2]), mu * y[0], select_lanes(y[0] > 0.0, Lanes(1.0, 1.0, 1.0, 1.0), 0.0)
    slips = size > limit
    a, b = select_lanes(slips, y[1] / size, 0.0), select_lanes(slips, y[2] / size, 0.0)
    s = on * select_lanes(slips, limit / size, 1.0)
    s = select_lanes(limit > 0.0, s, 0.0)
    m = select_lanes(limit > 0.0, on * mu, 0.0)
    return (on, 0.0 * on, 0.0 * on, m * a, s * (1.0 - a * a), -s * a * b, m * b, -s * a * b, s * (1.0 - b * b))


@inlined
def _world_rows(D, E, weight):
    """Rows of Eᵀ D E times `weight`: the matrix D of each contact, turned from its frame E to the world frame."""
    x = qt.transposed_matvec(D, (weight * E[0], weight * E[3], weight * E[6]))
    y = qt.transposed_matvec(D, (weight * E[1], weight * E[4], weight * E[7]))
    z = qt.transposed_matvec(D, (weight * E[2], weight * E[5], weight * E[8]))
    return qt.transposed_matvec(E, x), qt.transposed_matvec(E, y), qt.transposed_matvec(E, z)


@inlined
def _sum(a):
    """Sum of the vectors of a batch over its contacts, as half a column of a block of `block_lu`."""
    return lane_sums(a[0], a[1], a[2], Lanes(0.0, 0.0, 0.0, 0.0))


@inlined
def _columns(x, y, z):
    """Columns of the 3 x 3 matrix with the rows x, y and z, for all contacts of a batch."""
    return (x[0], y[0], z[0]), (x[1], y[1], z[1]), (x[2], y[2], z[2])


@inlined
def _sum_columns(A):
    """Sum of each of three columns A over the contacts of a batch, as half columns of `block_lu`."""
    return _sum(A[0]), _sum(A[1]), _sum(A[2])


@inlined
def _moment_columns(r, A):
    """Sum of r x a over the contacts of a batch, for each of three columns a of A, as half columns of `block_lu`."""
    return _sum(qt.cross(r, A[0])), _sum(qt.cross(r, A[1])), _sum(qt.cross(r, A[2]))


@inlined
def _add_columns(B, place, c, upper, lower):
    """Add three columns to columns c, c + 1 and c + 2 of block B[place].

    `upper` and `lower` have the first and the second halves of the three columns.
    """
    first, second, third = COLUMN_SIZE * c, COLUMN_SIZE * (c + 1), COLUMN_SIZE * (c + 2)
    store_lanes(B, place, first, load_lanes(B, place, first) + upper[0])
    store_lanes(B, place, first + ANGULAR_OFFSET, load_lanes(B, place, first + ANGULAR_OFFSET) + lower[0])
    store_lanes(B, place, second, load_lanes(B, place, second) + upper[1])
    store_lanes(B, place, second + ANGULAR_OFFSET, load_lanes(B, place, second + ANGULAR_OFFSET) + lower[1])
    store_lanes(B, place, third, load_lanes(B, place, third) + upper[2])
    store_lanes(B, place, third + ANGULAR_OFFSET, load_lanes(B, place, third + ANGULAR_OFFSET) + lower[2])


@inlined
def _subtract_columns(B, place, c, upper, lower):
    """Subtract three columns from columns c, c + 1 and c + 2 of block B[place].

    `upper` and `lower` have the first and the second halves of the three columns.
    """
    first, second, third = COLUMN_SIZE * c, COLUMN_SIZE * (c + 1), COLUMN_SIZE * (c + 2)
    store_lanes(B, place, first, load_lanes(B, place, first) - upper[0])
    store_lanes(B, place, first + ANGULAR_OFFSET, load_lanes(B, place, first + ANGULAR_OFFSET) - lower[0])
    store_lanes(B, place, second, load_lanes(B, place, second) - upper[1])
    store_lanes(B, place, second + ANGULAR_OFFSET, load_lanes(B, place, second + ANGULAR_OFFSET) - lower[1])
    store_lanes(B, place, third, load_lanes(B, place, third) - upper[2])
    store_lanes(B, place, third + ANGULAR_OFFSET, load_lanes(B, place, third + ANGULAR_OFFSET) - lower[2])


@kernel
def add_batch_to_matrix(g, D, rho, many):
    """Add Jᵀ ρ D J of the contacts of batch g to the blocks of its two bodies.

    D is a 3 x 3 matrix of each contact in the contact frame E, row by row. J = (1, -[r]x) turns the twist of a body
    into the velocity at the end of its arm r. With A = ρ Eᵀ D E a block is

        Jᵀ A J = (1; [r]x) A (1, -[s]x)

    for the arms r of the body of its rows and s of the body of its columns. The rows of -A [s]x are s x the rows of A.
    """
    a, b = many.newton.batch[g, BATCH_BODY_A], many.newton.batch[g, BATCH_BODY_B]
    x, y, z = _world_rows(D, of.batch_frames(g, many), rho * of.batch_field(g, of.LANE_WEIGHT, many))
    r = of.batch_vector(g, of.LANE_ARM, many)
    A, P = _columns(x, y, z), _columns(qt.cross(r, x), qt.cross(r, y), qt.cross(r, z))
    pull, of_a, turn_a = _sum_columns(A), _moment_columns(r, A), _sum_columns(P)
    _add_columns(many.system.diagonal, a, 0, pull, of_a)
    _add_columns(many.system.diagonal, a, 3, turn_a, _moment_columns(r, P))
    if b < 0:
        return
    s = of.batch_vector(g, of.LANE_ARM + 3, many)
    Q = _columns(qt.cross(s, x), qt.cross(s, y), qt.cross(s, z))
    of_b, turn_b = _moment_columns(s, A), _sum_columns(Q)
    _add_columns(many.system.diagonal, b, 0, pull, of_b)
    _add_columns(many.system.diagonal, b, 3, turn_b, _moment_columns(s, Q))
    place = many.newton.batch[g, BATCH_BLOCK]
    if many.newton.batch[g, BATCH_IS_A_FIRST] == 1:
        _subtract_columns(many.system.upper, place, 0, pull, of_a)
        _subtract_columns(many.system.upper, place, 3, turn_b, _moment_columns(r, Q))
        _subtract_columns(many.system.lower, place, 0, pull, of_b)
        _subtract_columns(many.system.lower, place, 3, turn_a, _moment_columns(s, P))
    else:
        _subtract_columns(many.system.lower, place, 0, pull, of_a)
        _subtract_columns(many.system.lower, place, 3, turn_b, _moment_columns(r, Q))
        _subtract_columns(many.system.upper, place, 0, pull, of_b)
        _subtract_columns(many.system.upper, place, 3, turn_a, _moment_columns(s, P))


@inlined
def _apply_inv_mass(B, place, b, many):
    """Multiply block B[place] from the left by M⁻¹, the inverse mass and inverse inertia of body b."""
    m, K = many.bodies.inv_mass[b], many.bodies.inv_inertia
    x = Lanes(K[b, 0], K[b, 1], K[b, 2], 0.0)
    y = Lanes(K[b, 1], K[b, 3], K[b, 4], 0.0)
    z = Lanes(K[b, 2], K[b, 4], K[b, 5], 0.0)
    for c in range(0, BLOCK_SIZE, COLUMN_SIZE):
        u, v, w = B[place, c + ANGULAR_OFFSET], B[place, c + ANGULAR_OFFSET + 1], B[place, c + ANGULAR_OFFSET + 2]
        store_lanes(B, place, c, m * load_lanes(B, place, c))
        store_lanes(B, place, c + ANGULAR_OFFSET, u * x + v * y + w * z)


@inlined
def complete_matrix(begin, end, many):
    """Complete the matrix of the bodies `many.islands.bodies[begin:end]`: multiply it by M⁻¹, and add 1."""
    for i in range(begin, end):
        b = many.islands.bodies[i]
        _apply_inv_mass(many.system.diagonal, b, b, many)
        for c in range(TWIST_DOFS):
            many.system.diagonal[b, COLUMN_SIZE * c + c + c // 3] += 1.0
        for k in range(many.system.start[b], many.system.stop[b]):
            _apply_inv_mass(many.system.upper, k, b, many)
            _apply_inv_mass(many.system.lower, k, many.system.column[k], many)


@kernel
def assemble_newton_matrix(part, rho, all_hold, many):
    """Assemble Newton's matrix 1 + M⁻¹ Jᵀ ρ p' J of an island, at the point of the last `compute_defect`.

    Arguments are as in `compute_defect`.
    """
    _, _, begin, end = part
    clear_system(begin, end, many)
    for g in range(many.counts[NUM_BATCHES]):
        y = of.batch_vector(g, of.PROX_ARGUMENT, many)
        if all_hold:
            y = (Lanes(1.0, 1.0, 1.0, 1.0), Lanes(0.0, 0.0, 0.0, 0.0), Lanes(0.0, 0.0, 0.0, 0.0))
        D = _slope_of_yielding(g, _projection_jacobian(y, of.batch_field(g, of.LANE_MU, many)), rho, many)
        add_batch_to_matrix(g, D, rho, many)
    complete_matrix(begin, end, many)
