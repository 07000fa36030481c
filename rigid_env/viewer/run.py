"""Run of a subject: steps with their samples and events, inputs of the user, and the way back."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from physics import Event
from rigid_env.viewer.hand import Hand
from rigid_env.viewer.history import History, Input, Samples
from rigid_env.viewer.interface import Subject
from rigid_env.viewer.pace import MICROSECONDS, Cost

MOST_EVENTS = 100_000
"""Events that are kept; later ones are left out."""

PATIENCE = 1.0
"""Time that a ghost may take to follow to a moment of the past [s]; a slower one starts anew there."""


class Kept(NamedTuple):
    """State before a step."""

    subject: Any
    hand: Hand
    ghost: Any


class Run:
    """Run of a subject from its start, or from where it was restarted.

    The future of a moment is known until something else is done there: a step or an input.

    Parameters
    ----------
    subject : Subject

    Attributes
    ----------
    index : int
        Steps from the start to now.
    samples : Samples
        One at the start and one after each step.
    events : list of Event
        Up to the latest moment that is known.
    ghost : Ghost or None
    hand : Hand
    fault : str
        Message about the last step; empty if all was well.
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
        """Begin anew; the ghost goes along. After an error of a user's function all is as it was."""
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
        """Events up to the present moment, a copy."""
        return self.events[: self.history.event_counts[self.index]]

    # --- onward ------------------------------------------------------------------------------------------------

    def take(self) -> None:
        """Take a new step; what came after this moment is forgotten."""
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
        """One step of the subject, with the hand in it."""
        world = self.subject.world
        load = None if world is None else self.hand.load(world, self.subject.interval)
        record = self.subject.step(load, record)
        self.hand.kicks.clear()
        return record

    def _follow(self) -> None:
        """Let the ghost take the step, too; one that cannot goes away."""
        if self.ghost is None:
            return
        try:
            self.ghost.follow(self.subject.listener.calls)
        except Exception as error:  # of a user's field, or a recorded wrench that is not finite
            self.ghost, self.fault = None, f"the ghost stopped: {error}"

    def _sample(self) -> None:
        values = {"time": self.subject.time, "cost": self.cost.value, **self.subject.measure()}
        if self.ghost is not None:
            values["error"], values["angle"] = self.ghost.distance(self.subject.world)
            values["error_of_reference"] = self.ghost.own_error
            values["cost_of_reference"] = self.ghost.cost.value
        self.samples.append(**values)

    def _forget(self) -> None:
        """Forget all that came after this moment; inputs that were given at it stay."""
        self.history.forget(self.index)
        self.samples.truncate(self.index + 1)
        del self.events[self.history.event_counts[self.index] :]

    # --- inputs ------------------------------------------------------------------------------------------------

    def give(self, name: str, *arguments: Any) -> None:
        """Do something that belongs to the run, and note it; after an error nothing has changed.

        Parameters
        ----------
        name : str
            ``drag`` (body, point, target), ``release``, ``kick`` (body, impulse), one of `worlds.SLIDERS` (value), or
            ``accuracy`` (name).
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

    # --- back --------------------------------------------------------------------------------------------------

    def go_to(self, index: int, anew: bool = False) -> None:
        """Be at a known moment, bit for bit as it was.

        Parameters
        ----------
        index : int
            Steps from the start, up to the latest.
        anew : bool
            The present state is not to be trusted.
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
        """Take recorded steps again, from the state at `first`."""
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
        """Let the ghost go on from what was kept of it; False: it starts anew where the run goes to."""
        if self.ghost is None or kept is None:
            return False
        cost = self.ghost.cost.value * self.subject.interval / MICROSECONDS  # of a step [s]
        if steps and not np.nan_to_num(cost) * steps <= PATIENCE:
            return False
        self.ghost.restore(kept)
        return True
