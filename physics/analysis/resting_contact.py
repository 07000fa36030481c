"""Resting contact at the level of accelerations, as the course notes of Witkin and Baraff pose the problem.

For the contacts of a body that touch and do not move apart, the normal forces f and the normal accelerations a of
the contact points are complementary,

    a = A f + b,    a >= 0,    f >= 0,    fᵀa = 0,

with A = J M⁻¹ Jᵀ and b the accelerations without contact forces. The time-stepping schemes solve the similar problem
of impulses and velocities. This module solves the problem of the notes, without friction, for analysis and teaching.

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
    """Acceleration-level contact problem of one body with n contacts, and its solution."""

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
    """Contact forces of a body that rests or slides without friction on walls, by Dantzig's method.

    Parameters
    ----------
    world : World
        Batch with the body, in its present state.
    index, body : int
        Index of the world in the batch, and of the body in the scene.
    wrench : (6,) array_like, optional
        Force [N] and torque about the centre of mass [N m] on the body, world frame; None: none.
    gap : float, optional
        Largest distance from a wall at which a feature counts as a contact [m]; None: ten times the world's slop.

    Returns
    -------
    RestingContact
        Problem and solution. Features that move away from their wall (normal velocity > 0 beyond rounding) are no
        contacts.

    Raises
    ------
    ValueError
        An index out of range, a wrench of the wrong shape or not finite, a body that is a hull, capsule, cylinder or
        compound, or a scene whose bodies touch each other.
    """
    if not (0 <= index < world.worlds and 0 <= body < world.body_count):
        raise ValueError(
            f"index, body is {index}, {body}; allowed are below {world.worlds} worlds and {world.body_count} bodies"
        )
    if world.plan.scheme.couples_bodies:
        raise ValueError("world has contact between bodies; allowed here are scenes with Contact(between_bodies=False)")
    kind = world.scene.bodies[body].kind
    if kind in ("hull", "capsule", "cylinder", "compound"):
        raise ValueError(f"body is {body}, a {kind}; allowed are blocks, spheres and ellipsoids")
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
    """Inverse inertia (3, 3) in the world frame [1/(kg m²)] of a body with this row of state and of parameters."""
    R = _matrix(row[at.QUAT : at.QUAT + 4]) @ _matrix(params[at.PRINCIPAL : at.PRINCIPAL + 4])
    return R @ np.diag(params[at.INV_INERTIA : at.INV_INERTIA + 3]) @ R.T


def _matrix(q: np.ndarray) -> np.ndarray:
    w, v = q[0], q[1:]
    skew = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + 2 * w * skew + 2 * skew @ skew


def _touching(world: World, i: int, gap: float, v: np.ndarray, w: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Contact arms (n, 3) [m] and normals (n, 3) of the features within `gap` [m] of a wall that do not leave it.

    The body has the row `i` of the state, velocity `v` [m/s] and angular velocity `w` [rad/s].
    """
    arms, normals = [], []
    features = at.VERTEX_COUNT if world.shapes[i % world.body_count] == at.BLOCK else 1
    position, radius = world.state[i, at.POS : at.POS + 3], world.params[i, at.RADIUS]
    # Rounding error of a normal velocity v·n + (ω x r)·n that should be zero.
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
