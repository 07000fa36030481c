"""Arguments that the kernels of a step pass on together, as named tuples: switches, arrays of bodies, records.

A switch is None (off) or has a value (on). The compiler knows from its type whether it is on, and compiles only the
code for that case (`physics.compiler.decorators.if_given`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from physics.compiler.decorators import if_given


class WorkQueue(NamedTuple):
    """Worlds that a thread may take, for `physics.kernels.parallel.work_stealing`."""

    turns: np.ndarray  # ranges of worlds of all threads
    taken: np.ndarray  # worlds that this thread has taken


class TimeGrid(NamedTuple):
    """Time that one call of a step kernel advances: steps, their substeps, and the length of a substep."""

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
    """Switches of a scene's contact with walls, each None where it is off."""

    acts: bool | None  # bodies touch walls
    friction: bool | None  # with friction: three unknowns a contact instead of one
    pivots: bool | None  # pivoting is the last resort of the contact solver


class FlightSwitches(NamedTuple):
    """Switches of the free motion of a scene's bodies, each None where it is off."""

    gyroscopic: bool | None  # moments of inertia differ
    offset_frame: bool | None  # principal axes are not the body's axes, or its centre is not its centre of mass
    scheme: int | None  # code of a textbook scheme (`physics.kernels.flight.integrators`) instead of the exact flow


class MultibodySwitches(NamedTuple):
    """Switches of scenes whose bodies may touch each other, each None where it is off."""

    friction: bool | None
    flight: FlightSwitches
    ellipsoids: bool | None  # some bodies are ellipsoids
    hulls: bool | None  # some bodies are hulls


class Records(NamedTuple):
    """Arrays, besides the state, that a step writes: warm starts, which it also reads, its report, and its events."""

    memory: np.ndarray  # (rows, ...) contacts of the last stage, for warm starts
    report: np.ndarray  # (worlds, REPORT_SIZE) columns of `physics.kernels.state.layout`
    log: np.ndarray  # (rows, room, EVENT_SIZE) events
    counts: np.ndarray  # (rows,) events of each body


@if_given("switches.friction", False)
def has_friction(switches):
    """True if the switch `friction` is on, for `ContactSwitches` or `MultibodySwitches`."""
    return True


@if_given("flight.scheme", True)
def flies_exactly(flight):
    """True if free motion is the exact flow, False if a textbook scheme (`FlightSwitches.scheme`) moves the bodies."""
    return False
