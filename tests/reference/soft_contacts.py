"""Points of a body on springs and dampers over the floor y = 0, with Coulomb friction at each: a wrench for DOP853.

A point at depth d > 0 that moves with velocity u is pushed with N = max(0, k d - c u_y), and friction is -μ N u_t/|u_t|
along the floor. So points must slide all the time that they are pressed. Without damping the force is continuous; with
it, it begins with a jump, which `solve_ivp` meets by short steps.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tests.reference.rigid_body import rotation_matrix


def soft_floor(
    mass: float,
    inertia_body: np.ndarray,
    points: np.ndarray,
    k: float,
    c: float = 0.0,
    mu: float = 0.0,
    share: float = 0.0,
) -> Callable[[float, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    """Wrench of a floor on a body, as `tests.reference.rigid_body.integrate_rigid_body` takes it.

    Parameters
    ----------
    mass, inertia_body : float, (3, 3)
        Of the body [kg], [kg m²].
    points : (n, 3)
        Points that may touch, from the centre of mass, body frame [m].
    k, c, mu : float
        Stiffness [N/m] and damping [N s/m] of each point, coefficient of friction.
    share : float
        Friction acts over the point by this share of its depth.
    """
    inverse = np.linalg.inv(inertia_body)

    def wrench(t: float, Y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        R = rotation_matrix(Y[3:7])
        arms = points @ R.T
        depth = -(Y[1] + arms[:, 1])
        arms[:, 1] += share * np.maximum(depth, 0.0)
        u = Y[7:10] / mass + np.cross(R @ inverse @ R.T @ Y[10:], arms)
        N = np.where(depth > 0, np.maximum(0.0, k * depth - c * u[:, 1]), 0.0)
        slip = u * [1, 0, 1]
        size = np.linalg.norm(slip, axis=1, keepdims=True)
        forces = -mu * N[:, None] * np.divide(slip, size, out=np.zeros_like(slip), where=size > 0)
        forces[:, 1] = N
        return forces.sum(axis=0), np.cross(arms, forces).sum(axis=0)

    return wrench
