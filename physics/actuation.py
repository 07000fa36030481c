"""From the wrench that is asked for to the wrench that acts: the actuator of a world, before its kernel.

A command is held over a step. Delayed, it is a staircase whose treads begin `delay` after the steps in which it was
given; each tread is clipped. Behind it stands the lag τ w' = c - w, which over a tread of length h with command c takes

    w -> c + (w - c) e^(-h/τ),    mean over the tread  c + (w - c) (τ/h) (1 - e^(-h/τ)),

both exact. The kernel holds over a step the mean of w over it: momentum at the end of every step is exact, place and
attitude are of second order in the step, as with anything that is held.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from physics.effects import Actuator
from physics.report import add_report

if TYPE_CHECKING:
    from physics.world import World

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
    """

    def __init__(self, actuator: Actuator, shape: tuple[int, int, int]):
        self.actuator = actuator
        self.applied = np.zeros(shape)
        self._output = np.zeros(shape)  # w
        self._commands: list[tuple[float, np.ndarray]] = []  # those that still count: when given [s], clipped

    def advance(self, world: World, calls: list[Callable[[], None]], wrench: np.ndarray, steps: int, dt: float) -> None:
        """`World.advance` through the actuator: one that remembers is asked at each step."""
        if not self.actuator.remembers:
            self.take(wrench, world.time, dt)
            world.make(calls, steps * dt)
            return
        total = np.zeros_like(world.report_table)
        for _ in range(steps):
            self.take(wrench, world.time, dt)
            world.make(calls, dt)
            add_report(total, world.report_table)
        world.report_table[...] = total

    def take(self, wrench: np.ndarray, start: float, dt: float) -> None:
        """Take the command of the step from `start` over `dt` [s]; `applied` is then what acts in it."""
        command = self._clipped(wrench)
        if not self.actuator.remembers:
            self.applied[...] = command
            return
        treads = self._treads(command, start, dt)
        if len(treads) == 1:
            self.applied[...] = self._follow(treads[0][1], dt)
            return
        total = np.zeros_like(command)
        for length, tread in treads:
            total += length * self._follow(tread, length)
        self.applied[...] = total / dt

    def _clipped(self, wrench: np.ndarray) -> np.ndarray:
        """A copy, with forces and torques no longer than the limits."""
        command = np.array(wrench)
        for first, limit in ((0, self.actuator.limit_force), (3, self.actuator.limit_torque)):
            if limit is not None:
                x, y, z = (command[..., first + c] for c in range(3))
                size = np.sqrt(x * x + y * y + z * z)
                share = np.divide(limit, size, out=np.ones_like(size), where=size > limit)
                command[..., first : first + 3] *= share[..., None]
        return command

    def _treads(self, command: np.ndarray, start: float, dt: float) -> list[tuple[float, np.ndarray]]:
        """(length [s], command) of the staircase from `start` over `dt`; zero before the first command arrives."""
        if self.actuator.delay == 0.0:
            return [(dt, command)]
        self._commands.append((start, command))
        arrivals = [-np.inf, *((given + self.actuator.delay - start) / dt for given, _ in self._commands)]
        commands = [np.zeros_like(self.applied), *(command for _, command in self._commands)]
        edges = [*(_snapped(share) for share in arrivals), 1.0]
        begun = sum(share <= 0.0 for share in edges[:-1]) - 1
        del self._commands[: max(begun - 1, 0)]
        spans = zip(pairwise(min(max(share, 0.0), 1.0) for share in edges), commands)
        return [((end - begin) * dt, command) for (begin, end), command in spans if end > begin]

    def _follow(self, command: np.ndarray, length: float) -> np.ndarray:
        """Let the lag follow a command for a time [s]; the mean of its output meanwhile."""
        if self.actuator.lag == 0.0:
            self._output = command
            return command
        x = length / self.actuator.lag
        gap = self._output - command
        self._output = command + gap * math.exp(-x)
        return command - gap * (math.expm1(-x) / x)

    def forget(self, worlds: np.ndarray) -> None:
        """Let these worlds begin at rest: no output, no commands on their way."""
        self._output = self._output.copy()
        self._output[worlds] = 0.0
        self._commands = [(given, command.copy()) for given, command in self._commands]
        for _, command in self._commands:
            command[worlds] = 0.0

    def kept(self) -> tuple:
        """What decides how it goes on, for `put_back`."""
        return self._output.copy(), [(given, command.copy()) for given, command in self._commands]

    def put_back(self, kept: tuple) -> None:
        """Go on from what `kept` gave."""
        output, commands = kept
        self._output = output.copy()
        self._commands = [(given, command.copy()) for given, command in commands]


def _snapped(share: float) -> float:
    """A share of a step, 0 or 1 where it is so but for rounding."""
    for edge in (0.0, 1.0):
        if abs(share - edge) <= NO_TIME:
            return edge
    return share
