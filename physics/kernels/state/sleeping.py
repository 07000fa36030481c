"""Sleeping bodies: the record of each body, and the rule for falling asleep.

A body is watched in windows of time, from a pose at the start of each. Its way in a window is the largest distance of
any of its points from there, or what the speed at the end of a substep would move one in it: motion that comes back to
the same place at the end of each substep is not rest. A window longer than `time` without way is quiet. A body sleeps
after two quiet windows, in the later of which its way was not `_SLEEP_GROWTH` times that in the one before: what falls
from an unstable balance goes e^{λT} times as far from window to window, however little it has moved so far.

What sleeps is left out of a step with not so much as a look at it. It wakes when the wrench that acts on it becomes
another; in worlds whose bodies touch each other, also with what it lies on or near (`multibody.data.sleeping`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from physics.compiler.decorators import inlined, kernel

# Columns of a body's row; all zero: awake, and nothing known of it yet.
SLEEP_GROUP = 0  # 0: awake; else the first body of those that sleep and wake together, + 1
SLEEP_CLOCK = 1  # time since the start of the window [s]; 0: the window is to begin
QUIET_WINDOWS = 2  # quiet windows in a row
WINDOW_DISPLACEMENT, LAST_DISPLACEMENT, EARLIER_DISPLACEMENT = (
    3,
    4,
    5,
)  # in this window [m], in the last one and the one before [bounding radii]
WINDOW_POSE = 6  # position [m] and quaternion at its start
SLEEP_WRENCH = 13  # that acts [N, N m]
SLEEP_SIZE = 19

# Quiet windows before sleep: two are compared.
WINDOWS_BEFORE_SLEEP = 2

# Rigid bodies that fall from an unstable balance have λ² = 0.75 a/r (a rod on its end) to 0.92 a/r (a cube on an edge),
# r the bounding radius, and go at least e^{λT} = 3.4 times as far in a window of T = √(2 r/a) as in the last. What
# drifts evenly goes 1 times as far. In between, in the middle:
_SLEEP_GROWTH = 2.0


class Sleep(NamedTuple):
    """Sleep of bodies for a step; None if the scene does not declare it."""

    rows: np.ndarray  # (worlds * bodies, SLEEP_SIZE)
    way: float  # that counts as none [bounding radii]
    time: float  # of a window [s]; 0: as long as a body would take to fall its bounding radius


@inlined
def is_asleep(i, sleep):
    """True if body i sleeps; False if the scene does not declare sleep."""
    if sleep is None:
        return False
    return sleep.rows[i, SLEEP_GROUP] > 0.0


@inlined
def wake_body(i, sleep):
    """Wake body i, or restart its window."""
    sleep.rows[i, SLEEP_GROUP] = sleep.rows[i, SLEEP_CLOCK] = sleep.rows[i, QUIET_WINDOWS] = 0.0


@inlined
def has_new_wrench(i, wrench, sleep):
    """True if the wrench on body i has changed; the new one is stored."""
    is_other = False
    for c in range(6):
        if wrench[i, c] != sleep.rows[i, SLEEP_WRENCH + c]:
            sleep.rows[i, SLEEP_WRENCH + c], is_other = wrench[i, c], True
    return is_other


@inlined
def _way_from_start(i, y, radius, rows):
    """Bound of the distance of any point of the body from its place at the window's start [m].

    A turn by θ moves a point by 2 r sin(θ/2) at most, and |q - q0| = 2 sin(θ/4): at most 2 r |q - q0|. Sums of
    absolute values are no less than norms.
    """
    x, q, _, _ = y
    far = abs(x[0] - rows[i, WINDOW_POSE]) + abs(x[1] - rows[i, WINDOW_POSE + 1]) + abs(x[2] - rows[i, WINDOW_POSE + 2])
    turn = (abs(q[0] - rows[i, WINDOW_POSE + 3]) + abs(q[1] - rows[i, WINDOW_POSE + 4])) + (
        abs(q[2] - rows[i, WINDOW_POSE + 5]) + abs(q[3] - rows[i, WINDOW_POSE + 6])
    )
    return far + 2.0 * radius * turn


@inlined
def _fastest_point(y, body):
    """Bound of the speed of any point of the body [m/s]: |v| + r |ω|, |ω| <= |L| over the least moment."""
    _, _, v, L = y
    spin = max(body.J[0], body.J[1], body.J[2]) * (abs(L[0]) + abs(L[1]) + abs(L[2]))
    return abs(v[0]) + abs(v[1]) + abs(v[2]) + body.radius * spin


@inlined
def _begin(i, y, rows):
    """Begin a window at y."""
    x, q, _, _ = y
    for c in range(3):
        rows[i, WINDOW_POSE + c] = x[c]
    for c in range(4):
        rows[i, WINDOW_POSE + 3 + c] = q[c]
    rows[i, WINDOW_DISPLACEMENT] = 0.0


@inlined
def _is_over(clock, body, sleep):
    """True if a window of this length is over: √(2 r/a) is the time to fall r at a."""
    if sleep.time > 0.0:
        return clock >= sleep.time
    return clock * clock * body.acceleration >= 2.0 * body.radius


@kernel
def update_sleep_window(i, y, h, body, sleep):
    """Record the place of body i after a substep of h; return whether the last of enough quiet windows has ended."""
    rows = sleep.rows
    if rows[i, SLEEP_CLOCK] == 0.0:
        _begin(i, y, rows)
    rows[i, SLEEP_CLOCK] += h
    way = max(_way_from_start(i, y, body.radius, rows), h * _fastest_point(y, body))
    rows[i, WINDOW_DISPLACEMENT] = max(rows[i, WINDOW_DISPLACEMENT], way)
    if not rows[i, WINDOW_DISPLACEMENT] <= sleep.way * body.radius:
        rows[i, SLEEP_CLOCK] = rows[i, QUIET_WINDOWS] = 0.0
        return False
    if not _is_over(rows[i, SLEEP_CLOCK], body, sleep):
        return False
    rows[i, EARLIER_DISPLACEMENT], rows[i, LAST_DISPLACEMENT] = (
        rows[i, LAST_DISPLACEMENT],
        rows[i, WINDOW_DISPLACEMENT] / body.radius,
    )
    rows[i, QUIET_WINDOWS] += 1.0
    rows[i, SLEEP_CLOCK] = 0.0
    return rows[i, QUIET_WINDOWS] >= WINDOWS_BEFORE_SLEEP


@inlined
def is_motion_growing(last, before):
    """True if the displacement in the last window shows a motion that grows."""
    return not last <= _SLEEP_GROWTH * before


@inlined
def without_velocities(y):
    """State y without velocities."""
    return y[0], y[1], (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)


@inlined
def remains_asleep(i, wrench, sleep):
    """True if body i, which meets walls only, sleeps and stays asleep under this wrench."""
    if has_new_wrench(i, wrench, sleep):
        wake_body(i, sleep)
    return sleep.rows[i, SLEEP_GROUP] > 0.0


@inlined
def falls_asleep(i, y, h, body, sleep):
    """Do `update_sleep_window` for body i, which meets walls only; return whether it falls asleep now."""
    if update_sleep_window(i, y, h, body, sleep) and not is_motion_growing(
        sleep.rows[i, LAST_DISPLACEMENT], sleep.rows[i, EARLIER_DISPLACEMENT]
    ):
        sleep.rows[i, SLEEP_GROUP] = i + 1.0
        return True
    return False
