"""An interior-point method for the contact problem of an island: hard ones, whatever the start.

With p̂ = (μ p_n, p_t) and û = (u_n/μ + |u_t|, u_t) Coulomb's law is û ∈ L, p̂ ∈ L, p̂ ∘ û = 0 for the Lorentz cone L
(De Saxcé's change of variables) [1]_. The method keeps both inside L and lets p̂ ∘ û shrink to nothing evenly: each
iteration is one Newton step for

    x = M⁻¹ Jᵀ p,    û = S (J x + b) + |û_t| e,    p̂ ∘ û = σ ν e,

scaled as in `cone` (λ = W p̂ = W⁻¹ û), first with σ = 0 to see how far that leads, then with σ and the second-order
term that this suggests (Mehrotra [2]_). The derivative of |û_t| is taken along, which makes the matrix unsymmetric, and
its blocks are those of Newton's method on twists (`system`). What counts is measured as everywhere, by the natural map.

Without friction of a contact its cone is a half line: S = (1, 0, 0).

References
----------
.. [1] V. Acary, P. Armand, H. M. Nguyen, M. Shpakovych, *Second-order cone programming for frictional contact
       mechanics using interior point algorithm*, Optim. Methods Softw. 39, 2024.
.. [2] S. Mehrotra, *On the implementation of a primal-dual interior point method*, SIAM J. Optim. 2, 1992.
"""

from __future__ import annotations

import math

from physics.kernels import quaternion as qt
from physics.kernels.compiler import inlined, kernel
from physics.kernels.many import cone
from physics.kernels.many.blocks import SIZE, clear, factor, substitute
from physics.kernels.many.contacts import local_velocity, plus, put, vector, velocity_along
from physics.kernels.many.response import natural_map, push
from physics.kernels.many.system import add_contact, complete_matrix

# How near to the boundary of the cones a step may lead; least ratio of p̂·û after and before that is aimed at.
STEP_SHARE = 0.98
LEAST_RATIO = 1.0e-4


@inlined
def _units(k, many):
    """Diagonal of S of contact k: (normal, tangents)."""
    if not many.mu[k] > 0.0:
        return 1.0, 0.0
    return 1.0 / many.mu[k], 1.0


@inlined
def _into(s, a):
    """S a."""
    return (s[0] * a[0], s[1] * a[1], s[1] * a[2])


@inlined
def _change(k, s, x, y, many):
    """(S + e dᵀ) J dx for the change of twists in `many.change`, d = (0, x, y) the direction of slip."""
    d = _into(s, velocity_along(k, many.change, many))
    return (d[0] + (x * d[1] + y * d[2]), d[1], d[2])


@inlined
def _begin(part, start, many):
    """Start inside the cones by about `start` [m/s], near the impulses as they are."""
    for i in range(part[0], part[1]):
        k = many.queue[i]
        s = _units(k, many)
        p, u, t = vector(many.impulse, k, 0), local_velocity(k, many), vector(many.target, k, 0)
        u = _into(s, (u[0] - t[0], u[1] - t[1], u[2] - t[2]))
        p = (p[0] / s[0], s[1] * p[1], s[1] * p[2])
        side, slip = math.sqrt(p[1] * p[1] + p[2] * p[2]), math.sqrt(u[1] * u[1] + u[2] * u[2])
        put(many.inside, k, 0, (max(p[0], side) + start / (many.block[k, 0] * s[0]), p[1], p[2]))
        put(many.slack, k, 0, (max(u[0] + slip, slip) + start, u[1], u[2]))


@inlined
def _pose(k, s, w, x, y, many):
    """Add contact k to the system: S W⁻² (S + e dᵀ) between its rows, d = (0, x, y) the direction of slip."""
    f = 1.0 / (w[3] * w[3])
    a, b, c = f * (2.0 * w[0] * w[0] - 1.0), -2.0 * f * w[0] * w[1], -2.0 * f * w[0] * w[2]
    d, e, g = f * (1.0 + 2.0 * w[1] * w[1]), 2.0 * f * w[1] * w[2], f * (1.0 + 2.0 * w[2] * w[2])
    n, t = s
    D = (n * n * a, n * t * (b + a * x), n * t * (c + a * y), n * t * b, t * t * (d + b * x), t * t * (e + b * y),
         n * t * c, t * t * (e + c * x), t * t * (g + c * y))  # fmt: skip
    add_contact(k, D, 1.0, many)


@kernel
def _prepare(part, many):
    """Scalings, matrix and the right side without what pushes off the boundary: (p̂·û of a contact, residual [m/s])."""
    first, last, begin, end = part
    clear(begin, end, many)
    for i in range(begin, end):
        b = many.order[i]
        for c in range(SIZE):
            many.defect[b, c] = many.free[b, c] - many.twist[b, c]
    gap = worst = 0.0
    for i in range(first, last):
        k = many.queue[i]
        s, p, u = _units(k, many), vector(many.inside, k, 0), vector(many.slack, k, 0)
        v, t = local_velocity(k, many), vector(many.target, k, 0)
        v = (v[0] - t[0], v[1] - t[1], v[2] - t[2])
        real = (p[0] * s[0], s[1] * p[1], s[1] * p[2])
        worst = max(worst, natural_map(real, v, many.block[k, 0], many.step[k], many.mu[k] * s[1]))
        slip = math.sqrt(u[1] * u[1] + u[2] * u[2])
        x, y = (u[1] / slip, u[2] / slip) if slip > 0.0 else (0.0, 0.0)
        w, own, inverse = cone.scaling(p, u)
        gap += qt.dot(p, u)
        v = _into(s, v)
        miss = (v[0] + slip - u[0], v[1] - u[1], v[2] - u[2])
        put(many.miss, k, 0, miss)
        put(many.own, k, 0, own)
        put(many.extra, k, 0, (0.0, 0.0, 0.0))
        many.own[k, 3], many.own[k, 4], many.own[k, 5] = inverse, x, y
        many.scaling[k, 0], many.scaling[k, 1], many.scaling[k, 2], many.scaling[k, 3] = w
        _pose(k, s, w, x, y, many)
        f = _into(s, cone.unscaled_twice(w, miss))
        push(k, (-f[0], -f[1], -f[2]), many.defect, many)
    complete_matrix(begin, end, many)
    factor(begin, end, many)
    return gap / (last - first), worst


@inlined
def _scaling_of(k, many):
    """(w₀, w₁, w₂, η) of contact k."""
    return (many.scaling[k, 0], many.scaling[k, 1], many.scaling[k, 2], many.scaling[k, 3])


@inlined
def _explore(part, many):
    """Changes that belong to `many.change`, W dp̂ and dû; how far they lead, and p̂·û of a contact there.

    With what is in `many.extra`, f, they satisfy W dp̂ + W⁻¹ dû = f - λ. The second number is right where f is 0.
    """
    first, last = part[0], part[1]
    most = 1.0  # of what 1/t must be at least
    square = product = 0.0
    for i in range(first, last):
        k = many.queue[i]
        own, inverse = vector(many.own, k, 0), many.own[k, 3]
        du = plus(_change(k, _units(k, many), many.own[k, 4], many.own[k, 5], many), 1.0, vector(many.miss, k, 0))
        f, g = vector(many.extra, k, 0), cone.unscaled(_scaling_of(k, many), du)
        dp = (f[0] - own[0] - g[0], f[1] - own[1] - g[1], f[2] - own[2] - g[2])
        put(many.aim, k, 0, dp)
        put(many.trial, k, 0, du)
        most = max(most, max(cone.way_out(own, inverse, dp), cone.way_out(own, inverse, g)))
        square += qt.dot(own, own)
        product += qt.dot(dp, g)
    t = 1.0 / most
    return t, ((1.0 - t) * square + t * t * product) / (last - first)


@inlined
def _set_right_side(part, many):
    """`many.change`: the right side that `_prepare` left."""
    for i in range(part[2], part[3]):
        b = many.order[i]
        for c in range(SIZE):
            many.change[b, c] = many.defect[b, c]


@inlined
def _correct(part, center, many):
    """Right side with σ ν = `center` and the second-order term of the changes found so far: f = λ \\ (σ ν e - ...)."""
    _set_right_side(part, many)
    for i in range(part[0], part[1]):
        k = many.queue[i]
        own, a = vector(many.own, k, 0), vector(many.aim, k, 0)
        m = cone.product(a, (-own[0] - a[0], -own[1] - a[1], -own[2] - a[2]))
        f = cone.quotient((center - m[0], -m[1], -m[2]), own, many.own[k, 3])
        put(many.extra, k, 0, f)
        push(k, _into(_units(k, many), cone.unscaled(_scaling_of(k, many), f)), many.change, many)


@inlined
def _step(part, t, many):
    """Go t of the way."""
    for i in range(part[0], part[1]):
        k = many.queue[i]
        dp = cone.unscaled(_scaling_of(k, many), vector(many.aim, k, 0))
        put(many.inside, k, 0, plus(vector(many.inside, k, 0), t, dp))
        put(many.slack, k, 0, plus(vector(many.slack, k, 0), t, vector(many.trial, k, 0)))
    for i in range(part[2], part[3]):
        b = many.order[i]
        for c in range(SIZE):
            many.twist[b, c] += t * many.change[b, c]


@inlined
def _take(part, many):
    """The impulses, and the twists that belong to them."""
    for i in range(part[2], part[3]):
        b = many.order[i]
        for c in range(SIZE):
            many.twist[b, c] = many.free[b, c]
    for i in range(part[0], part[1]):
        k = many.queue[i]
        s, p = _units(k, many), vector(many.inside, k, 0)
        put(many.impulse, k, 0, (p[0] * s[0], s[1] * p[1], s[1] * p[2]))
        push(k, vector(many.impulse, k, 0), many.twist, many)


@kernel
def interior_point(part, start, goal, limit, many):
    """Improve the impulses of an island by at most `limit` iterations; how many were made.

    Parameters
    ----------
    part : tuple of 4 ints
        As for `newton_contacts`; the bodies are ordered for elimination.
    start : float
        How far inside the cones to begin, about the residual of the impulses as they are [m/s]. 0: go on from where
        the last call for this island ended.
    goal : float
        Residual to stop at [m/s], before the impulses and twists are made to belong to each other.
    limit : int
    """
    if start > 0.0:
        _begin(part, start, many)
    count = 0
    while count < limit:
        gap, worst = _prepare(part, many)
        if not worst > goal:
            break
        _set_right_side(part, many)
        substitute(part[2], part[3], many.change, many)
        _, after = _explore(part, many)
        ratio = min(1.0, max(after / gap, LEAST_RATIO))
        _correct(part, ratio * ratio * ratio * gap, many)
        substitute(part[2], part[3], many.change, many)
        t, _ = _explore(part, many)
        _step(part, min(1.0, STEP_SHARE * t), many)
        count += 1
    _take(part, many)
    return count
