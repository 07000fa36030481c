"""Interior-point method for hard contact problems of an island, from any start.

Let p be the impulses of a contact, u its velocity error and x the change of the bodies' twists. With p̂ = (μ p_n, p_t)
and û = (u_n/μ + |u_t|, u_t), Coulomb's law is û ∈ L, p̂ ∈ L, p̂ ∘ û = 0 for the Lorentz cone L (De Saxcé's change of
variables) [1]_. The method keeps p̂ and û inside L, and lets the product p̂ ∘ û shrink to zero at the same rate for all
contacts. Each iteration is one Newton step for

    x = M⁻¹ Jᵀ p,    û = S (J x + b) + |û_t| e,    p̂ ∘ û = σ ν e,

with S = diag(1/μ, 1, 1), e = (1, 0, 0), ν the mean of p̂·û, and the scaling of `second_order_cone` (λ = W p̂ = W⁻¹ û).
A predictor step with σ = 0 measures how far a step may go. The corrector step has the σ and the second-order term that
follow from it (Mehrotra [2]_). The derivative of |û_t| is included, so that the matrix is unsymmetric. Its blocks are
those of Newton's method on twists (`newton_system`). The result is measured, as elsewhere, by the natural-map residual.

Where û_t is small, its direction d turns with every step. The matrix, which contains d, can then be nearly singular:
steps reach the boundary of the cones at once, and the method is stuck there. Without d, with |û_t| taken as given, the
matrix is that of a minimum, symmetric and positive definite, and steps are long. But |û_t| then follows slowly, or not
at all. So a share of d is included, which shrinks after a short step and grows after others.

The cone of a contact without friction is a half line: S = diag(1, 0, 0).

References
----------
.. [1] V. Acary, P. Armand, H. M. Nguyen, M. Shpakovych, *Second-order cone programming for frictional contact
       mechanics using interior point algorithm*, Optim. Methods Softw. 39, 2024.
.. [2] S. Mehrotra, *On the implementation of a primal-dual interior point method*, SIAM J. Optim. 2, 1992.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined, kernel
from physics.compiler.simd import Lanes, lane_sum, larger, max_of_lanes, select_lanes
from physics.kernels.math import quaternion as qt
from physics.kernels.multibody.data.arrays import COLUMN_SIZE, NUM_BATCHES
from physics.kernels.multibody.data.contact_set import add_scaled
from physics.kernels.multibody.solver import contact_batches as of
from physics.kernels.multibody.solver import second_order_cone
from physics.kernels.multibody.solver.block_lu import (
    ANGULAR_OFFSET,
    TWIST_DOFS,
    clear_system,
    factor_system,
    solve_factored,
)
from physics.kernels.multibody.solver.newton_system import add_batch_to_matrix, complete_matrix, subtract_twists

# Share of the way to the boundary of the cones that a step may go; least ratio of p̂·û after and before a predictor
# step.
_FRACTION_TO_BOUNDARY = 0.98
_MIN_CENTERING = 1.0e-4

# Rounding may lead across the boundary where masses are far apart. So inside the cone x₀ is at least this times |x'|,
# which has an error of at most two units in its last place.
_INTERIOR_MARGIN = 1.0 + 4 * 2.0**-52

# Share of a whole step below which a step is short; factor of the share of d that is included, after a short step and
# after any other step.
_SHORT_STEP = 0.1
_SLIP_SHRINK, _SLIP_GROWTH = 0.2, 2.0


@inlined
def _units(g, many):
    """Diagonal of the matrix S of the module, for the contacts of batch g: (normal entry, tangential entry)."""
    return of.batch_field(g, of.IPM_UNIT, many), of.batch_field(g, of.IPM_UNIT + 1, many)


@inlined
def _apply_units(s, a):
    """Product S a of a contact's vector a and the diagonal matrix S, given as s = (normal, tangential entry)."""
    return (s[0] * a[0], s[1] * a[1], s[1] * a[2])


@inlined
def _unscaled_impulse(s, p):
    """Impulse p of a contact from the scaled impulse p̂, for the diagonal s = (normal, tangential entry) of S."""
    return (s[0] * p[0], s[1] * p[1], s[1] * p[2])


@inlined
def _write_units(g, many):
    """Write the diagonal of the matrix S of the module for batch g: (1/μ, 1), or (1, 0) without friction."""
    mu = of.batch_field(g, of.LANE_MU, many)
    of.put_batch_field(g, of.IPM_UNIT, select_lanes(mu > 0.0, 1.0 / mu, 1.0), many)
    of.put_batch_field(g, of.IPM_UNIT + 1, select_lanes(mu > 0.0, Lanes(1.0, 1.0, 1.0, 1.0), 0.0), many)


@inlined
def _set_starting_point(start, many):
    """Set the scaled impulses p̂ and velocities û of all contacts to a point inside the cones (see the module).

    It is inside by about `start` [m/s], and near the present impulses.
    """
    for g in range(many.counts[NUM_BATCHES]):
        _write_units(g, many)
        s, p = _units(g, many), of.gather_batch(g, many.contacts.impulse, many)
        u = _apply_units(s, of.batch_velocity_error(g, many))
        p = (p[0] / s[0], s[1] * p[1], s[1] * p[2])
        side, slip = of.planar_length(p[1], p[2]), of.planar_length(u[1], u[2])
        inside = larger(p[0], side) + start / (of.batch_field(g, of.LANE_W_NN, many) * s[0])
        of.put_batch_vector(g, of.IPM_IMPULSE, (inside, p[1], p[2]), many)
        of.put_batch_vector(g, of.IPM_VELOCITY, (larger(u[0] + slip, slip) + start, u[1], u[2]), many)


@inlined
def _add_batch_matrix(g, s, w, x, y, many):
    """Add Jᵀ S W⁻² (S + e dᵀ) J of the contacts of batch g to the linear system.

    S, W and e are those of the module. s is the diagonal of S, w = (w₀, w₁, w₂, η) the scaling W, and d = (0, x, y) the
    direction of slip, times the share that is included.
    """
    f = 1.0 / (w[3] * w[3])
    a, b, c = f * (2.0 * w[0] * w[0] - 1.0), -2.0 * f * w[0] * w[1], -2.0 * f * w[0] * w[2]
    d, e, g2 = f * (1.0 + 2.0 * w[1] * w[1]), 2.0 * f * w[1] * w[2], f * (1.0 + 2.0 * w[2] * w[2])
    n, t = s
    D = (n * n * a, n * t * (b + a * x), n * t * (c + a * y), n * t * b, t * t * (d + b * x), t * t * (e + b * y),
         n * t * c, t * t * (e + c * x), t * t * (g2 + c * y))  # fmt: skip
    add_batch_to_matrix(g, D, 1.0, many)


@inlined
def _scale_batch(g, share, many):
    """Compute the scaling of batch g, and add its matrix and right side to the system: (p̂·û, residual [m/s]).

    p̂ and û are the scaled impulse and velocity of a contact (see the module); both results have a number for each
    contact. `share` is the share of the slip direction d that the matrix includes.
    """
    s, p, u = _units(g, many), of.batch_vector(g, of.IPM_IMPULSE, many), of.batch_vector(g, of.IPM_VELOCITY, many)
    v = of.batch_velocity_error(g, many)
    worst = of.batch_residuals(g, _unscaled_impulse(s, p), v, many)
    slip = of.planar_length(u[1], u[2])
    f = select_lanes(slip > 0.0, share / slip, 0.0)
    x, y = f * u[1], f * u[2]
    w, own, inverse = second_order_cone.nt_scaling(p, u)
    v = _apply_units(s, v)
    miss = (v[0] + slip - u[0], v[1] - u[1], v[2] - u[2])
    of.put_batch_vector(g, of.IPM_RESIDUAL, miss, many)
    of.put_batch_vector(g, of.IPM_LAMBDA, own, many)
    of.put_batch_field(g, of.IPM_INV_ROOT_DET, inverse, many)
    of.put_batch_field(g, of.IPM_SLIP_DIRECTION, x, many)
    of.put_batch_field(g, of.IPM_SLIP_DIRECTION + 1, y, many)
    of.put_batch_vector(g, of.IPM_SCALING, w, many)
    of.put_batch_field(g, of.IPM_SCALING + 3, w[3], many)
    _add_batch_matrix(g, s, w, x, y, many)
    f = _apply_units(s, second_order_cone.apply_inv_scaling_twice(w, miss))
    of.apply_batch_impulse(g, (-f[0], -f[1], -f[2]), many.newton.defect, ANGULAR_OFFSET, many)
    return qt.dot(p, u), worst


@kernel
def _prepare_predictor(part, share, many):
    """Compute all scalings, and the system of the predictor step: (mean p̂·û of a contact, largest residual [m/s]).

    `part` is as in `newton_contacts`; `share` is the share of the slip direction d that the matrix includes. The matrix
    is the sum over contacts, which `complete_matrix` multiplies by M⁻¹ and adds to 1. The right side is written to
    `many.newton.defect`.
    """
    first, last, begin, end = part
    clear_system(begin, end, many)
    for i in range(begin, end):
        subtract_twists(many.islands.bodies[i], many.bodies.free_twist, many.bodies.twist, many)
    gap = worst = Lanes(0.0, 0.0, 0.0, 0.0)
    for g in range(many.counts[NUM_BATCHES]):
        product, miss = _scale_batch(g, share, many)
        gap, worst = gap + of.batch_field(g, of.LANE_WEIGHT, many) * product, larger(worst, miss)
    return lane_sum(gap) / (last - first), max_of_lanes(worst)


@inlined
def _scaling_of(g, many):
    """Scaling W = (w₀, w₁, w₂, η) of the contacts of batch g."""
    w = of.batch_vector(g, of.IPM_SCALING, many)
    return (w[0], w[1], w[2], of.batch_field(g, of.IPM_SCALING + 3, many))


@inlined
def _batch_twist_step(g, s, many):
    """Vectors (S + e dᵀ) J dx of the contacts of batch g, for the change dx of twists in `many.newton.change`.

    S and e are those of the module, s is the diagonal of S, and d = (0, x, y) is the direction of slip, times the share
    that is included.
    """
    x, y = of.batch_field(g, of.IPM_SLIP_DIRECTION, many), of.batch_field(g, of.IPM_SLIP_DIRECTION + 1, many)
    d = _apply_units(s, of.batch_velocity(g, many.newton.change, ANGULAR_OFFSET, many))
    return (d[0] + (x * d[1] + y * d[2]), d[1], d[2])


@inlined
def _find_step_length(part, is_corrected, many):
    """Compute the changes dp̂ and dû that belong to the change of twists in `many.newton.change`: (step, product).

    p̂ and û are the scaled impulse and velocity of a contact (see the module). The step, at most 1, is the largest that
    stays inside all cones. The product is the mean p̂·û of a contact after that step. The changes satisfy

        W dp̂ + W⁻¹ dû = f - λ,

    where f is the corrector (`IPM_CORRECTION`) if `is_corrected`, else 0. The product is right only without corrector.
    """
    most = Lanes(1.0, 1.0, 1.0, 1.0)  # lower bounds of 1/t, a lane each
    square = product = Lanes(0.0, 0.0, 0.0, 0.0)
    for g in range(many.counts[NUM_BATCHES]):
        own, inverse, on = (
            of.batch_vector(g, of.IPM_LAMBDA, many),
            of.batch_field(g, of.IPM_INV_ROOT_DET, many),
            of.batch_field(g, of.LANE_WEIGHT, many),
        )
        du = add_scaled(_batch_twist_step(g, _units(g, many), many), 1.0, of.batch_vector(g, of.IPM_RESIDUAL, many))
        h = second_order_cone.apply_inv_scaling(_scaling_of(g, many), du)
        dp = (-own[0] - h[0], -own[1] - h[1], -own[2] - h[2])
        if is_corrected:
            dp = add_scaled(dp, 1.0, of.batch_vector(g, of.IPM_CORRECTION, many))
        of.put_batch_vector(g, of.IPM_IMPULSE_STEP, dp, many)
        of.put_batch_vector(g, of.IPM_VELOCITY_STEP, du, many)
        most = larger(
            most,
            larger(
                second_order_cone.inv_step_to_boundary(own, inverse, dp),
                second_order_cone.inv_step_to_boundary(own, inverse, h),
            ),
        )
        square = square + on * qt.dot(own, own)
        product = product + on * qt.dot(dp, h)
    t = 1.0 / max_of_lanes(most)
    return t, ((1.0 - t) * lane_sum(square) + t * t * lane_sum(product)) / (part[1] - part[0])


@inlined
def _set_right_side(part, many):
    """Copy the right side of `_prepare_predictor` to `many.newton.change`, for the bodies of the island `part`."""
    for i in range(part[2], part[3]):
        b = many.islands.bodies[i]
        for c in range(COLUMN_SIZE):
            many.newton.change[b, c] = many.newton.defect[b, c]


@inlined
def _set_corrector(part, center, many):
    """Write the right side of the corrector step to `many.newton.change`; `center` is the target product σ ν.

    The corrector f of each contact solves

        λ ∘ f = σ ν e - (W dp̂) ∘ (W⁻¹ dû),

    with the changes dp̂ and dû of the predictor step (see the module). It is stored in the batches.
    """
    _set_right_side(part, many)
    for g in range(many.counts[NUM_BATCHES]):
        own, a = of.batch_vector(g, of.IPM_LAMBDA, many), of.batch_vector(g, of.IPM_IMPULSE_STEP, many)
        m = second_order_cone.jordan_product(a, (-own[0] - a[0], -own[1] - a[1], -own[2] - a[2]))
        f = second_order_cone.jordan_quotient(
            (center - m[0], -m[1], -m[2]), own, of.batch_field(g, of.IPM_INV_ROOT_DET, many)
        )
        of.put_batch_vector(g, of.IPM_CORRECTION, f, many)
        of.apply_batch_impulse(
            g,
            _apply_units(_units(g, many), second_order_cone.apply_inv_scaling(_scaling_of(g, many), f)),
            many.newton.change,
            ANGULAR_OFFSET,
            many,
        )


@inlined
def _move_inside_cone(a):
    """Vector a with its first component raised, if need be, so that it is inside the cone despite rounding."""
    return (larger(a[0], _INTERIOR_MARGIN * of.planar_length(a[1], a[2])), a[1], a[2])


@inlined
def _take_step(part, t, many):
    """Change the scaled impulses p̂ and velocities û, and the twists of the island `part`, by a share t of the step."""
    for g in range(many.counts[NUM_BATCHES]):
        dp = second_order_cone.apply_inv_scaling(_scaling_of(g, many), of.batch_vector(g, of.IPM_IMPULSE_STEP, many))
        of.put_batch_vector(
            g, of.IPM_IMPULSE, _move_inside_cone(add_scaled(of.batch_vector(g, of.IPM_IMPULSE, many), t, dp)), many
        )
        du = of.batch_vector(g, of.IPM_VELOCITY_STEP, many)
        of.put_batch_vector(
            g, of.IPM_VELOCITY, _move_inside_cone(add_scaled(of.batch_vector(g, of.IPM_VELOCITY, many), t, du)), many
        )
    for i in range(part[2], part[3]):
        b = many.islands.bodies[i]
        for c in range(TWIST_DOFS):
            many.bodies.twist[b, c] += t * many.newton.change[b, c + c // 3]


@inlined
def _write_solution(part, many):
    """Write the impulses in the batches to the contacts of the island `part`, and the twists that they cause."""
    for i in range(part[2], part[3]):
        b = many.islands.bodies[i]
        for c in range(TWIST_DOFS):
            many.bodies.twist[b, c] = many.bodies.free_twist[b, c]
    for g in range(many.counts[NUM_BATCHES]):
        p = _unscaled_impulse(_units(g, many), of.batch_vector(g, of.IPM_IMPULSE, many))
        of.scatter_batch(g, p, many.contacts.impulse, many)
        of.apply_batch_impulse(g, p, many.bodies.twist, 3, many)


@kernel
def interior_point_contacts(part, start, goal, limit, many):
    """Improve the impulses of an island by at most `limit` iterations; return their number.

    Parameters
    ----------
    part : tuple of 4 ints
        Island as for `newton_contacts`; its bodies are ordered for elimination.
    start : float
        Distance from the boundary of the cones to begin with, about the residual of the present impulses [m/s].
    goal : float
        Residual to stop at [m/s]. It is measured before the twists are computed anew from the impulses.
    limit : int
        Largest number of iterations.
    many : BodiesWorkspace
        Workspace of the world; `contacts.impulse` and `bodies.twist` receive the result.
    """
    _, _, begin, end = part
    _set_starting_point(start, many)
    count, share = 0, 1.0
    while count < limit:
        gap, worst = _prepare_predictor(part, share, many)
        if not worst > goal:
            break
        complete_matrix(begin, end, many)
        factor_system(begin, end, many)
        _set_right_side(part, many)
        solve_factored(begin, end, many.newton.change, many)
        _, after = _find_step_length(part, False, many)
        ratio = min(1.0, max(after / gap, _MIN_CENTERING))
        _set_corrector(part, ratio * ratio * ratio * gap, many)
        solve_factored(begin, end, many.newton.change, many)
        t, _ = _find_step_length(part, True, many)
        _take_step(part, min(1.0, _FRACTION_TO_BOUNDARY * t), many)
        share = _SLIP_SHRINK * share if t < _SHORT_STEP else min(1.0, _SLIP_GROWTH * share)
        count += 1
    _write_solution(part, many)
    return count
