"""Contact of a cylinder and an ellipsoid: one point, along the direction of their largest separation.

It is that of an end; or across the axis, a problem of a point and the ellipse that the ellipsoid is along the axis
(`rim_line`); or that of a rim, by Newton's method (`smooth_separation`). All are measured with the support functions of
both bodies, and the largest separation wins.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, row_vector, times
from physics.kernels.multibody.data.contact_set import add_ordered_contact, add_scaled, tangent_basis
from physics.kernels.multibody.data.cylinder_balls import nearest_of_cylinder
from physics.kernels.multibody.data.cylinders import axis_of, rotation_of
from physics.kernels.multibody.narrowphase.cylinder_face import place_between
from physics.kernels.multibody.narrowphase.ellipsoid_distance import ellipsoid_matrix, ellipsoid_support_point
from physics.kernels.multibody.narrowphase.rim_line import ellipse_normal
from physics.kernels.multibody.narrowphase.smooth_separation import improved, off_kinks, round_separation


@inlined
def _product(D, n):
    """Product of a symmetric matrix (00, 01, 02, 11, 12, 22) and a vector."""
    return (
        D[0] * n[0] + D[1] * n[1] + D[2] * n[2],
        D[1] * n[0] + D[3] * n[1] + D[4] * n[2],
        D[2] * n[0] + D[4] * n[1] + D[5] * n[2],
    )


@inlined
def _across_axis(y, D, x):
    """Unit vector across the axis y, from an ellipsoid of matrix D to the axis; x leads from its centre to the axis.

    Along the axis the ellipsoid is the ellipse of the matrix E with the elements e_i·D e_j, for unit vectors e across
    y. Its axes are turned by half the angle of (E_00 - E_11, 2 E_01).
    """
    e, f = tangent_basis(y)
    g, h = _product(D, e), _product(D, f)
    one, mixed, other = qt.dot(e, g), qt.dot(e, h), qt.dot(f, h)
    angle = 0.5 * math.atan2(2.0 * mixed, one - other)
    c, s = math.cos(angle), math.sin(angle)
    u, v = plus(times(c, e), times(s, f)), plus(times(-s, e), times(c, f))
    long, short = math.sqrt(qt.dot(u, _product(D, u))), math.sqrt(qt.dot(v, _product(D, v)))
    p, q = ellipse_normal(min(1.0, short / long), qt.dot(u, x) / long, qt.dot(v, x) / long)
    return plus(times(p, u), times(q, v))


@kernel
def separation_from_ellipsoid(can, ball, many):
    """Largest separation of a cylinder and an ellipsoid: (separation [m], unit vector out of the ellipsoid)."""
    pair, y, d = (can, ball), axis_of(rotation_of(can, many)), many.bodies.body[ball].dims
    x, center = place_between(pair, many), row_vector(many.bodies.center, ball, 0)
    D = ellipsoid_matrix(rotation_of(ball, many), (d[0], d[1], d[2]))
    n = times(math.copysign(1.0, qt.dot(x, y)), y)
    best = round_separation(pair, x, n, many)
    m = _across_axis(y, D, x)
    apart = round_separation(pair, x, m, many)
    if apart > best:
        best, n = apart, m
    towards = times(-1.0, nearest_of_cylinder(can, center, many)[1])
    for start in (towards, n):
        apart, m = improved(pair, x, off_kinks(pair, x, start, many), many)
        if apart > best:
            best, n = apart, m
    return best, n


@kernel
def collide_cylinder_ellipsoid(can, ball, a, b, margin, h, many):
    """Add the contact of a cylinder and an ellipsoid, which are parts a and b in either order.

    Their gap is at most `margin` [m]; h is the length of the stage [s].
    """
    gap, n = separation_from_ellipsoid(can, ball, many)
    if gap > margin:
        return
    d = many.bodies.body[ball].dims
    point = ellipsoid_support_point(ellipsoid_matrix(rotation_of(ball, many), (d[0], d[1], d[2])), n)[1]
    p = plus(row_vector(many.bodies.center, ball, 0), point)
    add_ordered_contact(a, b, ball, minus((0.0, 0.0, 0.0), n), p, add_scaled(p, gap, n), gap, h, many)
