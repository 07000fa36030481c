"""Volume and centre of the part of a body that lies below a plane: exact for block, sphere and ellipsoid.

*Sphere*: a cap of height h of a sphere of radius r has the volume V = π h² (3r - h)/3. Its centre is
3 (2r - h)²/(4 (3r - h)) below the sphere's.

*Ellipsoid*: with the semi-axes D, the map x = D y takes the unit sphere to the ellipsoid, planes to planes, and centres
to centres. It multiplies volumes by det D.

*Block*: the part below the plane is a polyhedron. It consists of cones with a common tip o, a point of the plane, over
the faces of the polyhedron. With the area A and the centre c of each face, and the distance h of o from it, V = Σ A h/3
and V·centre = Σ (A h/3) (¾ c + ¼ o). The face in the plane has h = 0 and is left out; the others are rectangles cut by
the plane. Nothing is divided by a component of the normal, so the result is exact for every attitude.

References
----------
Moments by faces: B. Mirtich, *Fast and accurate computation of polyhedral mass properties*, J. Graphics
Tools 1, 1996.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.forces.force_field_state import ZERO
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, times
from physics.kernels.state.layout import BLOCK


@inlined
def spherical_cap(r, height):
    """Volume of the part of a sphere below a plane [m³], and the depth of its centre below the sphere's centre [m].

    r is the sphere's radius, `height` the height of the sphere's centre above the plane.
    """
    h = min(max(r - height, 0.0), 2.0 * r)
    return math.pi * h * h * (3.0 * r - h) / 3.0, 3.0 * (2.0 * r - h) * (2.0 * r - h) / (4.0 * (3.0 * r - h))


@inlined
def _corner(axis, side, k, d):
    """Corner k = 0 .. 3, in order round the edge, of the face of a block at `side` (1 or -1) of the body axis `axis`.

    d are the half edges; the corner is relative to the centre, in body axes [m].
    """
    a = d[(axis + 1) % 3] * (-1.0 if k == 0 or k == 3 else 1.0)
    b = d[(axis + 2) % 3] * (-1.0 if k < 2 else 1.0)
    c = side * d[axis]
    if axis == 0:
        return (c, a, b)
    if axis == 1:
        return (b, c, a)
    return (a, b, c)


@inlined
def _triangle(p, q, r):
    """Area of the triangle with the corners p, q, r [m²], and the area times the triangle's centre [m³]."""
    n = qt.cross(minus(q, p), minus(r, p))
    area = 0.5 * math.sqrt(qt.dot(n, n))
    return area, times(area / 3.0, plus(p, plus(q, r)))


@kernel
def _wet_face(axis, side, n, height, d):
    """Area, and area times centre, of the part of a block's face below the plane n·x = -height, in body axes.

    The face is that at `side` (1 or -1) of the body axis `axis`; d are the half edges.
    """
    area, moment = 0.0, ZERO
    first = last = ZERO
    count = 0
    a = _corner(axis, side, 3, d)
    above_a = qt.dot(n, a) + height
    for k in range(4):
        b = _corner(axis, side, k, d)
        above_b = qt.dot(n, b) + height
        for new in range(2):  # where the edge from a to b meets the plane, then b if it is below
            if new == 0 and not above_a * above_b < 0.0:
                continue
            if new == 1 and above_b > 0.0:
                continue
            p = b
            if new == 0:
                p = plus(a, times(above_a / (above_a - above_b), minus(b, a)))
            if count == 0:
                first = p
            elif count > 1:
                s, m = _triangle(first, last, p)
                area, moment = area + s, plus(moment, m)
            last = p
            count += 1
        a, above_a = b, above_b
    return area, moment


@kernel
def _wet_block(n, height, d):
    """Volume, and volume times centre, of the part of a block with half edges d below n·x = -height, in body axes."""
    o = times(-height, n)
    volume, moment = 0.0, ZERO
    for axis in range(3):
        for k in range(2):
            side = 2.0 * k - 1.0
            area, first = _wet_face(axis, side, n, height, d)
            distance = d[axis] - side * o[axis]
            cone = area * distance / 3.0
            volume += cone
            moment = plus(moment, plus(times(0.25 * distance, first), times(0.25 * cone, o)))
    return volume, moment


@kernel
def submerged_part(shape, dims, n, height):
    """Volume of the part of a body below a plane, and the centre of that part.

    Parameters
    ----------
    shape : int
        BLOCK, SPHERE or ELLIPSOID of `layout`.
    dims : tuple of 3 floats
        Half edges of a block, semi-axes of an ellipsoid, or three times the radius of a sphere [m].
    n : tuple of 3 floats
        Normal of the plane, up, in body axes.
    height : float
        Height of the body's geometric centre above the plane [m].

    Returns
    -------
    volume : float
        Volume of the part below the plane [m³].
    centre : tuple of 3 floats
        Its centre relative to the geometric centre, in body axes [m]; zero if the volume is zero.
    """
    if shape == BLOCK:
        reach = abs(dims[0] * n[0]) + abs(dims[1] * n[1]) + abs(dims[2] * n[2])
        if height >= reach:
            return 0.0, ZERO
        if height <= -reach:
            return 8.0 * dims[0] * dims[1] * dims[2], ZERO
        volume, moment = _wet_block(n, height, dims)
        return volume, times(1.0 / volume, moment) if volume > 0.0 else ZERO
    e = (dims[0] * n[0], dims[1] * n[1], dims[2] * n[2])
    reach = math.sqrt(qt.dot(e, e))
    volume, depth = spherical_cap(1.0, height / reach)
    s = -depth / reach
    return dims[0] * dims[1] * dims[2] * volume, (s * dims[0] * e[0], s * dims[1] * e[1], s * dims[2] * e[2])
