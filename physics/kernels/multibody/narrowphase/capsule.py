"""Contacts of a capsule with a body of any shape, for scenes that have capsules."""

from __future__ import annotations

from physics.compiler.decorators import if_given
from physics.kernels.multibody.data.capsules import is_capsule
from physics.kernels.multibody.narrowphase.capsule_contacts import (
    collide_capsule_ellipsoid,
    collide_capsule_sphere,
    collide_capsules,
)
from physics.kernels.multibody.narrowphase.capsule_hull import collide_capsule_hull
from physics.kernels.state.layout import ELLIPSOID, SPHERE


@if_given("ellipsoids", False)
def _collide_with_ellipsoid(capsule, other, a, b, margin, h, ellipsoids, many):
    """Add the contact of a capsule and another body, if this is an ellipsoid; return whether it is one."""
    if many.bodies.body[other].shape != ELLIPSOID:
        return False
    collide_capsule_ellipsoid(capsule, other, a, b, margin, h, many)
    return True


@if_given("many.narrowphase.hulls")
def _collide_with_hull(capsule, hull, margin, h, many):
    collide_capsule_hull(capsule, hull, margin, h, many)


@if_given("many.bodies.capsules", False)
def collide_capsule(a, b, margin, h, ellipsoids, many):
    """Add the contacts of bodies a and b, if one of them is a capsule; return whether it is one.

    Their gaps are at most `margin` [m]; h is the length of the stage [s]. `ellipsoids` is None if the scene has none.
    """
    capsule, other = a, b
    if not is_capsule(a, many):
        if not is_capsule(b, many):
            return False
        capsule, other = b, a
    if is_capsule(other, many):
        collide_capsules(a, b, margin, h, many)
    elif many.bodies.body[other].shape == SPHERE:
        collide_capsule_sphere(capsule, other, a, b, margin, h, many)
    elif not _collide_with_ellipsoid(capsule, other, a, b, margin, h, ellipsoids, many):
        _collide_with_hull(capsule, other, margin, h, many)
    return True
