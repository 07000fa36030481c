"""Frames of capsules and cylinders: MuJoCo's axis is that of z of the geom, ours is that of y of the body."""

from __future__ import annotations

import numpy as np

from physics.rotations import product

# Kinds of geoms with an axis.
WITH_AXIS = ("capsule", "cylinder")

# Frame of a scene's capsule or cylinder in that of the geom, whose z axis is its y axis; then that of the geom in it.
IN_GEOM = np.array([0.5**0.5, 0.5**0.5, 0.0, 0.0])
OF_GEOM = np.array([0.5**0.5, -(0.5**0.5), 0.0, 0.0])

# Sine of half the angle up to which a frame is turned by the rounding of a text alone.
ROUNDED = 1e-12


def capsule_frame(quat: np.ndarray) -> np.ndarray:
    """Quaternion (4,) of a scene's capsule or cylinder whose geom has the quaternion `quat` (4,).

    It is the identity up to rounding.
    """
    turned = product(quat, IN_GEOM)
    if np.abs(turned[1:]).max() <= ROUNDED:
        return np.array([1.0, 0.0, 0.0, 0.0])
    return turned


def axis_extents(kind: str, size: np.ndarray) -> np.ndarray:
    """Half extents (3,) [m] of a scene's capsule or cylinder from MuJoCo's radius and half-length of the cylinder."""
    return np.array([size[0], size[1] + size[0] * (kind == "capsule"), size[0]])
