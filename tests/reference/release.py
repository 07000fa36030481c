"""The moment at which a frictionless wall lets a body go: closed forms of planar bodies with one degree of freedom.

A body whose centre is at (x(θ), y(θ)) while it touches has, with s = x'² + y'²,

    ½ (I + m s) ω² + m g y = E,    (I + m s) ω̇ = -½ m s' ω² - m g y',

so that ω(θ) is known from the energy. The push of the floor is m (g + y'' ω² + y' ω̇), that of a wall at the left
m (x'' ω² + x' ω̇). It ends at the first θ where that is zero, at the time ∫ dθ/ω, both to many digits (mpmath).
From there the centre is on a parabola and ω is constant.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import mpmath

DIGITS = 40
LOOKS = 400  # at the push, along the way, for its first sign


class Planar(NamedTuple):
    """A body that turns by θ about z while it touches frictionless walls."""

    x: Callable  # of the centre, of θ [m]
    y: Callable
    mass: float
    inertia: float  # about z, at the centre
    gravity: float


class Release(NamedTuple):
    """Motion of the body as it is let go."""

    time: mpmath.mpf  # [s]
    angle: mpmath.mpf  # [rad]
    rate: mpmath.mpf  # [rad/s]
    pos: tuple  # (x, y) of the centre [m]
    vel: tuple  # [m/s]


def _rate_squared(body: Planar, start, rate, angle):
    """ω² at `angle`, of a body that began at `start` with `rate`."""
    m, g = body.mass, body.gravity

    def moved(a):
        return body.inertia + m * (mpmath.diff(body.x, a) ** 2 + mpmath.diff(body.y, a) ** 2)

    return (moved(start) * rate**2 + 2 * m * g * (body.y(start) - body.y(angle))) / moved(angle)


def _push(body: Planar, wall: str, square, angle):
    """Push per kilogram of the wall "floor" or "left", where ω² is `square`."""
    x1, x2, y1, y2 = (mpmath.diff(f, angle, n) for f in (body.x, body.y) for n in (1, 2))
    m = body.mass
    rate = -(m * (x1 * x2 + y1 * y2) * square + m * body.gravity * y1) / (body.inertia + m * (x1**2 + y1**2))
    return body.gravity + y2 * square + y1 * rate if wall == "floor" else x2 * square + x1 * rate


def release(body: Planar, start, rate, end, wall: str) -> Release:
    """When `wall` lets the body go that turns from `start` towards `end` [rad] at `rate` [rad/s] (may be 0) first.

    Raises
    ------
    ValueError
        It does not, on this way.
    """
    with mpmath.workdps(DIGITS):
        start, rate, end = mpmath.mpf(start), mpmath.mpf(rate), mpmath.mpf(end)

        def push(angle):
            return _push(body, wall, _rate_squared(body, start, rate, angle), angle)

        def spin(angle):
            return mpmath.sqrt(_rate_squared(body, start, rate, angle))

        angles = [start + (end - start) * k / LOOKS for k in range(1, LOOKS + 1)]
        pushes = [push(angle) for angle in angles]
        first = next((k for k in range(1, LOOKS) if pushes[k] < 0 < pushes[k - 1]), None)
        if first is None:
            raise ValueError("the wall does not let the body go on this way")
        angle = mpmath.findroot(push, (angles[first - 1], angles[first]), solver="anderson", tol=1e-60)
        sign = mpmath.sign(end - start)
        time = mpmath.quad(lambda a: sign / spin(a), [start, (start + angle) / 2, angle])
        rate = sign * spin(angle)
        vel = tuple(mpmath.diff(f, angle) * rate for f in (body.x, body.y))
        return Release(time, angle, rate, (body.x(angle), body.y(angle)), vel)


def ellipse(a, b, mass, gravity) -> Planar:
    """Ellipsoid with half-axes a, b in the plane of its motion, a horizontal at θ = 0, on the floor y = 0.

    Nothing pushes along x: the centre has the height of its support, y = √(a² sin²θ + b² cos²θ).
    """
    a, b = mpmath.mpf(a), mpmath.mpf(b)

    def height(angle):
        return mpmath.sqrt((a * mpmath.sin(angle)) ** 2 + (b * mpmath.cos(angle)) ** 2)

    mass = mpmath.mpf(mass)
    return Planar(lambda angle: mpmath.mpf(0), height, mass, mass * (a * a + b * b) / 5, mpmath.mpf(gravity))


def ladder(length, width, mass, gravity) -> Planar:
    """Block that leans with its lower side's ends at the wall x = 0 and on the floor y = 0, θ from the horizontal.

    From the end at the wall, (0, l sinθ), half the length along the ladder and half the width across it:
    x = (l cosθ + w sinθ)/2, y = (l sinθ + w cosθ)/2. Without width its top leaves where it has fallen by a third.
    """
    length, width, mass = mpmath.mpf(length), mpmath.mpf(width), mpmath.mpf(mass)

    def x(angle):
        return (length * mpmath.cos(angle) + width * mpmath.sin(angle)) / 2

    def y(angle):
        return (length * mpmath.sin(angle) + width * mpmath.cos(angle)) / 2

    return Planar(x, y, mass, mass * (length**2 + width**2) / 12, mpmath.mpf(gravity))
