"""Resting contact at the level of accelerations, as the course notes pose it.

For the contacts of a body that touch and do not move apart, the normal forces f and the normal accelerations a of
the contact points are complementary,

    a = A f + b,    a >= 0,    f >= 0,    fᵀa = 0,

with A = J M⁻¹ Jᵀ and b the accelerations without contact forces. The step solves the velocity-level twin in
impulses; this is the notes' own problem, without friction, for looking at and for teaching.

Source: Baraff and Witkin, *Physically Based Modeling* (SIGGRAPH course notes, 1997), "Rigid Body Simulation II",
section 9, and Baraff, *Fast contact force computation for nonpenetrating rigid bodies*, SIGGRAPH 1994.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from physics import validation
from physics.analysis.diagnostics import look_at
from physics.analysis.lcp import LcpResult, lcp
from physics.kernels.half_space.gap_queries import contact_point
from physics.kernels.state import layout as at
from physics.world.world import World


@dataclass(frozen=True)
class RestingContact:
    """The problem and its solution for one body with n contacts."""

    points: np.ndarray  # (n, 3) contact points, world frame [m]
    normals: np.ndarray  # (n, 3) out of the walls
    A: np.ndarray  # (n, n) [1/kg]
    b: np.ndarray  # (n,) normal accelerations without contact forces [m/s²]
    forces: np.ndarray  # (n,) f [N]
    accelerations: np.ndarray  # (n,) a = A f + b [m/s²]
    result: LcpResult  # status, pivots and residual of the solver


def resting_contact(
    world: World, index: int = 0, body: int = 0, wrench: ArrayLike | None = None, gap: float | None = None
) -> RestingContact:
    """Contact forces of a body that rests or slides without friction on walls, by Dantzig's pivoting.

    Parameters
    ----------
    world : World
    index, body : int
        Which world of the batch, which body of the scene.
    wrench : (6,) array_like, optional
        Force [N] and torque [N m] on the body, world frame.
    gap : float, optional
        Features up to this distance from a wall count as contacts [m]; None: the world's own slop, ten times.

    Returns
    -------
    RestingContact
        Features that move away from their wall (normal velocity > 0 beyond rounding) are not contacts.

    Raises
    ------
    ValueError
        An index out of range, a wrench of the wrong shape or not finite, or a world whose bodies touch each other.
    """
    if not (0 <= index < world.worlds and 0 <= body < world.body_count):
        raise ValueError(
            f"index, body is {index}, {body}; allowed are below {world.worlds} worlds and {world.body_count} bodies"
        )
    if world.plan.scheme.couples_bodies:
        raise ValueError("world has contact between bodies; allowed here are scenes with Contact(between_bodies=False)")
    if world.scene.bodies[body].kind == "hull":
        raise ValueError(f"body is {body}, a hull; allowed are blocks, spheres and ellipsoids")
    load = np.zeros(6) if wrench is None else validation.finite(wrench, (6,), "wrench")
    i = index * world.body_count + body
    load = load + look_at(world)[0][i]
    row, params = world.state[i], world.params[i]
    if gap is None:
        gap = 10 * world.accuracy.slop * params[at.RADIUS]
    v, w = row[at.LINVEL : at.LINVEL + 3], row[at.ANGVEL : at.ANGVEL + 3]
    arms, normals = _touching(world, i, gap, v, w)
    inverse = _inverse_inertia(row, params)
    # α = I⁻¹ (τ - ω x L); the acceleration of a point adds the centripetal ω x (ω x r).
    alpha = inverse @ (load[3:] - np.cross(w, row[at.ANGMOM : at.ANGMOM + 3]))
    centre = world.gravity[index] + load[:3] * params[at.INV_MASS]
    free = centre + np.cross(alpha, arms) + np.cross(w, np.cross(w, arms))
    angular = np.cross(arms, normals)
    A = normals @ normals.T * params[at.INV_MASS] + angular @ inverse @ angular.T
    b = np.sum(normals * free, axis=1)
    result = lcp(A, b, method="dantzig")
    return RestingContact(row[at.POS : at.POS + 3] + arms, normals, A, b, result.z, result.w, result)


def _inverse_inertia(row: np.ndarray, params: np.ndarray) -> np.ndarray:
    """I⁻¹ in the world frame, (3, 3) [1/(kg m²)]."""
    R = _matrix(row[at.QUAT : at.QUAT + 4]) @ _matrix(params[at.PRINCIPAL : at.PRINCIPAL + 4])
    return R @ np.diag(params[at.INV_INERTIA : at.INV_INERTIA + 3]) @ R.T


def _matrix(q: np.ndarray) -> np.ndarray:
    w, v = q[0], q[1:]
    skew = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + 2 * w * skew + 2 * skew @ skew


def _touching(world: World, i: int, gap: float, v: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Arms (n, 3) and normals (n, 3) of the features within `gap` of a wall that do not move away from it."""
    arms, normals = [], []
    features = at.VERTEX_COUNT if world.shapes[i % world.body_count] == at.BLOCK else 1
    position, radius = world.state[i, at.POS : at.POS + 3], world.params[i, at.RADIUS]
    # What rounding of v and of ω x r may leave of a normal velocity that is zero.
    rounding = 1e-9 * (np.linalg.norm(v) + radius * np.linalg.norm(w))
    for k, wall in enumerate(world.walls):
        n = wall[at.WALL_NORMAL : at.WALL_NORMAL + 3]
        for feature in range(features):
            point = np.empty(3)
            contact_point(world.state, world.params, world.shapes, world.walls, i, k, feature, point)
            arm = point - position
            if n @ point - wall[at.WALL_OFFSET] <= gap and n @ (v + np.cross(w, arm)) <= rounding:
                arms.append(arm)
                normals.append(n)
    return np.array(arms).reshape(-1, 3), np.array(normals).reshape(-1, 3)
