"""Resolution of the fields by a stage: by the rates that built-in ones tell, and by how the loads of others change."""

from __future__ import annotations

import math

from physics.kernels import layout as at
from physics.kernels import quaternion as qt
from physics.kernels.body import angular_velocity
from physics.kernels.compiler import inlined, kernel
from physics.kernels.fields.field_loads import (
    all_loads,
    field_state,
    less,
    principal_axes,
    size_of,
)
from physics.kernels.fields.state import minus, plus, times
from physics.kernels.fields.stiffness import implicit_share, is_beyond, is_unresolved
from physics.kernels.fields.terms import (
    if_declared,
    if_unknown,
    softened,
    total_mean_load,
    total_rates,
    total_unknown,
)
from physics.kernels.flight import drift
from physics.kernels.restraint import between

# A user's field is not resolved where its loads change by more than this until the middle of a step, times speed/step.
COARSE = 2.0

# Share of all loads by which those of a user's field may change in half a kick without opposing it: a radian a step.
TURNING = 0.5


@kernel
def note_rates(state, late, h, work):
    """Note whether a stage of length h is too long for the explicit midpoint rule, and for the fields at all.

    `state` and `late` are at the same place, with the velocities of the stage's start and those that its loads lead to:
    between them damping may grow, and a body reach a surface.
    """
    first, last = total_rates(state, h, work), total_rates(late, h, work)
    rates = max(first[0], last[0]), max(first[1], last[1]), max(first[2], last[2])
    work.rate, work.damping = max(rates[0], rates[2]), rates[0]
    work.is_stiff = 1 if is_beyond(rates, h) and work.is_textbook == 0 else 0
    if is_unresolved(rates, h) or (work.is_textbook == 1 and is_beyond(rates, h)):
        work.is_coarse = 1
    return rates[2]


@inlined
def _change_of(first, second, work):
    """Change between two loads (F, T): acceleration and torque, and the bound of what it does to any point [m/s²]."""
    F, T = minus(second[0], first[0]), minus(second[1], first[1])
    change = times(1.0 / work.mass, F), T
    return change, size_of(change, work)


@if_unknown()
def look_over_stage(y, middle, x, q, h, tilted, work):
    """Note whether loads of a user's fields change too much over a stage from y; `middle` are all loads at (x, q).

    Under a stiffness of frequency Ω the loads change by Ω² h v/2 until the middle: h times that is more than 2 v where
    h Ω > 2. Half a kick changes the loads by λ h/2 of what they are. If they oppose it, as damping does, the explicit
    rule grows from h λ = 2 on. Loads that turn with the velocity, at λ [rad/s], make it grow at any h λ. From 1 rad a
    step on they count as not resolved, as built-in ones do.
    """
    t = work.now
    v, L = y[2], y[3]
    start = total_unknown(field_state(y[0], y[1], v, L, t, tilted, work), t, work)
    moved = total_unknown(field_state(x, q, v, L, t, tilted, work), t, work)
    w = angular_velocity(q, L, work, tilted)
    speed = math.sqrt(qt.dot(v, v)) + work.radius * math.sqrt(qt.dot(w, w))
    _, change = _change_of(start, moved, work)
    if change > COARSE * speed / h:
        work.is_coarse = 1
    a, T = all_loads(middle[0], middle[1], work)
    v, L = plus(v, times(0.5 * h, a)), plus(L, times(0.5 * h, T))
    kicked = total_unknown(field_state(x, q, v, L, t, tilted, work), t, work)
    (b, S), change = _change_of(moved, kicked, work)
    arm = work.radius * max(work.J[0], work.J[1], work.J[2])
    size = size_of((a, T), work)
    opposes = qt.dot(a, b) + arm * arm * qt.dot(T, S) <= -0.5 * change * size
    if change > (size if opposes else TURNING * size):
        work.is_coarse = 1


@inlined
def change_to_agree(y, end, loads, h, gyroscopic, tilted, work):
    """Softened difference between the loads of a flight over h from y to `end` and `loads` (`stiffness`)."""
    t, half = work.now + 0.5 * h, 0.5 * h
    share = implicit_share(h * work.damping)
    v, L = between(y[2], end[2], share), between(y[3], end[3], share)
    x, q = times(0.5, plus(y[0], end[0])), drift(y[1], y[3], work, half, gyroscopic, tilted)
    middle = field_state(x, q, v, L, t, tilted, work)
    first = field_state(y[0], y[1], v, L, t, tilted, work)
    last = field_state(end[0], end[1], v, L, t, tilted, work)
    F, T = total_mean_load((middle, first, last), t, work)
    return softened(less(all_loads(F, T, work), loads), h, principal_axes(q, tilted, work), middle, work)


@if_declared(False)
def is_stiff(work):
    """True where the held loads are those of an implicit step."""
    return work.is_stiff == 1


@if_declared()
def note_report(is_moved, report, work):
    """Count a body that has moved in fields which some stage of the call did not resolve, or was put back by one."""
    if work.is_put_back == 1 or (work.is_coarse == 1 and is_moved):
        report[work.world, at.COARSE] += 1.0
