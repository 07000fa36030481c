"""Blocks on bodies with a prescribed motion: exact ways on a line, and a sliding point on a turntable by DOP853."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

GRAVITY = 9.81

# Step with which zeros of smooth functions are bracketed, as a share of the time that the user names.
SCAN_SHARE = 1e-3


def first_zero(f: Callable[[float], float], start: float, stop: float, step: float) -> float:
    """First sign change of f in (start, stop], or `stop`; f(start) itself may be 0 up to rounding."""
    t = start + 1e-9 * step
    while t < stop:
        later = min(t + step, stop)
        if f(t) * f(later) < 0.0:
            return float(brentq(f, t, later, xtol=1e-15, rtol=1e-15))
        t = later
    return stop


@dataclass(frozen=True)
class BlockOnBelt:
    """A block on a support that moves along a line with a smooth velocity; friction carries it.

    While it slips its acceleration is ±μ g. A slip ends where both velocities are equal. There it sticks if friction
    can give the acceleration of the support, until it cannot any more; else it slips the other way.

    Attributes
    ----------
    place, velocity, acceleration : callable
        Of the support at a time [m, m/s, m/s²].
    friction : float
        Coefficient μ.
    scale : float
        Time over which the motion of the support changes [s].
    """

    place: Callable[[float], float]
    velocity: Callable[[float], float]
    acceleration: Callable[[float], float]
    friction: float
    scale: float

    def state(self, t: float) -> tuple[float, float]:
        """Way [m] and velocity [m/s] at time t of a block that starts at rest."""
        now, x, v = 0.0, 0.0, 0.0
        sign, sticks = math.copysign(1.0, self.velocity(0.0)), self.velocity(0.0) == 0.0
        while now < t:
            if sticks:
                stop = self._end_of_hold(now, t)
                x, v, now = x + self.place(stop) - self.place(now), self.velocity(stop), stop
                sign, sticks = math.copysign(1.0, self.acceleration(stop)), False
                continue
            a = sign * self.friction * GRAVITY
            stop = self._end_of_slip(now, v, a, t)
            x, v, now = x + (stop - now) * (v + 0.5 * a * (stop - now)), v + a * (stop - now), stop
            sticks, sign = abs(self.acceleration(stop)) <= abs(a), -sign
        return x, v

    def _end_of_hold(self, start: float, t: float) -> float:
        """Time after `start`, at most t, from which friction cannot give the acceleration of the support."""
        most, step = self.friction * GRAVITY, self.scale * SCAN_SHARE
        if abs(self.acceleration(start + 1e-9 * step)) > most:
            return start
        return first_zero(lambda s: abs(self.acceleration(s)) - most, start, t, step)

    def _end_of_slip(self, start: float, speed: float, a: float, t: float) -> float:
        """Time after `start`, at most t, at which a block of velocity speed + a (t - start) has that of the support."""
        return first_zero(lambda s: self.velocity(s) - (speed + a * (s - start)), start, t, self.scale * SCAN_SHARE)


def on_turntable(place, velocity, spin: float, friction: float, t: float) -> np.ndarray:
    """Place (x, z) at time t of a point that slides on a table of the given spin about y, by DOP853.

    A point that moves with the table first, where friction cannot hold it, begins to slip outwards.
    """

    def rate(_, y):
        x, v = y[:2], y[2:]
        u = v - spin * np.array([x[1], -x[0]])  # the table's velocity is (0, spin, 0) x (x, 0, z)
        return np.concatenate([v, -friction * GRAVITY * u / np.linalg.norm(u)])

    x, v = np.array(place, dtype=float), np.array(velocity, dtype=float)
    if not np.linalg.norm(v - spin * np.array([x[1], -x[0]])) > 0.0:
        v = v + 1e-12 * x / np.linalg.norm(x)
    return solve_ivp(rate, (0.0, t), [*x, *v], "DOP853", rtol=1e-12, atol=1e-14).y[:2, -1]
