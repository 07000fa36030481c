"""Nearest point of a cylinder to a point, as of `nearest_points`, for scenes with cylinders."""

from __future__ import annotations

from physics.compiler.decorators import if_given
from physics.kernels.multibody.data.cylinder_balls import nearest_of_cylinder

_ZERO = (0.0, 0.0, 0.0)


@if_given("scratch.bodies.cylinders", (0.0, _ZERO, _ZERO))
def nearest_on_cylinder(b, x, scratch):
    """Nearest point of the surface of cylinder b to a point x: (distance, n out of b, point); negative inside."""
    return nearest_of_cylinder(b, x, scratch)
