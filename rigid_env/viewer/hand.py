"""Hand of the user in a world: a spring that drags a body, and kicks."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

import physics
from physics import validation
from physics.kernels.state import layout as at
from physics.rotations import rotation_matrices

RATE = 10.0
"""Angular frequency at which the spring swings the body's mass [rad/s]."""

LARGEST_TURN = 0.25
"""Largest angle by which it may swing in a step, which bounds the frequency [rad]."""

DAMPING = 0.7
"""Share of critical damping."""


@dataclass
class Hand:
    """Spring and kicks; their forces are held over a step.

    Attributes
    ----------
    body : int or None
        Dragged; None: none.
    point : (3,) float
        Of the body that the spring holds, from its centre of mass, body frame [m].
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
        """Another hand that does the same."""
        return Hand(self.body, self.point, self.target, dict(self.kicks))

    def kick(self, body: int, impulse: np.ndarray) -> None:
        """Add an impulse [N s] through the centre of a body."""
        self.kicks[body] = self.kicks.get(body, np.zeros(3)) + impulse

    def ends(self, world: physics.World) -> tuple[np.ndarray, np.ndarray] | None:
        """Ends of the spring, on the body and at the target, (3,) each, world frame [m]; None if nothing is dragged."""
        if self.body is None:
            return None
        arm = rotation_matrices(world.quat[0, self.body]) @ self.point
        return world.pos[0, self.body] + arm, self.target.copy()

    def load(self, world: physics.World, interval: float) -> np.ndarray | None:
        """(bodies, 6) wrench of a step that takes `interval` [s]: force [N] and torque [N m]; None if there is none."""
        if self.body is None and not self.kicks:
            return None
        load = np.zeros((world.body_count, 6))
        if self.body is not None:
            load[self.body] = self._spring(world, interval)
        for body, impulse in self.kicks.items():
            load[body, :3] += impulse / interval
        return load

    def _spring(self, world: physics.World, interval: float) -> np.ndarray:
        """(6,) wrench of the spring: its rate is bounded such that a force held over a step does not make it swing."""
        params, body = world.params[self.body], self.body
        arm = rotation_matrices(world.quat[0, body]) @ self.point
        velocity = world.linvel[0, body] + np.cross(world.angvel[0, body], arm)
        rate = min(RATE, LARGEST_TURN / interval)
        stiffness = rate**2 / params[at.INV_MASS]
        damping = 2.0 * DAMPING * np.sqrt(stiffness * _least_mass(params, world.quat[0, body], arm))
        force = stiffness * (self.target - world.pos[0, body] - arm) - damping * velocity
        return np.concatenate((force, np.cross(arm, force)))


def _least_mass(params: np.ndarray, quat: np.ndarray, arm: np.ndarray) -> float:
    """Least mass that a force at a point of a body meets, over all its directions [kg]."""
    frame = rotation_matrices(quat) @ rotation_matrices(params[at.PRINCIPAL : at.PRINCIPAL + 4])
    inverse = frame * params[at.INV_INERTIA : at.INV_INERTIA + 3] @ frame.T
    x, y, z = arm
    cross = np.array(((0.0, -z, y), (z, 0.0, -x), (-y, x, 0.0)))
    return 1.0 / float(np.linalg.eigvalsh(params[at.INV_MASS] * np.eye(3) - cross @ inverse @ cross)[-1])


def checked_body(world: physics.World, body) -> int:
    """Index of a body of a world.

    Raises
    ------
    ValueError
        There is no such body.
    """
    return validation.index(body, world.body_count, "body")


def checked_vector(value, name: str) -> np.ndarray:
    """(3,) finite numbers, a copy."""
    return np.array(validation.finite(value, (3,), name))
