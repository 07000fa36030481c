"""Resolution of the fields by a stage: built-in fields tell their rates, others show it by changes of loads."""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.flight.free_flight import drift_attitude
from physics.kernels.forces.field_loads import (
    add_held_loads,
    field_state,
    load_bound,
    principal_axes_matrix,
    subtract_loads,
)
from physics.kernels.forces.force_field_dispatch import (
    if_declared,
    if_user_field,
    soften_loads,
    total_mean_load,
    total_rates,
    total_user_load,
)
from physics.kernels.forces.implicit_loads import implicit_share, is_too_stiff, is_unresolved
from physics.kernels.math import quaternion as qt
from physics.kernels.math.quaternion import lerp
from physics.kernels.math.vector import minus, plus, times
from physics.kernels.state import layout as at
from physics.kernels.state.body import angular_velocity

# A user's field is not resolved where its loads change by more than this until the middle of a step, times speed/step.
_COARSE_CHANGE = 2.0

# Share of a kick's cause by which the loads of a user's field may change in half of it without opposing it: a radian a
# step.
_TURNING_SHARE = 0.5

# Share of all loads up to which a change of them is rounding.
_LOAD_ROUNDING = 1.0e-9


@kernel
def note_field_rates(state, late, h, body):
    """Note whether a stage of length h is too long for the explicit midpoint rule, and for resolving the fields.

    `state` and `late` are at the same place, with the velocities of the stage's start and those that its loads lead to:
    between them damping may grow, and a body reach a surface.
    """
    first, last = total_rates(state, h, body), total_rates(late, h, body)
    rates = max(first[0], last[0]), max(first[1], last[1]), max(first[2], last[2])
    body.rate, body.damping = max(rates[0], rates[2]), rates[0]
    body.is_stiff = 1 if is_too_stiff(rates, h) and body.is_textbook == 0 else 0
    if is_unresolved(rates, h) or (body.is_textbook == 1 and is_too_stiff(rates, h)):
        body.is_coarse = 1
    return rates[2]


@inlined
def _change_of(first, second, body):
    """Change between two loads (F, T): acceleration, torque, and a bound of any point's acceleration by it [m/s²]."""
    F, T = minus(second[0], first[0]), minus(second[1], first[1])
    change = times(1.0 / body.mass, F), T
    return change, load_bound(change, body)


@inlined
def _change_by_kick(kick, moved, v, L, place, body):
    """Change of the loads of a user's fields from `moved`, by half a step of the loads `kick`, and its bound [m/s²]."""
    x, q, h, offset_frame = place
    v, L = plus(v, times(0.5 * h, kick[0])), plus(L, times(0.5 * h, kick[1]))
    return _change_of(
        moved, total_user_load(field_state(x, q, v, L, body.now, offset_frame, body), body.now, body), body
    )


@inlined
def _is_too_much(change, size, cause, cause_size, body):
    """True if a change of loads is too large for the explicit rule; a change that opposes its cause may be larger."""
    arm = body.radius * max(body.J[0], body.J[1], body.J[2])
    product = qt.dot(cause[0], change[0]) + arm * arm * qt.dot(cause[1], change[1])
    return size > (cause_size if product <= -0.5 * size * cause_size else _TURNING_SHARE * cause_size)


@if_user_field()
def check_stage_resolution(y, middle, x, q, h, offset_frame, body):
    """Note whether loads of a user's fields change too much over a stage from y; `middle` are all loads at (x, q).

    Under a stiffness of frequency Ω the loads change by Ω² h v/2 until the middle: h times that is more than 2 v where
    h Ω > 2. Half a kick changes the loads by λ h/2 of what they are. If they oppose it, as damping does, the explicit
    rule grows from h λ = 2 on. Loads that turn with the velocity, at λ [rad/s], make it grow at any h λ. From 1 rad a
    step on they count as not resolved, as built-in ones do. A kick by all loads says little of λ where most of them do
    not depend on the velocity, so the change that it makes is itself taken for a kick, as a power iteration does.
    """
    t = body.now
    v, L = y[2], y[3]
    start = total_user_load(field_state(y[0], y[1], v, L, t, offset_frame, body), t, body)
    moved = total_user_load(field_state(x, q, v, L, t, offset_frame, body), t, body)
    w = angular_velocity(q, L, body, offset_frame)
    speed = math.sqrt(qt.dot(v, v)) + body.radius * math.sqrt(qt.dot(w, w))
    _, change = _change_of(start, moved, body)
    if change > _COARSE_CHANGE * speed / h:
        body.is_coarse = 1
    place = x, q, h, offset_frame
    loads = add_held_loads(middle[0], middle[1], body)
    size = load_bound(loads, body)
    first, by_loads = _change_by_kick(loads, moved, v, L, place, body)
    second, by_change = _change_by_kick(first, moved, v, L, place, body)
    if _is_too_much(first, by_loads, loads, size, body):
        body.is_coarse = 1
    if by_loads > _LOAD_ROUNDING * size and _is_too_much(second, by_change, first, by_loads, body):
        body.is_coarse = 1


@inlined
def newton_load_change(y, end, loads, h, gyroscopic, offset_frame, body):
    """Softened difference between the loads of a flight over h from y to `end` and `held_loads` (`implicit_loads`)."""
    t, half = body.now + 0.5 * h, 0.5 * h
    share = implicit_share(h * body.damping)
    v, L = lerp(y[2], end[2], share), lerp(y[3], end[3], share)
    x, q = times(0.5, plus(y[0], end[0])), drift_attitude(y[1], y[3], body, half, gyroscopic, offset_frame)
    middle = field_state(x, q, v, L, t, offset_frame, body)
    first = field_state(y[0], y[1], v, L, t, offset_frame, body)
    last = field_state(end[0], end[1], v, L, t, offset_frame, body)
    F, T = total_mean_load((middle, first, last), t, body)
    return soften_loads(
        subtract_loads(add_held_loads(F, T, body), loads), h, principal_axes_matrix(q, offset_frame, body), middle, body
    )


@if_declared(False)
def is_stiff(body):
    """True if the held loads are those of an implicit step."""
    return body.is_stiff == 1


@if_declared()
def report_unresolved_body(is_moved, report, body):
    """Count a body that moved while some stage of the call did not resolve its fields, or that a stage put back."""
    if body.is_put_back == 1 or (body.is_coarse == 1 and is_moved):
        report[body.world, at.UNRESOLVED_MOTION] += 1.0
