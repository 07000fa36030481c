"""Second-order (Lorentz) cone x₀ ≥ |(x₁, x₂)| and its scaling, for one contact or four at once.

With the Jordan product a ∘ b = (a·b, a₀ b' + b₀ a'), for a' = (a₁, a₂), the cone is the set of squares. The scaling of
Nesterov and Todd for vectors p and u in the cone is the symmetric matrix W with W p = W⁻¹ u = λ. Let p̄ and ū be p and
u divided by the roots of their determinants, R = diag(1, -1, -1), w = (ū + R p̄)/(2γ) with γ such that det w = 1, and
η⁴ = det u/det p. Then

    W = η (w₀, w'ᵀ; w', 1 + w' w'ᵀ/(1 + w₀)),    W⁻² = η⁻² (2 R w (R w)ᵀ - R).

Functions below take W as the tuple (w₀, w₁, w₂, η).

References
----------
.. [1] Y. E. Nesterov, M. J. Todd, *Self-scaled barriers and interior-point methods for convex programming*, Math.
       Oper. Res. 22, 1997.
.. [2] F. Alizadeh, D. Goldfarb, *Second-order cone programming*, Math. Program. 95, 2003.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined
from physics.compiler.simd import lane_sqrt
from physics.kernels.math import quaternion as qt


@inlined
def cone_determinant(a):
    """Determinant a₀² - a₁² - a₂² of a vector, as a product of two factors that avoids cancellation."""
    size = lane_sqrt(a[1] * a[1] + a[2] * a[2])
    return (a[0] - size) * (a[0] + size)


@inlined
def nt_scaling(p, u):
    """Nesterov-Todd scaling W p = W⁻¹ u = λ of vectors p and u inside the cone: (W, λ, 1/√det λ).

    W is the tuple (w₀, w₁, w₂, η) of the module.
    """
    dp, du = lane_sqrt(cone_determinant(p)), lane_sqrt(cone_determinant(u))
    s, t = 1.0 / dp, 1.0 / du
    half = 1.0 / lane_sqrt(2.0 + 2.0 * s * t * qt.dot(p, u))  # 1/(2γ)
    eta = lane_sqrt(du * s)
    w = (half * (t * u[0] + s * p[0]), half * (t * u[1] - s * p[1]), half * (t * u[2] - s * p[2]), eta)
    return w, apply_scaling(w, p), 1.0 / (dp * eta)


@inlined
def apply_scaling(w, x):
    """Product W x of the scaling w = (w₀, w₁, w₂, η) and a vector x."""
    d = w[1] * x[1] + w[2] * x[2]
    f = x[0] + d / (1.0 + w[0])
    return (w[3] * (w[0] * x[0] + d), w[3] * (x[1] + f * w[1]), w[3] * (x[2] + f * w[2]))


@inlined
def apply_inv_scaling(w, x):
    """Product W⁻¹ x of the inverse of the scaling w = (w₀, w₁, w₂, η) and a vector x."""
    return apply_scaling((w[0], -w[1], -w[2], 1.0 / w[3]), x)


@inlined
def apply_inv_scaling_twice(w, x):
    """Product W⁻² x for the scaling w = (w₀, w₁, w₂, η) and a vector x."""
    s = 1.0 / (w[3] * w[3])
    d = 2.0 * (w[0] * x[0] - w[1] * x[1] - w[2] * x[2])
    return (s * (d * w[0] - x[0]), s * (x[1] - d * w[1]), s * (x[2] - d * w[2]))


@inlined
def jordan_product(a, b):
    """Jordan product a ∘ b = (a·b, a₀ b' + b₀ a') of two vectors, with a' = (a₁, a₂)."""
    return (qt.dot(a, b), a[0] * b[1] + b[0] * a[1], a[0] * b[2] + b[0] * a[2])


@inlined
def jordan_quotient(b, a, inverse):
    """Solution x of a ∘ x = b, for a inside the cone; `inverse` is 1/√det a."""
    x = (a[0] * b[0] - a[1] * b[1] - a[2] * b[2]) * (inverse * inverse)
    s = 1.0 / a[0]
    return (x, s * (b[1] - x * a[1]), s * (b[2] - x * a[2]))


@inlined
def inv_step_to_boundary(a, inverse, d):
    """Inverse 1/t of the largest step t for which a + t d is in the cone, for a inside; at most 0 if all t are allowed.

    `inverse` is 1/√det a. The scaling that takes a to √det a (1, 0, 0) takes d to √det a h. So 1 + t h₀ ≥ t |h'| is
    required.
    """
    s = inverse
    h = apply_inv_scaling((s * a[0], s * a[1], s * a[2], 1.0), (s * d[0], s * d[1], s * d[2]))
    return lane_sqrt(h[1] * h[1] + h[2] * h[2]) - h[0]
