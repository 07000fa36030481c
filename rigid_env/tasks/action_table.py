"""Table of the vectors that a task's actions set: loads for the kernels, and velocities of driven bodies."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

import physics
from rigid_env.tasks.actions import (
    AXES,
    IMPULSE,
    SPIN,
    TORQUE,
    VELOCITY,
    Drive,
    Force,
    Impulse,
    Vector,
    Wrench,
    check_movable,
)

WAYS = (Wrench, Force, Impulse, Drive)
"""Classes of the ways to act."""

NAMES = {VELOCITY: "velocity", SPIN: "spin"}
"""Arguments of `physics.World.set_motion`, by the kind of a vector."""


class DrivenVector(NamedTuple):
    """Velocity or spin of a driven body.

    Attributes
    ----------
    vector : Vector
        Its kind, its body and its largest length.
    numbers : list of int
        Indices of its x, y and z in an action; -1: no number, always 0.
    """

    vector: Vector
    numbers: list[int]

    def of(self, actions: np.ndarray) -> np.ndarray:
        """Vectors (worlds, 3) that `actions` (worlds, numbers) set, world frame [m/s or rad/s]."""
        x, y, z = (np.clip(actions[:, k], -1.0, 1.0) if k >= 0 else np.zeros(len(actions)) for k in self.numbers)
        scale = self.vector.share / np.maximum(1.0, np.sqrt(x * x + y * y + z * z))
        return np.stack([scale * x, scale * y, scale * z], axis=1)


def drive_bodies(world: physics.World, drives: list[DrivenVector], actions: np.ndarray) -> None:
    """Give driven bodies the velocities and spins of `actions` (worlds, numbers), from now on."""
    for drive in drives:
        world.set_motion(drive.vector.body, **{NAMES[drive.vector.kind]: drive.of(actions)})


def check_drivable(drive: Drive, bodies) -> None:
    """Raise a ValueError unless a `Drive` moves a fixed body with a steady motion; `bodies` are those of the scene."""
    drivable = [b for b, body in enumerate(bodies) if body.motion is not None and body.motion.times is None]
    if drive.body not in drivable:
        allowed = f"{', '.join(map(str, drivable))}: " if drivable else ""
        raise ValueError(
            f"body of {drive!r} is {drive.body}; allowed are {allowed}bodies with fixed=True and a steady motion, such "
            "as motion=physics.Motion()"
        )


def check_driven_once(ways) -> None:
    """Raise a ValueError if two `Drive` move the same body."""
    driven = [way.body for way in ways if isinstance(way, Drive)]
    for body in driven:
        if driven.count(body) > 1:
            raise ValueError(f"actions holds several Drive of body {body}; allowed is one")


class ActionTable:
    """Arrays that describe the vectors of a task's actions, for the kernels of `rigid_env.tasks.wrenches`.

    Parameters
    ----------
    ways : sequence of Wrench, Force, Impulse and Drive
        Actuations that the task declares, or a single one.
    bodies : sequence of Body
        Bodies of the scene.

    Attributes
    ----------
    size : int
        Length of an action.
    vectors : list of Vector
        All vectors that an action sets, in the order of its numbers.
    loads : list of Vector
        Forces, torques and impulses among them.
    drives : list of DrivenVector
        Velocities and spins among them.
    table : (loads, 6) int64
        A row for each load: its kind, its body, the indices in the action of its x, y and z (-1: no number, always
        0), and 1 if the vector is in the body frame.
    points : (loads, 3) float64
        Points at which the loads act, body frame, from the centre of mass [m].
    has_impulses : bool
        Whether one of the vectors is an impulse.
    agents : dict of str to (k,) int64
        Indices of the action's numbers that each agent chooses, by the agent's name.

    Raises
    ------
    ValueError
        No actuation, an object of another class, or a body that is not in the scene. A `Drive` of a body that is not
        fixed or has no steady motion, or another actuation of a fixed body.
    """

    def __init__(self, ways, bodies):
        ways = tuple(ways) if isinstance(ways, (list, tuple)) else (ways,)
        if not ways or not all(isinstance(way, WAYS) for way in ways):
            raise ValueError(f"actions is {ways!r}; allowed are Wrench, Force, Impulse and Drive, at least one")
        check_driven_once(ways)
        self.vectors: list[Vector] = []
        self.loads: list[Vector] = []
        self.drives: list[DrivenVector] = []
        rows: list[Any] = []
        agents: dict[str, Any] = {}
        self.size = 0
        for way in ways:
            (check_drivable if isinstance(way, Drive) else check_movable)(way, bodies)
            first = self.size
            for vector in way.vectors:
                places = {axis: self.size + k for k, axis in enumerate(vector.axes)}
                numbers = [places.get(axis, -1) for axis in AXES]
                if isinstance(way, Drive):
                    self.drives.append(DrivenVector(vector, numbers))
                else:
                    self.loads.append(vector)
                    rows.append([vector.kind, vector.body, *numbers, vector.frame == "body"])
                self.vectors.append(vector)
                self.size += len(vector.axes)
            agents.setdefault(way.agent, []).extend(range(first, self.size))
        self.table = np.array(rows, dtype=np.int64).reshape(-1, 6)
        self.points = np.array([vector.point or (0.0, 0.0, 0.0) for vector in self.loads]).reshape(-1, 3)
        self.has_impulses = any(vector.kind == IMPULSE for vector in self.loads)
        self.agents = {agent: np.array(places) for agent, places in agents.items()}

    def limits(self, weight: np.ndarray, reach: np.ndarray, first_dt: float) -> np.ndarray:
        """Largest length of each load in each world.

        Parameters
        ----------
        weight, reach : (worlds, bodies) float64
            Weight m g [N] and reach [m] of each body.
        first_dt : float
            Time during which an impulse acts as a force [s].

        Returns
        -------
        (worlds, loads) float64
            [N] for forces, [N m] for torques. An impulse is given as the force that acts during `first_dt` [N].
        """
        columns = np.empty((len(weight), len(self.loads)))
        for k, vector in enumerate(self.loads):
            limit = vector.share * weight[:, vector.body]
            if vector.kind == TORQUE:
                limit = limit * reach[:, vector.body]
            columns[:, k] = limit / first_dt if vector.kind == IMPULSE else limit
        return columns
