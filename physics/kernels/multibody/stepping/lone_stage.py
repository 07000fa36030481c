"""Targets of a resting stage of a lone body: of second order where the body turns and where its slip turns.

The velocity that contacts gain by turning after the middle of a stage belongs to the twist after the impulses. That
twist is foretold from the impulses of the stage before. Friction opposes the mean of the slips before and after the
stage, where the slip is foretold to go on.

All of this is left out of kernels unless exactly one body moves, among fixed ones. Several bodies under error control
have the mean slip and the time in which gaps close, too (`foretold_twists`).
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import as_vector, minus, plus, row_vector, times
from physics.kernels.multibody.data.arrays import (
    WARM_CONTACT_COUNT,
    WARM_CONTACT_SIZE,
    WARM_HEADER_SIZE,
    WARM_IMPULSE,
    WARM_STAGE_LENGTH,
)
from physics.kernels.multibody.data.contact_set import put_vector, relative_velocity, row_matrix
from physics.kernels.multibody.data.lone_body import lone_body
from physics.kernels.multibody.data.warm_start import load_warm_impulses
from physics.kernels.multibody.stepping.foretold_twists import (
    foretell_twists_of_several,
    longest_stage,
)
from physics.kernels.state.body import angular_velocity, read_state

# Largest length of a stage, in lengths of the one before, and largest share of that one's impulse on contacts that are
# no longer there, for which the stage before foretells this one.
_MAX_STRETCH = 8.0
_LOST_SHARE = 0.05

# Largest share of a slip that a stage is foretold to take, if friction opposes the mean slip: then it does not end. Nor
# may the slip change by more than its size: the direction of a slip that has just begun is that of errors.
_SLIP_LOSS = 0.5

# Change of a slip across its direction in a stage up to which it may be the error of solves, in tolerances of the speed
# that loads give over a bounding radius. Such a slip counts as straight.
_TURN_TOLERANCES = 10.0

# Residual of a contact problem, in tolerances of the speed that loads give over a bounding radius; and under error
# control, where larger ones would hide sudden changes.
_RESIDUAL_SHARE = 0.1
_PART_RESIDUAL_SHARE = 0.01


@inlined
def _load_speed(b, many):
    """Speed that loads give to body b over a bounding radius [m/s]."""
    return math.sqrt(many.bodies.body[b].radius * many.bodies.body[b].acceleration)


@inlined
def _impulse_of_last_stage(world, memory):
    """Sum of the impulses of the stage before, world frame [N s]."""
    total = (0.0, 0.0, 0.0)
    for k in range(int(memory[world, WARM_CONTACT_COUNT])):
        total = plus(total, row_vector(memory, world, WARM_HEADER_SIZE + WARM_CONTACT_SIZE * k + WARM_IMPULSE))
    return total


@kernel
def _foretell(n, world, h, switches, memory, many):
    load_warm_impulses(n, world, h, switches.friction, memory, many)
    b, length = lone_body(many), memory[world, WARM_STAGE_LENGTH]
    _, q, v, L = read_state(many.bodies.state, b)
    body, total, turn = many.bodies.body[b], (0.0, 0.0, 0.0), times(h, as_vector(many.bodies.body[b].torque))
    for k in range(n):
        p = qt.transposed_matvec(row_matrix(many.contacts.frame, k), row_vector(many.contacts.impulse, k, 0))
        total, turn = plus(total, p), plus(turn, qt.cross(row_vector(many.contacts.arm, k, 0), p))
    for c in range(6):
        many.lone.later[0, c] = many.bodies.twist[b, c]
    if not length * _MAX_STRETCH >= h:
        return
    before = times(h / length, _impulse_of_last_stage(world, memory))
    lost = minus(total, before)
    if qt.dot(lost, lost) <= _LOST_SHARE * _LOST_SHARE * qt.dot(before, before):
        v = plus(plus(v, times(h, as_vector(body.free_acceleration))), times(many.bodies.inv_mass[b], total))
        put_vector(many.lone.later, 0, 0, v)
        put_vector(many.lone.later, 0, 3, angular_velocity(q, plus(L, turn), body, switches.flight.offset_frame))


def _foretell_of_several(n, world, h, switches, memory, many):
    foretell_twists_of_several(n, world, h, switches, memory, many)


@if_given("many.lone", _foretell_of_several)
def foretell_twist(n, world, h, switches, memory, many):
    """Write to `many.lone.later` the twist after a stage of h [s] whose n contacts push as in the stage before.

    It is the present twist if contacts of the stage before are no longer there, or that stage was much shorter. `world`
    is the index of the world, `memory` has its warm starts.
    """
    if many.lone.slow[0] == 0:
        _foretell(n, world, h, switches, memory, many)


@if_given("many.lone")
def exchange_twists(b, is_error_controlled, many):
    """Exchange the present twist of the lone body b and the foretold one, under error control.

    In longer stages the foretold twist would be the less accurate one where contacts come and go.
    """
    if many.settings[0].is_error_controlled != is_error_controlled or many.lone.slow[0] == 1:
        return
    for c in range(6):
        many.bodies.twist[b, c], many.lone.later[0, c] = many.lone.later[0, c], many.bodies.twist[b, c]


@inlined
def _oppose_mean_slip(k, t, u, change, many):
    """Target t of contact k, along the face replaced by -u if its slip u goes on and turns, contact frame [m/s].

    `change` is the change of the slip that is foretold for the stage, world frame [m/s].
    """
    b, square = many.contacts.bodies[k, 0], u[1] * u[1] + u[2] * u[2]
    change = qt.matvec(row_matrix(many.contacts.frame, k), change)
    along, most = u[1] * change[1] + u[2] * change[2], change[1] * change[1] + change[2] * change[2]
    goes_on = many.contacts.impulse[k, 0] > 0.0 and along > -_SLIP_LOSS * square and most < square
    least = _TURN_TOLERANCES * many.settings[0].tolerance * _load_speed(b, many)
    is_turning = abs(u[1] * change[2] - u[2] * change[1]) > least * math.sqrt(square)
    return (t[0], -u[1], -u[2]) if goes_on and is_turning else t


def _end_slip_target(k, t, u, many):
    return t


@if_given("many.foretold", _end_slip_target)
def _mean_slip_target_of_parts(k, t, u, many):
    """Target t of contact k between several moving bodies, as of `mean_slip_target`."""
    change = minus(relative_velocity(k, many.foretold.twist, many), relative_velocity(k, many.bodies.twist, many))
    return _oppose_mean_slip(k, t, u, change, many)


def _mean_slip_target_of_several(k, t, u, many):
    return _mean_slip_target_of_parts(k, t, u, many)


@if_given("many.lone", _mean_slip_target_of_several)
def mean_slip_target(k, t, u, many):
    """Target t of contact k, along the face replaced by -u if its slip u is foretold to go on, contact frame [m/s].

    Friction then opposes the mean of the slips before and after the stage (`time_stepping.midpoint_friction`). Against
    the slip after it, the error would be of first order where the direction of the slip turns. A straight slip has the
    same direction before and after.
    """
    if many.lone.slow[0] == 1:
        return t
    b = many.contacts.bodies[k, 0]
    turn = minus(row_vector(many.lone.later, 0, 3), row_vector(many.bodies.twist, b, 3))
    change = plus(
        minus(row_vector(many.lone.later, 0, 0), row_vector(many.bodies.twist, b, 0)),
        qt.cross(turn, row_vector(many.contacts.arm, k, 0)),
    )
    return _oppose_mean_slip(k, t, u, change, many)


def _closing_time_of_several(h, many):
    return longest_stage(h, many)


@if_given("many.lone", _closing_time_of_several)
def closing_time(h, many):
    """Time in which a small gap closes [s]: that of the stage, of length h, or the substep under error control.

    Parts may be short: a gap of rounding size would else be closed at a speed that is no rounding.
    """
    return max(h, many.lone.substep[0])


def _no_limit(many):
    return math.inf


@if_given("many.lone", _no_limit)
def residual_of_lone(many):
    """Largest residual of a contact problem of a lone body, whatever the tolerance is [m/s]; infinite for others.

    The tolerance is relative to the slip, however fast that is.
    """
    share = _RESIDUAL_SHARE
    if many.settings[0].is_error_controlled == 1:
        share = _PART_RESIDUAL_SHARE
    least = share * many.settings[0].tolerance * _load_speed(lone_body(many), many)
    return least if least > 0.0 else math.inf
