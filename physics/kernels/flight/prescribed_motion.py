"""Prescribed motion of a body: at constant velocity and spin, or through the poses of a table.

Between two knots of a table at the distance h, with s = (t - t₀)/h, each coordinate y is Hermite's cubic

    y(s) = y₀ + s h y'₀ + s² (3 d - 2 h y'₀ - h y'₁) + s³ (h y'₀ + h y'₁ - 2 d),    d = y₁ - y₀.

`physics.scene.motion` chooses the slopes y' so that the second derivative is continuous, too. The four components of
the quaternion are interpolated like places; their sum c is then scaled to q = c/|c|. With its derivative
q' = (c' - q (q·c'))/|c| the angular velocity is the vector part of 2 q' q*.

`m` (bodies, columns) holds the motion of each body of a world, in the columns below.
"""

from __future__ import annotations

import math

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import plus, row_vector, times

# Columns: kind of the motion; velocity and spin of a steady motion, world frame; velocity of the surface along the
# body, body frame; time of the world at which a table starts [s]; its period [s], 0 if it ends; number of its knots.
KIND, VELOCITY, SPIN, SURFACE, START, PERIOD, KNOTS = 0, 1, 4, 7, 10, 11, 12
MOTION_SIZE = 13

# Kinds of motion.
STILL, STEADY, TABLE = range(3)

# Columns of a knot, which follow `MOTION_SIZE`: time [s], place and its slope, quaternion and its slope.
KNOT_TIME, KNOT_PLACE, KNOT_QUAT = 0, 1, 7
KNOT_SIZE = 15


@inlined
def _find_knot(m, b, t):
    """First column of the last knot of body b at or before the time t of the table [s], except the last knot of all."""
    low, high = 0, int(m[b, KNOTS]) - 1
    while high - low > 1:
        middle = (low + high) // 2
        if m[b, MOTION_SIZE + KNOT_SIZE * middle + KNOT_TIME] <= t:
            low = middle
        else:
            high = middle
    return MOTION_SIZE + KNOT_SIZE * low


@inlined
def _end_of_table(m, b):
    return m[b, MOTION_SIZE + KNOT_SIZE * (int(m[b, KNOTS]) - 1) + KNOT_TIME]


@inlined
def _table_time(m, b, t):
    """Time of the table of body b at the time t of the world [s]: at its ends it stands, or begins again."""
    s, period = t - m[b, START], m[b, PERIOD]
    if period > 0.0:
        return s - period * math.floor(s / period)
    return min(max(s, 0.0), _end_of_table(m, b))


@inlined
def _stands(m, b, t):
    """True if the table of body b has not begun, or has ended, at the time t of the world [s]."""
    return m[b, PERIOD] == 0.0 and not 0.0 < t - m[b, START] < _end_of_table(m, b)


@inlined
def _interpolate(m, b, knot, size, column, s, h):
    """Value and derivative of one coordinate of body b, in its `column` of a knot and, `size` further on, its slope."""
    y, z = m[b, knot + column], m[b, knot + KNOT_SIZE + column]
    u, w, d = h * m[b, knot + column + size], h * m[b, knot + KNOT_SIZE + column + size], z - y
    second, third = 3.0 * d - 2.0 * u - w, u + w - 2.0 * d
    return y + s * (u + s * (second + s * third)), (u + s * (2.0 * second + 3.0 * s * third)) / h


@inlined
def _share_of_interval(m, b, t):
    """Place of the time t of a table between two knots of body b: (column of the first, share, interval [s])."""
    knot = _find_knot(m, b, t)
    start = m[b, knot + KNOT_TIME]
    h = m[b, knot + KNOT_SIZE + KNOT_TIME] - start
    return knot, (t - start) / h, h


@kernel
def table_pose(m, b, t):
    """Place [m] and attitude of body b at the time t of the world [s], by its table."""
    knot, s, h = _share_of_interval(m, b, _table_time(m, b, t))
    x = (
        _interpolate(m, b, knot, 3, KNOT_PLACE, s, h)[0],
        _interpolate(m, b, knot, 3, KNOT_PLACE + 1, s, h)[0],
        _interpolate(m, b, knot, 3, KNOT_PLACE + 2, s, h)[0],
    )
    q = (
        _interpolate(m, b, knot, 4, KNOT_QUAT, s, h)[0],
        _interpolate(m, b, knot, 4, KNOT_QUAT + 1, s, h)[0],
        _interpolate(m, b, knot, 4, KNOT_QUAT + 2, s, h)[0],
        _interpolate(m, b, knot, 4, KNOT_QUAT + 3, s, h)[0],
    )
    return x, qt.normalise(q)


@kernel
def table_twist(m, b, t):
    """Velocity [m/s] and angular velocity [rad/s] of body b at the time t of the world [s], by its table."""
    if _stands(m, b, t):
        return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    knot, s, h = _share_of_interval(m, b, _table_time(m, b, t))
    v = (
        _interpolate(m, b, knot, 3, KNOT_PLACE, s, h)[1],
        _interpolate(m, b, knot, 3, KNOT_PLACE + 1, s, h)[1],
        _interpolate(m, b, knot, 3, KNOT_PLACE + 2, s, h)[1],
    )
    w, w_rate = _interpolate(m, b, knot, 4, KNOT_QUAT, s, h)
    x, x_rate = _interpolate(m, b, knot, 4, KNOT_QUAT + 1, s, h)
    y, y_rate = _interpolate(m, b, knot, 4, KNOT_QUAT + 2, s, h)
    z, z_rate = _interpolate(m, b, knot, 4, KNOT_QUAT + 3, s, h)
    turn = qt.multiply((w_rate, x_rate, y_rate, z_rate), (w, -x, -y, -z))  # its scalar part only changes |c|
    scale = 2.0 / (w * w + x * x + y * y + z * z)
    return v, (scale * turn[1], scale * turn[2], scale * turn[3])


@inlined
def twist_at(m, b, t):
    """Velocity [m/s] and angular velocity [rad/s] of body b at the time t of the world [s], world frame."""
    if m[b, KIND] == TABLE:
        return table_twist(m, b, t)
    return row_vector(m, b, VELOCITY), row_vector(m, b, SPIN)


@inlined
def pose_after(m, b, x, q, t, h):
    """Place and attitude of body b at the time t + h of the world [s], if they are x and q at the time t."""
    if m[b, KIND] == TABLE:
        return table_pose(m, b, t + h)
    turn = qt.exp_map(times(h, row_vector(m, b, SPIN)))
    return plus(x, times(h, row_vector(m, b, VELOCITY))), qt.normalise(qt.multiply(turn, q))
