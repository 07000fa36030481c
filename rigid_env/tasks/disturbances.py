"""Disturbances: pushes and gusts at random times, which the agent does not choose.

They begin and end with control steps. One begins in each quiet control step with the same probability, so that the time
since the last one tells nothing about the next. No actuator stands between a disturbance and its body. All random
numbers come from the generator of the world that is disturbed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from physics import validation
from rigid_env.tasks.actions import check_axes, check_body
from rigid_env.tasks.distribution import Distribution
from rigid_env.tasks.distributions import as_distribution
from rigid_env.tasks.task_parts import Disturbed

UNIFORMS = 5  # of one disturbance: direction (2), size (1), duration (1), wait (1)
FAR = 2**53  # control steps after which nobody looks: larger numbers are cut
NEVER = np.iinfo(np.int64).max  # control step of a disturbance before its episode has begun


@dataclass(frozen=True)
class Push:
    """An impulse at the centre of mass, at random times.

    Parameters
    ----------
    body : int
    speed : number, pair or Distribution
        Change of the body's speed [m/s].
    every : float
        Mean time between two [s]; a control step has at most one.
    axes : str
        Axes that span the directions, each as likely as the other: ``xz`` is horizontal.

    Raises
    ------
    ValueError
        Naming the field, the value and what is allowed.
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
    """A force at the centre of mass that lasts for a while, at random times.

    Parameters
    ----------
    body : int
    force : number, pair or Distribution
        Force over the body's weight.
    lasts : number, pair or Distribution
        Duration [s], to the nearest number of control steps, at least one.
    every : float
        Mean time from the end of one to the start of the next [s].
    axes : str
        As of `Push`.

    Raises
    ------
    ValueError
        Naming the field, the value and what is allowed.
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
    """Replace a field by a distribution of non-negative numbers."""
    value = getattr(kind, field)
    sizes = as_distribution(field, value, 1)
    if (sizes.ends() < 0.0).any():
        raise ValueError(f"{field} is {value!r}; allowed are numbers of at least 0")
    object.__setattr__(kind, field, sizes)


def direction(shares: np.ndarray, axes: str) -> np.ndarray:
    """Random unit vector (3,) from two uniform numbers, uniform over directions along the `axes`."""
    vector = np.zeros(3)
    places = ["xyz".index(axis) for axis in axes]
    if len(places) == 1:
        vector[places] = 1.0 if shares[0] < 0.5 else -1.0
    elif len(places) == 2:
        turn = 2.0 * math.pi * shares[0]
        vector[places] = math.cos(turn), math.sin(turn)
    else:  # Archimedes: the height of a uniform point of a sphere is uniform
        height, turn = 2.0 * shares[1] - 1.0, 2.0 * math.pi * shares[0]
        radius = math.sqrt(max(0.0, 1.0 - height * height))
        vector[:] = radius * math.cos(turn), radius * math.sin(turn), height
    return vector


def quiet_steps(mean: float, share: float) -> int:
    """Number of control steps before a disturbance that starts in each step with the probability 1 / (1 + `mean`).

    Parameters
    ----------
    mean : float
        Of the number; none are below 0.
    share : float
        Uniform random number, at least 0 and below 1.
    """
    return math.floor(min(-math.log1p(-share) / math.log1p(1.0 / mean), FAR)) if mean > 0.0 else 0


class Disturbances:
    """All disturbances of a batch, and the times of the next ones.

    Parameters
    ----------
    kinds : sequence of Push and Gust
    task : Disturbed

    Attributes
    ----------
    next : (kinds, worlds) int64
        Control step of the episode in which the next one starts.
    end : (kinds, worlds) int64
        Control step before which the present one ends.
    force : (kinds, worlds, 3) float64
        Of the present one [N].
    load : (worlds, bodies, 6) float64
        Of all gusts in the last control step: force [N], torque [N m], world frame.

    Raises
    ------
    ValueError
        Something that is no disturbance, or a body that is not there.
    """

    def __init__(self, kinds, task: Disturbed):
        self.kinds, self._task = tuple(kinds) if isinstance(kinds, (list, tuple)) else (kinds,), task
        for kind in self.kinds:
            if not isinstance(kind, (Push, Gust)):
                raise ValueError(f"disturbances holds {kind!r}; allowed are Push and Gust")
            if kind.body >= task.world.body_count:
                raise ValueError(f"body of {kind!r} is {kind.body}; allowed are 0 to {task.world.body_count - 1}")
        shape = (len(self.kinds), task.worlds)
        self.next, self.end = np.full(shape, NEVER), np.zeros(shape, dtype=np.int64)
        self.force, self.load = np.zeros((*shape, 3)), task.world.no_wrench()
        self._push = task.world.no_wrench() if any(isinstance(kind, Push) for kind in self.kinds) else None

    @property
    def arrays(self) -> dict[str, np.ndarray]:
        """Arrays that decide the coming disturbances, without the random generators: views with the worlds first."""
        return {
            "disturbance start": self.next.swapaxes(0, 1), "disturbance end": self.end.swapaxes(0, 1),
            "disturbance force": self.force.swapaxes(0, 1), "disturbance load": self.load,
        }  # fmt: skip

    def begin(self, rows: np.ndarray) -> None:
        """Draw the first disturbances of episodes that begin in worlds `rows`."""
        self.load[rows] = 0.0
        for k, kind in enumerate(self.kinds):
            self.force[k, rows] = self.end[k, rows] = 0
            quiet = kind.every / self._task.control_dt
            self.next[k, rows] = [quiet_steps(quiet, self._task.generators[world].random()) for world in rows]

    def wait_anew(self) -> None:
        """Draw the starts of the next disturbances anew, for a model that must not know them.

        A disturbance starts in each quiet step with the same probability, so waits that go on from now have the same
        distribution.
        """
        for k, kind in enumerate(self.kinds):
            quiet = self._quiet(kind)
            waits = [quiet_steps(quiet, generator.random()) for generator in self._task.generators]
            self.next[k] = np.maximum(self._task.steps, self.end[k]) + waits

    def _quiet(self, kind: Any) -> float:
        """Mean number of quiet control steps between the end of a disturbance and the start of the next."""
        return kind.every / self._task.control_dt - (1.0 if isinstance(kind, Push) else 0.0)

    def due(self) -> np.ndarray:
        """Worlds (n,) int64 in which a disturbance starts in the coming control step."""
        return np.flatnonzero((self.next <= self._task.steps).any(axis=0))

    def act(self) -> tuple[np.ndarray, np.ndarray | None]:
        """Load (worlds, bodies, 6) of the coming control step, and the extra load of its first physics step, if any."""
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
        """Draw a disturbance that starts in a control step, and the start of the next one."""
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
