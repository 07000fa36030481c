"""Listener of a world's steps, which records the calls of `World.step`, their computing time and their events."""

from __future__ import annotations

import time
from typing import NamedTuple

import numpy as np

import physics
from physics import Event, Status
from physics.analysis.events import Pair, contact_events, fault_events, last_pushes, logged_events, named

EVENT_ROOM = 128
"""Events that are recorded per body and call; more are left out."""


class Call(NamedTuple):
    """One call of a world's step.

    Attributes
    ----------
    wrench : (1, bodies, 6) float64
        Command: force [N] and torque [N m], world frame.
    steps : int
        Steps of the call.
    dt : float
        Length of one step [s].
    start : Snapshot or None
        State before the call, if the world was changed from outside before it; else None.
    past : (1, bodies, 6) float64 or None
        Force [N] and torque [N m] that act directly on bodies, not through an actuator.
    """

    wrench: np.ndarray
    steps: int
    dt: float
    start: physics.Snapshot | None
    past: np.ndarray | None = None


class Listener:
    """Recorder of the calls of one world's step (`physics.world.step_listener.StepListener`).

    It must be made before any `Stepper` steps the world, since a stepper binds the log of events when it is made.

    Parameters
    ----------
    world : World
        Batch of one world.

    Attributes
    ----------
    calls : list of Call
        Calls since `begin`; the next four attributes are of these calls, too.
    events : list of Event
    seconds : float
        Computing time [s].
    penetration, residual : float
        Largest penetration [m] and residual [1].
    fault : str
        Message of the last fault; empty without one.
    pushes : dict
        Contacts after the last call, and when each last pushed: `physics.analysis.events.last_pushes`.
    is_changed : bool
        True if the world was changed from outside since the last call.
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
        """Forget all recorded calls, with their computing time, events and faults."""
        self.calls: list[Call] = []
        self.events: list[Event] = []
        self.seconds = self.penetration = self.residual = 0.0
        self.fault = ""

    def resume(self, pushes: dict[Pair, float]) -> None:
        """Forget the calls so far, after the world was restored to a state with these `pushes`."""
        self.begin()
        self.pushes, self.is_changed = pushes, False

    # --- called by the world -------------------------------------------------------------------------------

    def changed(self, worlds: np.ndarray | slice) -> None:
        """Note that the world was changed from outside."""
        self.is_changed = True

    def before(self, wrench: np.ndarray, steps: int, dt: float) -> None:
        """Record a call of the world's step that is about to be made."""
        start = self._world.snapshot() if self.is_changed else None
        self.is_changed = False
        past = None if self._world.actuation is None else self._world.actuation.past
        self.calls.append(Call(wrench.copy(), steps, dt, start, None if past is None else past.copy()))
        self._from = self._world.time
        self._clock = time.perf_counter()

    def after(self) -> None:
        """Record computing time, events and faults of the call that has just been made."""
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
        """Remove the last call, after an exception in it has restored the world."""
        self.calls.pop()
