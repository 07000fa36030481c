"""Axes of a block in an order that starts at a target face, so that a policy need not know which face it is."""

from __future__ import annotations

import numpy as np

AXES = tuple(
    f"{axis}, {part}"
    for axis in ("outward normal of the target face", "next body axis", "body axis after that")
    for part in "xyz"
)
"""Names of the numbers of `axes_of` in an observation."""

HALF_EDGES = tuple(f"half edge along {which}" for which in ("normal", "next", "last"))
"""Names of the half edges in the same order."""


def order_of(faces: np.ndarray) -> np.ndarray:
    """Body axes (n, 3) int64: the axis of a face, and the two axes that follow it cyclically.

    `faces` (n,) are 0 to 5 for -x, +x, -y, +y, -z, +z.
    """
    return (faces.astype(np.int64)[:, None] // 2 + np.arange(3)) % 3


def target_axes(rotation: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Outward normal of the target face, next body axis and the one after that, world frame.

    Parameters
    ----------
    rotation : (n, 3, 3) float64
        Body to world.
    faces : (n,) float64
        0 to 5.

    Returns
    -------
    (n, 3, 3) float64
        A row for each axis.
    """
    axes = np.take_along_axis(rotation.swapaxes(1, 2), order_of(faces)[:, :, None], axis=1)
    axes[:, 0] *= np.where(faces % 2 == 1, 1.0, -1.0)[:, None]
    return axes


def axes_of(worlds):
    """Result of `target_axes` (n, 9) for body 0 and its drawn ``target_face``, for an observation."""
    return target_axes(worlds.rotation[:, 0], worlds.drawn["target_face"]).reshape(-1, 9)
