"""Rotation matrices and products of quaternions (w, x, y, z), in NumPy: for code that is not compiled."""

from __future__ import annotations

import numpy as np


def rotation_matrices(quat: np.ndarray) -> np.ndarray:
    """Rotation matrices (..., 3, 3), body to world, of unit quaternions (..., 4) in the order (w, x, y, z)."""
    w, x, y, z = np.moveaxis(np.asarray(quat, dtype=float), -1, 0)
    rows = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    return np.stack([np.stack(row, axis=-1) for row in rows], axis=-2)


def product(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Product a b (4,) of two quaternions (4,): the rotation by `b`, followed by the rotation by `a`."""
    vector = a[0] * b[1:] + b[0] * a[1:] + np.cross(a[1:], b[1:])
    return np.concatenate(([a[0] * b[0] - a[1:] @ b[1:]], vector))
