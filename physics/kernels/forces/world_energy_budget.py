"""Energy budget of a stiff stage in a world of many bodies (`energy_budget`), for the energy of all bodies together.

Springs and contacts carry energy from body to body, so only the sum is limited. The excess is taken from the motion of
all bodies. If they are held by each other only, it is taken from their motion relative to their common centre of mass,
so that they keep their momentum.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.forces.energy_budget import (
    ENERGY_ROUNDING,
    UNRESOLVED_GAIN_SHARE,
    constant_loads,
    potential_energy,
)
from physics.kernels.forces.field_loads import field_state
from physics.kernels.forces.force_field_dispatch import if_declared, total_supplied_power
from physics.kernels.forces.force_field_state import ZERO
from physics.kernels.forces.resolution_limits import report_unresolved_body
from physics.kernels.forces.two_body_spring import place_anchors_now
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, times
from physics.kernels.state.body import angular_velocity, kinetic_energy, read_state, write_state
from physics.kernels.state.fixed_body import is_fixed


@inlined
def _start(body):
    """Read the state (x, q, v, L) that a body had at the start of the stage, `body.stage_start`."""
    m = body.stage_start
    return (m[0], m[1], m[2]), (m[3], m[4], m[5], m[6]), (m[7], m[8], m[9]), (m[10], m[11], m[12])


@inlined
def _any_is_stiff(records):
    for b in range(records.shape[0]):
        if records[b].is_stiff == 1:
            return True
    return False


@kernel
def _potential(later, offset_frame, bodies):
    """Potential energy of all fields of all bodies at their present poses, `later` [s] after the stage's start [J]."""
    place_anchors_now(offset_frame, bodies)
    total = 0.0
    for b in range(bodies.body.shape[0]):
        if not is_fixed(b, bodies):
            total += potential_energy(read_state(bodies.state, b), later, offset_frame, bodies.body[b])
    return total


@if_declared()
def note_stage_energy(offset_frame, bodies, first):
    """Store the states and the potential energy of all bodies at the start of a stage, if it is stiff for any of them.

    The energy goes to the record of the first body, `first`.
    """
    if not _any_is_stiff(bodies.body):
        return
    first.stage_energy = _potential(0.0, offset_frame, bodies)
    for b in range(bodies.body.shape[0]):
        (x, q, v, L), m = read_state(bodies.state, b), bodies.body[b].stage_start
        m[0], m[1], m[2] = x
        m[3], m[4], m[5], m[6] = q
        m[7], m[8], m[9] = v
        m[10], m[11], m[12] = L


@if_declared()
def grant_energy(work, first):
    """Let the stage raise the energy by `work` [J], which other things have done; `first` is as in `note_stage_energy`.

    These are bodies with a prescribed motion.
    """
    first.stage_energy += work


@kernel
def _gain_of(b, h, offset_frame, bodies):
    """Gain of kinetic energy of body b in a stage of length h, less work done on it [J], and a scale of its rounding.

    Subtracted is the work of held loads, and of fields without a potential energy. The scale is the sum of the sizes of
    these energies [J].
    """
    body, y, end = bodies.body[b], _start(bodies.body[b]), read_state(bodies.state, b)
    v, L = times(0.5, plus(y[2], end[2])), times(0.5, plus(y[3], end[3]))
    before, after = (
        kinetic_energy(y[1], y[2], y[3], body, offset_frame),
        kinetic_energy(end[1], end[2], end[3], body, offset_frame),
    )
    a, T = constant_loads(body)
    done = body.mass * qt.dot(a, minus(end[0], y[0])) + h * qt.dot(T, angular_velocity(y[1], L, body, offset_frame))
    t = body.now + 0.5 * h
    supply = h * total_supplied_power(field_state(y[0], y[1], v, L, t, offset_frame, body), t, body)
    return after - before - done - supply, before + after + abs(done) + supply


@inlined
def _common_velocities(ties, bodies):
    """Velocity of the common centre of mass, now and at the start of the stage [m/s].

    Both are zero if `ties` is 0: then walls or anchors also hold the bodies.
    """
    mass, p, start = 0.0, ZERO, ZERO
    for b in range(bodies.body.shape[0]):
        if is_fixed(b, bodies):
            continue
        m = bodies.body[b].mass
        mass, p = mass + m, plus(p, times(m, read_state(bodies.state, b)[2]))
        start = plus(start, times(m, _start(bodies.body[b])[2]))
    if ties == 0:
        return ZERO, ZERO
    return times(1.0 / mass, p), times(1.0 / mass, start)


@kernel
def _take(gain, ties, offset_frame, bodies):
    """Take the energy `gain` [J] from the motion of all bodies relative to their common velocity.

    If that motion has less energy, all bodies are put back to their poses at the start of the stage. They then have
    the common velocity of the start, since that of the end is as wrong as the rest of the stage.
    """
    c, start = _common_velocities(ties, bodies)
    motion = 0.0
    for b in range(bodies.body.shape[0]):
        if is_fixed(b, bodies):
            continue
        _, q, v, L = read_state(bodies.state, b)
        motion += kinetic_energy(q, minus(v, c), L, bodies.body[b], offset_frame)
    if gain > UNRESOLVED_GAIN_SHARE * motion:
        for b in range(bodies.body.shape[0]):
            bodies.body[b].is_coarse = 1
    s = math.sqrt(1.0 - gain / motion) if gain < motion else 0.0
    new = c if gain < motion else start
    for b in range(bodies.body.shape[0]):
        if is_fixed(b, bodies):
            continue
        x, q, v, L = read_state(bodies.state, b)
        if not gain < motion:
            bodies.body[b].is_put_back = 1
            x, q, _, _ = _start(bodies.body[b])
        write_state(bodies.state, b, (x, q, plus(new, times(s, minus(v, c))), times(s, L)))


@if_declared()
def limit_world_energy_gain(h, ties, offset_frame, bodies, first):
    """Take from the motion of all bodies the energy that a stiff stage of length h has created.

    `ties` is 1 if the bodies are held by each other only, else 0. `first` is the record of the first body.
    """
    if not _any_is_stiff(bodies.body):
        return
    high = _potential(h, offset_frame, bodies)
    gain, size = high - first.stage_energy, abs(high) + abs(first.stage_energy)
    for b in range(bodies.body.shape[0]):
        if is_fixed(b, bodies):
            continue
        more, measure = _gain_of(b, h, offset_frame, bodies)
        gain, size = gain + more, size + measure
    if gain > ENERGY_ROUNDING * size:
        _take(gain, ties, offset_frame, bodies)


@if_declared()
def report_unresolved_bodies(report, bodies, first):
    """Count in the report each body that moves, if some stage of the call did not resolve its fields."""
    for b in range(bodies.body.shape[0]):
        _, _, v, L = read_state(bodies.state, b)
        report_unresolved_body(v != ZERO or L != ZERO, report, bodies.body[b])
