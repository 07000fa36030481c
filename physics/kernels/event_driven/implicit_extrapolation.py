"""Make one step of smooth motion by the extrapolated, linearly implicit Euler rule, where slow sliding makes it stiff.

Friction turns the direction of a slip u within the time |u|/(μ a), for loads of acceleration a. Where loads nearly hold
a block, it slides at 1e-4 m/s for a hundred times as long, and an explicit rule needs parts as short as this time. The
implicit rule solves a linear system in each part instead,

    (1 - s C) Δ = s f(y),  C = ∂(v̇, L̇)/∂(v, L) at the start of the step,

of velocity and angular momentum; position and attitude follow explicitly, since friction does not depend on them. Its
error is a series in the length s of a part, so that each rule with more parts raises the order by one.

Hairer and Wanner, *Solving Ordinary Differential Equations II*, IV.9, for the rule, its table and the numbers of parts.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.contact_law.materials import friction_of
from physics.kernels.event_driven.extrapolated_midpoint import (
    compute_state_rate,
    extrapolation_aim,
    get_state_row,
    put_state_row,
    set_error_scale,
    try_extrapolated_step,
)
from physics.kernels.event_driven.slip_onset import sliding_velocity
from physics.kernels.event_driven.workspace import (
    IMPLICIT_SIZE,
    MAX_MIDPOINT_RULES,
    ROW_CURRENT,
    ROW_END,
    ROW_START,
    Y_ANGULAR_MOMENTUM,
    Y_SIZE,
    Y_VELOCITY,
)
from physics.kernels.math import quaternion as qt
from physics.kernels.math.full_pivot_solve import solve_full_pivot

# Parts of each rule.
_PARTS = (2, 3, 4, 6, 8, 12, 16, 24)

# A step is stiff if it is longer than this many times |u|/(μ a). The explicit rule with the most parts, 16, is stable
# for about as many.
_STIFF_TURNS = 16.0

# Difference by which C is measured, as a share of the slowest slip. The error of C is the share itself, from the
# curvature of the friction, and for rounding ε / share, which is far less.
_DIFFERENCE_SHARE = 1.0e-6


@inlined
def _slowest_slip(scratch, contacts):
    """Speed of the slowest contact that slides against friction [m/s]; infinite if none does."""
    slowest = math.inf
    for j in range(contacts.count):
        if contacts.sticks[j] or not friction_of(contacts.slot[j], scratch) > 0.0:
            continue
        slowest = min(slowest, sliding_velocity(j, scratch.scene, contacts)[1])
    return slowest


@inlined
def _largest_friction(scratch, contacts):
    """Return the largest friction coefficient of the acting contacts."""
    most = 0.0
    for j in range(contacts.count):
        most = max(most, friction_of(contacts.slot[j], scratch))
    return most


@kernel
def note_stiffness(h, offset_frame, scratch, motion):
    """Set `pace.is_stiff` for steps of length h [s] from ROW_START of `smooth.y`; return whether they are stiff.

    That is, if a contact slides against friction, and friction turns its slip `_STIFF_TURNS` times within h. The only
    contact of a body has a rule of its own (`extrapolated_midpoint`).
    """
    contacts, pace = motion.contacts, motion.pace
    pace.is_stiff = 0
    if contacts.count < 2:
        return False
    compute_state_rate(ROW_START, 0.0, offset_frame, scratch, motion)
    pace.slowest_slip = _slowest_slip(scratch, contacts)
    turn = _largest_friction(scratch, contacts) * scratch.body.acceleration
    if motion.thresholds.slip_stop_speed < pace.slowest_slip < math.inf and (
        h * turn > _STIFF_TURNS * pace.slowest_slip
    ):
        pace.is_stiff = 1
    return pace.is_stiff == 1


@kernel
def _measure_jacobian(offset_frame, scratch, motion):
    """Measure C, the change of the rates of velocity and angular momentum with these, by differences at ROW_START."""
    body, smooth = scratch.body, motion.smooth
    for k in range(IMPLICIT_SIZE):
        step = _DIFFERENCE_SHARE * motion.pace.slowest_slip
        if Y_VELOCITY + k >= Y_ANGULAR_MOMENTUM:
            step *= body.mass * body.radius
        for c in range(Y_SIZE):
            smooth.y[ROW_CURRENT, c] = smooth.y[ROW_START, c]
        smooth.y[ROW_CURRENT, Y_VELOCITY + k] += step
        compute_state_rate(ROW_CURRENT, 0.0, offset_frame, scratch, motion)
        for c in range(IMPLICIT_SIZE):
            smooth.jacobian[c, k] = (smooth.rate[Y_VELOCITY + c] - smooth.first_rate[Y_VELOCITY + c]) / step


@inlined
def _implicit_part(s, smooth):
    """Advance the state in ROW_CURRENT by one part of s [s], with its rate of change in `smooth.rate`."""
    y, rate, matrix = smooth.y, smooth.rate, smooth.implicit_matrix
    for i in range(IMPLICIT_SIZE):
        for k in range(IMPLICIT_SIZE):
            matrix[i, k] = -s * smooth.jacobian[i, k]
        matrix[i, i] += 1.0
        matrix[i, IMPLICIT_SIZE] = s * rate[Y_VELOCITY + i]
    solve_full_pivot(IMPLICIT_SIZE, matrix, smooth.implicit_order, smooth.implicit_change)
    for c in range(Y_VELOCITY):
        y[ROW_CURRENT, c] += s * rate[c]
    for c in range(IMPLICIT_SIZE):
        y[ROW_CURRENT, Y_VELOCITY + c] += smooth.implicit_change[c]


@kernel
def _implicit_rule(parts, h, offset_frame, scratch, motion):
    """Make one rule with `parts` parts over h [s], from ROW_START into ROW_END of `smooth.y`."""
    smooth = motion.smooth
    y, s = smooth.y, h / parts
    for c in range(Y_SIZE):
        y[ROW_CURRENT, c] = y[ROW_START, c]
        smooth.rate[c] = smooth.first_rate[c]
    for k in range(parts):
        if k > 0:
            compute_state_rate(ROW_CURRENT, k * s, offset_frame, scratch, motion)
        _implicit_part(s, smooth)
    for c in range(Y_SIZE):
        y[ROW_END, c] = y[ROW_CURRENT, c]


@inlined
def _extrapolate(k, smooth):
    """Add ROW_END of `smooth.y`, the result of rule k, to the table; returns the relative change by the last order."""
    table, y = smooth.extrapolation_table, smooth.y
    error = total = 0.0
    for c in range(Y_SIZE):
        new, change = y[ROW_END, c], math.inf
        for j in range(1, k + 1):
            old = table[j - 1, c]
            change = (new - old) / (_PARTS[k] / _PARTS[k - j] - 1.0)
            table[j - 1, c] = new
            new += change
        table[k, c] = new
        y[ROW_END, c] = new
        total += new
        if smooth.scale[c] > 0.0:
            error = max(error, abs(change) / smooth.scale[c])
    return error if math.isfinite(total) else math.nan


@kernel
def _try_implicit_step(h, offset_frame, scratch, motion):
    """Make a step of length h [s] as `try_extrapolated_step` does, by the implicit rule."""
    smooth = motion.smooth
    goal = scratch.settings.tolerance
    aim = extrapolation_aim(goal, motion.contacts)
    set_error_scale(h, scratch.body, smooth)
    _measure_jacobian(offset_frame, scratch, motion)
    error, used = math.inf, MAX_MIDPOINT_RULES
    for k in range(MAX_MIDPOINT_RULES):
        _implicit_rule(_PARTS[k], h, offset_frame, scratch, motion)
        error = _extrapolate(k, smooth)
        if math.isnan(error):
            return math.inf, MAX_MIDPOINT_RULES
        if error <= aim:
            used = k + 1
            break
    x, q, v, m = get_state_row(smooth, ROW_END)
    put_state_row(smooth, ROW_END, (x, qt.normalise(q), v, m))
    return error, used


@kernel
def try_smooth_step(h, offset_frame, scratch, motion):
    """Make a step of length h [s] as `try_extrapolated_step` does, by the implicit rule if `pace.is_stiff`."""
    if motion.pace.is_stiff == 1:
        return _try_implicit_step(h, offset_frame, scratch, motion)
    return try_extrapolated_step(h, offset_frame, scratch, motion)
