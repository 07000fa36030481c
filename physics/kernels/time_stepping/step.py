"""Time stepping of bodies that meet walls only: advance each body of each world by steps, substeps and stages.

A substep consists of stages: an impact ends a stage, and the next one begins. Each stage has the parts 1 to 6 below,
and part 7 ends a substep. y = (x, q, v, L) is the state, M its mass and inertia, f the load, J the Jacobian of the
contacts, u = J (v, ω) their velocities, p their impulses.

1. Hold loads         f = f(y), held over the stage                                        `held_loads.hold_loads`
2. Find contacts      {i : g_i(x, q) <= slop}, g_i the gap of a feature to a wall          `find_contact_set`
3. Resolve impacts    M Δ(v, ω) = Jᵀ p, u_n⁺ >= -e u_n⁻ ⟂ p_n >= 0, |p_t| <= μ p_n         `resolve_impacts`
4. Limit the stage    to the first t at which a gap g(t) closes: part 5 is tried, and      `advance_to_impact`
                      tried again for a shorter time if a feature has passed a wall
5. Integrate          in the air the exact flow of ẋ = v, q̇ = ½ ω q, M v̇ = f              `fly_stage`
                      in contact Moreau's midpoint step: x, q drift by h/2;                `midpoint_step`
                      M Δ(v, ω) = h f + Jᵀ p, u_n >= target ⟂ p_n >= 0, |p_t| <= μ p_n;
                      x, q drift by h/2
6. Correct positions  x moves along a normal where a feature is deeper than the slop       `keep_out_of_walls`
7. Sleep              a body whose motion stays below a threshold is left out              `falls_asleep`

Part 4 cuts the substep where a feature meets a wall, so that impulses act where and when bodies meet. Three things make
the scheme second order between impacts, and exact on parabolas: this cut, the target velocity of part 5 at the end of
the stage (`target_velocity.set_resting_targets`), and friction against the mean slip of few contacts
(`midpoint_friction`).

Effects that a scene does not have arrive as None, and the compiler removes their code (`decorators.kernel`). Kernels
that take a state and return one are inlined, except those that a step seldom needs (`cold_kernel`): passing a state's
thirteen numbers through memory took a quarter of the time of a block at rest.

References
----------
.. [1] J. J. Moreau, *Unilateral contact and dry friction in finite freedom dynamics*, 1988, for the midpoint step.
"""

from __future__ import annotations

from physics.compiler.decorators import cold_kernel, if_given, inlined, kernel
from physics.kernels.contact_law.compliance import contact_stiffness, correct_spring_depth
from physics.kernels.contact_law.materials import bind_materials
from physics.kernels.contact_law.restitution_energy import lift_conserving_energy
from physics.kernels.contact_solver.solve import rows_per_contact
from physics.kernels.flight.free_flight import integrate_flight
from physics.kernels.forces.energy_budget import has_work_error, limit_energy_gain
from physics.kernels.forces.held_loads import (
    advance_clock,
    bind_fields,
    hold_contact_loads,
    hold_loads,
    hold_mean_loads,
    hold_softened_loads,
    set_clock,
)
from physics.kernels.forces.resolution_limits import is_stiff, report_unresolved_body
from physics.kernels.forces.stiff_flight import subdivide_stiff_flight
from physics.kernels.half_space.conservative_advancement import (
    FAR_TURN,
    MAX_TURNING_CUTS,
    limit_turning_stage,
    may_turn,
)
from physics.kernels.half_space.contact_set import (
    check_penetration,
    collect_wall_contacts,
    feature_gap,
    feature_gap_rate,
    nearest_outside_set,
    project_out_of_walls,
)
from physics.kernels.half_space.persistent_contacts import WALL_MEMORY_COUNT
from physics.kernels.half_space.safe_substeps import count_clear_substeps
from physics.kernels.math.parabolic_root import parabola_crossing_time, second_difference
from physics.kernels.math.quaternion import to_matrix
from physics.kernels.parallel.work_stealing import for_each_world
from physics.kernels.state import layout as at
from physics.kernels.state.body import (
    angular_velocity,
    bind_body,
    clear_report,
    has_finite_loads,
    is_finite,
    read_state,
    report_fault,
    write_state,
)
from physics.kernels.state.contact_law_dispatch import bind_laws
from physics.kernels.state.groups import flies_exactly
from physics.kernels.state.sleeping import falls_asleep, remains_asleep, without_velocities
from physics.kernels.time_stepping.event_log import clear_events, drop_events
from physics.kernels.time_stepping.impact import resolve_impacts
from physics.kernels.time_stepping.midpoint_step import midpoint_step
from physics.kernels.time_stepping.warm_start import add_to_warm_start, store_warm_start

# Largest number of trials for one time of impact: a secant, then parabolas through the last three gaps (usually three).
IMPACT_TRIALS = 16


@inlined
def has_touched(memory, i):
    """True if the body in row i of the contact memory had contacts in its last stage, so that it is near a wall."""
    return memory[i, WALL_MEMORY_COUNT] > 0.0


@inlined
def forget_contacts(memory, i, contacts):
    """Clear row i of the contact memory, of a body that is in flight."""
    if has_touched(memory, i):
        store_warm_start(0, 0, memory, i, 0.0, contacts)


@inlined
def fly_stage(y, h, flight, body):
    """State after a flight of h [s] from y under the held loads; stiff force fields cut the flight into parts."""
    return subdivide_stiff_flight(integrate_flight(y, h, flight, body), y, h, flight, body)


@inlined
def advance_stage(n, y, h, contact, flight, records, scratch):
    """State after one stage of length h [s] from y: a flight if n = 0, else Moreau's midpoint step with n contacts."""
    body = scratch.body
    if n > 0:
        hold_contact_loads(y, h, flight.gyroscopic, flight.offset_frame, body)
        end = midpoint_step(n, y, h, contact, flight, records, scratch)
        if hold_mean_loads(y, end, h, flight.gyroscopic, flight.offset_frame, body):
            end = midpoint_step(n, y, h, contact, flight, records, scratch)
        if is_stiff(body) and has_work_error(y, end, h, flight.offset_frame, body):
            hold_softened_loads(y, h, flight.gyroscopic, flight.offset_frame, body)
            end = midpoint_step(n, y, h, contact, flight, records, scratch)
        return limit_energy_gain(y, end, h, False, flight.offset_frame, body)
    hold_loads(y, h, flight.gyroscopic, flight.offset_frame, body)
    forget_contacts(records.memory, body.i, scratch.contacts)
    return fly_stage(y, h, flight, body)


@inlined
def outside_gap(y, offset_frame, scratch):
    """Smallest gap of all features outside the contact set in the state y [m], and that feature's contact slot."""
    return nearest_outside_set(y[0], to_matrix(y[1]), offset_frame, scratch)


@inlined
def find_contact_set(y, h, offset_frame, memory, scratch):
    """Write the contact set in the state y, for a stage of length h [s], into `scratch.contacts`: (count, depth).

    `depth` is the deepest penetration among the contacts [m].
    """
    return collect_wall_contacts(
        y, angular_velocity(y[1], y[3], scratch.body, offset_frame), h, offset_frame, memory, scratch
    )


@inlined
def has_same_pose(y, z):
    """True if two states have the same position and attitude, to the last bit."""
    return y[0] == z[0] and y[1] == z[1]


@cold_kernel
def keep_out_of_walls(y, offset_frame, scratch):
    """State y, moved out of walls where the body is deeper than the slop, as after turns by radians."""
    return lift_conserving_energy(
        project_out_of_walls(y[0], to_matrix(y[1]), offset_frame, scratch), y, offset_frame, scratch.body
    )


@cold_kernel
def shorten_to_impact(n, y, end, h, contact, flight, records, scratch):
    """Shorten a stage from y, of length h and with the state `end`, to its first impact: (state, time advanced).

    At `end` a feature has passed through a wall. The stage is made again and again, for a shorter time from
    `parabolic_root` of this feature's gap, until the feature is within half a slop of the wall. If another feature is
    through a wall by then, the search continues with that one. The gap of a single feature is smooth in time. The
    smallest gap of all features has kinks, which would mislead the search. Where no method solves the contacts, their
    impulses may jump between two times. Then no state has the feature at the wall, and the last one outside is taken.
    """
    t, low, low_gap, high, high_gap, bend, slot = h, 0.0, 0.0, h, 0.0, 0.0, -1
    low_end = y
    for _ in range(IMPACT_TRIALS):
        gap, nearest = outside_gap(end, flight.offset_frame, scratch)
        if nearest != slot and gap < -0.5 * scratch.body.slop:
            slot, high, high_gap = nearest, t, gap
            low_gap = max(feature_gap(slot, low_end[0], to_matrix(low_end[1]), flight.offset_frame, scratch), 0.0)
            rate = feature_gap_rate(slot, low_end, flight.offset_frame, scratch)
            bend = ((high_gap - low_gap) / (high - low) - rate) / (high - low)
        else:
            if nearest != slot:
                gap = feature_gap(slot, end[0], to_matrix(end[1]), flight.offset_frame, scratch)
            if abs(gap) <= 0.5 * scratch.body.slop:
                break
            bend = second_difference(low, low_gap, t, gap, high, high_gap)
            if gap > 0.0:
                low, low_gap, low_end = t, gap, end
            else:
                high, high_gap = t, gap
        t = low + parabola_crossing_time(low_gap, high_gap, high - low, bend)
        if not t < high:  # nor where low and high are one, and t is not a number
            end, t = low_end, low
            break
        end = advance_stage(n, y, t, contact, flight, records, scratch)
        if has_same_pose(end, y):
            break
    return end, t


@inlined
def advance_to_impact(n, y, h, contact, flight, records, scratch):
    """Advance the state y by a stage of length h, or to the first impact within h: (state, time advanced, is_deep).

    `is_deep` is true if the body may be deeper than the slop in a wall. If a feature outside the contact set has passed
    through a wall at the end, the stage is made again for a shorter time (`shorten_to_impact`, a separate kernel
    because it is seldom needed).
    """
    end = advance_stage(n, y, h, contact, flight, records, scratch)
    if has_same_pose(end, y):
        return end, h, False
    has_passed, is_deep = check_penetration(end[0], to_matrix(end[1]), flight.offset_frame, scratch)
    if scratch.stage.is_last or not has_passed:
        return end, h, is_deep
    end, t = shorten_to_impact(n, y, end, h, contact, flight, records, scratch)
    return end, t, True


@inlined
def substep(y, start, h, contact, flight, records, scratch):
    """State after a substep of h [s] from y: impacts at their times, and flight or contact stages between them.

    The substep begins `start` [s] after the start of the call. When it has used up its cuts at impacts, the rest of it
    is one plastic stage, with contacts wherever the body would pass a wall. Cuts for bodies that turn far
    (`half_space.conservative_advancement`) are counted apart. When these are used up, a body that turns far is treated
    like one that turns little.
    """
    body, stage = scratch.body, scratch.stage
    left, splits, cuts = h, 0, 0
    world = body.world
    stage.is_last = 0
    while True:
        if splits == scratch.settings.splits:
            records.report[world, at.UNRESOLVED] += 1.0
            stage.is_last = 1
        hold_loads(y, left, flight.gyroscopic, flight.offset_frame, body)
        n, depth = find_contact_set(y, left, flight.offset_frame, records.memory, scratch)
        goes_on = False
        if n > 0:
            records.report[world, at.PENETRATION] = max(records.report[world, at.PENETRATION], depth)
            if not stage.is_last and not contact_stiffness(body) > 0.0:
                y, goes_on = resolve_impacts(
                    n, y, start + (h - left), left, contact, flight.offset_frame, records, scratch
                )
        span = left
        is_cut = flies_exactly(flight) and cuts < MAX_TURNING_CUTS and not stage.is_last
        if is_cut and may_turn(y[3], h, FAR_TURN, flight.offset_frame, body):
            span = limit_turning_stage(n, y, h, left, flight.gyroscopic, flight.offset_frame, scratch)
        end, t, is_deep = advance_to_impact(n, y, span, contact, flight, records, scratch)
        if goes_on:
            add_to_warm_start(n, rows_per_contact(contact), records.memory, scratch)
        if t == span and span < left:
            cuts += 1
            if cuts == MAX_TURNING_CUTS:
                records.report[world, at.UNRESOLVED] += 1.0
        else:
            splits += 1
        left -= t
        advance_clock(t, body)
        if is_deep and n > 0 and not contact_stiffness(body) > 0.0:
            end = keep_out_of_walls(end, flight.offset_frame, scratch)
        y = correct_spring_depth(n, y, end, t, flight.offset_frame, records.report, scratch)
        if stage.is_last or not left > 0.0:
            break
        records.report[world, at.SPLITS] += 1.0
    return y


@if_given("contact.acts", 0)
def _clear_substeps(y, clear, h, left, contact, memory, scratch):
    """Number of the next substeps in which the body cannot meet a wall, at most `left`; 0 if it may in the next one.

    `clear` is the number found earlier, minus the substeps taken since. It is returned while it is positive.
    """
    if clear > 0 or has_touched(memory, scratch.body.i):
        return clear
    clear = count_clear_substeps(y[0], y[2], h, left, scratch)
    if clear > 0:
        forget_contacts(memory, scratch.body.i, scratch.contacts)
    return clear


def _fly_substep(y, start, h, clear, contact, flight, records, scratch):
    return fly_stage(y, h, flight, scratch.body)


@if_given("contact.acts", _fly_substep)
def _take_substep(y, start, h, clear, contact, flight, records, scratch):
    """State after a substep of h [s] from y, which begins `start` [s] after the start of the call.

    If `clear` is positive, the body cannot meet a wall in the substep, and flies.
    """
    if clear == 0:
        return substep(y, start, h, contact, flight, records, scratch)
    return fly_stage(y, h, flight, scratch.body)


@inlined
def advance_world(world, grid, bodies, contact, restitution, flight, sleep, records, scratch):
    """Advance each body of a world by `grid.steps` steps; write its state, and the world's report and events.

    Walls are only tested for bodies that could be near one (`count_clear_substeps`), or have just touched one. Sleeping
    bodies are left out; `sleep` is None where the scene does not declare sleep. A body whose new state is not finite
    keeps the old one, and the report counts a fault. Impacts go to `records.log`, if it has room for events, and their
    number to `records.counts`. The groups of arguments are those of `physics.kernels.state.groups`.
    """
    body = scratch.body
    h, count, end = grid.h, bodies.shapes.shape[0], grid.steps * grid.substeps
    clear_report(world, records.report)
    clear_events(world, count, records.log, records.counts)
    for b in range(count):
        i = world * count + b
        if sleep is not None and remains_asleep(i, bodies.wrench, sleep):
            continue
        bind_body(world, i, bodies.shapes[b], bodies, contact.friction, restitution, flight.offset_frame, body)
        if not has_finite_loads(body):
            report_fault(world, b, records.report)
            continue
        bind_fields(bodies.params, i, flight.scheme, body)
        bind_laws(bodies.params, i, bodies.params.shape[1], body)
        bind_materials(bodies.params, i, body)
        y, clear = read_state(bodies.state, i), 0
        for k in range(end):
            set_clock(k * h, body)
            hold_loads(y, h, flight.gyroscopic, flight.offset_frame, body)
            clear = _clear_substeps(y, clear, h, end - k, contact, records.memory, scratch)
            new = _take_substep(y, k * h, h, clear, contact, flight, records, scratch)
            clear = max(clear - 1, 0)
            if not is_finite(new):
                report_fault(world, b, records.report)
                drop_events(i, 1, k * h, records.log, records.counts)
                break
            y = new
            if sleep is not None and falls_asleep(i, y, h, body, sleep):
                y = without_velocities(y)
                break
        report_unresolved_body(not has_same_pose(y, read_state(bodies.state, i)), records.report, body)
        write_state(bodies.state, i, y)
        w = angular_velocity(y[1], y[3], body, flight.offset_frame)
        bodies.state[i, at.ANGVEL], bodies.state[i, at.ANGVEL + 1], bodies.state[i, at.ANGVEL + 2] = w


_advance_worlds = for_each_world(advance_world)


@kernel
def step_worlds(queue, grid, bodies, contact, restitution, flight, sleep, records, scratch):
    """Advance all worlds that the calling thread can take from `queue`, whose bodies meet walls only (`advance_world`).

    `scratch` is the thread's workspace, an array of one record.
    """
    _advance_worlds(queue, (grid, bodies, contact, restitution, flight, sleep, records, scratch[0]))
