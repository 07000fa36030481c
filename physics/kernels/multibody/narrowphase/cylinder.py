"""Contacts of a cylinder with another body, which is a sphere: with other shapes scenes are refused."""

from __future__ import annotations

from physics.compiler.decorators import if_given
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.contact_set import add_ordered_contact, add_scaled
from physics.kernels.multibody.data.cylinder_balls import nearest_of_cylinder
from physics.kernels.multibody.data.cylinders import is_cylinder


@if_given("many.bodies.cylinders", False)
def collide_cylinder(a, b, margin, h, many):
    """Add the contact of parts a and b, if one of them is a cylinder; return whether it is one.

    Its gap is at most `margin` [m]; h is the length of the stage [s].
    """
    can, ball = a, b
    if not is_cylinder(a, many):
        if not is_cylinder(b, many):
            return False
        can, ball = b, a
    x, r = row_vector(many.bodies.center, ball, 0), many.bodies.body[ball].dims[0]
    distance, n, point = nearest_of_cylinder(can, x, many)
    if distance - r <= margin:
        add_ordered_contact(a, b, ball, n, add_scaled(x, -r, n), point, distance - r, h, many)
    return True
