"""Step worlds whose bodies are tied by springs and touch nothing: all bodies of a world advance together.

Springs between bodies make their motions depend on each other, so all of them go from substep to substep together.
`physics.kernels.time_stepping.step` advances each body alone to the end of the call, and
`physics.kernels.multibody.stepping.step` steps bodies that may also touch something.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from physics.compiler.decorators import inlined, kernel
from physics.kernels.flight.free_flight import integrate_flight
from physics.kernels.forces.force_field_dispatch import Term
from physics.kernels.forces.held_loads import bind_fields, set_clock
from physics.kernels.forces.two_body_spring import hold_linked_loads
from physics.kernels.forces.world_energy_budget import (
    limit_world_energy_gain,
    note_stage_energy,
    report_unresolved_bodies,
)
from physics.kernels.parallel.work_stealing import for_each_world
from physics.kernels.state import layout as at
from physics.kernels.state.body import (
    angular_velocity,
    bind_body,
    clear_report,
    find_nonfinite_body,
    find_overloaded_body,
    read_state,
    report_fault,
    write_state,
)
from physics.kernels.time_stepping.spring_coupled_extrapolation import (
    LINKED_STATE_SIZE,
    PLANE_COUNT,
    step_linked_segment,
)
from physics.kernels.time_stepping.workspace import body_fields


class LinkedWorld(NamedTuple):
    """Scratch memory of one thread: the bodies of the world that it steps."""

    body: np.ndarray  # records: parameters and loads, see `workspace.body_fields`
    state: np.ndarray  # columns of `layout`
    touched: np.ndarray  # 0: no body is in contact
    room: np.ndarray  # states and rates of `spring_coupled_extrapolation`
    tolerance: float  # largest error of a step of `spring_coupled_extrapolation`
    most: int  # largest number of such steps in one substep
    fixed: None = None  # no body is fixed (`state.fixed_body`)


def make_linked_world(
    bodies: int, terms: tuple[Term, ...], *, relative_slop: float, tolerance: float, splits: int
) -> LinkedWorld:
    """Make the scratch memory for worlds of `bodies` bodies with the force fields `terms`.

    `relative_slop` is in bounding radii. `splits` is the largest number of extrapolated steps in a substep.
    """
    rows = np.zeros(bodies, np.dtype(body_fields(terms)))
    rows["relative_slop"] = relative_slop
    now, touched, room = (
        np.zeros((bodies, at.STATE_SIZE)),
        np.zeros(bodies, np.int64),
        np.zeros((PLANE_COUNT, bodies, LINKED_STATE_SIZE)),
    )
    return LinkedWorld(rows, now, touched, room, float(tolerance), int(splits))


@kernel
def _substep(h, flight, linked):
    """Advance all bodies of a world by h [s], with the loads of the middle held over the whole substep."""
    hold_linked_loads(h, flight.gyroscopic, flight.offset_frame, linked)
    note_stage_energy(flight.offset_frame, linked, linked.body[0])
    for b in range(linked.state.shape[0]):
        y = integrate_flight(read_state(linked.state, b), h, flight, linked.body[b])
        write_state(linked.state, b, y)
    limit_world_energy_gain(h, 1, flight.offset_frame, linked, linked.body[0])


@inlined
def advance_world(world, grid, bodies, flight, held, events, records, linked):
    """Advance the bodies of a world by `grid.steps` steps; write their states and the world's report.

    One of the switches `held` and `events` is on: with `held` loads are held over each substep, with `events` the
    motion is integrated to a tolerance. If the new state of any body is not finite, all bodies of the world keep the
    last good states, and the report counts a fault.
    """
    h, count = grid.h, bodies.shapes.shape[0]
    clear_report(world, records.report)
    for b in range(count):
        i = world * count + b
        bind_body(world, i, bodies.shapes[b], bodies, None, None, flight.offset_frame, linked.body[b])
        bind_fields(bodies.params, i, flight.scheme, linked.body[b])
        write_state(linked.state, b, read_state(bodies.state, i))
    lost = find_overloaded_body(linked.body)
    if lost >= 0:
        report_fault(world, lost, records.report)
        return
    for k in range(grid.steps * grid.substeps):
        for b in range(count):
            set_clock(k * h, linked.body[b])
        if held is not None:
            _substep(h, flight, linked)
        if events is not None:
            step_linked_segment(world, h, flight.offset_frame, records.report, linked)
        lost = find_nonfinite_body(linked.state)
        if lost >= 0:
            report_fault(world, lost, records.report)
            break
        for b in range(count):
            write_state(bodies.state, world * count + b, read_state(linked.state, b))
    report_unresolved_bodies(records.report, linked, linked.body[0])
    for b in range(count):
        i = world * count + b
        _, q, _, L = read_state(bodies.state, i)
        w = angular_velocity(q, L, linked.body[b], flight.offset_frame)
        bodies.state[i, at.ANGVEL], bodies.state[i, at.ANGVEL + 1], bodies.state[i, at.ANGVEL + 2] = w


_advance_worlds = for_each_world(advance_world)


@kernel
def step_linked(queue, grid, bodies, flight, held, events, records, linked):
    """Advance all worlds that the calling thread can take from `queue`, whose bodies are tied by springs.

    See `advance_world`; `linked` is the thread's scratch memory.
    """
    _advance_worlds(queue, (grid, bodies, flight, held, events, records, linked))
