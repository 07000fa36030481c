"""Distance of two convex bodies in any poses, by Gilbert, Johnson and Keerthi's algorithm on support functions.

The differences of points of body a and body b fill a convex body, the Minkowski difference A - B. Its point v nearest
to the origin is the shortest vector between the bodies. Each iteration finds w, the point of A - B farthest along -v.
It adds w to a simplex and replaces v by the simplex's point nearest to the origin. The distance is between the bound
v·w/|v| and |v|. A sphere is replaced by its centre and a capsule by its axis. Their radius is subtracted at the end, so
that their distance is exact.

Reference: E. G. Gilbert, D. W. Johnson, S. S. Keerthi, *A fast procedure for computing the distance between complex
objects in three-dimensional space*, IEEE J. Robotics and Automation 4, 1988.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.capsules import farthest_axis_end, is_capsule
from physics.kernels.multibody.data.contact_set import add_scaled, put_vector, subtract
from physics.kernels.multibody.data.cylinders import cylinder_support_arm, is_cylinder
from physics.kernels.multibody.data.hull_tables import FIRST_CORNER, LAST_CORNER
from physics.kernels.state.layout import BLOCK, HULL, SPHERE

# Largest number of iterations; polyhedra take about five, round bodies that nearly touch about twenty.
_MAX_ITERATIONS = 64

# Largest relative difference between the distance and its lower bound.
_GAP_TOLERANCE = 0.1


@kernel
def hull_support_vertex(b, k, many):
    """Corner of hull b that reaches farthest along the vector k; both in the body frame [m]."""
    best, first = -math.inf, many.narrowphase.hulls.of[b, FIRST_CORNER]
    far = first
    for i in range(first, many.narrowphase.hulls.of[b, LAST_CORNER]):
        reach = qt.dot(k, row_vector(many.narrowphase.hulls.corners, i, 0))
        if reach > best:
            best, far = reach, i
    return row_vector(many.narrowphase.hulls.corners, far, 0)


@inlined
def support_point(b, x, R, k, thinner, hulls, many):
    """Point of body b that reaches farthest along the unit vector k, world axes [m].

    x is the geometric centre of the body, R its rotation matrix, and `thinner` the depth by which the body is shrunk on
    all sides [m]. `hulls` is None if the scene has no hulls.
    """
    d, shape = many.bodies.body[b].dims, many.bodies.body[b].shape
    if shape == SPHERE:
        return add_scaled(x, d[0] - thinner, k)
    if is_capsule(b, many):
        return add_scaled(add_scaled(x, 1.0, farthest_axis_end(b, R, k, many)), d[0] - thinner, k)
    if is_cylinder(b, many):
        return add_scaled(x, 1.0, cylinder_support_arm((d[0] - thinner, d[1] - thinner), R, k))
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
    """Farthest point along k of the core of body b: centre x of a sphere, end of a capsule's axis, or `support_point`.

    The vector k may have any length here. For R, `thinner` and `hulls` see `support_point`.
    """
    if many.bodies.body[b].shape == SPHERE:
        return x
    if is_capsule(b, many):
        return add_scaled(x, 1.0, farthest_axis_end(b, R, k, many))
    return support_point(b, x, R, k, thinner, hulls, many)


@inlined
def _difference_point(a, b, poses, v, thinner, hulls, many):
    """Point of the Minkowski difference A - B that reaches farthest along -v, from the cores of bodies a and b.

    `poses` has (geometric centre, rotation matrix) of a and of b. The core of a sphere is its centre, that of a capsule
    its axis, and that of another body the body shrunk by `thinner` [m]. `hulls` is None if the scene has no hulls.
    """
    one, other = poses
    x, y = subtract(one[0], other[0]), (0.0, 0.0, 0.0)
    return subtract(
        _core_point(a, x, one[1], (-v[0], -v[1], -v[2]), thinner, hulls, many),
        _core_point(b, y, other[1], v, thinner, hulls, many),
    )


@kernel
def closest_on_simplex(count, many):
    """Find the point of a simplex nearest to the origin: (point, number of corners that are kept).

    The simplex has `count` corners in `many.narrowphase.simplex`, and a new one after them. Corners that are not needed
    to form the point are removed; the new one always is needed. If a tetrahedron holds the origin, the point is (0, 0,
    0).
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
    """Radius that is added to the core of body b [m]: that of a sphere or capsule shrunk by `thinner`, else 0."""
    is_core = many.bodies.body[b].shape == SPHERE or is_capsule(b, many)
    return many.bodies.body[b].dims[0] - thinner if is_core else 0.0


@kernel
def gjk_distance(a, b, now, later, way, touch, thinner, hulls, many):
    """Distance of body a from body b in given poses: (unit vector out of b, lower bound of the distance [m]).

    The search stops when the bound is at least 0.9 of the distance. It returns 0 if the distance is at most `touch`.

    Parameters
    ----------
    a, b : int
        Bodies, of which shapes and dimensions are read.
    now : pair of tuples
        Geometric centre (3 floats) [m] and rotation matrix (9 floats) of a, and of b.
    later : pair of tuples or None
        Second poses of both bodies. If given, the result is the distance from the origin to the convex hull of A - B in
        both poses.
    way : tuple of 3 floats
        Direction to start from, out of b; not 0.
    touch : float
        Distance at and below which the bodies count as touching [m].
    thinner : float
        Depth by which both bodies are shrunk on all sides [m].
    hulls : bool or None
        None if the scene has no hulls.
    many : BodiesWorkspace
        Workspace of the world.
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
