"""Controls of a viewer's session: the user's hand, sliders, accuracy and ghost; kernels compile in the background."""

from __future__ import annotations

import threading
from collections.abc import Callable

import numpy as np

from physics import PRESETS, validation
from rigid_env.viewer.ghost import Ghost
from rigid_env.viewer.interface import Can, Subject
from rigid_env.viewer.run import Run

START, GHOST = "the scene", "the ghost"
"""Names of the background jobs that compile kernels for the start and for the ghost; other jobs have names of
accuracies."""


class Background:
    """One function call in a thread of its own; the thread ends with the program at the latest.

    Parameters
    ----------
    name : str
        Name of the thread.
    work : callable
        Function without arguments.

    Attributes
    ----------
    error : BaseException or None
        Exception that ended the call, if any.
    """

    def __init__(self, name: str, work: Callable[[], None]):
        self.error: BaseException | None = None
        self._work = work
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)
        self._thread.start()

    def _run(self) -> None:
        try:
            self._work()
        except BaseException as error:  # `Controls._poll` reports it
            self.error = error

    @property
    def is_done(self) -> bool:
        """True once the call has ended, also by an exception."""
        return not self._thread.is_alive()

    def join(self) -> None:
        """Wait until the call has ended."""
        self._thread.join()


class Controls:
    """Base of `session.Session`: methods by which a user changes the run of a subject."""

    def __init__(self, subject: Subject):
        self.subject, self.is_playing = subject, False
        self._run, self._note = Run(subject), ""
        self._sliders: dict[str, float] = {}  # values that the user has set
        self._jobs: dict[str, Background] = {}
        self._ghost: Ghost | None = None  # the requested ghost, whose kernel may still compile
        self._ready, self._wanted = {subject.accuracy}, subject.accuracy
        work = subject.rehearsal()
        if work is not None:
            self._jobs[START] = Background(START, work)

    @property
    def can(self) -> Can:
        """Controls that the subject allows."""
        return self.subject.can

    def _needs(self, control: str) -> None:
        if not getattr(self.can, control):
            allowed = ", ".join(name for name, is_on in vars(self.can).items() if is_on) or "none"
            raise ValueError(f"{control} does not act on {self.subject.name}; allowed controls are {allowed}")

    # --- the user's hand ---------------------------------------------------------------------------------------

    def drag(self, body: int, point_body, target) -> None:
        """Pull a body by a spring from now on, until `release`.

        Parameters
        ----------
        body : int
        point_body : (3,) array_like
            Point of the body that the spring is attached to, from its centre of mass, body frame [m].
        target : (3,) array_like
            Other end of the spring, world frame [m].

        Raises
        ------
        ValueError
            No such body, a fixed one, numbers that are not finite, or a subject whose bodies cannot be dragged.
        """
        self._needs("drag")
        self._run.give("drag", self._body(body), _vector(point_body, "point_body"), _vector(target, "target"))

    def release(self) -> None:
        """Remove the spring of `drag`."""
        if self._run.hand.body is not None:
            self._run.give("release")

    def kick(self, body: int, impulse) -> None:
        """Apply an impulse (3,) to a body at its centre of mass in the next step, world frame [N s]."""
        self._needs("drag")
        self._run.give("kick", self._body(body), _vector(impulse, "impulse"))

    def _body(self, body: int) -> int:
        index = validation.index(body, self.subject.world.body_count, "body")
        if self.subject.world.scene.bodies[index].fixed:
            raise ValueError(f"body is {index}, which is fixed; allowed are bodies that are not")
        return index

    # --- sliders -----------------------------------------------------------------------------------------------

    def set_gravity(self, strength: float) -> None:
        """Change the strength of gravity at once, to a number of at least 0 [m/s²]; its direction stays."""
        self._slide("gravity", strength)

    def set_friction(self, mu: float) -> None:
        """Change the friction coefficient of all bodies at once, to a number of at least 0."""
        self._slide("friction", mu)

    def set_restitution(self, e: float) -> None:
        """Change the restitution coefficient of all bodies at once, to a number from 0 to 1."""
        self._slide("restitution", e)

    @property
    def settings(self) -> dict[str, float]:
        """Present values of the sliders that the subject allows: gravity [m/s²], friction, restitution of body 0."""
        return self.subject.settings()

    def _slide(self, name: str, value: float) -> None:
        self._needs(name)
        self._run.give(name, value)
        self._sliders[name] = value

    # --- accuracy ----------------------------------------------------------------------------------------------

    @property
    def accuracy(self) -> str:
        """Name of the accuracy: a preset or ``custom``; empty if the subject is not simulated."""
        return self.subject.accuracy

    def set_accuracy(self, preset: str) -> None:
        """Continue with another preset from the same state, as soon as its kernel is compiled.

        Raises
        ------
        ValueError
            No such preset, or one that this scene does not allow.
        """
        self._needs("accuracy")
        validation.one_of(preset, {**PRESETS, **dict.fromkeys(self._ready)}, "accuracy")
        if preset not in self._ready and preset not in self._jobs:
            self._jobs[preset] = Background(preset, self.subject.prepare(preset))
        self._wanted = preset
        self._switch()

    def _switch(self) -> None:
        if self._wanted != self.accuracy and self._wanted in self._ready:
            self._run.give("accuracy", self._wanted)

    @property
    def ghost_label(self) -> str:
        """Name of the ghost, with its own error if it is only an estimate; empty if there is no ghost."""
        return "" if self._run.ghost is None else self._run.ghost.label

    def set_ghost(self, on: bool) -> None:
        """Show or remove the ghost: the same scene at the accuracy ``reference``, started from the present state.

        The ghost appears when its kernel is compiled.
        """
        if not on:
            self._run.ghost = self._ghost = None
            self._jobs.pop(GHOST, None)
        elif self._ghost is None:
            self._needs("ghost")
            self._ghost = Ghost(self.subject.world)
            self._jobs[GHOST] = Background(GHOST, self._ghost.warm)

    # --- background jobs ---------------------------------------------------------------------------------------

    @property
    def is_compiling(self) -> bool:
        """True while a kernel compiles in the background."""
        return bool(self._jobs)

    def wait(self) -> None:
        """Wait until no kernel compiles in the background."""
        for job in list(self._jobs.values()):
            job.join()
        self._poll()

    def _poll(self) -> None:
        """Apply the results of background jobs that have ended, and report their errors."""
        for name in [name for name, job in self._jobs.items() if job.is_done]:
            error = self._jobs.pop(name).error
            if error is not None:
                self._note = f"{name}: {type(error).__name__}: {error}"
                self.is_playing = self.is_playing and name != START
            elif name == GHOST:
                self._ghost.start(self.subject.world.snapshot())
                self._run.ghost = self._ghost
            elif name != START:
                self._ready.add(name)
                self._switch()


def _vector(value, name: str) -> np.ndarray:
    """Copy of three finite numbers as a (3,) array; `name` names them in an error."""
    return np.array(validation.finite(value, (3,), name))
