"""Limit of a load that dry friction can hold, at any contacts, by a linear program."""

from __future__ import annotations

import numpy as np
from scipy.optimize import linprog

DIRECTIONS = 512
"""Number of tangential forces at each contact. Inside a disk their polygon leaves out 1 - cos(π/512) = 1.9e-5."""


def tangents(normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two unit vectors across each of the normals (n, 3)."""
    helper = np.where(np.abs(normals[:, :1]) < 0.5, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    first = np.cross(normals, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return first, np.cross(normals, first)


def largest_share(
    points: np.ndarray, normals: np.ndarray, friction: float | tuple, fixed: np.ndarray, growing: np.ndarray
) -> float:
    """Largest s >= 0 for which contact forces can balance the wrench `fixed` + s `growing`.

    Parameters
    ----------
    points, normals : (n, 3)
        Contacts, from the point about which moments are taken [m].
    friction : float or (float, float, axis)
        Coefficient, or those along `axis` and across it, where all normals are the same.
    fixed, growing : (6,)
        Force [N] and moment [N m] on the body, without contacts.
    """
    first, second = tangents(normals)
    mu1 = mu2 = friction
    if isinstance(friction, tuple):
        mu1, mu2, axis = friction
        first = np.broadcast_to(axis, normals.shape)
        second = np.cross(normals, first)
    angle = 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS
    forces = (
        normals[:, None]
        + mu1 * np.cos(angle)[:, None] * first[:, None]
        + mu2 * np.sin(angle)[:, None] * second[:, None]
    )
    wrenches = np.concatenate([forces, np.cross(points[:, None], forces)], axis=2).reshape(-1, 6)
    found = linprog(
        np.append(np.zeros(len(wrenches)), -1.0), A_eq=np.vstack([wrenches, growing]).T, b_eq=-fixed, bounds=(0, None)
    )
    assert found.status == 0, found.message
    return float(found.x[-1])
