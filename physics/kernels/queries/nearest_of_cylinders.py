"""Nearest point of a cylinder to a point, as of `nearest_points`, for scenes with cylinders."""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, row_vector
from physics.kernels.multibody.data.contact_set import row_matrix

_ZERO = (0.0, 0.0, 0.0)


@if_given("scratch.bodies.cylinders", (0.0, _ZERO, _ZERO))
def nearest_on_cylinder(b, x, scratch):
    """Nearest point of the surface of cylinder b to a point x: (distance, n out of b, point); negative inside.

    In the plane of the axis and x, the cylinder is a rectangle. From inside, the shortest way out is to the side or to
    an end.
    """
    center, R, d = (
        row_vector(scratch.bodies.center, b, 0),
        row_matrix(scratch.bodies.rotation, b),
        scratch.bodies.body[b].dims,
    )
    y = qt.transposed_matvec(R, minus(x, center))
    across = math.sqrt(y[0] * y[0] + y[2] * y[2])
    out = (y[0] / across, 0.0, y[2] / across) if across > 0.0 else (1.0, 0.0, 0.0)
    side, end, sign = across - d[0], abs(y[1]) - d[1], math.copysign(1.0, y[1])
    if side > 0.0 and end > 0.0:
        distance = math.sqrt(side * side + end * end)
        n = (side / distance * out[0], sign * end / distance, side / distance * out[2])
        p = (d[0] * out[0], sign * d[1], d[0] * out[2])
    elif side > end:
        distance, n, p = side, out, (d[0] * out[0], y[1], d[0] * out[2])
    else:
        distance, n, p = end, (0.0, sign, 0.0), (y[0], sign * d[1], y[2])
    return distance, qt.matvec(R, n), plus(center, qt.matvec(R, p))
