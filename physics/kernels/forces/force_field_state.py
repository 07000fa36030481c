"""State of a body in the form that force fields read, with the velocity and the load at a point of it."""

from __future__ import annotations

from typing import NamedTuple

from physics.compiler.decorators import inlined
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import plus

ZERO = (0.0, 0.0, 0.0)


class FieldState(NamedTuple):
    """State of a body as force fields read it; vectors are in the world frame unless stated otherwise.

    Attributes
    ----------
    x, v, w : tuples of 3 floats
        Centre of mass, its velocity, angular velocity [m, m/s, rad/s].
    R : tuple of 9 floats
        Rotation matrix from body to world, row by row.
    center : tuple of 3 floats
        Geometric centre relative to the centre of mass [m].
    air : tuple of 3 floats
        Velocity of the air [m/s]: of `physics.Wind`, or zero.
    mass : float
        Mass of the body [kg].
    shape : int
        `layout.BLOCK`, `SPHERE` or `ELLIPSOID`.
    dims : tuple of 3 floats
        Half edges, semi-axes, or the radius three times, along the body axes [m].
    """

    x: tuple
    v: tuple
    w: tuple
    R: tuple
    center: tuple
    air: tuple
    mass: float
    shape: int
    dims: tuple


@inlined
def velocity_at(s, arm):
    """Velocity of the point of a body at `arm` [m] from its centre of mass, world frame [m/s]; s is a `FieldState`."""
    return plus(s.v, qt.cross(s.w, arm))


@inlined
def acting_at(arm, force):
    """Force and torque about the centre of mass of a force that acts at `arm` [m] from the centre of mass."""
    return force, qt.cross(arm, force)
