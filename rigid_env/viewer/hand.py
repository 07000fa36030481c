"""Hand of the viewer's user in a world or a task: a spring that drags one body, and kicks."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

import physics
from physics.kernels.state import layout as at
from physics.rotations import rotation_matrices

if TYPE_CHECKING:
    from rigid_env.tasks.disturbances import Disturbances

RATE = 10.0
"""Angular frequency of the dragged body's mass on the spring [rad/s]."""

LARGEST_TURN = 0.25
"""Largest phase of this oscillation in one step [rad]; it bounds the angular frequency."""

DAMPING = 0.7
"""Damping of the spring as a share of critical damping."""


@dataclass
class Hand:
    """Spring and kicks of the user; their forces are constant over a step.

    Attributes
    ----------
    body : int or None
        Body that the spring drags; None: no body.
    point : (3,) float
        Point of the body where the spring is attached, from its centre of mass, body frame [m].
    target : (3,) float
        Other end of the spring, world frame [m].
    kicks : dict of int to (3,) float
        Impulses that act in the coming step, by body, world frame [N s].
    """

    body: int | None = None
    point: np.ndarray = field(default_factory=lambda: np.zeros(3))
    target: np.ndarray = field(default_factory=lambda: np.zeros(3))
    kicks: dict[int, np.ndarray] = field(default_factory=dict)

    def copy(self) -> Hand:
        """Copy of the hand, with the same spring and kicks."""
        return Hand(self.body, self.point, self.target, dict(self.kicks))

    def kick(self, body: int, impulse: np.ndarray) -> None:
        """Add an impulse (3,) through the centre of mass of a body, world frame [N s]."""
        self.kicks[body] = self.kicks.get(body, np.zeros(3)) + impulse

    def ends(self, world: physics.World) -> tuple[np.ndarray, np.ndarray] | None:
        """Ends of the spring, on the body and at the target, (3,) each, world frame [m]; None if nothing is dragged."""
        if self.body is None:
            return None
        arm = rotation_matrices(world.quat[0, self.body]) @ self.point
        return world.pos[0, self.body] + arm, self.target.copy()

    def load(self, world: physics.World, interval: float) -> np.ndarray | None:
        """Wrench (bodies, 6) of the hand in a step of `interval` [s]: force [N], torque [N m], world frame; or None."""
        if self.body is None and not self.kicks:
            return None
        load = np.zeros((world.body_count, 6))
        if self.body is not None:
            load[self.body] = self._spring(world, interval)
        for body, impulse in self.kicks.items():
            load[body, :3] += impulse / interval
        return load

    def _spring(self, world: physics.World, interval: float) -> np.ndarray:
        """Wrench (6,) of the spring on the dragged body: force [N] and torque [N m], world frame.

        The spring's rate is bounded so that a force that is constant over a step does not make the body oscillate.
        """
        params, body = world.params[self.body], self.body
        arm = rotation_matrices(world.quat[0, body]) @ self.point
        velocity = world.linvel[0, body] + np.cross(world.angvel[0, body], arm)
        rate = min(RATE, LARGEST_TURN / interval)
        stiffness = rate**2 / params[at.INV_MASS]
        damping = 2.0 * DAMPING * np.sqrt(stiffness * _least_mass(params, world.quat[0, body], arm))
        force = stiffness * (self.target - world.pos[0, body] - arm) - damping * velocity
        return np.concatenate((force, np.cross(arm, force)))


def _least_mass(params: np.ndarray, quat: np.ndarray, arm: np.ndarray) -> float:
    """Smallest effective mass of a body for a force at a point of it, over all directions of the force [kg].

    `params` are the body's parameters, `quat` its attitude, and `arm` (3,) points from its centre of mass to the point
    [m].
    """
    frame = rotation_matrices(quat) @ rotation_matrices(params[at.PRINCIPAL : at.PRINCIPAL + 4])
    inverse = frame * params[at.INV_INERTIA : at.INV_INERTIA + 3] @ frame.T
    x, y, z = arm
    cross = np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
    return 1.0 / float(np.linalg.eigvalsh(params[at.INV_MASS] * np.eye(3) - cross @ inverse @ cross)[-1])


class HandOfUser:
    """Disturbances of a task with the user's force added; an object of this class replaces the task's `disturbed`.

    Parameters
    ----------
    inner : Disturbances or None
        Disturbances of the task itself.

    Attributes
    ----------
    pull : (bodies, 6) float64 or None
        Force [N] and torque [N m] of the user in the coming control step, world frame.
    """

    def __init__(self, inner: Disturbances | None):
        self.inner, self.pull = inner, None

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """Arrays of the task's own disturbances, by name."""
        return {} if self.inner is None else self.inner.arrays

    @property
    def load(self) -> np.ndarray | float:
        """Loads of the task's own disturbances in the last control step; the user's force is drawn as a spring."""
        return 0.0 if self.inner is None else self.inner.load

    def due(self) -> np.ndarray:
        """Worlds in which a disturbance of the task starts in the coming control step."""
        return np.zeros(0, dtype=np.int64) if self.inner is None else self.inner.due()

    def begin(self, rows: np.ndarray) -> None:
        """Draw the first disturbances of the task for episodes that begin in worlds `rows`."""
        if self.inner is not None:
            self.inner.begin(rows)

    def act(self) -> tuple[np.ndarray | None, np.ndarray | None]:
        """Loads (1, bodies, 6) of the coming control step, and further loads of its first physics step; or None."""
        load, push = (None, None) if self.inner is None else self.inner.act()
        if self.pull is None:
            return load, push
        return (self.pull[None] if load is None else load + self.pull), push
