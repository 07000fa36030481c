"""Energy budget of a stage with stiff fields: take from the motion the energy that the stage has created.

An implicit step (`implicit_loads`) keeps the energy of a linear spring. It may create energy where springs have a rest
length or act beside the centre of mass, and where fluids end at a surface. So the energy after such a stage is limited
to the energy before, plus the work of held loads, plus the work of fields without a potential energy (pushes, wind).
The excess is taken from the kinetic energy. If that is smaller than the excess, the body went too far up a potential;
then it is put back to its place at the start of the stage.
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

# Rounding error of the energy of a stage, as a share of the energies that take part.
ENERGY_ROUNDING = 1.0e-13

# Two limits, as shares of the kinetic energy: by which the work of explicit loads, in contact, may miss the change of
# the fields' potential energy; and of energy created in a stage, beyond which the stage has not resolved its fields.
WORK_ERROR_SHARE = UNRESOLVED_GAIN_SHARE = 0.01


@inlined
def potential_energy(y, later, offset_frame, body):
    """Potential energy [J] of all fields for a body in the state y, at the time `body.now` + `later` [s]."""
    x, q, v, L = y
    t = body.now + later
    return total_energy(field_state(x, q, v, L, t, offset_frame, body), t, body)


@inlined
def _middle(y, end):
    """State with the pose of y and the means of the velocities and angular momenta of y and `end`."""
    return y[0], y[1], times(0.5, plus(y[2], end[2])), times(0.5, plus(y[3], end[3]))


@inlined
def constant_loads(body):
    """Acceleration [m/s²] and torque [N m] by gravity and wrench, which are constant over the step."""
    a, T = body.held_acceleration, body.held_torque
    return (a[0], a[1], a[2]), (T[0], T[1], T[2])


@kernel
def energy_gain(y, end, h, offset_frame, body):
    """Energy that a stage of length h from y to `end` has created, kinetic energy at `end`, and their rounding [J].

    Created is the change of kinetic and potential energy, less the work of held loads and the work that fields without
    a potential energy supply.
    """
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
    """True if the work of the loads in a stage's middle differs from the loss of the fields' potential energy.

    h is the length of the stage; the difference must be more than WORK_ERROR_SHARE of the kinetic energy.
    """
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
    """State after a stiff stage of length h from y to `end`, with the energy that the stage created taken away.

    The excess is taken from the velocities. If the kinetic energy is smaller than the excess, the body is put back to
    its pose in y: in free flight (`is_free`) with reversed velocities, in contact without velocity.
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
