"""Time stepping of bodies that touch each other: a substep of a world as a list of stages.

The stages are those of `physics.kernels.time_stepping.step`, for all bodies of a world at once. y = (x, q, v, L) are
their states, M their masses and inertias, f the loads, J the Jacobian of the contacts, u their velocities, p their
impulses.

1. Hold loads         f = f(y), held over the stage                                        `hold_all_loads`
2. Find contacts      {i : g_i can close in the time left}: sweep and prune, then the      `find_contacts`
                      narrow phase of each pair
3. Part passing pairs a normal n with n·(a - b) > 0 all through the stage, if one exists   `redirect_passing_pairs`
4. Resolve impacts    M Δ(v, ω) = Jᵀ p, u_n⁺ >= -e u_n⁻ ⟂ p_n >= 0, |p_t| <= μ p_n;        `resolve_impacts`
                      later meetings are speculative: u_n⁺ >= -g/t
5. Limit the stage    to the first t at which bodies meet that bounce, are fast or turn    `safe_stage_length`
                      far
6. Integrate          in the air the exact flow of ẋ = v, q̇ = ½ ω q, M v̇ = f              `midpoint_step`
                      in contact Moreau's midpoint step: x, q drift by h/2;
                      M Δ(v, ω) = h f + Jᵀ p, u_n >= target ⟂ p_n >= 0, |p_t| <= μ p_n;
                      x, q drift by h/2
7. Correct positions  overlaps are pushed apart, positions only                            `correct_positions`
8. Sleep              groups whose motion stays below a threshold fall asleep (in `step`)  `update_sleep`

No body passes through another one, however fast: a speculative contact bounds the speed at which the gap may close.
"""

from __future__ import annotations

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.forces.held_loads import advance_clock
from physics.kernels.half_space.conservative_advancement import MAX_TURNING_CUTS
from physics.kernels.multibody.data.arrays import NUM_CONTACTS, NUM_DROPPED, NUM_STOPPING, WARM_STAGE_LENGTH
from physics.kernels.multibody.data.contact_set import smaller_radius
from physics.kernels.multibody.data.driven_bodies import bind_driven_twists, report_stage_work
from physics.kernels.multibody.data.fixed_bodies import body_at
from physics.kernels.multibody.data.kinematics import update_poses_and_twists
from physics.kernels.multibody.data.lone_body import note_slowness
from physics.kernels.multibody.narrowphase.dispatch import find_contacts
from physics.kernels.multibody.stepping.conservative_advancement import (
    clear_spin_bounds,
    safe_stage_length,
    write_spin_bounds,
)
from physics.kernels.multibody.stepping.constraint_projection import project_constraints
from physics.kernels.multibody.stepping.impact import resolve_impacts
from physics.kernels.multibody.stepping.midpoint_step import hold_all_loads
from physics.kernels.multibody.stepping.passing_pairs import redirect_passing_pairs
from physics.kernels.multibody.stepping.position_correction import correct_positions
from physics.kernels.multibody.stepping.rim_crossing import stage_to_rim
from physics.kernels.multibody.stepping.slip_end import step_to_slip_end
from physics.kernels.state import layout as at
from physics.kernels.state.groups import flies_exactly

# Largest number of cuts of a substep, per impact that it may have. The time to an impact is a lower bound, so that two
# or three cuts lead up to one.
SPLITS_PER_IMPACT = 4

# Largest number of stages of a substep that end with a slip, per body. A pile may rattle between holding and slipping.
SLIP_ENDS_PER_BODY = 2

# Depth from which bodies that a user placed count as overlapping, as a share of the smaller one's bounding radius. The
# same depth in a wall is refused (`physics.world.setters.START_DEPTH`).
OVERLAP_SHARE = 1.0e-2


def _share_of_rigid(many):
    return OVERLAP_SHARE


@if_given("many.compliance", _share_of_rigid)
def _overlap_share(many):
    """Depth from which bodies count as overlapping [smaller bounding radii]: compliant ones may be as deep as that."""
    return 1.0


@inlined
def record_penetration(n, world, memory, report, many):
    """Record the deepest penetration of the n contacts, and the contacts that found no room, in the world's report.

    If `memory` is empty, a user has just placed the bodies: then overlap of two bodies is reported, too.
    """
    is_start = memory[world, WARM_STAGE_LENGTH] == 0.0
    for k in range(n):
        depth = -many.contacts.gap[k]
        report[world, at.PENETRATION] = max(report[world, at.PENETRATION], depth)
        a, b = many.contacts.bodies[k, 0], many.contacts.bodies[k, 1]
        if is_start and body_at(b, many) >= 0 and depth > _overlap_share(many) * smaller_radius(a, b, many):
            report[world, at.OVERLAP] = max(report[world, at.OVERLAP], depth)
    report[world, at.CONTACTS_LEFT_OUT] += many.counts[NUM_DROPPED]
    many.counts[NUM_DROPPED] = 0


@inlined
def mark_touched(n, many):
    """Set `many.bodies.touched` to 1 for bodies in one of the n contacts, to 0 for all others."""
    for b in range(many.bodies.touched.shape[0]):
        many.bodies.touched[b] = 0
    for k in range(n):
        many.bodies.touched[many.contacts.bodies[k, 0]] = 1
        if many.contacts.bodies[k, 1] >= 0:
            many.bodies.touched[many.contacts.bodies[k, 1]] = 1


@kernel
def substep_world(
    world, start, h, switches, sleep, records, many):  # fmt: skip
    """Advance the bodies of one world by a substep of h [s]: the stages of the module's list, repeated until h is over.

    `start` is the time since the start of the call [s], `world` the index of the world. For the other arguments see
    `step.advance_world`.
    """
    left, impacts, cuts, turns, stops = h, 0, 0, 0, 0
    many.settings[0].substep = h
    while True:
        is_last = impacts >= many.settings[0].splits or cuts == SPLITS_PER_IMPACT * many.settings[0].splits
        hold_all_loads(left, switches.flight.gyroscopic, switches.flight.offset_frame, many)
        update_poses_and_twists(switches.flight.offset_frame, many)
        bind_driven_twists(start + (h - left), left, many)
        note_slowness(left, many)
        is_turning = write_spin_bounds(h, switches.flight.offset_frame, many)
        if is_turning and (is_last or turns >= MAX_TURNING_CUTS):
            clear_spin_bounds(many)
            is_turning = False
        find_contacts(left, switches.ellipsoids, switches.hulls, world, sleep, many)
        n = many.counts[NUM_CONTACTS]
        record_penetration(n, world, records.memory, records.report, many)
        if many.counts[NUM_STOPPING] > 0:
            redirect_passing_pairs(
                n, left, switches.flight.gyroscopic, switches.flight.offset_frame, switches.hulls, many
            )
            n = many.counts[NUM_CONTACTS]
        n, t, is_impact = resolve_impacts(n, world, start + (h - left), left, is_last, switches, records, many)
        many.counts[NUM_CONTACTS] = n
        if is_impact and not is_last:
            impacts += 1
            cuts += 1
            continue  # velocities have changed, so that other contacts may close in the time left
        mark_touched(n, many)
        if is_last:
            records.report[world, at.UNRESOLVED] += 1.0
        first = t
        if is_turning and flies_exactly(switches.flight):
            t = safe_stage_length(first, switches.flight.gyroscopic, switches.flight.offset_frame, switches.hulls, many)
        if t < first:
            turns += 1
            if turns == MAX_TURNING_CUTS:
                records.report[world, at.UNRESOLVED] += 1.0
        else:
            cuts += 1
        if t < left:
            records.report[world, at.SPLITS] += 1.0
        t = stage_to_rim(n, world, t, is_last, records.memory, many)
        first, is_whole = t, is_last or stops == SLIP_ENDS_PER_BODY * many.bodies.state.shape[0]
        t = step_to_slip_end(n, world, start + (h - left), t, is_whole, switches, sleep, records, many)
        if t < first:
            stops += 1
        report_stage_work(world, records.report, many)
        left -= t
        for b in range(many.bodies.state.shape[0]):
            advance_clock(t, many.bodies.body[b])
        if n > 0:
            project_constraints(world, t, switches, records.memory, many)
            n = many.counts[NUM_CONTACTS]
            correct_positions(n, switches.flight.offset_frame, many)
        if is_last or not left > 0.0:
            break
