"""Planar truths at the edges of fixed bodies by DOP853: a block that slides off a ramp, a ball that leaves a ball.

Coordinates are x to the right and y up, gravity is along -y, and an angle turns from x to y.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

GRAVITY = 9.81  # [m/s²]
ACCURATE = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-14}


class Planar(NamedTuple):
    """Place of the centre of mass (2,) [m], angle [rad], velocity (2,) [m/s], angular velocity [rad/s]."""

    place: np.ndarray
    angle: float
    velocity: np.ndarray
    spin: float


class RampEnd(NamedTuple):
    """Block of mass 1 kg on a ramp that falls along +x and ends at the origin.

    Attributes
    ----------
    slope : float
        Angle of the ramp below the horizon [rad].
    friction : float
        Coulomb coefficient, below tan(slope).
    length, height : float
        Edges of the block along and across the ramp [m].
    start : float
        Distance of the block's centre from the end of the ramp, along the ramp [m], at which it is released from rest.
    """

    slope: float = 0.5
    friction: float = 0.2
    length: float = 0.6
    height: float = 0.25
    start: float = 0.8

    @property
    def down(self) -> np.ndarray:
        """Unit vector down the ramp."""
        return np.array([math.cos(self.slope), -math.sin(self.slope)])

    @property
    def up(self) -> np.ndarray:
        """Unit normal of the ramp."""
        return np.array([math.sin(self.slope), math.cos(self.slope)])

    @property
    def tipping_time(self) -> float:
        """Time at which the pressure reaches the end of the ramp and the block begins to tip [s].

        Friction μ N at the face, half a height below the centre, turns the block forward. So the pressure N acts μ
        times half a height ahead of the centre. The block starts to tip when that point is at the end of the ramp.
        """
        way = self.start - 0.5 * self.friction * self.height
        return math.sqrt(2.0 * way / self._acceleration)

    @property
    def _acceleration(self) -> float:
        return GRAVITY * (math.sin(self.slope) - self.friction * math.cos(self.slope))

    def sliding(self, t: float) -> Planar:
        """State at a time t [s] before the block tips: uniform acceleration."""
        way, a = 0.5 * self._acceleration * t * t, self._acceleration
        return Planar((way - self.start) * self.down + 0.5 * self.height * self.up, -self.slope, a * t * self.down, 0.0)

    def pressure(self, y: np.ndarray) -> tuple[float, np.ndarray, float]:
        """Pressure N of the edge on the face [N], and acceleration and angular acceleration with it.

        The face has the normal n, into the block, and the direction t. The edge at the origin touches it where
        g = n·x - height/2 is 0. With ṅ = -ω t, ṫ = ω n and the force N n - μ N t at the arm -x,

            g̈ = n·a - 2 ω t·v - α t·x - ω² n·x.

        Friction acts against the slip, which is along t.
        """
        x, v, w = y[:2], y[3:5], y[5]
        t = np.array([math.cos(y[2]), math.sin(y[2])])
        n = np.array([-t[1], t[0]])
        push = n - self.friction * t
        inertia = (self.length**2 + self.height**2) / 12.0
        turning = (-x[0] * push[1] + x[1] * push[0]) / inertia
        free = -GRAVITY * n[1] - 2.0 * w * (t @ v) - w * w * (n @ x)
        N = -free / (n @ push - turning * (t @ x))
        return N, np.array([0.0, -GRAVITY]) + N * push, N * turning

    def state(self, time: float) -> Planar:
        """State at a `time` after the release [s]: slides, tips about the edge while the face slips on it, flies.

        It flies once the edge no longer presses, or the rear corner has slipped past the edge.
        """
        if time <= self.tipping_time:
            return self.sliding(time)
        first = self.sliding(self.tipping_time)
        y = np.array([*first.place, first.angle, *first.velocity, first.spin])

        def rates(_, y):
            _, a, turning = self.pressure(y)
            return np.array([*y[3:], *a, turning])

        def leaves(_, y):
            return self.pressure(y)[0]

        def passes(_, y):
            return 0.5 * self.length - math.cos(y[2]) * y[0] - math.sin(y[2]) * y[1]

        leaves.terminal = passes.terminal = True
        tip = solve_ivp(rates, (self.tipping_time, time), y, events=(leaves, passes), **ACCURATE)
        y, left = tip.y[:, -1], time - tip.t[-1]
        fall = np.array([0.0, -0.5 * GRAVITY * left * left])
        return Planar(
            y[:2] + left * y[3:5] + fall, y[2] + left * y[5], y[3:5] + np.array([0.0, -GRAVITY * left]), float(y[5])
        )


class BallOnBall(NamedTuple):
    """Ball that slides without friction on a fixed ball at the origin, released from rest.

    Attributes
    ----------
    radius : float
        Sum of both radii: distance of the centres [m].
    start : float
        Angle of the centre from the vertical at the release [rad].
    """

    radius: float = 1.2
    start: float = 0.3

    @property
    def leaving(self) -> tuple[float, float, float]:
        """Time [s], angle [rad] and rate [rad/s] at which the ball leaves: the pressure g cos θ - R θ'² is 0."""

        def leaves(_, y):
            return GRAVITY * math.cos(y[0]) - self.radius * y[1] ** 2

        leaves.terminal = True
        run = solve_ivp(
            lambda _, y: (y[1], GRAVITY / self.radius * math.sin(y[0])), (0.0, 10.0), (self.start, 0.0), events=leaves,
            **ACCURATE,
        )  # fmt: skip
        return float(run.t[-1]), *map(float, run.y[:, -1])

    def place_after_leaving(self, later: float) -> np.ndarray:
        """Place (2,) of the centre a time `later` [s] after the ball has left [m]."""
        _, angle, rate = self.leaving
        place = self.radius * np.array([math.sin(angle), math.cos(angle)])
        velocity = self.radius * rate * np.array([math.cos(angle), -math.sin(angle)])
        return place + later * velocity + np.array([0.0, -0.5 * GRAVITY * later * later])
