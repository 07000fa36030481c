"""Closed forms for the first point at which a ray meets a surface.

A ray is the set of points o + t d for t >= 0, with a unit vector d. Each function returns (t, n): the smallest such t
on the surface [m], and the unit normal out of the body there. t is inf if the ray misses. A ray that starts inside
meets the surface where it leaves. Vectors are in the frame of the body, from its geometric centre.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import plus, row_vector, times

MISS = (math.inf, (0.0, 0.0, 0.0))


@inlined
def ray_plane(o, d, n, offset):
    """First point of a ray on a wall {x : n·x = offset}, met from its free side only; o is from the world's origin.

    A ray that starts behind the plane misses.
    """
    height, speed = qt.dot(n, o) - offset, qt.dot(n, d)
    if height >= 0.0 and speed < 0.0:
        return height / -speed, n
    return MISS


@inlined
def ray_sphere(o, d, radius):
    """First point of a ray on a sphere.

    With b = o·d the point of the line nearest to the centre is p = o - b d, and the line is inside for
    |t + b| <= √(radius² - p²). The difference of squares is taken of p, not of o, and so loses no digits far away.
    """
    b = qt.dot(o, d)
    p = plus(o, times(-b, d))
    square = radius * radius - qt.dot(p, p)
    if not square >= 0.0:
        return MISS
    half = math.sqrt(square)
    side = -half if half <= -b else half
    if not side >= b:
        return MISS
    x = plus(p, times(side, d))
    return side - b, times(1.0 / math.sqrt(qt.dot(x, x)), x)


@inlined
def ray_ellipsoid(o, d, axes):
    """First point of a ray on an ellipsoid, by `ray_sphere` in coordinates divided by the semi-axes.

    There the direction has the length s, and t is the distance on the unit sphere divided by s. The normal n there
    becomes nᵢ/axesᵢ, normalised.
    """
    e = (d[0] / axes[0], d[1] / axes[1], d[2] / axes[2])
    s = math.sqrt(qt.dot(e, e))
    scaled = (o[0] / axes[0], o[1] / axes[1], o[2] / axes[2])
    t, n = ray_sphere(scaled, times(1.0 / s, e), 1.0)
    if not t < math.inf:
        return MISS
    m = (n[0] / axes[0], n[1] / axes[1], n[2] / axes[2])
    return t / s, times(1.0 / math.sqrt(qt.dot(m, m)), m)


@inlined
def _slab(o, d, size):
    """Values of t between which |o + t d| <= size along one axis, as (first, last); none: (inf, -inf)."""
    if d == 0.0:
        if abs(o) <= size:
            return -math.inf, math.inf
        return math.inf, -math.inf
    a, b = (-size - o) / d, (size - o) / d
    return min(a, b), max(a, b)


@inlined
def _axis_normal(k, d, sign):
    """Unit normal of the face across axis k that a ray of direction d enters (sign -1) or leaves (sign 1)."""
    return (
        math.copysign(1.0, sign * d[0]) if k == 0 else 0.0,
        math.copysign(1.0, sign * d[1]) if k == 1 else 0.0,
        math.copysign(1.0, sign * d[2]) if k == 2 else 0.0,
    )


@inlined
def ray_block(o, d, dims):
    """First point of a ray on a block with half edges `dims`: the ray is inside while it is in all three slabs."""
    near, last = _slab(o[0], d[0], dims[0])
    enter = leave = 0
    a, b = _slab(o[1], d[1], dims[1])
    if a > near:
        near, enter = a, 1
    if b < last:
        last, leave = b, 1
    a, b = _slab(o[2], d[2], dims[2])
    if a > near:
        near, enter = a, 2
    if b < last:
        last, leave = b, 2
    if near > last or last < 0.0:
        return MISS
    if near >= 0.0:
        return near, _axis_normal(enter, d, -1.0)
    return last, _axis_normal(leave, d, 1.0)


@inlined
def _stay(a, b, square):
    """First and last root t of a t² + 2 b t + b²/a = `square`; no roots: (inf, -inf)."""
    if not square >= 0.0:
        return math.inf, -math.inf
    half = math.sqrt(square / a)
    return -b / a - half, -b / a + half


@inlined
def _stay_in_ball(o, d, radius):
    """First and last t at which a ray is in a ball about the origin, as in `ray_sphere`; none: (inf, -inf)."""
    b = qt.dot(o, d)
    p = plus(o, times(-b, d))
    return _stay(1.0, b, radius * radius - qt.dot(p, p))


@inlined
def _stay_in_tube(o, d, radius, half):
    """First and last t at which a ray is in a cylinder along y from -half to half; none: first > last.

    Across the axis it is a ball, and along it a slab.
    """
    first, last = _slab(o[1], d[1], half)
    a, b = d[0] * d[0] + d[2] * d[2], o[0] * d[0] + o[2] * d[2]
    if not a > 0.0:
        if o[0] * o[0] + o[2] * o[2] > radius * radius:
            return math.inf, -math.inf
        return first, last
    x, z = o[0] - b / a * d[0], o[2] - b / a * d[2]
    enter, leave = _stay(a, b, radius * radius - (x * x + z * z))
    return max(first, enter), min(last, leave)


@inlined
def ray_capsule(o, d, dims):
    """First point of a ray on a capsule along y with half extents `dims`.

    The ray is inside from the first to the last time at which it is in the cylinder or in one of two balls.
    """
    r, half = dims[0], dims[1] - dims[0]
    near, last = _stay_in_tube(o, d, r, half)
    if near > last:
        near, last = math.inf, -math.inf
    for end in range(2):
        first, leave = _stay_in_ball((o[0], o[1] - (2.0 * end - 1.0) * half, o[2]), d, r)
        near, last = min(near, first), max(last, leave)
    if last < max(near, 0.0):
        return MISS
    t = near if near >= 0.0 else last
    x = plus(o, times(t, d))
    n = (x[0], x[1] - min(max(x[1], -half), half), x[2])
    return t, times(1.0 / math.sqrt(qt.dot(n, n)), n)


@inlined
def ray_cylinder(o, d, dims):
    """First point of a ray on a cylinder along y with half extents `dims`.

    The normal is that of the side, or that of an end, whichever the point is nearer to.
    """
    r, half = dims[0], dims[1]
    near, last = _stay_in_tube(o, d, r, half)
    if near > last or last < 0.0:
        return MISS
    t = near if near >= 0.0 else last
    x = plus(o, times(t, d))
    across = math.sqrt(x[0] * x[0] + x[2] * x[2])
    if abs(abs(x[1]) - half) <= abs(across - r):
        return t, (0.0, math.copysign(1.0, x[1]), 0.0)
    return t, (x[0] / across, 0.0, x[2] / across)


@kernel
def ray_polyhedron(o, d, first, last, normals, offsets):
    """First point of a ray on a convex polyhedron: the ray is inside while it is below the planes of all faces.

    The faces are the rows `first` to `last` - 1 of `normals` and `offsets`.

    Reference: M. Cyrus, J. Beck, *Generalized two- and three-dimensional clipping*, Computers & Graphics 3, 1978.
    """
    near, far, enter, leave = -math.inf, math.inf, first, first
    for face in range(first, last):
        n = row_vector(normals, face, 0)
        speed, depth = qt.dot(n, d), offsets[face] - qt.dot(n, o)
        if speed < 0.0:
            if depth / speed > near:
                near, enter = depth / speed, face
        elif speed > 0.0:
            if depth / speed < far:
                far, leave = depth / speed, face
        elif depth < 0.0:
            return MISS
    if near > far or far < 0.0:
        return MISS
    if near >= 0.0:
        return near, row_vector(normals, enter, 0)
    return far, row_vector(normals, leave, 0)
