"""Actuator of a world: it turns the commanded wrench into the acting wrench, before the kernel runs.

A command holds for a step. Commands over time form a staircase, with a tread for each command; with a delay a tread
begins `delay` after its step began. The lengths of a tread's force and torque are limited. The acting wrench w then
follows the command c with the lag τ w' = c - w. Over a tread of length h the exact solution is

    w -> c + (w - c) e^(-h/τ),    mean over the tread  c + (w - c) (τ/h) (1 - e^(-h/τ)).

The kernel applies the mean of w over a step throughout that step. So momentum is exact at the end of every step, and
position and attitude are of second order in the length of the step.

A delayed command is stored with its age, not with the time at which it was given: ages round the same in all batches,
whatever the times at which their worlds began. Loads that are no commands, such as gusts, bypass the actuator:
`Actuation.passed_by`.
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

# A tread shorter than this share of the step is a rounding error of the times between which it lies, and is left out.
NO_TIME = 1e-9


class Actuation:
    """The state of an `Actuator` for a batch of worlds.

    Parameters
    ----------
    actuator : Actuator
        The effect of the scene, with delay, limits and lag.
    shape : tuple of int
        Shape of the wrenches, (worlds, bodies, 6).

    Attributes
    ----------
    applied : (worlds, bodies, 6) float64
        Acting wrench of the next step: force [N], torque [N m], world frame; written in place by `apply`.
    output : (worlds * bodies, 6) float64
        Wrench w that the lag has reached at the end of the last step [N, N m].
    past : (worlds, bodies, 6) float64 or None
        Loads that bypass the actuator in the next steps: force [N], torque [N m], world frame.
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
        """Advance a batch by `steps` steps of `dt` [s] under a commanded wrench (worlds, bodies, 6).

        An actuator with lag or delay is applied before each step. One without is applied once, and the kernel makes
        all steps in one call. `calls` are the kernel's bound calls. The report covers all steps.
        """
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
        """Add a load (worlds, bodies, 6) [N, N m], behind the actuator, to all steps within the ``with`` block."""
        self.past = load
        try:
            yield
        finally:
            self.past = None

    def apply(self, wrench: np.ndarray, dt: float) -> None:
        """Pass the commanded wrench (worlds, bodies, 6) of a step of `dt` [s] through the actuator into `applied`."""
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
        """Treads of the delayed commands within a step of `dt` [s], in order: share of the step, and command.

        Before the first command arrives the command is zero. Commands that no later step needs are forgotten.
        """
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
        """Reset the actuators of these worlds (indices): zero output, and zero for all commands not yet arrived."""
        if len(worlds) == self._shape[0]:
            self._late = []
        for rows in (self.output, *(command for _, command in self._late)):
            rows.reshape(self._shape)[worlds] = 0.0

    def kept(self, worlds: np.ndarray | None = None) -> tuple:
        """Copy the state of the actuators of these worlds (indices; None: all), for the methods `reinstate...`.

        Returns
        -------
        tuple
            Output (k * bodies, 6), and the list of delayed commands, each as (age [s], command (k * bodies, 6)).
        """
        if worlds is None:
            return self.output.copy(), [(age, command.copy()) for age, command in self._late]
        output, late = self.output, self._late
        return self._rows(output, worlds).reshape(-1, 6), [
            (age, self._rows(command, worlds).reshape(-1, 6)) for age, command in late
        ]

    def reinstate(self, kept: tuple) -> None:
        """Restore the state of all worlds, as the method `kept` returned it."""
        output, late = kept
        self.output[...] = output
        self._late = [(age, command.copy()) for age, command in late]

    def reinstate_worlds(self, kept: tuple, source: np.ndarray, worlds: np.ndarray) -> None:
        """Restore the actuators of some worlds from a state that the method `kept` returned.

        Parameters
        ----------
        kept : tuple
            State, possibly of another batch of the same scene.
        source : (k,) int64
            Indices of worlds within `kept`.
        worlds : (k,) int64
            Indices of the worlds of this batch that get these states. Other worlds keep their commands; their delayed
            commands and the restored ones are merged by age.
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
        """Copy the rows (k, bodies, 6) of the worlds with these indices from a table (worlds * bodies, 6)."""
        return table.reshape(-1, *self._shape[1:])[worlds]


def _held(staircase: list[tuple[float, np.ndarray]], age: float) -> np.ndarray | None:
    """Youngest of the commands (age [s], command), oldest first, that is at least `age` old; None if there is none."""
    return next((command for each, command in reversed(staircase) if each >= age), None)


def _snapped(share: float) -> float:
    """Round a share of a step to 0 or 1 if it is within `NO_TIME` of it; else return it unchanged."""
    for edge in (0.0, 1.0):
        if abs(share - edge) <= NO_TIME:
            return edge
    return share
