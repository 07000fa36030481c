"""A cylinder that touches the floor y = 0 with one point of its lower rim: equations of motion, solved by DOP853.

The state is (x, q, v, ω): centre of mass, attitude, velocity and angular velocity, world frame. The axis a = R y has
the lower end -l a. With the unit vector n up, the lowest point of the rim is

    r = -l a + R_0 d,    d = -(n - (n·a) a)/|n - (n·a) a|,    R_0: the radius.

The contact force F acts there: m v' = m g + F, (I ω)' = r x F. Three laws give F:

- "rolling": the point does not move, v + ω x r = 0, so that v' + ω' x r + ω x r' = 0;
- "free": no friction; F is along n, and the normal part of the equation above holds;
- "sliding": F = N (n - μ u/|u|) for the slip u = v + ω x r.
"""

from __future__ import annotations

import math

import numpy as np
from scipy.integrate import solve_ivp

UP = np.array([0.0, 1.0, 0.0])


def rotation(q):
    """Rotation matrix of a unit quaternion (w, x, y, z)."""
    w, x, y, z = q
    return np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip


def lowest_point(R, omega, radius, height):
    """Lowest point of the lower rim from the centre, and its rate as it rolls along the rim [m, m/s]."""
    axis = R[:, 1]
    turn = np.cross(omega, axis)
    p = -(UP - (UP @ axis) * axis)
    rate = (UP @ turn) * axis + (UP @ axis) * turn
    size = np.linalg.norm(p)
    d = p / size
    return -0.5 * height * axis + radius * d, -0.5 * height * turn + radius * (rate - (rate @ d) * d) / size


def derivative(y, radius, height, law, mu, g):
    """Rate of the state (13,) of a cylinder of mass 1 kg; `law` as of this module."""
    q, v, omega = y[3:7], y[7:10], y[10:13]
    R = rotation(q / np.linalg.norm(q))
    across = radius**2 / 4 + height**2 / 12
    inertia = R @ np.diag([across, radius**2 / 2, across]) @ R.T
    r, rate = lowest_point(R, omega, radius, height)
    spin = np.cross(inertia @ omega, omega)
    cross = np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
    inverse = np.linalg.inv(inertia)
    # Acceleration of the point: W F + free, with W = 1/m - [r] I⁻¹ [r].
    W = np.eye(3) - cross @ inverse @ cross
    free = -g * UP - cross @ (inverse @ spin) + np.cross(omega, rate)
    if law == "rolling":
        force = np.linalg.solve(W, -free)
    else:
        u = v + np.cross(omega, r)
        slip = u - (u @ UP) * UP
        way = UP - mu * slip / np.linalg.norm(slip) if law == "sliding" else UP
        force = -(UP @ free) / (UP @ W @ way) * way
    w, x, yy, z = q
    a, b, c = omega
    turn = 0.5 * np.array(
        [-a * x - b * yy - c * z, a * w + b * z - c * yy, b * w + c * x - a * z, c * w + a * yy - b * x]
    )
    return np.concatenate((v, turn, force - g * UP, inverse @ (spin + np.cross(r, force)))), force


def motion(start, duration, radius, height, *, law="rolling", mu=0.0, g=9.81):
    """State (13,) after `duration` [s], from the state `start` (13,), by DOP853 to 1e-13."""
    found = solve_ivp(
        lambda t, y: derivative(y, radius, height, law, mu, g)[0], (0.0, duration), start,
        method="DOP853", rtol=1e-13, atol=1e-14,
    )  # fmt: skip
    assert found.success
    return found.y[:, -1]


def tilted(tilt, omega, radius, height, slip=(0.0, 0.0, 0.0)):
    """State (13,) whose axis leans by `tilt` [rad] from world y towards z, with the lowest point's velocity `slip`."""
    q = np.array([math.cos(0.5 * tilt), math.sin(0.5 * tilt), 0.0, 0.0])
    omega = np.asarray(omega, float)
    r, _ = lowest_point(rotation(q), omega, radius, height)
    return np.concatenate(((0.0, -r[1], 0.0), q, np.asarray(slip) - np.cross(omega, r), omega))


def steady_precession(tilt, rate, radius, height, g=9.81):
    """Angular velocity (3,) with which a cylinder rolls in a circle: its axis turns about y at `rate` [rad/s].

    With the axis a, the tilt θ of a from y, and the spin s about the axis, ω = rate y + s a. The lowest point is at
    b = -l a + R_0 d. The centre of mass moves on a circle at v = -ω x b, with the acceleration rate y x v, so that the
    force is F = rate y x v + g y for a mass of 1 kg. The angular momentum L = I ω turns with the axis: rate y x L = b x
    F. All these vectors are across the horizontal axis of the tilt, x, so that one linear equation for s is left.
    """
    q = (math.cos(0.5 * tilt), math.sin(0.5 * tilt), 0.0, 0.0)
    R = rotation(q)
    across = radius**2 / 4 + height**2 / 12
    inertia = R @ np.diag([across, radius**2 / 2, across]) @ R.T
    r, _ = lowest_point(R, np.zeros(3), radius, height)

    def torque_left(spin):
        omega = rate * UP + spin * R[:, 1]
        force = rate * np.cross(UP, -np.cross(omega, r)) + g * UP
        return (np.cross(r, force) - rate * np.cross(UP, inertia @ omega))[0]

    zero, one = torque_left(0.0), torque_left(1.0)
    return rate * UP + zero / (zero - one) * R[:, 1]
