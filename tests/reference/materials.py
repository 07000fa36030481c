"""Materials in plain Python: rules that combine two coefficients, and a block that slides in a corner."""

import math

from scipy.integrate import solve_ivp

COMBINED = {
    "minimum": min,
    "average": lambda a, b: (a + b) / 2,
    "geometric_mean": lambda a, b: math.sqrt(a * b),
    "product": lambda a, b: a * b,
    "maximum": max,
}


def block_in_corner(duration, speed, slope, floor, side, g):
    """Way [m] and speed [m/s] of a block that slides along two walls at right angles, after `duration` [s].

    Gravity g presses the block onto the floor with m g cos(slope), and onto the side wall with m g sin(slope). Both are
    parallel to the motion, so each brakes with its coefficient times its normal force. By DOP853, to rest.
    """
    brake = g * (floor * math.cos(slope) + side * math.sin(slope))

    def stops(t, y):
        return y[1]

    stops.terminal = True
    found = solve_ivp(
        lambda t, y: (y[1], -brake), (0, duration), (0.0, speed), "DOP853", events=stops, rtol=1e-13, atol=1e-13
    )
    way, left = found.y[:, -1]
    return way, left if found.status == 0 else 0.0
