"""Session: a subject that is being played, with its history, samples, the user's hand and a ghost."""

from __future__ import annotations

import time as clock
from dataclasses import replace

from physics import Event, validation
from rigid_env.viewer.controls import START, Controls
from rigid_env.viewer.history import Samples
from rigid_env.viewer.interface import Look, Subject
from rigid_env.viewer.pace import Pace

BUDGET = 0.05
"""Computing time after which a call of `Session.advance` takes no further step [s]."""


class Session(Controls):
    """Player of a subject; used from one thread only.

    Kernels compile in the background, while `is_compiling` is True. Until the kernel for the start is compiled, the run
    stays at its start. Until another kernel is compiled, the run continues without it. An error of the simulation
    pauses the run, and its text is in `message`.

    Parameters
    ----------
    subject : Subject
        Subject from `rigid_env.viewer.subject.open_subject`, which only one session may use at a time.

    Attributes
    ----------
    subject : Subject
    is_playing : bool
        Whether `advance` takes steps.
    """

    def __init__(self, subject: Subject):
        super().__init__(subject)
        self._pace = Pace()

    # --- present state -----------------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        return self.subject.time

    @property
    def span(self) -> tuple[float, float]:
        """First and last time [s] that `seek` can go to."""
        times, end = self._run.history.times, self.subject.end
        return times[0], times[-1] if end is None else end

    @property
    def seed(self) -> int:
        """Seed of the run."""
        return self.subject.seed

    @property
    def speed(self) -> float:
        """Simulated seconds per real second."""
        return self._pace.speed

    @speed.setter
    def speed(self, value: float) -> None:
        self._pace.speed = float(validation.positive(value, (), "speed"))

    @property
    def samples(self) -> Samples:
        """Samples of the run: one at the start and one after each known step."""
        return self._run.samples

    @property
    def events(self) -> list[Event]:
        """Copy of the events up to the present time."""
        return self._run.known_events

    @property
    def message(self) -> str:
        """Text of one line for the user: an error, a compilation in progress, a delay, or a message of the subject."""
        if self._note:
            return self._note
        compiling = f"compiling {', '.join(self._jobs)} ..." if self._jobs else ""
        return "; ".join(filter(None, (compiling, self._pace.message, self.subject.message)))

    def look(self) -> Look:
        """Everything to draw of the present state, with the user's spring and the ghost."""
        run, subject = self._run, self.subject
        drag = None if subject.world is None else run.hand.ends(subject.world)
        ghost = None if run.ghost is None else run.ghost.frame()
        return replace(subject.look(), drag=drag, ghost=ghost)

    # --- time --------------------------------------------------------------------------------------------------

    def play(self) -> None:
        """Let `advance` take steps from now on."""
        self.is_playing, self._note = True, ""
        self._pace.stop()

    def pause(self) -> None:
        """Let `advance` take no steps."""
        self.is_playing = False

    def step(self) -> bool:
        """Take one step; returns False without a step at the end, while the scene compiles, and after an error."""
        self._poll()
        self._note = ""
        return self._take()

    def advance(self, seconds: float) -> int:
        """Take the steps that are due after `seconds` of real time; returns their number.

        Steps that are not taken within `BUDGET` are dropped, and `message` says that the run cannot keep up.
        """
        self._poll()
        if not self.is_playing or START in self._jobs:
            return 0
        pace, subject = self._pace, self.subject
        pace.owe(seconds)
        limit, wanted, count = clock.perf_counter() + BUDGET, pace.due, 0
        while self.is_playing and (subject.is_over or pace.is_due(subject.interval)):
            if count and clock.perf_counter() > limit:
                pace.leave_out(wanted)
                return count
            interval = 0.0 if subject.is_over else subject.interval
            if self._take():
                pace.due -= interval
                count += 1
        pace.keep_up()
        return count

    def seek(self, time: float) -> None:
        """Go to the latest known moment that is not after `time` [s], bit for bit.

        A subject with a known end also takes new steps up to `time`. At an earlier moment, later ones stay known until
        a step or an input there replaces them.
        """
        time = validation.number(time, "time")
        self._poll()
        self._note = ""
        self._pace.stop()
        run = self._run
        self._safely(lambda: run.go_to(run.history.index_at(time)))
        if self.subject.end is None or run.index != run.history.last:
            return
        while not self.subject.is_over and self.time + self.subject.interval <= time * (1.0 + 1e-12) + 1e-12:
            if not self._take():
                break

    def reset(self, seed: int | None = None) -> None:
        """Restart the run, and keep the sliders' values; if a user's function fails, `message` holds its error instead.

        Parameters
        ----------
        seed : int, optional
            Seed of the first episode and of random actions; None: the same as before.

        Raises
        ------
        ValueError
            A value that is no seed.
        """
        seed = self.seed if seed is None else validation.index(seed, 2**32, "seed")
        self._poll()
        self._note = ""
        self._pace.stop()
        if not self._safely(lambda: self._run.restart(seed)):
            return
        for name, value in self._sliders.items():
            self._run.give(name, value)

    def _take(self) -> bool:
        """Take one step, and show a fault of the step as the message; returns False if no step was taken."""
        if START in self._jobs:
            return False
        if self.subject.is_over:
            self.is_playing, self._note = False, "the end"
            return False
        if not self._safely(self._run.take):
            return False
        if self._run.fault:
            self.is_playing, self._note = False, self._run.fault
        return True

    def _safely(self, work) -> bool:
        """Call a function that may call a user's code; an error pauses the run and restores the present moment.

        Returns False after an error.
        """
        try:
            work()
        except Exception as error:
            self.is_playing, self._note = False, f"{type(error).__name__}: {error}"
            self._run.go_to(self._run.index, anew=True)
            return False
        return True
