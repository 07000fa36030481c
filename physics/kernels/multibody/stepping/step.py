"""Step of worlds whose bodies touch each other: substeps, each of them a list of stages (`substep`).

If the plan gives an error tolerance instead of a number of substeps, each substep is cut into parts that meet the
tolerance (`adaptive_substep`). If the scene declares sleep, groups of bodies that have been at rest for long enough
fall asleep (`data.sleeping`). Sleeping bodies only take part in the broad phase, until something wakes them.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined, kernel
from physics.kernels.contact_law.materials import bind_wall_coefficients
from physics.kernels.forces.held_loads import bind_fields, set_clock
from physics.kernels.forces.world_energy_budget import report_unresolved_bodies
from physics.kernels.multibody.data.contact_set import put_vector
from physics.kernels.multibody.data.driven_bodies import (
    bind_motions,
    motion_column,
    write_driven_velocities,
)
from physics.kernels.multibody.data.parts import acting_bodies, bind_parts
from physics.kernels.multibody.data.sleeping import is_staying_asleep, is_world_asleep, update_sleep, wake_world
from physics.kernels.multibody.data.warm_start import clear_warm_start
from physics.kernels.multibody.stepping.adaptive_substep import step_with_error_control
from physics.kernels.multibody.stepping.still_bodies import place_still_bodies
from physics.kernels.multibody.stepping.substep import substep_world
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
from physics.kernels.state.contact_law_dispatch import bind_laws
from physics.kernels.state.fixed_body import clear_loads, is_fixed
from physics.kernels.time_stepping.event_log import clear_events, drop_events


@inlined
def advance_world(world, grid, arrays, switches, restitution, kept, sleep, records, many):
    """Advance a world by `grid.steps` steps, and write its new state, report and events.

    Parameters
    ----------
    world : int
        Index of the world.
    grid : TimeGrid
        Numbers of steps and substeps, length of a substep.
    arrays : BodyArrays
        States, parameters and loads of all worlds.
    switches : MultibodySwitches
        Effects that are compiled in.
    restitution : None or not None
        None if the scene declares no restitution.
    kept : WorldSnapshots or None
        Room for snapshots; None without error control.
    sleep : Sleep or None
        None if the scene declares no sleep.
    records : Records
        Warm starts, reports, and logs of impacts. `records.counts` counts impacts even if the log has no room.
    many : BodiesWorkspace
        Scratch memory.

    If a new state is not finite, the world keeps the last good one, and its report counts a fault.
    """
    state, params, shapes, wrench = arrays.state, arrays.params, arrays.shapes, arrays.wrench
    memory, report, log, counts = records.memory, records.report, records.log, records.counts
    h, offset_frame = grid.h, switches.flight.offset_frame
    bodies = shapes.shape[0]
    clear_report(world, report)
    clear_events(world, bodies, log, counts)
    if sleep is not None and is_staying_asleep(world, wrench, sleep, many):
        return
    for b in range(bodies):
        i = world * bodies + b
        bind_body(world, i, shapes[b], arrays, switches.friction, restitution, offset_frame, many.bodies.body[b])
        if is_fixed(b, many.bodies):
            clear_loads(many.bodies.body[b])
        many.bodies.inv_mass[b] = params[i, at.INV_MASS]
        bind_fields(params, i, switches.flight.scheme, many.bodies.body[b])
        bind_wall_coefficients(params, i, many.bodies.body[b])
        bind_laws(params, i, motion_column(params, many), many.bodies.body[b])
        write_state(many.bodies.state, b, read_state(state, i))
        many.bodies.touched[b] = 0
    bind_parts(many)
    bind_motions(params, world * bodies, many)
    place_still_bodies(offset_frame, many)
    lost = max(find_overloaded_body(acting_bodies(many).body), find_nonfinite_body(many.bodies.state))
    if lost >= 0:
        report_fault(world, lost, report)
        clear_warm_start(world, memory)
        wake_world(world, bodies, sleep)
        return
    for k in range(grid.steps * grid.substeps):
        if kept is not None:
            step_with_error_control(world, k * h, h, switches, kept, sleep, records, many)
        else:
            for b in range(bodies):
                set_clock(k * h, many.bodies.body[b])
            substep_world(world, k * h, h, switches, sleep, records, many)
        lost = find_nonfinite_body(many.bodies.state)
        if lost >= 0:
            report_fault(world, lost, report)
            clear_warm_start(world, memory)
            drop_events(world, bodies, k * h, log, counts)
            wake_world(world, bodies, sleep)
            break
        if sleep is not None:
            update_sleep(world, h, kept, sleep, memory, many)
        for b in range(bodies):
            write_state(state, world * bodies + b, read_state(many.bodies.state, b))
        if sleep is not None and is_world_asleep(world, sleep, many):
            break
    report_unresolved_bodies(report, acting_bodies(many), many.bodies.body[0])
    for b in range(bodies):
        i = world * bodies + b
        _, q, _, L = read_state(state, i)
        put_vector(state, i, at.ANGVEL, angular_velocity(q, L, many.bodies.body[b], offset_frame))
    write_driven_velocities(state, world * bodies, many)


_advance_worlds = for_each_world(advance_world)


@kernel
def step_many(queue, grid, arrays, switches, restitution, kept, sleep, records, many):
    """Advance, by `advance_world`, each world that no other thread has taken from the work queue."""
    _advance_worlds(queue, (grid, arrays, switches, restitution, kept, sleep, records, many))
