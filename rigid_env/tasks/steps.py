"""Physics steps of a control step: prepared once, so that each call is cheap."""

from __future__ import annotations

import numpy as np

import physics
from physics.world.report import gravest


class Steps:
    """The `frame_skip` physics steps of a control step.

    Impulses of actions and disturbances act as forces during the first of them. Commands of the agent go through the
    scene's actuator; disturbances do not.

    Parameters
    ----------
    world : physics.World
    frame_skip : int
        Physics steps in a control step.
    has_impulses : bool
        Whether actions contain impulses.
    has_pushes : bool
        Whether there are disturbances that are impulses.
    then : callable, optional
        Work of each thread on the worlds that it has stepped; see `physics.Stepper`.

    Attributes
    ----------
    wrench : (worlds, bodies, 6) float64
        Input: command during all physics steps, force [N] and torque [N m], world frame.
    kick : (worlds, bodies, 6) float64
        Input: further command during the first physics step. Without impulses it is the same array as `wrench`.
    advance : callable
        Takes all physics steps, without disturbances.
    has_first : bool
        Whether the first physics step is a call of its own, so that the world's report leaves it out; see `note_first`.
    """

    def __init__(self, world: physics.World, frame_skip: int, has_impulses: bool, has_pushes: bool = False, then=None):
        self._world, self.has_first = world, (has_impulses or has_pushes) and frame_skip > 1
        self._last = physics.Stepper(world, frame_skip - 1 if self.has_first else frame_skip, then=then)
        self._first = physics.Stepper(world, 1) if self.has_first else None
        self.wrench = np.zeros((world.worlds, world.body_count, 6)) if has_impulses else self._last.wrench
        self.kick = np.zeros_like(self.wrench) if has_impulses else self.wrench
        self._early = np.zeros(world.worlds, dtype=np.int64)
        self.advance = self._advance_with_impulses if has_impulses else self._last

    def _advance_with_impulses(self) -> None:
        self.advance_disturbed(None, None)

    def advance_disturbed(self, load: np.ndarray | None, push: np.ndarray | None) -> None:
        """Take all physics steps under a load, and the first one also under a push, both past the actuators.

        Parameters
        ----------
        load, push : (worlds, bodies, 6) float64 or None
            Force [N] and torque [N m], world frame.
        """
        command = self.wrench.copy()
        first = command if self.kick is self.wrench else command + self.kick
        both = load if push is None else push if load is None else load + push
        try:
            if self._first is not None:
                self._run(self._first, first, both)
                gravest(self._world.report_table, self._early)
                self._world.continue_step()
                self._run(self._last, command, load)
            else:
                self._run(self._last, first, both)
        finally:
            self.wrench[...] = command  # `_run` wrote the sum into this array, if it is the stepper's

    def _run(self, stepper: physics.Stepper, command: np.ndarray, load: np.ndarray | None) -> None:
        """Call a stepper with a command, and with a load that goes past the scene's actuator."""
        actuation = self._world.actuation
        if actuation is None:
            stepper.wrench[...] = command if load is None else command + load
            stepper()
            return
        stepper.wrench[...] = command
        with actuation.passed_by(load):
            stepper()

    def note_first(self, status: np.ndarray) -> None:
        """Write the status of the first physics step into `status` (worlds,), where `status` is OK."""
        np.copyto(status, self._early, where=status == physics.Status.OK)
