"""One or two contacts that slide, or open: directly, on the assembled problem."""

from __future__ import annotations

import math

from physics.kernels.compiler import inlined, kernel

# Linear solves of one attempt at most. Two are usual at a tolerance of 1e-6.
FEW_LIMIT = 12

# Columns of `work.patch`: friction per normal impulse (-μ d).
X, Y = range(2)


@inlined
def _heading(n, count, width, work):
    """Directions of the active contacts under the warm start, as -μ d."""
    W, b, p, few = work.delassus, work.bias, work.impulse, work.patch
    for j in range(count):
        r = 3 * work.active[j]
        ua, ub = b[r + 1], b[r + 2]
        for s in range(3 * n):
            ua += W[r + 1, s] * p[s]
            ub += W[r + 2, s] * p[s]
        size = math.sqrt(ua * ua + ub * ub)
        s = 0.0
        if size > 0.0:
            s = -work.mu / size
        few[j, X], few[j, Y] = s * ua, s * ub


@inlined
def _response(r, s, j, friction, work):
    """Normal velocity of row r to a unit normal impulse of active contact j, friction along with it."""
    W = work.delassus
    if friction is None:
        return W[r, s]
    return W[r, s] + W[r, s + 1] * work.patch[j, X] + W[r, s + 2] * work.patch[j, Y]


@inlined
def _few_normals(count, width, friction, work):
    """Normal impulses of the one or two active contacts for their directions."""
    b = work.bias
    r = width * work.active[0]
    a11 = _response(r, r, 0, friction, work)
    if count == 1:
        return -b[r] / a11, 0.0
    s = width * work.active[1]
    a12, a21 = _response(r, s, 1, friction, work), _response(s, r, 0, friction, work)
    a22 = _response(s, s, 1, friction, work)
    scale = 1.0 / (a11 * a22 - a12 * a21)
    return scale * (a12 * b[s] - a22 * b[r]), scale * (a21 * b[r] - a11 * b[s])


@inlined
def _turn(n, j, r, work):
    """Residual of active contact j, and its direction turned for the next solve."""
    W, b, p, few, mu = work.delassus, work.bias, work.impulse, work.patch, work.mu
    if not mu > 0.0:
        return 0.0
    ua, ub = b[r + 1], b[r + 2]
    for s in range(3 * n):
        ua += W[r + 1, s] * p[s]
        ub += W[r + 2, s] * p[s]
    x, y = -few[j, X] / mu, -few[j, Y] / mu
    along, across = x * ua + y * ub, x * ub - y * ua
    s = mu * p[r] * (W[r + 1, r + 1] + W[r + 2, r + 2])
    miss = 0.0
    if s > 0.0:
        miss = abs(across) * s / (s + along) if along > 0.0 else math.inf
    t = across / (abs(along) + 0.5 * s)
    if math.isfinite(t):
        x, y = x - t * y, y + t * x
        s = -mu / math.sqrt(x * x + y * y)
        few[j, X], few[j, Y] = s * x, s * y
    return miss


@kernel
def slide_few(n, count, friction, goal, work):
    """Try the impulses with which one or two contacts slide, or open: on the assembled problem.

    The direction of contact i is turned by the velocity across it divided by |u| + μ p (W_tt of the contact):
    Newton's step of the contact alone.
    """
    W, b, p, few, active = work.delassus, work.bias, work.impulse, work.patch, work.active
    width = 1 if friction is None else 3
    if count == n:
        for i in range(n):
            active[i] = i
    if friction is not None:
        _heading(n, count, width, work)
    for _ in range(FEW_LIMIT):
        p0 = p1 = 0.0
        if count > 0:
            p0, p1 = _few_normals(count, width, friction, work)
            if not (p0 >= 0.0 and p1 >= 0.0):
                count -= 1
                if count == 1 and not p0 >= p1:
                    active[0] = active[1]
                    few[0, X], few[0, Y] = few[1, X], few[1, Y]
                continue
        for s in range(width * n):
            p[s] = 0.0
        for j in range(count):
            r = width * active[j]
            q = p0 if j == 0 else p1
            p[r] = q
            if friction is not None:
                p[r + 1], p[r + 2] = q * few[j, X], q * few[j, Y]
        worst = 0.0
        for i in range(n):
            r = width * i
            if p[r] == 0.0:
                u = b[r]
                for s in range(width * n):
                    u += W[r, s] * p[s]
                worst = max(worst, -u)
        if friction is not None:
            for j in range(count):
                worst = max(worst, _turn(n, j, 3 * active[j], work))
        if worst <= goal:
            return True, worst
    return False, 0.0
