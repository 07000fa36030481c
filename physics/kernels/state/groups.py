"""Arguments of a step that travel together, as named tuples: switches, arrays of bodies, records of a step.

A switch is None (off) or not (on). Which of two functions is called, or which of two answers given, is chosen by its
type (`physics.compiler.decorators.if_given`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from physics.compiler.decorators import if_given


class WorkQueue(NamedTuple):
    """Worlds that a thread may take, of `physics.kernels.parallel.work_stealing`."""

    turns: np.ndarray  # ranges of worlds of all threads
    taken: np.ndarray  # worlds that this thread has taken


class TimeGrid(NamedTuple):
    """Time interval of a call."""

    steps: int
    substeps: int  # of each step
    h: float  # length of a substep [s]


class BodyArrays(NamedTuple):
    """Bodies of all worlds; rows are those of world 0, then of world 1, and so on."""

    state: np.ndarray  # (rows, STATE_SIZE) columns of `physics.kernels.state.layout`
    params: np.ndarray  # (rows, ...) mass properties, coefficients, columns of fields and laws
    shapes: np.ndarray  # (bodies,) codes of shapes
    gravity: np.ndarray | None  # (worlds, 3) [m/s²]
    wrench: np.ndarray  # (rows, 6) force [N] and torque about the centre of mass [N m], in the world frame


class ContactSwitches(NamedTuple):
    """Switches of a scene's contact."""

    acts: bool | None  # bodies touch walls
    friction: bool | None  # with friction: three unknowns a contact instead of one
    pivots: bool | None  # pivoting is the last resort of the contact solver


class FlightSwitches(NamedTuple):
    """Switches of the free motion of a scene's bodies."""

    gyroscopic: bool | None  # moments of inertia differ
    offset_frame: bool | None  # principal axes are not the body's axes, or its centre is not its centre of mass
    scheme: int | None  # code of a textbook scheme (`physics.kernels.flight.integrators`) instead of the exact flow


class MultibodySwitches(NamedTuple):
    """Switches of bodies that touch each other."""

    friction: bool | None
    flight: FlightSwitches
    ellipsoids: bool | None  # some of them are ellipsoids
    hulls: bool | None  # some of them are hulls


class Records(NamedTuple):
    """Arrays that a step keeps and writes besides the state."""

    memory: np.ndarray  # (rows, ...) contacts of the last stage, for warm starts
    report: np.ndarray  # (worlds, REPORT_SIZE) columns of `physics.kernels.state.layout`
    log: np.ndarray  # (rows, room, EVENT_SIZE) events
    counts: np.ndarray  # (rows,) events of each body


@if_given("switches.friction", False)
def has_friction(switches):
    """True where a group of switches has friction on."""
    return True


@if_given("flight.scheme", True)
def flies_exactly(flight):
    """True unless a textbook scheme moves the bodies."""
    return False
