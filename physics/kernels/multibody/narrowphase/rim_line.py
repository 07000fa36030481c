"""Rim of a cylinder and a line: the direction in which they are nearest, a problem of a point and an ellipse.

Seen along the line the line is a point, and the circle of the rim an ellipse. Let its semi-axes be 1 and b <= 1, and P
the point, in its first quadrant. The nearest point of the ellipse has an outward normal along (P_0/(t + 1),
P_1/(t + b²)), where t is the largest root of

    F(t) = (P_0/(t + 1))² + (b P_1/(t + b²))² - 1,    t > -b².

F falls and is convex there. Newton's steps from a place with F >= 0 lead up to the root and never past it. The normal
comes from t, not from a difference of nearby points, so that it is exact where both touch. The same root serves a point
inside the ellipse, of a line that pierces the disk.

Reference: D. Eberly, *Distance from a point to an ellipse, an ellipsoid, or a hyperellipsoid*, 2013.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import plus, times
from physics.kernels.multibody.data.contact_set import tangent_basis

# Largest number of Newton steps; eight are usual, and each halves the distance from the root at least.
_NEWTON_STEPS = 60

# Change of t at which Newton's method ends.
_ROUNDING = 1.0e-16

# Semi-axis b or coordinate that is no different from 0, and whose square does not underflow.
_LEAST = 1.0e-100

# Square of the sine of the angle below which a line is across the disk: the ellipse is a circle then.
_ACROSS_SINE_SQUARED = 1.0e-24


@inlined
def _largest_root(b, x, y):
    """Largest root t of F, for the point (x, y) in the first quadrant, with b y > 0."""
    t = max(b * (y - b), x - 1.0)
    for _ in range(_NEWTON_STEPS):
        f, g = x / (t + 1.0), b * y / (t + b * b)
        value, slope = f * f + g * g - 1.0, f * f / (t + 1.0) + g * g / (t + b * b)
        step = 0.5 * value / slope
        t += step
        if not step > _ROUNDING * abs(t):
            break
    return t


@kernel
def ellipse_normal(b, x, y):
    """Outward unit normal (2) of an ellipse at its point nearest to (x, y); its semi-axes are 1 and b, 0 <= b <= 1."""
    p, q = abs(x), abs(y)
    b, q = b if b > _LEAST else 0.0, q if q > _LEAST else 0.0
    if b * q > 0.0:
        t = _largest_root(b, p, q)
        u, v = p / (t + 1.0), q / (t + b * b)
    elif p > 1.0 - b * b:  # beyond the centre of curvature of an end, or beside a disk that is seen from its edge
        u, v = (1.0, 0.0) if b > 0.0 else (p - 1.0, q)
    else:
        u = b * p / (1.0 - b * b) if b < 1.0 else 1.0
        v = math.sqrt(max(0.0, 1.0 - (p / (1.0 - b * b)) ** 2)) if b < 1.0 else 0.0
    size = math.sqrt(u * u + v * v)
    if not size > 0.0:
        return 0.0, 1.0
    return math.copysign(u / size, x), math.copysign(v / size, y)


@kernel
def rim_line_normal(c, y, r, e):
    """Unit vector out of a line, across it, along which a rim is nearest to it.

    The line passes the origin along the unit vector e. The rim has the centre c [m], the radius r [m], and lies across
    the unit vector y. If the line pierces the disk, the vector is that of the shortest way out.
    """
    m = qt.cross(y, e)
    square = qt.dot(m, m)
    m = times(1.0 / math.sqrt(square), m) if square > _ACROSS_SINE_SQUARED else tangent_basis(e)[0]
    k = qt.cross(e, m)
    u, v = ellipse_normal(min(1.0, abs(qt.dot(y, e))), -qt.dot(c, m) / r, -qt.dot(c, k) / r)
    return plus(times(-u, m), times(-v, k))
