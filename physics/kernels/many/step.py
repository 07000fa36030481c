"""A step of worlds whose bodies touch each other: the visible list of stages.

A substep of a world is, until its time is used up:

1. find      the contact set where the bodies are (`touch`): what touches or could within the time left;
2. strike    velocities jump where bodies meet (`strike`); what could meet later may approach no faster than its gap
             allows (a speculative contact: nothing passes through anything, however fast);
3. until     the time that can pass before a meeting that matters: one that bounces, or is fast (`strike`);
4. glide     bodies in no contact fly exactly; the others take Moreau's midpoint step (`glide`): half a free drift,
             the contact problem of all of them at the middle, half a free drift;
5. apart     what still overlaps is pushed apart, positions only (`apart`).

Where the scene declares it, what has been at rest for long enough then falls asleep and takes part in none of this, but
for the broad phase, until something wakes it (`sleep`).

The stages are those of `physics.kernels.step`, for a whole world where that has one body.
"""

from __future__ import annotations

from physics.kernels import layout as at
from physics.kernels.body import angular_velocity, bind_body, is_finite, read_state, write_state
from physics.kernels.compiler import inlined, kernel
from physics.kernels.fields.loads import bind_fields, pass_time, set_clock
from physics.kernels.many import memory as kept
from physics.kernels.many.apart import push_apart
from physics.kernels.many.arrays import CONTACTS, LEFT_OUT
from physics.kernels.many.contacts import put
from physics.kernels.many.glide import glide, hold_all_loads
from physics.kernels.many.place import place_bodies
from physics.kernels.many.sleep import all_sleep, doze, sleep_on, wake_world
from physics.kernels.many.strike import strike
from physics.kernels.many.touch import find_contacts

# Cuts of a substep per impact allowed: a meeting is approached from before it, in two or three.
CUTS_PER_IMPACT = 4


@inlined
def note_depth(n, world, report, many):
    """Deepest penetration of the set into the world's report, and contacts for which there was no room."""
    for k in range(n):
        report[world, at.PENETRATION] = max(report[world, at.PENETRATION], -many.gap[k])
    report[world, at.LEFT_OUT] += many.counts[LEFT_OUT]
    many.counts[LEFT_OUT] = 0


@inlined
def mark_touched(n, many):
    """`many.touched`: bodies in a contact of the set."""
    for b in range(many.touched.shape[0]):
        many.touched[b] = 0
    for k in range(n):
        many.touched[many.ends[k, 0]] = 1
        if many.ends[k, 1] >= 0:
            many.touched[many.ends[k, 1]] = 1


@kernel
def substep_world(world, h, friction, gyroscopic, tilted, ellipsoids, hulls, scheme, sleep, memory, report, many):
    """Advance the bodies of one world by h: the stages of the module's list."""
    left, impacts = h, 0
    for cut in range(CUTS_PER_IMPACT * many.settings[0].splits + 1):
        is_last = impacts >= many.settings[0].splits or cut == CUTS_PER_IMPACT * many.settings[0].splits
        hold_all_loads(left, gyroscopic, tilted, many)
        place_bodies(tilted, many)
        find_contacts(left, ellipsoids, hulls, world, sleep, many)
        n = many.counts[CONTACTS]
        note_depth(n, world, report, many)
        n, t, is_impact = strike(n, world, left, is_last, friction, tilted, report, many)
        many.counts[CONTACTS] = n
        if is_impact and not is_last:
            impacts += 1
            continue  # what may be met in the time left is another set now
        mark_touched(n, many)
        if is_last:
            report[world, at.UNRESOLVED] += 1.0
        if t < left:
            report[world, at.SPLITS] += 1.0
        glide(n, world, t, friction, gyroscopic, tilted, scheme, sleep, memory, report, many)
        left -= t
        for b in range(many.now.shape[0]):
            pass_time(t, many.bodies[b])
        if n > 0:
            push_apart(n, tilted, many)
        if not left > 0.0:
            break


@inlined
def world_is_finite(many):
    """Whether every number of every body is."""
    for b in range(many.now.shape[0]):
        if not is_finite(read_state(many.now, b)):
            return False
    return True


@kernel
def step_many(
    first, last, steps, substeps, h, state, params, shapes, gravity, wrench, friction, restitution, gyroscopic,
    tilted, ellipsoids, hulls, scheme, sleep, memory, report, many,
):  # fmt: skip
    """Advance the worlds first <= world < last by `steps` steps of `substeps` substeps of h seconds each.

    A world in which a new state is not finite keeps the last good one, and its report counts the fault.
    """
    bodies = shapes.shape[0]
    for world in range(first, last):
        for c in range(at.REPORT_SIZE):
            report[world, c] = 0.0
        if sleep is not None and sleep_on(world, bodies, wrench, sleep):
            continue
        for b in range(bodies):
            i = world * bodies + b
            bind_body(world, i, shapes[b], params, gravity, wrench, friction, restitution, tilted, many.bodies[b])
            many.lightness[b] = params[i, at.INV_MASS]
            bind_fields(params, i, many.bodies[b])
            write_state(many.now, b, read_state(state, i))
            many.touched[b] = 0
        for k in range(steps * substeps):
            for b in range(bodies):
                set_clock(k * h, many.bodies[b])
            substep_world(
                world, h, friction, gyroscopic, tilted, ellipsoids, hulls, scheme, sleep, memory, report, many
            )
            if not world_is_finite(many):
                report[world, at.FAULTS] += 1.0
                kept.forget(world, memory)
                wake_world(world, bodies, sleep)
                break
            if sleep is not None:
                doze(world, h, sleep, many)
            for b in range(bodies):
                write_state(state, world * bodies + b, read_state(many.now, b))
            if sleep is not None and all_sleep(world, bodies, sleep):
                break
        for b in range(bodies):
            i = world * bodies + b
            _, q, _, L = read_state(state, i)
            put(state, i, at.ANGVEL, angular_velocity(q, L, many.bodies[b], tilted))
