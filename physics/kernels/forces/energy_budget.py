"""Energy budget of a stage with stiff fields: the stage may create none.

An implicit step (`implicit_loads`) keeps the energy of a linear spring. Where springs have a rest length, act beside
the centre of mass, or fluids end at a surface, it may gain. So the energy after such a stage is limited to the energy
before, plus the work of the held loads, plus the work of fields without an energy: pushes, the wind. The excess is
taken from the motion. If the motion has less than that, the body went too far up a potential, and is put back to its
place.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.forces.field_loads import field_state
from physics.kernels.forces.force_field_dispatch import (
    if_declared,
    total_conservative_load,
    total_energy,
    total_supplied_power,
)
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, times
from physics.kernels.state.body import angular_velocity, kinetic_energy

# Share of the energies at hand that rounding may add in a stage.
ENERGY_ROUNDING = 1.0e-13

# Share of the kinetic energy by which explicit loads of a stage in contact may miss the work of their fields, and
# beyond which a stage that gains has not resolved them.
WORK_ERROR_SHARE = UNRESOLVED_GAIN_SHARE = 0.01


@inlined
def potential_energy(y, later, offset_frame, body):
    """Potential energy of all fields at y, `later` [s] than now [J]."""
    x, q, v, L = y
    t = body.now + later
    return total_energy(field_state(x, q, v, L, t, offset_frame, body), t, body)


@inlined
def _middle(y, end):
    """Mean velocities of a stage, at its start's place."""
    return y[0], y[1], times(0.5, plus(y[2], end[2])), times(0.5, plus(y[3], end[3]))


@inlined
def constant_loads(body):
    """Acceleration and torque held over the step."""
    a, T = body.held_acceleration, body.held_torque
    return (a[0], a[1], a[2]), (T[0], T[1], T[2])


@kernel
def energy_gain(y, end, h, offset_frame, body):
    """(energy created by a stage from y to `end`, its kinetic energy, rounding of both) [J]."""
    x, q, v, L = _middle(y, end)
    before, after = (
        kinetic_energy(y[1], y[2], y[3], body, offset_frame),
        kinetic_energy(end[1], end[2], end[3], body, offset_frame),
    )
    low, high = potential_energy(y, 0.0, offset_frame, body), potential_energy(end, h, offset_frame, body)
    a, T = constant_loads(body)
    done = body.mass * qt.dot(a, minus(end[0], y[0])) + h * qt.dot(T, angular_velocity(q, L, body, offset_frame))
    t = body.now + 0.5 * h
    supply = h * total_supplied_power(field_state(x, q, v, L, t, offset_frame, body), t, body)
    rounding = ENERGY_ROUNDING * (before + after + abs(low) + abs(high) + abs(done) + supply)
    return (after + high) - (before + low) - done - supply, after, rounding


@if_declared(False)
def has_work_error(y, end, h, offset_frame, body):
    """True if the work of explicit loads from y to `end` misses the change of the fields' energy."""
    x, q, v, L = _middle(y, end)
    t = body.now + 0.5 * h
    state = field_state(plus(x, times(0.5 * h, y[2])), q, v, L, t, offset_frame, body)
    F, T = total_conservative_load(state, t, body)
    low, high = potential_energy(y, 0.0, offset_frame, body), potential_energy(end, h, offset_frame, body)
    motion = kinetic_energy(y[1], y[2], y[3], body, offset_frame) + kinetic_energy(
        end[1], end[2], end[3], body, offset_frame
    )
    missed = high - low + h * (qt.dot(F, state.v) + qt.dot(T, state.w))
    return abs(missed) > WORK_ERROR_SHARE * motion + ENERGY_ROUNDING * (abs(low) + abs(high))


def _as_it_is(y, end, h, is_free, offset_frame, body):
    return end


@if_declared(_as_it_is)
def limit_energy_gain(y, end, h, is_free, offset_frame, body):
    """State `end` of a stage of length h from y, without the energy that the stage created.

    If the motion is too small for the excess, the body is back at y: reversed in free flight (`is_free`), without
    velocity in contact.
    """
    if body.is_stiff == 0:
        return end
    gain, motion, rounding = energy_gain(y, end, h, offset_frame, body)
    if gain <= rounding:
        return end
    if gain > UNRESOLVED_GAIN_SHARE * motion:
        body.is_coarse = 1
    x, q, v, L = end
    if gain < motion:
        s = math.sqrt(1.0 - gain / motion)
    else:
        body.is_put_back = 1
        x, q, v, L = y
        s = -1.0 if is_free else 0.0
    return x, q, times(s, v), times(s, L)
