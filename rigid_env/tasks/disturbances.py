"""Disturbances: pushes and gusts at random times, which the agent does not choose.

Disturbances begin and end together with control steps. In each control step without one, a disturbance begins with the
same probability, so the time since the last one says nothing about the next. A disturbance acts on its body directly,
not through an actuator of the scene. Its random numbers come from the generator of its world.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from physics import validation
from rigid_env.tasks.actions import check_axes, check_body, check_movable
from rigid_env.tasks.distribution import Distribution
from rigid_env.tasks.distributions import as_distribution
from rigid_env.tasks.task_parts import Disturbed

UNIFORMS = 5  # of one disturbance: direction (2), size (1), duration (1), wait (1)
FAR = 2**53  # largest wait or duration in control steps; no episode is as long
NEVER = np.iinfo(np.int64).max  # start of the next disturbance, in control steps, before the first episode


@dataclass(frozen=True)
class Push:
    """A sudden change of a body's velocity at random times, by an impulse at the centre of mass.

    Parameters
    ----------
    body : int
        Index of the body.
    speed : number, pair or Distribution
        Change of the body's speed [m/s].
    every : float
        Mean time between two pushes [s]; a control step has at most one.
    axes : str
        Axes that span the possible directions, letters of "xyz"; each direction has the same probability. ``xz`` means
        all horizontal directions.

    Raises
    ------
    ValueError
        The message names the field, its value and what is allowed.
    """

    body: int = 0
    speed: Distribution | float | tuple[float, float] = (0.0, 1.0)
    every: float = 2.0
    axes: str = "xz"

    def __post_init__(self):
        check_body(self.body)
        validation.positive(self.every, (), "every")
        check_axes("axes", self.axes)
        _take_size(self, "speed")


@dataclass(frozen=True)
class Gust:
    """A constant force at a body's centre of mass that lasts for a while, at random times.

    Parameters
    ----------
    body : int
        Index of the body.
    force : number, pair or Distribution
        Force over the body's weight.
    lasts : number, pair or Distribution
        Duration [s], rounded to a whole number of control steps, at least one.
    every : float
        Mean time from the end of one gust to the start of the next [s].
    axes : str
        Axes that span the possible directions, as in `Push`.

    Raises
    ------
    ValueError
        The message names the field, its value and what is allowed.
    """

    body: int = 0
    force: Distribution | float | tuple[float, float] = (0.0, 0.3)
    lasts: Distribution | float | tuple[float, float] = (0.2, 1.0)
    every: float = 3.0
    axes: str = "xz"

    def __post_init__(self):
        check_body(self.body)
        validation.positive(self.every, (), "every")
        check_axes("axes", self.axes)
        _take_size(self, "force")
        _take_size(self, "lasts")


def _take_size(kind: Push | Gust, field: str) -> None:
    """Replace the value in a field of a disturbance by a distribution; refuse one with negative numbers."""
    value = getattr(kind, field)
    sizes = as_distribution(field, value, 1)
    if (sizes.ends() < 0.0).any():
        raise ValueError(f"{field} is {value!r}; allowed are numbers of at least 0")
    object.__setattr__(kind, field, sizes)


def direction(shares: np.ndarray, axes: str) -> np.ndarray:
    """Unit vector (3,), uniform over directions in the span of `axes` (letters of "xyz"), from uniform numbers (2,)."""
    vector = np.zeros(3)
    places = ["xyz".index(axis) for axis in axes]
    if len(places) == 1:
        vector[places] = 1.0 if shares[0] < 0.5 else -1.0
    elif len(places) == 2:
        turn = 2.0 * math.pi * shares[0]
        vector[places] = math.cos(turn), math.sin(turn)
    else:  # Archimedes: a uniform point on a sphere has a uniform height
        height, turn = 2.0 * shares[1] - 1.0, 2.0 * math.pi * shares[0]
        radius = math.sqrt(max(0.0, 1.0 - height * height))
        vector[:] = radius * math.cos(turn), radius * math.sin(turn), height
    return vector


def quiet_steps(mean: float, share: float) -> int:
    """Draw the number of control steps before the next disturbance.

    The disturbance starts in each step with the probability 1 / (1 + `mean`), so the number has a geometric
    distribution.

    Parameters
    ----------
    mean : float
        Mean of the number; 0 or below gives 0.
    share : float
        Uniform random number, at least 0 and below 1.
    """
    return math.floor(min(-math.log1p(-share) / math.log1p(1.0 / mean), FAR)) if mean > 0.0 else 0


class Disturbances:
    """Disturbances of all worlds of a batch: the current ones, and the start times of the next ones.

    Parameters
    ----------
    kinds : sequence of Push and Gust
        Disturbances that the task declares.
    task : Disturbed
        The task, which has the worlds, their random generators and the bodies' weights.

    Attributes
    ----------
    next : (kinds, worlds) int64
        Control step of the episode in which the next disturbance starts.
    end : (kinds, worlds) int64
        First control step of the episode in which the current disturbance no longer acts.
    force : (kinds, worlds, 3) float64
        Force of the current disturbance, world frame [N].
    load : (worlds, bodies, 6) float64
        Sum of all gusts in the last control step: force [N], torque [N m], world frame.

    Raises
    ------
    ValueError
        An object that is no disturbance, or a body that is not in the scene.
    """

    def __init__(self, kinds, task: Disturbed):
        self.kinds, self._task = tuple(kinds) if isinstance(kinds, (list, tuple)) else (kinds,), task
        for kind in self.kinds:
            if not isinstance(kind, (Push, Gust)):
                raise ValueError(f"disturbances holds {kind!r}; allowed are Push and Gust")
            check_movable(kind, task.world.scene.bodies)
        shape = (len(self.kinds), task.worlds)
        self.next, self.end = np.full(shape, NEVER), np.zeros(shape, dtype=np.int64)
        self.force, self.load = np.zeros((*shape, 3)), task.world.no_wrench()
        self._push = task.world.no_wrench() if any(isinstance(kind, Push) for kind in self.kinds) else None

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """Arrays that decide the coming disturbances, by name, as views whose first axis is the world.

        The random generators, which decide them too, are not included.
        """
        return {
            "disturbance start": self.next.swapaxes(0, 1), "disturbance end": self.end.swapaxes(0, 1),
            "disturbance force": self.force.swapaxes(0, 1), "disturbance load": self.load,
        }  # fmt: skip

    def begin(self, rows: np.ndarray) -> None:
        """Draw when the first disturbances start, for the episodes that begin in worlds `rows` (n,)."""
        self.load[rows] = 0.0
        for k, kind in enumerate(self.kinds):
            self.force[k, rows] = self.end[k, rows] = 0
            quiet = kind.every / self._task.control_dt
            self.next[k, rows] = [quiet_steps(quiet, self._task.generators[world].random()) for world in rows]

    def wait_anew(self) -> None:
        """Draw again when the next disturbances start, in all worlds.

        A planner's model calls it, so that it does not know the future of the real worlds. A disturbance starts in each
        quiet step with the same probability, so a wait that is drawn from now on has the right distribution.
        """
        for k, kind in enumerate(self.kinds):
            quiet = self._quiet(kind)
            waits = [quiet_steps(quiet, generator.random()) for generator in self._task.generators]
            self.next[k] = np.maximum(self._task.steps, self.end[k]) + waits

    def _quiet(self, kind: Any) -> float:
        """Mean number of control steps between the end of a disturbance of this kind and the start of the next."""
        return kind.every / self._task.control_dt - (1.0 if isinstance(kind, Push) else 0.0)

    def due(self) -> np.ndarray:
        """Worlds (n,) int64 in which a disturbance starts in the coming control step."""
        return np.flatnonzero((self.next <= self._task.steps).any(axis=0))

    def act(self) -> tuple[np.ndarray, np.ndarray | None]:
        """Start the disturbances that are due, and return the loads of the coming control step.

        Returns
        -------
        load : (worlds, bodies, 6) float64
            Gusts of the whole control step: force [N], torque [N m], world frame.
        push : (worlds, bodies, 6) float64 or None
            Pushes, which act in the first physics step only; None if the task declares no `Push`.
        """
        steps, push = self._task.steps, self._push
        self.load.fill(0.0)
        if push is not None:
            push.fill(0.0)
        for k, kind in enumerate(self.kinds):
            due = np.flatnonzero(self.next[k] <= steps)
            for world in due.tolist():
                self._draw(k, kind, world, int(steps[world]))
            if push is not None and isinstance(kind, Push):
                push[due, kind.body, :3] += self.force[k, due]
            else:
                acting = self.end[k] > steps
                self.load[:, kind.body, :3] += np.where(acting[:, None], self.force[k], 0.0)
        return self.load, push

    def _draw(self, k: int, kind: Any, world: int, step: int) -> None:
        """Start a disturbance in control step `step` of a world: draw its force, its end and the next start.

        `k` is the index of its `kind` among the task's disturbances.
        """
        task = self._task
        shares = task.generators[world].random(UNIFORMS)
        along = direction(shares[:2], kind.axes)
        one = shares[2:3, None]
        if isinstance(kind, Push):
            inv_mass = task.inv_mass(world, kind.body)
            speed: Any = kind.speed
            self.force[k, world] = speed.at(one, {})[0] / inv_mass / task.world.dt * along
            end = step + 1
        else:
            self.force[k, world] = kind.force.at(one, {})[0] * task.weights[world, kind.body] * along
            lasts = kind.lasts.at(shares[3:4, None], {})[0] / task.control_dt
            end = self.end[k, world] = step + max(1, round(min(lasts, FAR)))
        self.next[k, world] = end + quiet_steps(self._quiet(kind), shares[4])
