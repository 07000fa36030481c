"""Listener of a world's steps: which calls were made, what they took, and what happened in them."""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np

import physics
from physics import Event, Status
from physics.analysis.events import Pair, contact_events, fault_events, last_pushes, logged_events, named

EVENT_ROOM = 128
"""Events per body and call of a step that are told; more are left out."""


class Call(NamedTuple):
    """Call of a world's step.

    Attributes
    ----------
    wrench : (1, bodies, 6) float64
        Force [N] and torque [N m], world frame.
    steps : int
    dt : float
        Length of one [s].
    start : Snapshot or None
        State before the call, where the world was put there from outside.
    past : (1, bodies, 6) float64 or None
        Force and torque that went past an actuator.
    """

    wrench: np.ndarray
    steps: int
    dt: float
    start: physics.Snapshot | None
    past: np.ndarray | None = None


class Listener:
    """Listener of one world, in the place of its recorder (`physics.world.step_listener.StepListener`).

    It must be made before the world is stepped by a `Stepper`, which binds the log of events.

    Parameters
    ----------
    world : World
        Of one world.

    Attributes
    ----------
    calls : list of Call
        Since `begin`, and so are the others.
    events : list of Event
    seconds : float
        Time that the calls took [s].
    penetration, residual : float
        The largest of any call [m], [1].
    fault : str
        Message of the last fault; empty without one.
    pushes : dict
        Contacts after the last call, and when each last pushed: `physics.analysis.events.last_pushes`.
    is_changed : bool
        The world was changed from outside since the last call.
    """

    def __init__(self, world: physics.World):
        self._world = world
        world.make_event_room(EVENT_ROOM)
        world.recorder = self
        self.pushes: dict[Pair, float] = {}
        self.is_changed = False
        self._clock = self._from = 0.0
        self.begin()

    def begin(self) -> None:
        """Forget the calls so far."""
        self.calls: list[Call] = []
        self.events: list[Event] = []
        self.seconds = self.penetration = self.residual = 0.0
        self.fault = ""

    def resume(self, pushes: dict[Pair, float]) -> None:
        """Forget the calls so far: the world was put into a state with these `pushes`, and goes on from there."""
        self.begin()
        self.pushes, self.is_changed = pushes, False

    # --- told by the world ---------------------------------------------------------------------------------

    def changed(self, worlds: np.ndarray | slice) -> None:
        """The world was changed from outside."""
        self.is_changed = True

    def before(self, wrench: np.ndarray, steps: int, dt: float) -> None:
        """A call is about to be made."""
        start = self._world.snapshot() if self.is_changed else None
        self.is_changed = False
        past = None if self._world.actuation is None else self._world.actuation.past
        self.calls.append(Call(wrench.copy(), steps, dt, start, None if past is None else past.copy()))
        self._from = self._world.time
        self._clock = time.perf_counter()

    def after(self) -> None:
        """It has been made."""
        self.seconds += time.perf_counter() - self._clock
        world, report = self._world, self._world.report
        events = logged_events(world, self._from)
        if not world.plan.scheme.logs_all_events:
            before, self.pushes = self.pushes, last_pushes(world, self.pushes, world.time)
            events += contact_events(before, self.pushes, world.time) + fault_events(world, world.time)
        self.events += named(events, world.names)
        self.penetration = max(self.penetration, float(report.penetration[0]))
        self.residual = max(self.residual, float(report.residual[0]))
        if report.status[0] == Status.FAULT:
            self.fault = report.messages()[0]

    def undone(self) -> None:
        """It is none: an exception has put everything back."""
        self.calls.pop()
