"""Implicit loads of fields, for a step that is too long for the explicit midpoint rule.

With the loads A = (a, T) of the middle, z = (v, ω) and the generalised mass M, the linearly implicit midpoint rule is

    z' = z + h (1 + M⁻¹ Z)⁻¹ M⁻¹ A,    Z = θ h D + (h²/4) K,

D the damping and K the stiffness of the field: both positive, so that no step can amplify, whatever h. Loads in balance
(A = 0) stay so. A spring has θ = ½ beside its h²/4: the implicit midpoint rule, which keeps a quadratic energy.
Damping has

    θ = max(½, 1 - 1/(h λ)),

second order while it resolves the rate λ, and monotone beyond, towards implicit Euler. Several fields take their turn:
Π (1 + M⁻¹ Z_i)⁻¹ differs from (1 + M⁻¹ Σ Z_i)⁻¹ by O(h²), and damps no less.

A field says how stiff it is by three `rates`: of damping λ [1/s], the square of a frequency Ω² [1/s²], and of turning
the velocity γ [1/s]. Each is a bound for one body alone.

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

# A stage is taken implicitly where h λ is more, or where it does not resolve a field.
DAMPING_LIMIT = 0.5

# It does not resolve a field where h Ω or h γ, the angle that it swings or turns by [rad], is more.
_RESOLVED_ANGLE = 1.0


@inlined
def implicit_share(z):
    """θ of a damping of z = h λ."""
    if z > 2.0:
        return 1.0 - 1.0 / z
    return 0.5


@inlined
def is_unresolved(rates, h):
    """True if a step of h does not resolve the swing or turn of a field; `stiff_flight` resolves damping."""
    return h * h * rates[1] > _RESOLVED_ANGLE * _RESOLVED_ANGLE or h * rates[2] > _RESOLVED_ANGLE


@inlined
def is_too_stiff(rates, h):
    """True where a step of h is too long for the explicit midpoint rule."""
    return h * rates[0] > DAMPING_LIMIT or is_unresolved(rates, h)


@inlined
def mobility_bound(arm, mass, J):
    """Bound of the inverse mass of any point of the body under a force [1/kg]."""
    return 1.0 / mass + qt.dot(arm, arm) * max(J[0], J[1], J[2])


@inlined
def arm_frequency_squared(force, arm, J):
    """Squared frequency [1/s²] of the swing of a body under a force at an arm: a pendulum's, |F| |r| J at most."""
    return math.sqrt(qt.dot(force, force) * qt.dot(arm, arm)) * max(J[0], J[1], J[2])


@inlined
def soften_torque(T, s, R, J):
    """(1 + s I⁻¹)⁻¹ T for a stiffness s of Z [kg m²] against turning, equal about all axes."""
    m = qt.transposed_matvec(R, T)
    return qt.matvec(R, (m[0] / (1.0 + s * J[0]), m[1] / (1.0 + s * J[1]), m[2] / (1.0 + s * J[2])))


@inlined
def soften_arm(loads, h, force, arm, R, J):
    """Loads with the torque softened for the swing of a force at an arm."""
    a, T = loads
    return a, soften_torque(T, 0.25 * h * h * math.sqrt(qt.dot(force, force) * qt.dot(arm, arm)), R, J)


@inlined
def axes_across(n):
    """Two unit vectors across the unit vector n."""
    if abs(n[0]) < 0.6:
        e = (1.0, 0.0, 0.0)
    else:
        e = (0.0, 1.0, 0.0)
    s = qt.cross(n, e)
    s = times(1.0 / math.sqrt(qt.dot(s, s)), s)
    return s, qt.cross(n, s)


@inlined
def point_mobility(direction, arm, R, mass, J):
    """Acceleration of the point `arm` under a unit force along `direction` [1/kg]."""
    alpha = apply_inv_inertia(R, qt.cross(arm, direction), J)
    return plus(times(1.0 / mass, direction), qt.cross(alpha, arm))


@kernel
def implicit_point_force(w, n, s, t, wn, ws, wt, along, across):
    """Force f = (1 + Z W)⁻¹ Z w for the acceleration w of a point, or of two against each other.

    Z has the stiffness `along` on the unit vector n, and `across` on s and t [kg]. wn, ws, wt are W n, W s and W t,
    with the mobility W of the point or of both [1/kg]. In these axes row i reads f_i + z_i (W f)_i = z_i w_i. Each row
    is divided by 1 + z_i W_ii, which keeps the system accurate for any z.
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
    """(1 + M⁻¹ Z)⁻¹ of the loads for Z at the point `arm`: `along` the unit vector n and `across` it [kg].

    With W the mobility of the point and w its acceleration, the force f = (1 + Z W)⁻¹ Z w acts on it, backwards.
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
