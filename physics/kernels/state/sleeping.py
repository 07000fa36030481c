"""Sleeping bodies: the memory of each body's motion, and the rules for falling asleep and waking.

The motion of a body is measured in windows of time. The displacement of a body in a window is the largest distance of
any of its points from its place at the window's start. Its speed at the end of a substep, times the substep, counts
as a displacement too: a motion that is back at the same place after each substep is not rest. A window is quiet if it
lasts for `Sleep.time` and its displacement stays below `Sleep.way`. A body falls asleep after two quiet windows, unless
its displacement in the later one was more than `_SLEEP_GROWTH` times that in the earlier one. Such growth shows a body
that falls from an unstable balance: from window to window it moves e^{λT} times as far, however little it has moved.

A sleeping body is left out of the step. It wakes when its wrench changes. Where bodies touch each other, it also wakes
with the bodies that it touches or is near (`multibody.data.sleeping`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from physics.compiler.decorators import inlined, kernel

# Columns of a body's row. A row of zeros is an awake body whose first window has not begun.
SLEEP_GROUP = 0  # 0: awake; else 1 + the first body of its sleeping group
SLEEP_CLOCK = 1  # time since the start of the window [s]; 0: a new window begins with the next substep
QUIET_WINDOWS = 2  # quiet windows in a row
WINDOW_DISPLACEMENT, LAST_DISPLACEMENT, EARLIER_DISPLACEMENT = (
    3,
    4,
    5,
)  # in this window [m], in the last one and the one before [bounding radii]
WINDOW_POSE = 6  # position [m] and quaternion at the start of the window
SLEEP_WRENCH = 13  # last wrench on the body [N, N m]
SLEEP_SIZE = 19

# Quiet windows before sleep: their two displacements are compared.
WINDOWS_BEFORE_SLEEP = 2

# Growth of the displacement from window to window that shows an unstable balance. Rigid bodies that fall from one have
# λ² = 0.75 a/r (a rod on its end) to 0.92 a/r (a cube on an edge), with the bounding radius r and the acceleration a.
# In a window of T = √(2 r/a) they move at least e^{λT} = 3.4 times as far as in the last one. A body that drifts evenly
# moves 1 times as far. The limit is about the geometric mean of both.
_SLEEP_GROWTH = 2.0


class Sleep(NamedTuple):
    """Memory and limits of sleeping for a step; in its place is None if the scene does not declare sleep."""

    rows: np.ndarray  # (worlds * bodies, SLEEP_SIZE)
    way: float  # largest displacement of a quiet window [bounding radii]
    time: float  # length of a window [s]; 0: the time that a body would take to fall its bounding radius


@inlined
def is_asleep(i, sleep):
    """True if the body in row i sleeps; False if the scene does not declare sleep (`sleep` is None)."""
    if sleep is None:
        return False
    return sleep.rows[i, SLEEP_GROUP] > 0.0


@inlined
def wake_body(i, sleep):
    """Wake the body in row i; if it is awake, forget its quiet windows and start a new one."""
    sleep.rows[i, SLEEP_GROUP] = sleep.rows[i, SLEEP_CLOCK] = sleep.rows[i, QUIET_WINDOWS] = 0.0


@inlined
def has_new_wrench(i, wrench, sleep):
    """True if the wrench on body i differs from the one stored in its row of `sleep`; the new one is stored there."""
    is_other = False
    for c in range(6):
        if wrench[i, c] != sleep.rows[i, SLEEP_WRENCH + c]:
            sleep.rows[i, SLEEP_WRENCH + c], is_other = wrench[i, c], True
    return is_other


@inlined
def _way_from_start(i, y, radius, rows):
    """Upper bound of the displacement of any point of body i since the start of its window, in the state y [m].

    A turn by θ moves a point by at most 2 r sin(θ/2), with the bounding radius r. As |q - q0| = 2 sin(θ/4), this is at
    most 2 r |q - q0|. Norms are replaced by sums of absolute values, which are never smaller.
    """
    x, q, _, _ = y
    far = abs(x[0] - rows[i, WINDOW_POSE]) + abs(x[1] - rows[i, WINDOW_POSE + 1]) + abs(x[2] - rows[i, WINDOW_POSE + 2])
    turn = (abs(q[0] - rows[i, WINDOW_POSE + 3]) + abs(q[1] - rows[i, WINDOW_POSE + 4])) + (
        abs(q[2] - rows[i, WINDOW_POSE + 5]) + abs(q[3] - rows[i, WINDOW_POSE + 6])
    )
    return far + 2.0 * radius * turn


@inlined
def _fastest_point(y, body):
    """Upper bound of the speed of any point of a body in the state y [m/s]: |v| + r |ω|.

    r is the bounding radius, and |ω| is at most |L| over the smallest moment of inertia.
    """
    _, _, v, L = y
    spin = max(body.J[0], body.J[1], body.J[2]) * (abs(L[0]) + abs(L[1]) + abs(L[2]))
    return abs(v[0]) + abs(v[1]) + abs(v[2]) + body.radius * spin


@inlined
def _begin(i, y, rows):
    """Start a window of time in which the displacement of body i is measured: store the pose of y, and set it to 0."""
    x, q, _, _ = y
    for c in range(3):
        rows[i, WINDOW_POSE + c] = x[c]
    for c in range(4):
        rows[i, WINDOW_POSE + 3 + c] = q[c]
    rows[i, WINDOW_DISPLACEMENT] = 0.0


@inlined
def _is_over(clock, body, sleep):
    """True if a window of time, in which displacements are measured, is over after `clock` [s].

    Its length is `sleep.time`, or if that is 0 the time √(2 r/a) in which the body, with its acceleration a, falls its
    bounding radius r.
    """
    if sleep.time > 0.0:
        return clock >= sleep.time
    return clock * clock * body.acceleration >= 2.0 * body.radius


@kernel
def update_sleep_window(i, y, h, body, sleep):
    """Update the window of time in which the displacement of body i is measured, after a substep of h [s] to y.

    Returns True when a quiet window, with little displacement, has just ended, and the body has had
    `WINDOWS_BEFORE_SLEEP` of them in a row.
    """
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
    """True if the displacement `last`, in the last window of time, is more than `_SLEEP_GROWTH` times that `before`."""
    return not last <= _SLEEP_GROWTH * before


@inlined
def without_velocities(y):
    """State y with velocity and angular momentum set to zero."""
    return y[0], y[1], (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)


@inlined
def remains_asleep(i, wrench, sleep):
    """True if body i sleeps and stays asleep, because its wrench is the same; a new wrench wakes it.

    For scenes whose bodies touch walls only; others have `multibody.data.sleeping`.
    """
    if has_new_wrench(i, wrench, sleep):
        wake_body(i, sleep)
    return sleep.rows[i, SLEEP_GROUP] > 0.0


@inlined
def falls_asleep(i, y, h, body, sleep):
    """Put body i to sleep if it has moved little for two windows of time (`update_sleep_window`).

    y is the state after a substep of h [s]. Returns whether the body has fallen asleep. For scenes whose bodies touch
    walls only; others have `multibody.data.sleeping`.
    """
    if update_sleep_window(i, y, h, body, sleep) and not is_motion_growing(
        sleep.rows[i, LAST_DISPLACEMENT], sleep.rows[i, EARLIER_DISPLACEMENT]
    ):
        sleep.rows[i, SLEEP_GROUP] = i + 1.0
        return True
    return False
