"""Physics steps of one control step: prepared once, taken often."""

from __future__ import annotations

import numpy as np

import physics
from physics.world.report import gravest


class Steps:
    """The `frame_skip` physics steps of a control step.

    Where a task has impulses, they act as a force during the first of them.

    Parameters
    ----------
    world : physics.World
    frame_skip : int
    has_impulses : bool
    then : callable, optional
        What each thread does with the worlds that it has stepped; see `physics.Stepper`.

    Attributes
    ----------
    wrench : (worlds, bodies, 6) float64
        To be written: force [N] and torque [N m] of all steps.
    kick : (worlds, bodies, 6) float64
        To be written: of the first step besides. The same array as `wrench` without impulses.
    take : callable
        Takes the steps.
    has_first : bool
        The first step is one of its own, of which the world's report does not tell: see `note_first`.
    """

    def __init__(self, world: physics.World, frame_skip: int, has_impulses: bool, then=None):
        self._world, self.has_first = world, has_impulses and frame_skip > 1
        self._last = physics.Stepper(world, frame_skip - 1 if self.has_first else frame_skip, then=then)
        self._first = physics.Stepper(world, 1) if self.has_first else None
        self.wrench = np.zeros((world.worlds, world.body_count, 6)) if has_impulses else self._last.wrench
        self.kick = np.zeros_like(self.wrench) if has_impulses else self.wrench
        self._early = np.zeros(world.worlds, dtype=np.int64)
        self.take = self._take_with_impulses if has_impulses else self._last

    def _take_with_impulses(self) -> None:
        if self._first is not None:
            np.add(self.wrench, self.kick, out=self._first.wrench)
            self._first()
            gravest(self._world.report_table, self._early)
            self._last.wrench[...] = self.wrench
        else:
            np.add(self.wrench, self.kick, out=self._last.wrench)
        self._last()

    def note_first(self, status: np.ndarray) -> None:
        """Write into `status` (worlds,) what the first step came to, where it is OK otherwise."""
        np.copyto(status, self._early, where=status == physics.Status.OK)
