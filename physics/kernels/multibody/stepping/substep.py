"""Time stepping of bodies that touch each other: a substep of a world as a list of stages.

The stages are those of `physics.kernels.time_stepping.step`, for all bodies of a world at once. y = (x, q, v, L) are
their states, M their masses and inertias, f the loads, J the Jacobian of the contacts, u their velocities, p their
impulses.

1. Hold loads         f = f(y), held over the stage                                        `hold_all_loads`
2. Find contacts      {i : g_i <= what the time left can close}: sweep and prune, then the `find_contacts`
                      narrow phase of each pair
3. Part passing pairs n such that n·(a - b) > 0 all through the stage, where there is one  `redirect_passing_pairs`
4. Resolve impacts    M Δ(v, ω) = Jᵀ p, u_n⁺ >= -e u_n⁻ ⟂ p_n >= 0, |p_t| <= μ p_n;        `resolve_impacts`
                      later meetings are speculative: u_n⁺ >= -g/t
5. Limit the stage    the first t at which bodies meet that bounce, are fast, or turn far  `safe_stage_length`
6. Integrate          in the air the exact flow of ẋ = v, q̇ = ½ ω q, M v̇ = f              `midpoint_step`
                      in contact Moreau's midpoint step: x, q drift by h/2;
                      M Δ(v, ω) = h f + Jᵀ p, u_n >= target ⟂ p_n >= 0, |p_t| <= μ p_n;
                      x, q drift by h/2
7. Correct positions  overlaps are pushed apart, positions only                            `correct_positions`
8. Sleep              groups whose motion stays below a threshold are left out (`step`)    `update_sleep`

No body passes through another one, however fast: a speculative contact bounds the speed at which the gap may close.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined, kernel
from physics.kernels.forces.held_loads import advance_clock
from physics.kernels.half_space.conservative_advancement import MAX_TURNING_CUTS
from physics.kernels.multibody.data.arrays import NUM_CONTACTS, NUM_DROPPED, NUM_STOPPING, WARM_STAGE_LENGTH
from physics.kernels.multibody.data.kinematics import update_poses_and_twists
from physics.kernels.multibody.narrowphase.dispatch import find_contacts
from physics.kernels.multibody.stepping.conservative_advancement import (
    clear_spin_bounds,
    safe_stage_length,
    write_spin_bounds,
)
from physics.kernels.multibody.stepping.impact import resolve_impacts
from physics.kernels.multibody.stepping.midpoint_step import hold_all_loads, midpoint_step
from physics.kernels.multibody.stepping.passing_pairs import redirect_passing_pairs
from physics.kernels.multibody.stepping.position_correction import correct_positions
from physics.kernels.state import layout as at
from physics.kernels.state.groups import flies_exactly

# Cuts of a substep per impact allowed: a meeting is approached from before it, in two or three.
SPLITS_PER_IMPACT = 4

# Bodies put into each other deeper than this share of the smaller one's bounding radius overlap: as for walls
# (`physics.world.setters.START_DEPTH`), which refuse it.
OVERLAP_SHARE = 1.0e-2


@inlined
def record_penetration(n, world, memory, report, many):
    """Record the set's deepest penetration in the world's report, and the number of contacts without room.

    After bodies were placed by a user the memory is empty, even of a stage's length; their overlap is reported.
    """
    is_start = memory[world, WARM_STAGE_LENGTH] == 0.0
    for k in range(n):
        depth = -many.contacts.gap[k]
        report[world, at.PENETRATION] = max(report[world, at.PENETRATION], depth)
        if is_start and many.contacts.bodies[k, 1] >= 0:
            radius = min(
                many.bodies.body[many.contacts.bodies[k, 0]].radius,
                many.bodies.body[many.contacts.bodies[k, 1]].radius,
            )
            if depth > OVERLAP_SHARE * radius:
                report[world, at.OVERLAP] = max(report[world, at.OVERLAP], depth)
    report[world, at.CONTACTS_LEFT_OUT] += many.counts[NUM_DROPPED]
    many.counts[NUM_DROPPED] = 0


@inlined
def mark_touched(n, many):
    """Mark bodies in a contact of the set in `many.bodies.touched`."""
    for b in range(many.bodies.touched.shape[0]):
        many.bodies.touched[b] = 0
    for k in range(n):
        many.bodies.touched[many.contacts.bodies[k, 0]] = 1
        if many.contacts.bodies[k, 1] >= 0:
            many.bodies.touched[many.contacts.bodies[k, 1]] = 1


@kernel
def substep_world(
    world, start, h, switches, sleep, records, many):  # fmt: skip
    """Advance the bodies of one world by h, `start` after the call [s]: the stages of the module's list."""
    left, impacts, cuts, turns = h, 0, 0, 0
    many.settings[0].substep = h
    while True:
        is_last = impacts >= many.settings[0].splits or cuts == SPLITS_PER_IMPACT * many.settings[0].splits
        hold_all_loads(left, switches.flight.gyroscopic, switches.flight.offset_frame, many)
        update_poses_and_twists(switches.flight.offset_frame, many)
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
            continue  # what may be met in the time left is another set now
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
        midpoint_step(n, world, t, switches, sleep, records, many)
        left -= t
        for b in range(many.bodies.state.shape[0]):
            advance_clock(t, many.bodies.body[b])
        if n > 0:
            correct_positions(n, switches.flight.offset_frame, many)
        if is_last or not left > 0.0:
            break
