"""Copy of a task before a control step, from which it is restored if a user's function raises an error."""

from __future__ import annotations

import numpy as np

from physics.undo import Undo
from rigid_env.tasks.task_parts import Stepped


class StepUndo:
    """Memory for a copy of everything that a control step changes.

    Parameters
    ----------
    task : Stepped
        Task whose arrays are copied.
    """

    def __init__(self, task: Stepped):
        self._task, world = task, task.world
        disturbed = () if task.disturbed is None else task.disturbed.arrays.values()
        motions = [world.params] if task.is_driving else []
        changing = [world.state, world.memory, world.report_table, world.sleep, task.action, task.previous_action,
                    task.status, task.wrench, task.record, task.outcome, task.obs, *motions,
                    *task.memory_arrays.values(), *task.own_arrays().values(),
                    *disturbed]  # fmt: skip
        self._kept = [(array, np.empty_like(array)) for array in changing if array.size]
        self._time, self._clock, self._actuation = 0.0, 0, None
        self._generators: dict[int, dict] = {}

    def keep(self) -> Undo:
        """Copy everything that the coming control step changes; returns the method `undo`."""
        task = self._task
        for array, kept in self._kept:
            kept[...] = array
        self._time, self._clock = task.world.time, task.clock
        if task.world.actuation is not None:
            self._actuation = task.world.actuation.kept()
        if task.disturbed is not None:
            due = task.disturbed.due().tolist()
            self._generators = {world: task.generators[world].bit_generator.state for world in due}
        return self.undo

    def undo(self) -> None:
        """Restore the task as it was at the last call of `keep`."""
        task = self._task
        for array, kept in self._kept:
            array[...] = kept
        task.world.time, task.clock = self._time, self._clock
        task.world.forget_impacts()
        if self._actuation is not None:
            task.world.actuation.reinstate(self._actuation)
        for world, state in self._generators.items():
            task.generators[world].bit_generator.state = state
