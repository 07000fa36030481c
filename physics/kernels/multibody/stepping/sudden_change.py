"""Error of a part that its halves do not show: the acceleration of a lone body may change within it unnoticed.

A contact problem acts at the middle of its step. If contacts begin to open at a time s, the acceleration grows from
there as c (time - s). A step whose middle is before s misses this, and its velocity is off by up to c h²/8. If s is in
the first or in the last quarter of a part, its whole step and its halves miss the same, and agree. If a support ends,
the acceleration jumps by J, and all steps since the last contact problem agree, too, and are off by up to J h.

So the next part is stepped as a whole before a part is accepted, which it needs anyway. In smooth motion its mean
acceleration is on the line through those of both halves, up to a term of second order. Let d be its distance from that
line, and n its length. For a change that neither part shows otherwise, d n/8 is at least the error of the velocity:

    at s < n/4 of the next part:   d = c (n/2 - s) >= c n/4,    d n/8 >= c n²/32 >= c s²/2;
    at ε before its start:         d >= c (n/2 + ε),            d n/8 >= c ε²/2 for ε <= n/4.

In smooth motion d n/8 is at most nine times the difference between the whole step and its halves. The excess over
sixteen times that difference is the mark of a sudden change.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import row_vector
from physics.kernels.multibody.data.contact_set import subtract
from physics.kernels.multibody.data.lone_body import lone_body
from physics.kernels.state import layout as at
from physics.kernels.state.body import angular_velocity, read_state

# Rows of `kept.rates`: in both halves of a part, in the whole next part. Columns: acceleration [m/s²], rate of the
# angular momentum [N m].
FIRST_HALF, SECOND_HALF, NEXT_PART = range(3)
_TORQUE = 3

# Multiple of the difference between the whole step and its halves that smooth motion may show.
_SMOOTH_FACTOR = 16.0


def _not_counted(many):
    return None


@if_given("many.lone", _not_counted)
def count_impact(many):
    """Count an impact of the lone body."""
    many.lone.impacts[0] += 1


@inlined
def note_rates(row, before, h, kept, many):
    """Note in a row of `kept.rates` the mean rates of the lone body since the snapshot `before`, h [s] ago."""
    b = lone_body(many)
    for c in range(3):
        v, L = at.LINVEL + c, at.ANGMOM + c
        kept.rates[row, c] = (many.bodies.state[b, v] - kept.state[before, b, v]) / h
        kept.rates[row, _TORQUE + c] = (many.bodies.state[b, L] - kept.state[before, b, L]) / h


@inlined
def _distance_from_line(along, first, rates):
    """Vector from the line through the rates of both halves to those of the next part, in columns from `first` on.

    `along` is the time of the next part's middle since the middle of the first half, over the time between the middles
    of both halves.
    """
    one = row_vector(rates, FIRST_HALF, first)
    way, d = subtract(row_vector(rates, SECOND_HALF, first), one), subtract(row_vector(rates, NEXT_PART, first), one)
    return (d[0] - along * way[0], d[1] - along * way[1], d[2] - along * way[2])


@inlined
def _size(a):
    return math.sqrt(qt.dot(a, a))


@kernel
def sudden_change(error, h, next_h, offset_frame, kept, many):
    """Velocity error by a sudden change near the end of a part of h [s], d n/8 less what smooth motion may show.

    `next_h` [s] is the length n of the next part, which has just been stepped. `error` is the difference of the part
    between its whole step and its halves. Both errors are shares of the body's size and speed, as in `part`. The result
    is 0 if an impact has changed the velocities.
    """
    if many.lone.impacts[0] > 0:
        return 0.0
    b, along = lone_body(many), 1.5 + next_h / h
    _, q, v, L = read_state(many.bodies.state, b)
    body = many.bodies.body[b]
    turning = angular_velocity(q, _distance_from_line(along, _TORQUE, kept.rates), body, offset_frame)
    d = _size(_distance_from_line(along, 0, kept.rates)) + body.radius * _size(turning)
    if not d > 0.0:
        return 0.0
    w = angular_velocity(q, L, body, offset_frame)
    speed = _size(v) + body.radius * _size(w) + math.sqrt(body.radius * body.acceleration)
    return max(0.0, 0.125 * next_h * d / speed - _SMOOTH_FACTOR * error)
