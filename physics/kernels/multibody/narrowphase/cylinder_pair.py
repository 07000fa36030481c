"""Contacts of two cylinders.

The direction of the largest separation decides. It is that of an end, or that across both axes, or it leads from a rim
to the other side (`rim_line`), or from rim to rim (`smooth_separation`). On an end the part of the other cylinder above
it touches (`cylinder_face`). Sides that are nearly parallel touch with both ends of the part beside each other.
Anything else touches with one point.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.segments import nearest_places, point_on_segment
from physics.kernels.math.vector import minus, plus, times
from physics.kernels.multibody.data.contact_set import pair_slop, tangent_basis
from physics.kernels.multibody.data.cylinders import (
    BESIDE_FEATURE,
    SINGLE_FEATURE,
    across_axis,
    axis_of,
    cylinder_support_arm,
    rotation_of,
)
from physics.kernels.multibody.data.parts import body_of
from physics.kernels.multibody.narrowphase.box_sat import FLAT_COSINE
from physics.kernels.multibody.narrowphase.cylinder_face import add_of_pair, add_on_face, end_towards, place_between
from physics.kernels.multibody.narrowphase.rim_line import rim_line_normal
from physics.kernels.multibody.narrowphase.smooth_separation import (
    between_cylinders,
    improved,
    off_kinks,
    round_separation,
)

# Cosine of the angle between two axes from which on the sides lie along each other (8 degrees), and component of the
# normal along an axis up to which they do (11 degrees).
_ALONG_COSINE, _FLAT_SINE = 0.99, 0.2

# Square of the sine of the angle below which two axes are parallel.
_PARALLEL_SINE_SQUARED = 1.0e-12


@inlined
def _better(best, n, m, pair, x, many):
    """The better one of two directions n, of separation `best`, and m: (separation [m], unit vector)."""
    apart = round_separation(pair, x, m, many)
    return (apart, m) if apart > best else (best, n)


@inlined
def _across_both(y, z, x):
    """Unit vector across two axes, towards x; of parallel axes that across both in their plane."""
    m = qt.cross(y, z)
    if qt.dot(m, m) < _PARALLEL_SINE_SQUARED:
        m = across_axis(y, x)
    square = qt.dot(m, m)
    if not square > 0.0:
        return tangent_basis(y)[0]
    return times(math.copysign(1.0 / math.sqrt(square), qt.dot(m, x)), m)


@inlined
def _best_end(y, pair, x, many):
    """Better direction along an axis: (separation [m], unit vector)."""
    best, n = round_separation(pair, x, y, many), y
    return _better(best, n, times(-1.0, y), pair, x, many)


@kernel
def best_between(pair, x, many):
    """Largest separation of two cylinders, ends apart: (separation [m], unit vector out of the second one)."""
    (a, b), ends = pair, (-1.0, 1.0)
    y, z = axis_of(rotation_of(a, many)), axis_of(rotation_of(b, many))
    one, other = many.bodies.body[a].dims, many.bodies.body[b].dims
    n = _across_both(y, z, x)
    best = round_separation(pair, x, n, many)
    for end in ends:
        best, n = _better(best, n, rim_line_normal(plus(x, times(end * one[1], y)), y, one[0], z), pair, x, many)
        m = rim_line_normal(minus(times(end * other[1], z), x), z, other[0], y)
        best, n = _better(best, n, times(-1.0, m), pair, x, many)
    for start in (between_cylinders(a, b, n, many), n):
        apart, m = improved(pair, x, off_kinks(pair, x, start, many), many)
        if apart > best:
            best, n = apart, m
    return best, n


@inlined
def _add_ball(pair, feature, place, x, limits, h, many):
    """Add the contact of the first side with the second one, at a place on the second axis; return its gap [m]."""
    (a, b), (least, margin) = pair, limits
    q = times(place, axis_of(rotation_of(b, many)))
    w = across_axis(axis_of(rotation_of(a, many)), minus(x, q))
    far = math.sqrt(qt.dot(w, w))
    gap = far - many.bodies.body[a].dims[0] - many.bodies.body[b].dims[0]
    if gap > margin or not far > 0.0:
        return math.inf
    gap, n = max(gap, least), times(1.0 / far, w)
    q = plus(q, times(many.bodies.body[b].dims[0], n))
    add_of_pair(pair, feature, -1, n, (plus(q, times(gap, n)), q), gap, h, many)
    return gap


@kernel
def _add_sides_along(pair, x, limits, h, many):
    """Add both ends of the part in which two sides are beside each other; return the least gap, else inf [m]."""
    a, b = pair
    y, z = axis_of(rotation_of(a, many)), axis_of(rotation_of(b, many))
    l, k, c, along = many.bodies.body[a].dims[1], many.bodies.body[b].dims[1], qt.dot(y, z), qt.dot(x, y)
    one, other = (along - l) / c, (along + l) / c
    first, last = max(min(one, other), -k), min(max(one, other), k)
    if first > last:
        return math.inf
    low = _add_ball(pair, BESIDE_FEATURE, first, x, limits, h, many)
    return min(low, _add_ball(pair, BESIDE_FEATURE + 1, last, x, limits, h, many))


@kernel
def _add_single(pair, n, x, apart, h, many):
    """Add the contact of two sides that cross, or of a rim, at its separation `apart` along n [m]."""
    (a, b), l, k = pair, many.bodies.body[pair[0]].dims[1], many.bodies.body[pair[1]].dims[1]
    R, S = rotation_of(a, many), rotation_of(b, many)
    y, z = axis_of(R), axis_of(S)
    p = plus(x, cylinder_support_arm(many.bodies.body[a].dims, R, times(-1.0, n)))
    if abs(qt.dot(n, y)) < abs(qt.dot(n, z)):  # the rim of the second one is the certain point
        p = plus(cylinder_support_arm(many.bodies.body[b].dims, S, n), times(apart, n))
    m = qt.cross(y, z)
    if qt.dot(m, m) > _PARALLEL_SINE_SQUARED and qt.dot(m, n) ** 2 > (1.0 - _SAME) * qt.dot(m, m):
        s, _, _ = nearest_places(x, times(l, y), (0.0, 0.0, 0.0), times(k, z))
        p = plus(point_on_segment(x, times(l, y), s), times(-many.bodies.body[a].dims[0], n))
    add_of_pair(pair, SINGLE_FEATURE, -1, n, (p, plus(p, times(-apart, n))), apart, h, many)


# One minus the square of the cosine within which a direction is that across both axes.
_SAME = 1.0e-12


@inlined
def _add_on_end(pair, n, limits, h, many):
    """Add the contacts of the first cylinder with the end of the second one that faces along n: the least gap [m]."""
    return add_on_face(pair, end_towards(pair[1], times(-1.0, n), many), limits, h, many)


@inlined
def _add_near(pair, n, x, limits, h, many):
    """Add the contacts of ends or sides whose direction is nearly n: the least gap, inf if there is none [m]."""
    y, z = axis_of(rotation_of(pair[0], many)), axis_of(rotation_of(pair[1], many))
    if abs(qt.dot(n, z)) >= FLAT_COSINE:
        return _add_on_end(pair, n, limits, h, many)
    if abs(qt.dot(n, y)) >= FLAT_COSINE:
        return _add_on_end((pair[1], pair[0]), times(-1.0, n), limits, h, many)
    if abs(qt.dot(y, z)) >= _ALONG_COSINE and max(abs(qt.dot(n, y)), abs(qt.dot(n, z))) <= _FLAT_SINE:
        return _add_sides_along(pair, x, limits, h, many)
    return math.inf


@kernel
def collide_cylinders(a, b, margin, h, many):
    """Add the contacts of two cylinders whose gaps are at most `margin` [m]; h is the length of the stage [s]."""
    pair, slop = (a, b), pair_slop(body_of(a, many), body_of(b, many), many)
    x = place_between(pair, many)
    best, n = _best_end(axis_of(rotation_of(b, many)), pair, x, many)
    other, m = _best_end(axis_of(rotation_of(a, many)), pair, x, many)
    if max(best, other) > margin:
        return
    further, k = best_between(pair, x, many)
    if further > margin:
        return
    most, low = max(best, max(other, further)), math.inf
    if most <= best + slop:
        low = _add_on_end(pair, n, (most, margin), h, many)
    elif most <= other + slop:
        n = m
        low = _add_on_end((b, a), times(-1.0, m), (most, margin), h, many)
    else:
        n = k
        low = _add_near(pair, k, x, (most, margin), h, many)
    if low > most + slop:
        _add_single(pair, n, x, most, h, many)
