"""A step of worlds whose bodies touch each other: the visible list of stages.

A substep of a world is, until its time is used up:

1. find      the contact set where the bodies are (`touch.find_contacts`): what touches or could within the time left;
2. impact    velocities jump where bodies meet (`strike`); what could meet later may approach no faster than its gap
             allows (a speculative contact: nothing passes through anything, however fast);
3. until     the time that can pass before a meeting that matters: one that bounces, or is fast (`time_until_meeting`);
4. glide     bodies in no contact fly exactly; the others take Moreau's midpoint step (`glide`): half a free drift, the
             contact problem of all of them at the middle, half a free drift;
5. apart     what still overlaps is pushed apart, positions only (`apart.push_apart`).

The stages are those of `physics.kernels.step`, for a whole world where that has one body.
"""

from __future__ import annotations

import math

from physics.kernels import layout as at
from physics.kernels import quaternion as qt
from physics.kernels.body import angular_velocity, bind_body, is_finite, read_state, write_state
from physics.kernels.compiler import inlined, kernel
from physics.kernels.contact import CLOSING_SHARE, UNSEEN
from physics.kernels.fields.loads import bind_fields, hold_contact_loads, hold_loads, pass_time, set_clock
from physics.kernels.flight import drift
from physics.kernels.many import memory as kept
from physics.kernels.many.apart import push_apart
from physics.kernels.many.arrays import CONTACTS, LEFT_OUT
from physics.kernels.many.contacts import matrix, minus, pair_slop, plus, put, refresh, vector
from physics.kernels.many.place import place_bodies, place_body
from physics.kernels.many.solve import solve_contacts
from physics.kernels.many.touch import find_contacts
from physics.kernels.step import coast

# A meeting is fast where it would close this share of the smaller body's radius in the time left: it is then met in
# time, not stopped in front of. A quarter of it: the error of the place where a plastic meeting acts.
FAST_SHARE = 0.1

# Cuts of a substep per impact allowed: a meeting is approached from before it, in two or three.
CUTS_PER_IMPACT = 4

# What a free rotation may add to the bound of a point's acceleration, ω² r: its angular velocity changes on the way.
TURNING_MARGIN = 2.0

FAR = 1.0e300


@inlined
def add_impulses(n, many):
    """Momenta of the bodies after the contact impulses; v from the solve, L + Σ r x p."""
    for k in range(n):
        p = qt.transposed_matvec(matrix(many.frame, k), vector(many.impulse, k, 0))
        a, b = many.ends[k, 0], many.ends[k, 1]
        put(many.now, a, at.ANGMOM, plus(vector(many.now, a, at.ANGMOM), 1.0, qt.cross(vector(many.arm, k, 0), p)))
        put(many.now, a, at.LINVEL, vector(many.twist, a, 0))
        if b >= 0:
            put(many.now, b, at.ANGMOM, plus(vector(many.now, b, at.ANGMOM), -1.0, qt.cross(vector(many.arm, k, 3), p)))
            put(many.now, b, at.LINVEL, vector(many.twist, b, 0))


@inlined
def note_solve(world, solved, tolerance, report):
    """Add one contact solve (iterations, residual, method) to the world's report."""
    sweeps, residual, method = solved
    report[world, at.SOLVES] += 1.0
    report[world, at.ITERATIONS] += sweeps
    report[world, at.RESIDUAL] = max(report[world, at.RESIDUAL], residual)
    report[world, at.SOLVER] = max(report[world, at.SOLVER], float(method))
    if not residual <= tolerance:
        report[world, at.UNCONVERGED] += 1.0


# --- impact ----------------------------------------------------------------------------------------------------


@inlined
def _acceleration(k, many):
    """Bound for the relative acceleration of a contact's points without contact [m/s²]."""
    a, b = many.ends[k, 0], many.ends[k, 1]
    if b < 0:
        return many.bodies[a].acceleration
    return many.bodies[a].acceleration + many.bodies[b].acceleration


@inlined
def bounces(k, h, many):
    """Whether contact k would leave again for longer than `rest_share` of h after an impact at its speed now."""
    least = many.settings[0].rest_share * _acceleration(k, many) * h
    return many.bounce[k] > 0.0 and -many.bounce[k] * many.speed[k] > least


@inlined
def is_meeting(k, h, many):
    """Whether contact k is still apart and to be met in time: it bounces, or is fast."""
    a, b = many.ends[k, 0], many.ends[k, 1]
    if not (many.gap[k] > pair_slop(a, b, many) and many.speed[k] < 0.0):
        return False
    radius = many.bodies[a].radius
    if b >= 0:
        radius = min(radius, many.bodies[b].radius)
    return bounces(k, h, many) or -many.speed[k] * h > FAST_SHARE * radius


@inlined
def aim_impact(n, h, is_last, many):
    """Targets of an impact, and whether there is one; see `physics.kernels.contact.aim_impact`.

    What approaches no faster than loads make it within `rest_share` of the step is left to the resting stage.
    """
    is_impact = False
    for k in range(n):
        slop = pair_slop(many.ends[k, 0], many.ends[k, 1], many)
        gap, speed, goal = many.gap[k], many.speed[k], 0.0
        slow = max(slop / h, many.settings[0].rest_share * _acceleration(k, many) * h)
        if gap > slop:
            goal = -gap / h
            if not is_last and is_meeting(k, h, many):
                goal = -FAR
            elif goal - speed > slow:
                is_impact = True
        elif bounces(k, h, many):
            goal, is_impact = -many.bounce[k] * speed, True
        elif -speed > slow:
            is_impact = True
        put(many.target, k, 0, (goal, 0.0, 0.0))
        put(many.impulse, k, 0, (0.0, 0.0, 0.0))
    return is_impact


@inlined
def leave_out_the_free(n, many):
    """Drop the contacts that have no target from the set: they are not met in this stage. Returns what is left."""
    left = 0
    for k in range(n):
        if many.target[k, 0] > -FAR:
            if left < k:
                kept.copy_contact(k, left, many)
            left += 1
    return left


@kernel
def strike(n, world, h, is_last, friction, tilted, report, many):
    """Velocities after the impulses of the contacts that approach; nothing where none does. Contacts in the set."""
    is_impact = aim_impact(n, h, is_last, many)
    meeting = time_until_meeting(n, h, is_last, many)
    n = leave_out_the_free(n, many)
    if not is_impact:
        return n, meeting, False
    solved = solve_contacts(n, friction, many)
    add_impulses(n, many)
    note_solve(world, solved, many.settings[0].tolerance, report)
    return n, meeting, True


@inlined
def time_until_meeting(n, h, is_last, many):
    """Time until the first of the meetings that matter, at the latest h [s]: never too late.

    Two points approach by no more than s t + a t²/2 with a the bound of their acceleration by loads and turning, so
    that the gap lasts at least until t = 2 gap/(s + √(s² + 2 a gap)).
    """
    first = h
    if is_last:
        return first
    for k in range(n):
        if not is_meeting(k, h, many):
            continue
        a, b, s = many.ends[k, 0], many.ends[k, 1], -many.speed[k]
        w = vector(many.twist, a, 3)
        bound = _acceleration(k, many) + TURNING_MARGIN * qt.dot(w, w) * many.bodies[a].radius
        if b >= 0:
            w = vector(many.twist, b, 3)
            bound += TURNING_MARGIN * qt.dot(w, w) * many.bodies[b].radius
        first = min(first, 2.0 * many.gap[k] / (s + math.sqrt(s * s + 2.0 * bound * many.gap[k])))
    return first


# --- the stage between impacts ---------------------------------------------------------------------------------


@inlined
def drift_body(b, h, gyroscopic, tilted, many):
    """Body b after half a free drift: position and attitude at constant momenta."""
    x, q, v, L = read_state(many.now, b)
    write_state(many.now, b, (plus(x, h, v), drift(q, L, many.bodies[b], h, gyroscopic, tilted), v, L))


@inlined
def _centripetal(b, k, first, many):
    """ω x (ω x r) of one end of contact k, world frame [m/s²]."""
    w = vector(many.twist, b, 3)
    return qt.cross(w, qt.cross(w, vector(many.arm, k, first)))


@inlined
def aim_rest(n, h, many):
    """Targets of the resting stage over h, with gaps at its middle; see `physics.kernels.contact.aim_rest`.

    A contact that was apart at the start may close what is left of its gap at the middle in the half that follows.
    """
    half = 0.5 * h
    for k in range(n):
        a, b = many.ends[k, 0], many.ends[k, 1]
        slop = pair_slop(a, b, many)
        c = _centripetal(a, k, 0, many)
        if b >= 0:
            c = minus(c, _centripetal(b, k, 3, many))
        t = qt.matvec(matrix(many.frame, k), (-half * c[0], -half * c[1], -half * c[2]))
        if many.gap[k] > slop:
            t = (t[0] - many.gap[k] / half, t[1], t[2])
        elif many.gap[k] > 0.0:
            t = (t[0] - CLOSING_SHARE * many.gap[k] / h, t[1], t[2])
        negligible = max(many.settings[0].tolerance * _acceleration(k, many) * h, UNSEEN * slop / h)
        if max(abs(t[0]), max(abs(t[1]), abs(t[2]))) <= negligible:
            t = (0.0, 0.0, 0.0)
        put(many.target, k, 0, t)


@inlined
def hold_all_loads(h, gyroscopic, tilted, many):
    """Hold the loads of the middle of a stage of length h for every body; nothing where there are no fields."""
    for b in range(many.now.shape[0]):
        if many.touched[b] == 1:
            hold_contact_loads(read_state(many.now, b), h, gyroscopic, tilted, many.bodies[b])
        else:
            hold_loads(read_state(many.now, b), h, gyroscopic, tilted, many.bodies[b])


@kernel
def glide(n, world, h, friction, gyroscopic, tilted, scheme, memory, report, many):
    """Every body after h: exact flight, or Moreau's midpoint step with the n contacts of the set."""
    half = 0.5 * h
    hold_all_loads(h, gyroscopic, tilted, many)
    for b in range(many.now.shape[0]):
        if many.touched[b] == 0:
            write_state(many.now, b, coast(read_state(many.now, b), h, gyroscopic, tilted, scheme, many.bodies[b]))
            continue
        drift_body(b, half, gyroscopic, tilted, many)
        place_body(b, tilted, many)
    if n == 0:
        kept.forget(world, memory)
        return
    refresh(many)
    aim_rest(n, h, many)
    for b in range(many.now.shape[0]):
        if many.touched[b] == 1:
            body = many.bodies[b]
            a, torque = vector_of(body.free_acceleration), vector_of(body.torque)
            put(many.now, b, at.LINVEL, plus(vector(many.now, b, at.LINVEL), h, a))
            put(many.now, b, at.ANGMOM, plus(vector(many.now, b, at.ANGMOM), h, torque))
            put(many.twist, b, 0, vector(many.now, b, at.LINVEL))
            q, L = read_state(many.now, b)[1], vector(many.now, b, at.ANGMOM)
            put(many.twist, b, 3, angular_velocity(q, L, body, tilted))
    kept.load(n, world, h, friction, memory, many)
    solved = solve_contacts(n, friction, many)
    add_impulses(n, many)
    note_solve(world, solved, many.settings[0].tolerance, report)
    kept.store(n, world, h, memory, many)
    for b in range(many.now.shape[0]):
        if many.touched[b] == 1:
            drift_body(b, half, gyroscopic, tilted, many)


@inlined
def vector_of(a):
    """The three numbers of an array."""
    return (a[0], a[1], a[2])


# --- substep and step ------------------------------------------------------------------------------------------


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
def substep_world(world, h, friction, gyroscopic, tilted, scheme, memory, report, many):
    """Advance the bodies of one world by h: the stages of the module's list."""
    left, impacts = h, 0
    for cut in range(CUTS_PER_IMPACT * many.settings[0].splits + 1):
        is_last = impacts >= many.settings[0].splits or cut == CUTS_PER_IMPACT * many.settings[0].splits
        hold_all_loads(left, gyroscopic, tilted, many)
        place_bodies(tilted, many)
        find_contacts(left, many)
        n = many.counts[CONTACTS]
        note_depth(n, world, report, many)
        n, t, is_impact = strike(n, world, left, is_last, friction, tilted, report, many)
        many.counts[CONTACTS] = n
        mark_touched(n, many)
        if is_last:
            report[world, at.UNRESOLVED] += 1.0
        if is_impact:
            impacts += 1
        if t < left:
            report[world, at.SPLITS] += 1.0
        glide(n, world, t, friction, gyroscopic, tilted, scheme, memory, report, many)
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
    tilted, scheme, memory, report, many,
):  # fmt: skip
    """Advance the worlds first <= world < last by `steps` steps of `substeps` substeps of h seconds each.

    A world in which a new state is not finite keeps the last good one, and its report counts the fault.
    """
    bodies = shapes.shape[0]
    for world in range(first, last):
        for c in range(at.REPORT_SIZE):
            report[world, c] = 0.0
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
            substep_world(world, h, friction, gyroscopic, tilted, scheme, memory, report, many)
            if not world_is_finite(many):
                report[world, at.FAULTS] += 1.0
                kept.forget(world, memory)
                break
            for b in range(bodies):
                write_state(state, world * bodies + b, read_state(many.now, b))
        for b in range(bodies):
            i = world * bodies + b
            _, q, _, L = read_state(state, i)
            put(state, i, at.ANGVEL, angular_velocity(q, L, many.bodies[b], tilted))
