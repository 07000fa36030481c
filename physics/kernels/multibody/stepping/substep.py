"""A substep of a world whose bodies touch each other: the visible list of stages.

The world goes, until the time of the substep is used up, through

1. find      the contact set where the bodies are (`touch`): what touches or could within the time left;
2. strike    velocities jump where bodies meet (`impact`); what could meet later may approach no faster than its gap
             allows (a speculative contact: nothing passes through anything, however fast);
3. until     the time that can pass before a meeting that matters: one that bounces, or is fast (`impact`);
4. glide     bodies in no contact fly exactly; the others take Moreau's midpoint step (`midpoint_step`): half a free
drift,
             the contact problem of all of them at the middle, half a free drift;
5. apart     what still overlaps is pushed apart, positions only (`position_correction`).

The stages are those of `physics.kernels.time_stepping.step`, for a whole world where that has one body.
"""

from __future__ import annotations

from physics.kernels.compile.decorators import inlined, kernel
from physics.kernels.forces.held_loads import advance_clock
from physics.kernels.half_space.conservative_advancement import MAX_TURNING_CUTS
from physics.kernels.multibody.data.arrays import NUM_CONTACTS, NUM_DROPPED, WARM_STAGE_LENGTH
from physics.kernels.multibody.data.kinematics import update_poses_and_twists
from physics.kernels.multibody.narrowphase.dispatch import find_contacts
from physics.kernels.multibody.stepping.conservative_advancement import (
    clear_spin_bounds,
    safe_stage_length,
    write_spin_bounds,
)
from physics.kernels.multibody.stepping.impact import resolve_impacts
from physics.kernels.multibody.stepping.midpoint_step import hold_all_loads, midpoint_step
from physics.kernels.multibody.stepping.position_correction import correct_positions
from physics.kernels.state import layout as at

# Cuts of a substep per impact allowed: a meeting is approached from before it, in two or three.
SPLITS_PER_IMPACT = 4

# Bodies put into each other deeper than this share of the smaller one's bounding radius overlap: as for walls
# (`physics.world.setters.START_DEPTH`), which refuse it.
OVERLAP_SHARE = 1.0e-2


@inlined
def record_penetration(n, world, memory, report, many):
    """Deepest penetration of the set into the world's report, and contacts for which there was no room.

    Nothing is remembered, not even the length of a stage, where the bodies were put: what overlaps there is told.
    """
    is_start = memory[world, WARM_STAGE_LENGTH] == 0.0
    for k in range(n):
        depth = -many.contacts.gap[k]
        report[world, at.PENETRATION] = max(report[world, at.PENETRATION], depth)
        if is_start and many.contacts.bodies[k, 1] >= 0:
            radius = min(
                many.bodies.work[many.contacts.bodies[k, 0]].radius,
                many.bodies.work[many.contacts.bodies[k, 1]].radius,
            )
            if depth > OVERLAP_SHARE * radius:
                report[world, at.OVERLAP] = max(report[world, at.OVERLAP], depth)
    report[world, at.CONTACTS_LEFT_OUT] += many.counts[NUM_DROPPED]
    many.counts[NUM_DROPPED] = 0


@inlined
def mark_touched(n, many):
    """`many.bodies.touched`: bodies in a contact of the set."""
    for b in range(many.bodies.touched.shape[0]):
        many.bodies.touched[b] = 0
    for k in range(n):
        many.bodies.touched[many.contacts.bodies[k, 0]] = 1
        if many.contacts.bodies[k, 1] >= 0:
            many.bodies.touched[many.contacts.bodies[k, 1]] = 1


@kernel
def substep_world(
    world, start, h, friction, gyroscopic, tilted, ellipsoids, hulls, scheme, sleep, memory, report, many, log, counts
):  # fmt: skip
    """Advance the bodies of one world by h, `start` after the call [s]: the stages of the module's list."""
    left, impacts, cuts, turns = h, 0, 0, 0
    while True:
        is_last = impacts >= many.settings[0].splits or cuts == SPLITS_PER_IMPACT * many.settings[0].splits
        hold_all_loads(left, gyroscopic, tilted, many)
        update_poses_and_twists(tilted, many)
        is_turning = write_spin_bounds(h, tilted, many)
        if is_turning and (is_last or turns >= MAX_TURNING_CUTS):
            clear_spin_bounds(many)
            is_turning = False
        find_contacts(left, ellipsoids, hulls, world, sleep, many)
        n = many.counts[NUM_CONTACTS]
        record_penetration(n, world, memory, report, many)
        n, t, is_impact = resolve_impacts(
            n, world, start + (h - left), left, is_last, friction, tilted, report, many, log, counts
        )  # fmt: skip
        many.counts[NUM_CONTACTS] = n
        if is_impact and not is_last:
            impacts += 1
            cuts += 1
            continue  # what may be met in the time left is another set now
        mark_touched(n, many)
        if is_last:
            report[world, at.UNRESOLVED] += 1.0
        first = t
        if scheme is None:  # noqa: SIM102 (a branch of its own is what the compiler prunes)
            if is_turning:
                t = safe_stage_length(first, gyroscopic, tilted, hulls, many)
        if t < first:
            turns += 1
            if turns == MAX_TURNING_CUTS:
                report[world, at.UNRESOLVED] += 1.0
        else:
            cuts += 1
        if t < left:
            report[world, at.SPLITS] += 1.0
        midpoint_step(n, world, t, friction, gyroscopic, tilted, scheme, sleep, memory, report, many)
        left -= t
        for b in range(many.bodies.state.shape[0]):
            advance_clock(t, many.bodies.work[b])
        if n > 0:
            correct_positions(n, tilted, many)
        if is_last or not left > 0.0:
            break
