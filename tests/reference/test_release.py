"""The closed forms of a release, against what is known of them otherwise."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.reference.release import ellipse, ladder, release

G = 9.81


def test_a_rod_leaves_the_wall_when_its_top_has_fallen_by_a_third():
    """The textbook's ladder: sinθ = (2/3) sinθ₀ from rest, with ω² = 3 g (sinθ₀ - sinθ)/l."""
    length, start = 2.0, 1.2
    found = release(ladder(length, 0.0, 3.0, G), start, 0.0, 0.05, "left")
    assert mpmath.sin(found.angle) == pytest.approx(2 / 3 * math.sin(start), abs=1e-15)
    assert found.rate**2 == pytest.approx(G / length * math.sin(start), rel=1e-15)


def test_an_ellipse_leaves_the_floor_where_the_equations_of_motion_let_it():
    """Lagrange's equation by DOP853, without the energy: let go where y'' ω² = -g, since then nothing turns it."""
    a, b, mass, rate = 0.3, 0.15, 2.0, 14.0
    inertia = mass * (a * a + b * b) / 5
    c = a * a - b * b

    def slopes(t):
        y = math.sqrt((a * math.sin(t)) ** 2 + (b * math.cos(t)) ** 2)
        y1 = c * math.sin(2 * t) / (2 * y)
        return y1, (c * math.cos(2 * t) - y1 * y1) / y

    def rates(_, s):
        y1, y2 = slopes(s[0])
        return s[1], -mass * y1 * (y2 * s[1] ** 2 + G) / (inertia + mass * y1 * y1)

    def push(_, s):
        return slopes(s[0])[1] * s[1] ** 2 + G

    push.terminal, push.direction = True, -1
    run = solve_ivp(rates, (0, 1), (0.0, rate), "DOP853", rtol=1e-13, atol=1e-15, events=push)
    found = release(ellipse(a, b, mass, G), 0.0, rate, math.pi / 2, "floor")
    # DOP853 makes some ten steps of 1e-13 each; its dense output, of order 7, is as good where steps are that short.
    np.testing.assert_allclose(run.y_events[0][0], [float(found.angle), float(found.rate)], rtol=1e-11)
    assert run.t_events[0][0] == pytest.approx(float(found.time), rel=1e-11)
