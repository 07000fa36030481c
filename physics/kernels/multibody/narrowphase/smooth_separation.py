"""Separation of a rim of a cylinder from another rim or an ellipsoid, by Newton's method on the direction between them.

It is the method of `ellipsoid_distance`. Away from the directions of its ends and its side the support function of a
cylinder is smooth: for a unit vector n with the component c along the axis y, and p = n - c y,

    s = l |c| + r |p|,    point: sign(c) l y + r p/|p|,    H = r/|p| t tᵀ  with  t = y x p/|p|.

Of the directions from which it starts the best result counts. It is a lower bound of the separation in any case.
Vectors are in the world frame.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, row_vector, times
from physics.kernels.multibody.data.cylinder_balls import nearest_of_cylinder
from physics.kernels.multibody.data.cylinders import across_axis, axis_of, cylinder_support, is_cylinder, rotation_of
from physics.kernels.multibody.narrowphase.ellipsoid_distance import (
    ellipsoid_matrix,
    ellipsoid_support_point,
    newton_direction,
    support_hessian,
)

# Largest number of Newton steps, and of halvings of a step that does not increase the separation.
_NEWTON_STEPS, _STEP_HALVINGS = 40, 20

# Turn of a Newton step below which the direction has converged [rad]. The error of the separation is of its square.
_DIRECTION_TOLERANCE = 1.0e-10

# Share of the trace that is added to the matrix of a Newton step, which two rims leave singular.
_REGULAR = 1.0e-12

# Rounds of projections from one cylinder to the other that lead to a first direction.
_PROJECTIONS = 6

# Size of a vector, as a share of a unit vector, from which it has a direction.
_LEAST = 1.0e-12


@inlined
def _rim_support(b, n, many):
    """Support function, point and second derivative of cylinder b for a direction n of a rim."""
    y, d = axis_of(rotation_of(b, many)), many.bodies.body[b].dims
    c, p = qt.dot(n, y), across_axis(y, n)
    size = max(math.sqrt(qt.dot(p, p)), _LEAST)
    p = times(1.0 / size, p)
    t, h = qt.cross(y, p), d[0] / size
    H = (h * t[0] * t[0], h * t[0] * t[1], h * t[0] * t[2], h * t[1] * t[1], h * t[1] * t[2], h * t[2] * t[2])
    return d[1] * abs(c) + d[0] * size, plus(times(math.copysign(d[1], c), y), times(d[0], p)), H


@inlined
def _ellipsoid_support(b, n, many):
    d = many.bodies.body[b].dims
    D = ellipsoid_matrix(rotation_of(b, many), (d[0], d[1], d[2]))
    s, p = ellipsoid_support_point(D, n)
    return s, p, support_hessian(D, s, p)


@inlined
def _support(b, n, many):
    """Support function [m], point and second derivative of a cylinder or ellipsoid for the unit vector n."""
    if is_cylinder(b, many):
        return _rim_support(b, n, many)
    return _ellipsoid_support(b, n, many)


@inlined
def round_support(b, n, many):
    """Support function of a cylinder or ellipsoid b for the unit vector n [m]."""
    if is_cylinder(b, many):
        return cylinder_support(b, rotation_of(b, many), n, many)
    return _ellipsoid_support(b, n, many)[0]


@inlined
def round_separation(pair, x, n, many):
    """Separation of two bodies, each a cylinder or an ellipsoid, along the unit vector n out of the second one [m].

    x leads from the centre of the second body to that of the first one.
    """
    return qt.dot(n, x) - round_support(pair[0], n, many) - round_support(pair[1], n, many)


@kernel
def improved(pair, x, n, many):
    """Improve a direction by Newton's method: (separation [m], unit vector); see `round_separation`."""
    best = round_separation(pair, x, n, many)
    for _ in range(_NEWTON_STEPS):
        _, p, H = _support(pair[0], n, many)
        _, q, K = _support(pair[1], n, many)
        g = minus(minus(x, p), q)
        g = across_axis(n, g)
        more = max(best, 0.0) + _REGULAR * (H[0] + H[3] + H[5] + K[0] + K[3] + K[5])
        H = (H[0] + K[0] + more, H[1] + K[1], H[2] + K[2], H[3] + K[3] + more, H[4] + K[4], H[5] + K[5] + more)
        e = newton_direction(H, g, n, 1.0, 1.0, 1.0)
        size = math.sqrt(qt.dot(e, e))
        if not size > _DIRECTION_TOLERANCE:
            break
        share, found = min(1.0, 1.0 / size), False
        for _ in range(_STEP_HALVINGS):
            m = plus(n, times(share, e))
            m = times(1.0 / math.sqrt(qt.dot(m, m)), m)
            apart = round_separation(pair, x, m, many)
            if apart > best:
                best, n, found = apart, m, True
                break
            share *= 0.5
        if not found:
            break
    return best, n


@kernel
def between_cylinders(a, b, n, many):
    """Direction from cylinder b to cylinder a by alternating projections; n if they end in one point."""
    q = row_vector(many.bodies.center, b, 0)
    p = q
    for _ in range(_PROJECTIONS):
        p = nearest_of_cylinder(a, q, many)[2]
        q = nearest_of_cylinder(b, p, many)[2]
    d = minus(p, q)
    size = math.sqrt(qt.dot(d, d))
    return times(1.0 / size, d) if size > _LEAST else n


@inlined
def _tilted(n, y, towards):
    """Direction n leant a little along the axis y or across it, where it is exactly that of a side or an end."""
    c = qt.dot(n, y)
    if abs(c) < _LEAN:
        return plus(n, times(math.copysign(_LEAN, qt.dot(towards, y)), y))
    p = across_axis(y, n)
    if qt.dot(p, p) < _LEAN * _LEAN:
        w = across_axis(y, towards)
        return plus(n, times(_LEAN / max(math.sqrt(qt.dot(w, w)), _LEAST), w))
    return n


# Sine by which a direction leans that is exactly that of a side or an end.
_LEAN = 0.1


@inlined
def off_kinks(pair, x, n, many):
    """Direction near n at which the supports of both bodies are smooth."""
    if is_cylinder(pair[0], many):
        n = _tilted(n, axis_of(rotation_of(pair[0], many)), x)
    if is_cylinder(pair[1], many):
        n = _tilted(n, axis_of(rotation_of(pair[1], many)), x)
    return times(1.0 / math.sqrt(qt.dot(n, n)), n)
