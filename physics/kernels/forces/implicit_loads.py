"""Soften the loads of force fields, for a stage that is too long for the explicit midpoint rule (implicit loads).

Let A = (a, T) be the loads at the middle of a stage of length h, z = (v, ω), and M the generalised mass. The linearly
implicit midpoint rule is

    z' = z + h (1 + M⁻¹ Z)⁻¹ M⁻¹ A,    Z = θ h D + (h²/4) K,

with the damping D and the stiffness K of the field. Both are positive, so no step amplifies, whatever h. *Softened*
loads are (1 + Z M⁻¹)⁻¹ A: smaller loads, which an explicit step may hold. Loads in balance (A = 0) stay so. Stiffness
has the weight h²/4, the implicit midpoint rule, which keeps a quadratic energy. Damping has the weight

    θ = max(½, 1 - 1/(h λ)).

This is of second order while h resolves the rate λ, and monotone beyond, towards implicit Euler. Several fields soften
the loads one after the other: Π (1 + M⁻¹ Z_i)⁻¹ differs from (1 + M⁻¹ Σ Z_i)⁻¹ by O(h²), and damps no less.

The stiffness of a field is given by three rates: damping λ [1/s], a squared frequency Ω² [1/s²], and the rate γ [1/s]
at which it turns the velocity. Each is an upper bound, for one body alone. The function `<field>_rates` of each field
returns (λ, Ω², γ), and `soften_<field>` returns softened loads (a, T): acceleration [m/s²] and torque [N m].

References
----------
H. H. Rosenbrock, *Some general implicit processes for the numerical solution of differential equations*, Computer J. 5,
1963 (the one-stage method); E. Hairer, G. Wanner, *Solving Ordinary Differential Equations II*, 2nd ed., 1996, IV.7.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, times
from physics.kernels.state.body import apply_inv_inertia

# A stage of length h is implicit where h λ is above this limit, or where the stage does not resolve a field.
DAMPING_LIMIT = 0.5

# A stage does not resolve a field where h Ω or h γ, the angle by which the body swings or turns, is above this [rad].
_RESOLVED_ANGLE = 1.0


@inlined
def implicit_share(z):
    """Weight θ of a damping in Z (module docstring), from z = h λ: ½ up to z = 2, then 1 - 1/z."""
    if z > 2.0:
        return 1.0 - 1.0 / z
    return 0.5


@inlined
def is_unresolved(rates, h):
    """True if a stage of length h does not resolve a field's swing or turn, from its rates (λ, Ω², γ).

    Damping does not count, since `stiff_flight` resolves it.
    """
    return h * h * rates[1] > _RESOLVED_ANGLE * _RESOLVED_ANGLE or h * rates[2] > _RESOLVED_ANGLE


@inlined
def is_too_stiff(rates, h):
    """True if a stage of length h is too long for the explicit midpoint rule, by the rates (λ, Ω², γ) of its fields."""
    return h * rates[0] > DAMPING_LIMIT or is_unresolved(rates, h)


@inlined
def mobility_bound(arm, mass, J):
    """Upper bound of the acceleration per force of the point `arm` of a body, in any direction [1/kg]."""
    return 1.0 / mass + qt.dot(arm, arm) * max(J[0], J[1], J[2])


@inlined
def arm_frequency_squared(force, arm, J):
    """Bound of the squared frequency with which a body swings, as a pendulum, under a force at `arm` [1/s²].

    It is |force| |arm| times the largest inverse moment.
    """
    return math.sqrt(qt.dot(force, force) * qt.dot(arm, arm)) * max(J[0], J[1], J[2])


@inlined
def soften_torque(T, s, R, J):
    """Soften the torque T by a stiffness s of Z against turning [kg m²], equal about all axes: (1 + s I⁻¹)⁻¹ T.

    R is the matrix of the principal axes, J the inverse principal moments.
    """
    m = qt.transposed_matvec(R, T)
    return qt.matvec(R, (m[0] / (1.0 + s * J[0]), m[1] / (1.0 + s * J[1]), m[2] / (1.0 + s * J[2])))


@inlined
def soften_arm(loads, h, force, arm, R, J):
    """Soften the torque of the loads (a, T), because a force at `arm` makes the body swing like a pendulum.

    The acceleration a is returned as it is.
    """
    a, T = loads
    return a, soften_torque(T, 0.25 * h * h * math.sqrt(qt.dot(force, force) * qt.dot(arm, arm)), R, J)


@inlined
def axes_across(n):
    """Two unit vectors that are perpendicular to the unit vector n and to each other."""
    if abs(n[0]) < 0.6:
        e = (1.0, 0.0, 0.0)
    else:
        e = (0.0, 1.0, 0.0)
    s = qt.cross(n, e)
    s = times(1.0 / math.sqrt(qt.dot(s, s)), s)
    return s, qt.cross(n, s)


@inlined
def point_mobility(direction, arm, R, mass, J):
    """Acceleration vector of the point `arm` of a body under a unit force there, along `direction` [1/kg]."""
    alpha = apply_inv_inertia(R, qt.cross(arm, direction), J)
    return plus(times(1.0 / mass, direction), qt.cross(alpha, arm))


@kernel
def implicit_point_force(w, n, s, t, wn, ws, wt, along, across):
    """Force f = (1 + Z W)⁻¹ Z w by which a stiffness Z at a point softens the acceleration w of that point [m/s²].

    For a spring between two bodies, w is the acceleration of its two points relative to each other. n, s and t are
    perpendicular unit vectors; Z is `along` on n, and `across` on s and t [kg]. wn, ws and wt are W n, W s and W t,
    with the mobility W of the point, or the sum of both mobilities [1/kg]. In these axes row i of the system is
    f_i + z_i (W f)_i = z_i w_i. Each row is divided by 1 + z_i W_ii, which keeps the system accurate for any z.
    """
    kn = along / (1.0 + along * qt.dot(n, wn))
    ks = across / (1.0 + across * qt.dot(s, ws))
    kt = across / (1.0 + across * qt.dot(t, wt))
    ns, nt, st = qt.dot(n, ws), qt.dot(n, wt), qt.dot(s, wt)
    bn, bs, bt = kn * qt.dot(n, w), ks * qt.dot(s, w), kt * qt.dot(t, w)
    p, u = ks * ns, kt * nt
    # Rows of s and t without the unknown along n.
    ss, sr, cs = 1.0 - p * kn * ns, ks * st - p * kn * nt, bs - p * bn
    ts, tr, ct = kt * st - u * kn * ns, 1.0 - u * kn * nt, bt - u * bn
    share = ts / ss
    ft = (ct - share * cs) / (tr - share * sr)
    fs = (cs - sr * ft) / ss
    fn = bn - kn * ns * fs - kn * nt * ft
    return plus(times(fn, n), plus(times(fs, s), times(ft, t)))


@kernel
def soften_at(loads, arm, n, along, across, R, mass, J):
    """Soften the loads (a, T) of a body by a stiffness Z that acts at its point `arm`.

    The loads are an acceleration a [m/s²] and a torque T [N m]. Z, the stiffness times a squared time [kg], is a matrix
    with the value `along` in the direction of the unit vector n and `across` perpendicular to it. Let W be the mobility
    of the point, and w its acceleration under the loads. Then the force f = (1 + Z W)⁻¹ Z w, which acts at the point,
    is subtracted from the loads. R is the matrix of the principal axes, J the inverse principal moments.
    """
    a, T = loads
    w = plus(a, qt.cross(apply_inv_inertia(R, T, J), arm))
    s, t = axes_across(n)
    wn, ws, wt = (
        point_mobility(n, arm, R, mass, J),
        point_mobility(s, arm, R, mass, J),
        point_mobility(t, arm, R, mass, J),
    )
    f = implicit_point_force(w, n, s, t, wn, ws, wt, along, across)
    return minus(a, times(1.0 / mass, f)), minus(T, qt.cross(arm, f))
