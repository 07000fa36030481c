"""Error of a part in which springs of contacts begin or end to push, and which its halves do not show.

A part and its halves may miss the same. Then they agree, however large their error is:

- Bodies meet in the second half of a part. The stage after the meeting has the same length in the whole step and in the
  halves.
- The push f of a contact ends in the last quarter. A stage knows f at its start and at its end, and takes it to be
  linear. While the sum of both is positive, the contact pulls after the end of its push.

So stages note a bound of their error of velocity. Let h be the length of a stage, W the mobility of a contact,
λ = √(k W) + c W its rate, u its speed at the start. After a meeting the method of second order has the error
(λh)³ u/12. Where f changes its sign, it lacks at most h/2 times the smaller one of the sizes of f at start and end. The
push f⁺ at the end follows from the impulse p = h ((1 - θ) f + θ f⁺).

A lone body has a look at the next part instead (`sudden_change`).
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.contact_law.compliance import contact_damping, contact_stiffness
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.contact_set import pair_slop
from physics.kernels.multibody.stepping.allowed_error import allowed_error, reference_speed
from physics.kernels.multibody.stepping.compliant_stage import contact_mobility

# Weight of these errors. Parts with such a change are few; their errors should be less than those of all other parts.
_SWITCH_WEIGHT = 16.0


@inlined
def _speed(b, many):
    """Speed to which errors of body b are compared [m/s]; 0 for a wall, b < 0."""
    if b < 0:
        return 0.0
    return reference_speed(
        row_vector(many.bodies.twist, b, 0), row_vector(many.bodies.twist, b, 3), many.bodies.body[b]
    )


@inlined
def _switch_error(k, h, many):
    """Bound of the error of contact k's velocity in a stage of h [s] in which its push begins or ends; else 0 [m/s]."""
    soft, body, W = many.compliance, many.bodies.body[0], contact_mobility(k, many)
    stiffness, damping, u = contact_stiffness(body), contact_damping(body), soft.start_speed[k]
    push = many.contacts.impulse[k, 0] / h
    slop = pair_slop(many.contacts.bodies[k, 0], many.contacts.bodies[k, 1], many)
    if soft.start_gap[k] >= -slop and push > 0.0:
        return (h * (math.sqrt(stiffness * W) + damping * W)) ** 3 * abs(u) / 12.0
    start = -stiffness * min(soft.start_gap[k], 0.0) - (damping * u if soft.start_gap[k] <= slop else 0.0)
    theta = soft.last_drift[0] / h
    end = (push - (1.0 - theta) * start) / theta
    if start * end < 0.0 and (start > 0.0 or push > 0.0):
        return 0.5 * h * W * min(abs(start), abs(end))
    return 0.0


@kernel
def _note_switches(n, h, many):
    if many.settings[0].is_error_controlled == 0:
        return
    for k in range(n):
        error = _switch_error(k, h, many)
        if error > 0.0:
            speed = _speed(many.contacts.bodies[k, 0], many) + _speed(many.contacts.bodies[k, 1], many)
            many.compliance.switch[0] = max(many.compliance.switch[0], error / speed)


def _of_several(n, h, many):
    _note_switches(n, h, many)


@if_given("many.lone", _of_several)
def _of_lone(n, h, many):
    """Note nothing: the next part shows the errors of a lone body."""


@if_given("many.compliance")
def note_switches(n, h, many):
    """Note the errors of the n contacts whose push begins or ends in a stage of h [s], after its contact problem."""
    _of_lone(n, h, many)


def _none_noted(many):
    return None


@if_given("many.compliance", _none_noted)
def forget_switches(many):
    """Forget the errors that stages have noted, at the start of a part."""
    many.compliance.switch[0] = 0.0


def _same(error, many):
    return error


@if_given("many.compliance", _same)
def with_switches(error, many):
    """Larger one of `error` and of the errors that stages have noted since the start of a part, in allowed errors."""
    return max(error, _SWITCH_WEIGHT * many.compliance.switch[0] / allowed_error(many))
