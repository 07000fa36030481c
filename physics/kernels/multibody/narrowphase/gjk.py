"""Distance of two convex bodies in any poses, by Gilbert, Johnson and Keerthi's algorithm on support functions.

The differences of points of the two fill a convex body A - B; its point v nearest to the origin is sought. Each round
adds its corner w farthest against v to a simplex and takes the point of that nearest to the origin. Along n = v/|v| the
two are apart by n·w at least, and by |v| at most. A sphere takes part as its centre, so that its distance is exact.

Reference: E. G. Gilbert, D. W. Johnson, S. S. Keerthi, *A fast procedure for computing the distance between complex
objects in three-dimensional space*, IEEE J. Robotics and Automation 4, 1988.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.contact_set import add_scaled, put_vector, subtract
from physics.kernels.multibody.data.hull_tables import FIRST_CORNER, LAST_CORNER
from physics.kernels.state.layout import BLOCK, HULL, SPHERE

# Rounds at most; polyhedra take some five, round bodies that nearly touch some twenty.
_MAX_ITERATIONS = 64

# Share of the distance that the bound along n may fall short of it.
_GAP_TOLERANCE = 0.1


@kernel
def hull_support_vertex(b, k, many):
    """Corner of hull b that reaches farthest along k, both in its frame [m]."""
    best, first = -math.inf, many.narrowphase.hulls.of[b, FIRST_CORNER]
    far = first
    for i in range(first, many.narrowphase.hulls.of[b, LAST_CORNER]):
        reach = qt.dot(k, row_vector(many.narrowphase.hulls.corners, i, 0))
        if reach > best:
            best, far = reach, i
    return row_vector(many.narrowphase.hulls.corners, far, 0)


@inlined
def support_point(b, x, R, k, thinner, hulls, many):
    """Farthest point of body b along k, a unit vector, for its geometric centre at x and rotation R [m].

    The body is taken thinner by `thinner` [m] on all sides.
    """
    d, shape = many.bodies.body[b].dims, many.bodies.body[b].shape
    if shape == SPHERE:
        return add_scaled(x, d[0] - thinner, k)
    e = qt.transposed_matvec(R, k)
    if hulls is not None:  # noqa: SIM102 (a branch of its own is what the compiler prunes)
        if shape == HULL:
            corner = hull_support_vertex(b, e, many)
            return add_scaled(x, 1.0 - thinner / math.sqrt(qt.dot(corner, corner)), qt.matvec(R, corner))
    d = (d[0] - thinner, d[1] - thinner, d[2] - thinner)
    if shape == BLOCK:
        r = (math.copysign(d[0], e[0]), math.copysign(d[1], e[1]), math.copysign(d[2], e[2]))
        return add_scaled(x, 1.0, qt.matvec(R, r))
    f = (d[0] * e[0], d[1] * e[1], d[2] * e[2])
    s = math.sqrt(qt.dot(f, f))
    return add_scaled(x, 1.0 / s, qt.matvec(R, (d[0] * f[0], d[1] * f[1], d[2] * f[2])))


@inlined
def _core_point(b, x, R, k, thinner, hulls, many):
    """`support_point` of the core of body b: the centre of a sphere, any other body itself; k of any length."""
    if many.bodies.body[b].shape == SPHERE:
        return x
    return support_point(b, x, R, k, thinner, hulls, many)


@inlined
def _difference_point(a, b, poses, v, thinner, hulls, many):
    """Farthest corner of A - B against v, for the poses of both."""
    one, other = poses
    x, y = subtract(one[0], other[0]), (0.0, 0.0, 0.0)
    return subtract(
        _core_point(a, x, one[1], (-v[0], -v[1], -v[2]), thinner, hulls, many),
        _core_point(b, y, other[1], v, thinner, hulls, many),
    )


@kernel
def closest_on_simplex(count, many):
    """Point nearest the origin of a simplex: the first `count` corners in `narrowphase.simplex` and the next one.

    Only the corners that form the point stay: (point, their number). The new corner is one of them, since the point
    comes nearer with it than without. (0, 0, 0) inside a tetrahedron.
    """
    S = many.narrowphase.simplex
    w = row_vector(S, count, 0)
    best, v, i_best, j_best = qt.dot(w, w), w, -1, -1
    is_inside = count == 3
    for i in range(count):
        p = row_vector(S, i, 0)
        d = subtract(p, w)
        square, t = qt.dot(d, d), -qt.dot(w, d)
        if 0.0 < t < square:
            u = add_scaled(w, t / square, d)
            if qt.dot(u, u) < best:
                best, v, i_best, j_best = qt.dot(u, u), u, i, -1
        for j in range(i):
            q = row_vector(S, j, 0)
            n = qt.cross(d, subtract(q, w))
            area = qt.dot(n, n)
            if not area > 0.0:
                is_inside = False
                continue
            height = qt.dot(n, w)
            if count == 3 and height * qt.dot(n, subtract(w, row_vector(S, 3 - i - j, 0))) < 0.0:
                is_inside = False
            u = (height / area * n[0], height / area * n[1], height / area * n[2])
            a, b, c = subtract(p, u), subtract(q, u), subtract(w, u)
            is_above = qt.dot(n, qt.cross(a, b)) > 0.0 and qt.dot(n, qt.cross(b, c)) > 0.0
            if is_above and qt.dot(n, qt.cross(c, a)) > 0.0 and qt.dot(u, u) < best:
                best, v, i_best, j_best = qt.dot(u, u), u, i, j
    if is_inside:
        p, q, r = row_vector(S, 0, 0), row_vector(S, 1, 0), row_vector(S, 2, 0)
        n = qt.cross(subtract(q, p), subtract(r, p))
        if qt.dot(n, p) * qt.dot(n, subtract(p, w)) >= 0.0:
            return (0.0, 0.0, 0.0), count
    count = 0
    if j_best >= 0:  # j < i: nothing is written over before it is read
        put_vector(S, 0, 0, row_vector(S, j_best, 0))
        count = 1
    if i_best >= 0:
        put_vector(S, count, 0, row_vector(S, i_best, 0))
        count += 1
    put_vector(S, count, 0, w)
    return v, count + 1


@inlined
def _core_radius(b, thinner, many):
    """Radius around the core of body b [m]: a sphere's own, 0 of other shapes."""
    return many.bodies.body[b].dims[0] - thinner if many.bodies.body[b].shape == SPHERE else 0.0


@kernel
def gjk_distance(a, b, now, later, way, touch, thinner, hulls, many):
    """Distance of body a from body b in their poses, or a close bound: (direction out of b, distance).

    Parameters
    ----------
    now : pair of tuples
        Geometric centre (3 floats) [m] and rotation (9 floats) of a, and of b.
    later : pair of tuples or None
        Other poses of both: the distance is then that of the convex hull of A - B in both.
    way : tuple of 3 floats
        Where to look first, not 0.
    touch : float
        Distance below which no more is asked [m]: 0 is returned then.
    thinner : float
        By how much both bodies are taken thinner on all sides [m].
    """
    v, count, core = way, 0, _core_radius(a, thinner, many) + _core_radius(b, thinner, many)
    best, n = -math.inf, way
    for _ in range(_MAX_ITERATIONS):
        w = _difference_point(a, b, now, v, thinner, hulls, many)
        if later is not None:
            u = _difference_point(a, b, later, v, thinner, hulls, many)
            if qt.dot(v, u) < qt.dot(v, w):
                w = u
        size = math.sqrt(qt.dot(v, v))
        bound = qt.dot(v, w) / size - core
        if bound > best:
            best, n = bound, (v[0] / size, v[1] / size, v[2] / size)
        if count > 0 and best >= (1.0 - _GAP_TOLERANCE) * (size - core):
            break
        put_vector(many.narrowphase.simplex, count, 0, w)
        v, count = closest_on_simplex(count, many)
        far = math.sqrt(qt.dot(v, v)) - core
        if not far > touch:
            return n, 0.0
        if count == 4:
            break
    return n, max(best, 0.0)
