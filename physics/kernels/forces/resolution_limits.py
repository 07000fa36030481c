"""Test whether a stage is short enough for its force fields.

Built-in fields tell their rates. Users' fields do not; they are tested by the changes of their loads over the stage.
The results are flags in the record of a body: `is_stiff`, the loads must be softened (`implicit_loads`), and
`is_coarse`, the stage does not resolve a field, which the report tells.
"""

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

# A user's field is not resolved where its loads change by more than this from the start of a stage to its middle, in
# units of speed over length of the stage.
_COARSE_CHANGE = 2.0

# Half a kick may change the loads of a user's field by this share of the loads that kick, unless the change opposes
# them. At this share they turn by a radian in a stage.
_TURNING_SHARE = 0.5

# A change of the loads by less than this share of all loads is rounding.
_LOAD_ROUNDING = 1.0e-9


@kernel
def note_field_rates(state, late, h, body):
    """Set the flags `is_stiff` and `is_coarse` of a body for a stage of length h, from the rates of its fields.

    The larger rates at two `FieldState`s count: `state` has the velocities of the stage's start, `late` those that its
    loads lead to, since damping may grow in between and the body may reach a surface. Also written are `body.rate` and
    `body.damping`. Returns the rate γ at which fields turn the velocity [1/s].
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
    """Change from the load `first` (F, T) to `second`: the pair (acceleration, torque), and a bound of its size.

    The bound is that of the acceleration of any point of the body by the change [m/s²].
    """
    F, T = minus(second[0], first[0]), minus(second[1], first[1])
    change = times(1.0 / body.mass, F), T
    return change, load_bound(change, body)


@inlined
def _change_by_kick(kick, moved, v, L, place, body):
    """Change of the load of users' fields when the loads `kick` (acceleration, torque) act for half a stage.

    `moved` is their load (F, T) before, at the velocity v and the angular momentum L. `place` is (x, q, length of the
    stage, offset_frame). The change is returned with a bound of its size, like that of `_change_of`.
    """
    x, q, h, offset_frame = place
    v, L = plus(v, times(0.5 * h, kick[0])), plus(L, times(0.5 * h, kick[1]))
    return _change_of(
        moved, total_user_load(field_state(x, q, v, L, body.now, offset_frame, body), body.now, body), body
    )


@inlined
def _is_too_much(change, size, cause, cause_size, body):
    """True if a change of loads is too large for the explicit midpoint rule.

    `cause` are the loads whose kick made the change; both are pairs (acceleration, torque). `size` and `cause_size`
    bound the acceleration of any point of the body by each of them [m/s²]. A change that opposes its cause may be twice
    as large as another.
    """
    arm = body.radius * max(body.J[0], body.J[1], body.J[2])
    product = qt.dot(cause[0], change[0]) + arm * arm * qt.dot(cause[1], change[1])
    return size > (cause_size if product <= -0.5 * size * cause_size else _TURNING_SHARE * cause_size)


@if_user_field()
def check_stage_resolution(y, middle, x, q, h, offset_frame, body):
    """Set the flag `is_coarse` of a body if the loads of users' fields change too much over a stage.

    The stage has the length h and starts at y. x and q are the pose in its middle, and `middle` is the load (F, T) of
    all fields there. Two tests are made:

    - By place: under a stiffness of frequency Ω the loads change by Ω² h v/2 until the middle. This times h is more
      than 2 v where h Ω > 2.
    - By velocity: half a kick changes the loads by the share λ h/2 of themselves. If the change opposes the kick, as
      damping does, the explicit midpoint rule amplifies where h λ > 2. If the loads turn with the velocity, at λ
      [rad/s], it amplifies at any h λ; from 1 rad a stage on they count as unresolved, as built-in fields do.

    Where most loads do not depend on the velocity, the kick by all loads tells little of λ. So the change that it makes
    is then used as a kick itself, like in a power iteration.
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
    """Correction of the `loads` (acceleration, torque) that act in a flight, towards loads that agree with its end.

    It is the softened difference (`implicit_loads`) between the mean loads of the flight over h from y to `end` and
    `loads`: one step of Newton's method.
    """
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
    """True if the loads that act on the body are softened, those of an implicit step."""
    return body.is_stiff == 1


@if_declared()
def report_unresolved_body(is_moved, report, body):
    """Count a body in the report if it moved while some stage of the call did not resolve its fields.

    A body that a stage has put back to its place (`energy_budget`) counts, too.
    """
    if body.is_put_back == 1 or (body.is_coarse == 1 and is_moved):
        report[body.world, at.UNRESOLVED_MOTION] += 1.0
