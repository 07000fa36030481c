"""Actuator of a world: it turns the commanded wrench into the acting one, before the kernel.

A command is held over a step. Delayed, it is a staircase whose treads begin `delay` after the steps in which it was
given; each tread is clipped. Behind it stands the lag τ w' = c - w, which over a tread of length h with command c takes

    w -> c + (w - c) e^(-h/τ),    mean over the tread  c + (w - c) (τ/h) (1 - e^(-h/τ)),

both exact. The kernel holds over a step the mean of w over it: momentum at the end of every step is exact, place and
attitude are of second order in the step, as with anything that is held.

A command is known by its age. Times since the start of a batch would round otherwise in a batch whose worlds begin at
other times. Loads that are no commands, such as a gust, go past the actuator: `Actuation.passed_by`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from physics.kernels.forces.actuator_lag import apply_actuator_lag, clamp_command
from physics.scene.effects import Actuator
from physics.world.batch import Batch
from physics.world.report import add_report

if TYPE_CHECKING:
    from physics.parallel.bound_call import BoundCall

# Treads shorter than this share of the step are rounding of the times they lie between.
NO_TIME = 1e-9


class Actuation:
    """The state of an `Actuator` for a batch of worlds.

    Parameters
    ----------
    actuator : Actuator
    shape : tuple of int
        (worlds, bodies, 6).

    Attributes
    ----------
    applied : (worlds, bodies, 6) float64
        What acts in the next step: force [N], torque [N m], world frame; renewed in place.
    output : (worlds * bodies, 6) float64
        Wrench that the lag has reached.
    past : (worlds, bodies, 6) float64 or None
        Loads that go past the actuator in the next steps: force [N], torque [N m], world frame.
    """

    def __init__(self, actuator: Actuator, shape: tuple[int, int, int]):
        self.actuator = actuator
        self.applied = np.zeros(shape)
        self._shape = shape
        self.output = self._nothing()
        self._command = self._nothing()  # of this step, clipped
        self._late: list[tuple[float, np.ndarray]] = []  # delayed commands that still count, oldest first: age [s]
        self.past: np.ndarray | None = None

    def _nothing(self) -> np.ndarray:
        return np.zeros((self._shape[0] * self._shape[1], 6))

    def advance(self, world: Batch, calls: list[BoundCall], wrench: np.ndarray, steps: int, dt: float) -> None:
        """Make `World.advance` through the actuator; one with a memory is called at each step."""
        if steps == 1 or not self.actuator.remembers:
            self.apply(wrench, dt)
            world.make(calls, steps * dt)
            return
        total = np.zeros_like(world.report_table)
        for k in range(steps):
            if k > 0:
                world.continue_step()
            self.apply(wrench, dt)
            world.make(calls, dt)
            add_report(total, world.report_table)
        world.report_table[...] = total

    @contextmanager
    def passed_by(self, load: np.ndarray | None) -> Iterator[None]:
        """Add a load (worlds, bodies, 6) past the actuator in the steps of the block."""
        self.past = load
        try:
            yield
        finally:
            self.past = None

    def apply(self, wrench: np.ndarray, dt: float) -> None:
        """Take the command of a step of `dt` [s]; `applied` is then the acting wrench."""
        if self.actuator.delay > 0.0:
            self._command = self._nothing()
        self._command[...] = wrench.reshape(-1, 6)
        limits = (self.actuator.limit_force, self.actuator.limit_torque)
        clamp_command(self._command, *(np.inf if limit is None else limit for limit in limits))
        applied = self.applied.reshape(-1, 6)
        for k, (share, tread) in enumerate(self._treads(dt)):
            gone, kept = 1.0, 0.0
            if self.actuator.lag > 0.0:
                x = share * dt / self.actuator.lag
                gone = -math.expm1(-x)
                kept = gone / x
            apply_actuator_lag(tread, gone, kept, share, k == 0, self.output, applied)
        if self.past is not None:
            self.applied += self.past

    def _treads(self, dt: float) -> list[tuple[float, np.ndarray]]:
        """Staircase of commands over a step of `dt`: (share of the step, command); zero before the first command."""
        if self.actuator.delay == 0.0:
            return [(1.0, self._command)]
        late = [*self._late, (0.0, self._command)]
        arrivals = [-np.inf, *(_snapped((self.actuator.delay - age) / dt) for age, _ in late)]
        commands = [self._nothing(), *(command for _, command in late)]
        begun = sum(share <= 0.0 for share in arrivals) - 1
        self._late = [(age + dt, command) for age, command in late[max(begun - 1, 0) :]]
        edges = [min(max(share, 0.0), 1.0) for share in (*arrivals, 1.0)]
        return [(end - begin, command) for (begin, end), command in zip(pairwise(edges), commands) if end > begin]

    def forget(self, worlds: np.ndarray) -> None:
        """Reset these worlds: no output, no commands on their way."""
        if len(worlds) == self._shape[0]:
            self._late = []
        for rows in (self.output, *(command for _, command in self._late)):
            rows.reshape(self._shape)[worlds] = 0.0

    def kept(self, worlds: np.ndarray | None = None) -> tuple:
        """State of the actuators of some worlds, or of all, for `reinstate` and `reinstate_worlds`."""
        if worlds is None:
            return self.output.copy(), [(age, command.copy()) for age, command in self._late]
        output, late = self.output, self._late
        return self._rows(output, worlds).reshape(-1, 6), [
            (age, self._rows(command, worlds).reshape(-1, 6)) for age, command in late
        ]

    def reinstate(self, kept: tuple) -> None:
        """Restore a state from `kept` of all worlds."""
        output, late = kept
        self.output[...] = output
        self._late = [(age, command.copy()) for age, command in late]

    def reinstate_worlds(self, kept: tuple, source: np.ndarray, worlds: np.ndarray) -> None:
        """Restore `worlds` (k,) from the worlds `source` (k,) of a state from `kept`.

        Parameters
        ----------
        kept : tuple
        source, worlds : (k,) int64
            If `worlds` are all there are, nothing of the batch's own commands is left.
        """
        output, theirs = kept
        self.output.reshape(self._shape)[worlds] = self._rows(output, source)
        own = [] if len(worlds) == self._shape[0] else self._late
        near = NO_TIME * self.actuator.delay
        ages = [age for age, _ in own]
        ages += [age for age, _ in theirs if all(abs(age - known) > near for known in ages)]
        self._late = []
        for age in sorted(ages, reverse=True):
            held, taken = _held(own, age), _held(theirs, age - near)
            command = self._nothing() if held is None else held.copy()
            command.reshape(self._shape)[worlds] = 0.0 if taken is None else self._rows(taken, source)
            self._late.append((age, command))

    def _rows(self, table: np.ndarray, worlds: np.ndarray) -> np.ndarray:
        """Copied rows (k, bodies, 6) of some worlds in a table (worlds * bodies, 6)."""
        return table.reshape(-1, *self._shape[1:])[worlds]


def _held(staircase: list[tuple[float, np.ndarray]], age: float) -> np.ndarray | None:
    """Youngest command of a staircase that is at least as old as this [s]; None without one."""
    return next((command for each, command in reversed(staircase) if each >= age), None)


def _snapped(share: float) -> float:
    """Share of a step, set to 0 or 1 where it is so to rounding."""
    for edge in (0.0, 1.0):
        if abs(share - edge) <= NO_TIME:
            return edge
    return share
