"""Independent oracles for force fields: plain NumPy formulas and polyhedra, no kernel of the engine."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial import ConvexHull, HalfspaceIntersection, QhullError

from tests.reference.rigid_body import RigidState, Wrench, integrate_rigid_body, rotation_matrix

Force = Callable[[float, np.ndarray, np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]


def integrate_in_field(body, force: Force, duration: float, gravity=(0.0, 0.0, 0.0)) -> RigidState:
    """State of a `physics` body after `duration` [s] by DOP853.

    Parameters
    ----------
    body : physics.Body
    force : callable
        (t, x, R, v, ω) -> force [N], torque [N m], world frame.
    """
    R = rotation_matrix(np.array(body.quat))
    start = RigidState(
        np.array(body.pos), np.array(body.quat), body.mass * np.array(body.linvel),
        R @ body.inertia @ R.T @ np.array(body.angvel),
    )  # fmt: skip
    inverse = np.linalg.inv(body.inertia)

    def wrench(t: float, Y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        R = rotation_matrix(Y[3:7])
        return force(t, Y[:3], R, Y[7:10] / body.mass, R @ inverse @ R.T @ Y[10:])

    checked: Wrench = wrench
    return integrate_rigid_body(body.mass, body.inertia, start, duration, gravity=gravity, wrench=checked)


def shadow_of_points(points: np.ndarray, direction: np.ndarray) -> float:
    """Area [m²] of the projection of the convex hull of `points` (n, 3) along a direction."""
    direction = direction / np.linalg.norm(direction)
    across = np.linalg.svd(direction[None])[2][1:]
    return ConvexHull(points @ across.T).volume


def cut_block(half: np.ndarray, normal: np.ndarray, height: float) -> tuple[float, np.ndarray]:
    """Volume and centre of the part of a block below the plane normal·x = -height, by Qhull and tetrahedra."""
    planes = [[*(sign * np.eye(3)[k]), -half[k]] for k in range(3) for sign in (1.0, -1.0)]
    planes.append([*normal, height])
    corners = half * (2 * (np.arange(8)[:, None] >> np.arange(3) & 1) - 1)
    low = corners[np.argmin(corners @ normal)]
    # A point inside: from the lowest corner a little towards the centre, less than the plane's height above it.
    step = 0.25 * min(1.0, (-height - normal @ low) / np.abs(normal @ low))
    try:
        vertices = HalfspaceIntersection(np.array(planes), low * (1 - step)).intersections
        hull = ConvexHull(vertices)
    except QhullError:
        return 0.0, np.zeros(3)
    inside = vertices.mean(axis=0)
    volume, moment = 0.0, np.zeros(3)
    for a, b, c in vertices[hull.simplices]:
        part = abs(np.linalg.det([a - inside, b - inside, c - inside])) / 6
        volume += part
        moment += part * (a + b + c + inside) / 4
    return volume, moment / volume


def flight_with_drag(radius: float, mass: float, velocity, gravity: float, duration: float) -> np.ndarray:
    """Place of a sphere thrown from the origin after `duration` [m], by DOP853: m v' = -½ ρ C π r² |v| v - m g e_y."""
    k = 0.5 * 1.225 * 0.47 * np.pi * radius**2 / mass

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        v = y[3:]
        return np.concatenate((v, -k * np.linalg.norm(v) * v - np.array([0.0, gravity, 0.0])))

    start = np.concatenate((np.zeros(3), velocity))
    return solve_ivp(rate, (0.0, duration), start, method="DOP853", rtol=1e-12, atol=1e-13).y[:3, -1]
