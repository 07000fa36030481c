"""Run of a subject: its steps with samples and events, inputs of the user, and the return to earlier moments."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from physics import Event
from rigid_env.viewer.hand import Hand
from rigid_env.viewer.history import History, Input, Samples
from rigid_env.viewer.interface import Subject
from rigid_env.viewer.pace import MICROSECONDS, Cost

MOST_EVENTS = 100_000
"""Events that a run keeps; later ones are left out."""

PATIENCE = 1.0
"""Computing time that a ghost may take to follow the run to an earlier moment [s]; beyond it the ghost starts anew
there."""


class Kept(NamedTuple):
    """State of a run before a step: of the subject, the user's hand and the ghost."""

    subject: Any
    hand: Hand
    ghost: Any


class Run:
    """Run of a subject from its start.

    The run can return to an earlier moment. Later steps stay known there until a new step or input replaces them.

    Parameters
    ----------
    subject : Subject

    Attributes
    ----------
    index : int
        Steps from the start to the present moment.
    samples : Samples
        One sample at the start and one after each known step.
    events : list of Event
        Events of all known steps.
    ghost : Ghost or None
    hand : Hand
        Spring and kicks of the user.
    fault : str
        Message about the last step; empty if there was no fault.
    """

    def __init__(self, subject: Subject):
        self.subject, self.ghost = subject, None
        self._begin()

    def _begin(self) -> None:
        self.index, self.history = 0, History(self.subject.time)
        self.hand, self.cost, self.fault = Hand(), Cost(), ""
        self.samples, self.events = Samples(), []
        self._sample()

    def restart(self, seed: int) -> None:
        """Begin the run anew, with the ghost; after an error in a user's function everything is as before."""
        before = self.subject.snapshot()
        try:
            self.subject.restart(seed)
        except Exception:
            self.subject.restore(before)
            raise
        if self.ghost is not None:
            self.ghost.start(self.subject.world.snapshot())
        self._begin()

    @property
    def known_events(self) -> list[Event]:
        """Copy of the events up to the present moment."""
        return self.events[: self.history.event_counts[self.index]]

    # --- new steps ---------------------------------------------------------------------------------------------

    def take(self) -> None:
        """Take a new step; steps that were known after this moment are forgotten."""
        subject, history = self.subject, self.history
        self._forget()
        if history.is_due(self.index):
            kept = Kept(subject.snapshot(), self.hand.copy(), None if self.ghost is None else self.ghost.snapshot())
            history.keep(self.index, kept)
        interval = subject.interval
        record = self._step()
        self.index += 1
        self.events += subject.events()[: MOST_EVENTS - len(self.events)]
        history.add(subject.time, record, len(self.events))
        if subject.listener is not None:
            self.cost.add(subject.listener.seconds, interval)
            self.fault = subject.listener.fault
        self._follow()
        self._sample()

    def _step(self, record: Any = None) -> Any:
        """Take one step with the user's forces, or repeat the step of a `record`; returns the record of the step."""
        world = self.subject.world
        load = None if world is None else self.hand.load(world, self.subject.interval)
        record = self.subject.step(load, record)
        self.hand.kicks.clear()
        return record

    def _follow(self) -> None:
        """Let the ghost take the step that the subject has just taken; remove a ghost that fails, and set `fault`."""
        if self.ghost is None:
            return
        try:
            self.ghost.follow(self.subject.listener.calls)
        except Exception as error:  # a user's force field fails, or a recorded wrench is not finite
            self.ghost, self.fault = None, f"the ghost stopped: {error}"

    def _sample(self) -> None:
        values = {"time": self.subject.time, "cost": self.cost.value, **self.subject.measure()}
        if self.ghost is not None:
            values["error"], values["angle"] = self.ghost.distance(self.subject.world)
            values["error_of_reference"] = self.ghost.own_error
            values["cost_of_reference"] = self.ghost.cost.value
        self.samples.append(**values)

    def _forget(self) -> None:
        """Forget everything after the present moment; inputs at this moment stay."""
        self.history.forget(self.index)
        self.samples.truncate(self.index + 1)
        del self.events[self.history.event_counts[self.index] :]

    # --- inputs ------------------------------------------------------------------------------------------------

    def give(self, name: str, *arguments: Any) -> None:
        """Apply an input of the user, and note it in the history; after an error nothing has changed.

        Parameters
        ----------
        name : str
            ``drag`` (body, point, target), ``release``, ``kick`` (body, impulse), one of `worlds.SLIDERS` (value), or
            ``accuracy`` (name).
        arguments
            Arguments in the parentheses above.
        """
        done = Input(name, arguments)
        self._apply(done)
        self._forget()
        self.history.inputs.setdefault(self.index, []).append(done)

    def _apply(self, given: Input) -> None:
        name, arguments = given
        if name == "drag":
            self.hand.body, self.hand.point, self.hand.target = arguments
        elif name == "release":
            self.hand.body = None
        elif name == "kick":
            self.hand.kick(*arguments)
        elif name == "accuracy":
            self.subject.switch(*arguments)
            self.cost = Cost()
        else:
            self.subject.set(name, *arguments)
            if self.ghost is not None:
                self.ghost.take_parameters(self.subject.world)

    # --- return to known moments -------------------------------------------------------------------------------

    def go_to(self, index: int, anew: bool = False) -> None:
        """Return to a known moment, bit for bit.

        Parameters
        ----------
        index : int
            Steps from the start to that moment, at most the number of known steps.
        anew : bool
            True if the present state may be wrong, so that a kept state is restored in any case.
        """
        entry = self.history.before(index)
        if entry is None or (index == self.index and not anew):
            return
        first = self.index
        is_following = self.ghost is not None
        if anew or not entry.index <= self.index < index:
            first = entry.index
            self.subject.restore(entry.state.subject)
            self.hand = entry.state.hand.copy()
            is_following = self._put_ghost(entry.state.ghost, index - first)
            self._apply_all(first, entry.inputs)
        self._repeat(first, index, is_following)

    def _repeat(self, first: int, last: int, is_following: bool) -> None:
        """Repeat recorded steps, from the state before step `first` to the state before step `last`.

        `is_following` lets the ghost take them, too; otherwise the ghost starts anew at the end.
        """
        for k in range(first, last):
            self._step(self.history.records[k])
            if is_following:
                self._follow()
            self._apply_all(k + 1)
        self.index = last
        if self.ghost is not None and not is_following:
            self.ghost.start(self.subject.world.snapshot())

    def _apply_all(self, index: int, first: int = 0) -> None:
        for given in self.history.inputs.get(index, [])[first:]:
            self._apply(given)

    def _put_ghost(self, kept: Any, steps: int) -> bool:
        """Restore the ghost's kept state, unless `steps` steps of the ghost take too long; returns whether it did."""
        if self.ghost is None or kept is None:
            return False
        cost = self.ghost.cost.value * self.subject.interval / MICROSECONDS  # computing time of a step [s]
        if steps and not np.nan_to_num(cost) * steps <= PATIENCE:
            return False
        self.ghost.restore(kept)
        return True
