"""Contacts of a cylinder with another body of any shape, for scenes that have cylinders."""

from __future__ import annotations

from physics.compiler.decorators import if_given, kernel
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.capsules import is_capsule
from physics.kernels.multibody.data.contact_set import add_ordered_contact, add_scaled
from physics.kernels.multibody.data.cylinder_balls import nearest_of_cylinder
from physics.kernels.multibody.data.cylinders import is_cylinder
from physics.kernels.multibody.narrowphase.cylinder_capsule import collide_cylinder_capsule
from physics.kernels.multibody.narrowphase.cylinder_ellipsoid import collide_cylinder_ellipsoid
from physics.kernels.multibody.narrowphase.cylinder_hull import collide_cylinder_hull
from physics.kernels.multibody.narrowphase.cylinder_pair import collide_cylinders
from physics.kernels.state.layout import ELLIPSOID, SPHERE


@kernel
def _collide_with_sphere(can, ball, a, b, margin, h, many):
    """Add the contact of a cylinder and a sphere, which are parts a and b in either order."""
    x, r = row_vector(many.bodies.center, ball, 0), many.bodies.body[ball].dims[0]
    distance, n, point = nearest_of_cylinder(can, x, many)
    if distance - r <= margin:
        add_ordered_contact(a, b, ball, n, add_scaled(x, -r, n), point, distance - r, h, many)


@if_given("ellipsoids", False)
def _collide_with_ellipsoid(can, other, a, b, margin, h, ellipsoids, many):
    """Add the contact of a cylinder and another body, if this is an ellipsoid; return whether it is one."""
    if many.bodies.body[other].shape != ELLIPSOID:
        return False
    collide_cylinder_ellipsoid(can, other, a, b, margin, h, many)
    return True


@if_given("many.narrowphase.hulls")
def _collide_with_hull(can, hull, margin, h, many):
    collide_cylinder_hull(can, hull, margin, h, many)


@if_given("many.bodies.cylinders", False)
def collide_cylinder(a, b, margin, h, ellipsoids, many):
    """Add the contacts of parts a and b, if one of them is a cylinder; return whether it is one.

    Their gaps are at most `margin` [m]; h is the length of the stage [s]. `ellipsoids` is None if the scene has none.
    """
    can, other = a, b
    if not is_cylinder(a, many):
        if not is_cylinder(b, many):
            return False
        can, other = b, a
    if is_cylinder(other, many):
        collide_cylinders(a, b, margin, h, many)
    elif many.bodies.body[other].shape == SPHERE:
        _collide_with_sphere(can, other, a, b, margin, h, many)
    elif is_capsule(other, many):
        collide_cylinder_capsule(can, other, margin, h, many)
    elif not _collide_with_ellipsoid(can, other, a, b, margin, h, ellipsoids, many):
        _collide_with_hull(can, other, margin, h, many)
    return True
