"""Bound of the time for which a flying body reaches no wall."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.polynomial import Chebyshev
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import physics
from physics.kernels.event_driven.time_of_impact import gap_jerk_bound, gap_safe_time, parabola_root
from tests.kernels.called import called

pytestmark = pytest.mark.interpreted

EPS = np.finfo(float).eps


def none_or_some(most):
    """Numbers up to `most` that are zero or not so small that a root is beyond the largest number."""
    return st.floats(-most, most).filter(lambda a: a == 0 or abs(a) > 1e-6)


GAP, RATE, BEND = st.floats(1e-6, 10), none_or_some(10), none_or_some(30)


@given(GAP, RATE, BEND)
def test_parabola_root_is_the_first_zero(g, r, b):
    t = parabola_root(g, r, b)
    if t == math.inf:
        # Never below zero: at its lowest place, rounding of r² aside.
        lowest = g - r * r / (2 * b) if b > 0 and r < 0 else g
        assert lowest >= -8 * EPS * g
        assert b > 0 or (b == 0 and r >= 0)
        return
    # Zero to the rounding of its terms, and positive before it (it is the smaller of the positive roots).
    size = g + abs(r) * t + abs(b) * t * t
    assert abs(g + r * t + b * t * t / 2) <= 16 * EPS * size
    for share in np.linspace(0, 1 - 1e-6, 20):
        s = share * t
        assert g + r * s + b * s * s / 2 >= -16 * EPS * size


@given(GAP, RATE, BEND, st.floats(0, 50), st.floats(1e-3, 10), st.lists(st.floats(-1, 1), min_size=3))
def test_safe_time_is_never_beyond_the_first_zero(g, r, b, third, horizon, shares):
    """Any gap whose third derivative stays within the bound, its worst case too, is not used up by then."""
    t = gap_safe_time(g, r, b, third, horizon)
    assert 0 < t <= horizon
    scale = g + abs(r) * t + abs(b) * t * t + third * t**3
    # A constant third derivative -third is the worst; then piecewise constant ones, each sampled.
    for s in np.linspace(0, t, 100):
        assert g + r * s + b * s * s / 2 - third * s**3 / 6 >= -1e-13 * scale
    y, h = [g, r, b], t / len(shares)
    for share in shares:
        c = share * third
        for s in np.linspace(0, h, 8):
            assert y[0] + y[1] * s + y[2] * s * s / 2 + c * s**3 / 6 >= -1e-13 * scale
        y = [y[0] + y[1] * h + y[2] * h * h / 2 + c * h**3 / 6, y[1] + y[2] * h + c * h * h / 2, y[2] + c * h]


@pytest.mark.parametrize("b", [-9.81, 0.0, 4.0])
def test_safe_time_without_a_third_derivative_is_the_zero_itself(b):
    assert gap_safe_time(1.0, -4.0, b, 0.0, 10.0) == parabola_root(1.0, -4.0, b)


def test_safe_time_of_a_contact_that_is_about_to_leave():
    """From no gap and no speed at all: b t²/2 - C t³/6 is zero at 3 b / C."""
    assert gap_safe_time(0.0, 0.0, 4.0, 6.0, 10.0) == pytest.approx(2.0, rel=4 * EPS)
    assert gap_safe_time(0.0, 0.0, 4.0, 6.0, 1.0) == 1.0


@given(GAP, RATE, BEND, st.floats(0, 15), st.floats(1e-3, 10))
@example(1.0, -4.0, 10.0, 1.0, 1.0)
def test_safe_time_is_safe_and_cannot_be_doubled(g, r, b, digits, horizon):
    """However loose the bound C of the third derivative is: g + r t + b t²/2 - C t³/6 is positive before the safe time.

    On τ <= h the parabola with b - C h/3 lies below that cubic by C τ² (h - τ)/6, so that its root is safe, and falls
    with h. The time is doubled until the parabola over twice the time has its root within the time: a horizon twice as
    long gains nothing. A C of 10¹⁵ takes 50 doublings from the first guess.
    """
    third = 10.0**digits
    t = gap_safe_time(g, r, b, third, horizon)
    assert 0.0 <= t <= horizon
    tau = np.linspace(0.0, t, 101)
    sizes = g + abs(r) * tau + abs(b) * tau**2 / 2 + third * tau**3 / 6
    assert (g + r * tau + b * tau**2 / 2 - third * tau**3 / 6 >= -16 * EPS * sizes).all()
    assert t == horizon or parabola_root(g, r, b - third * min(2 * t, horizon) / 3) <= t * (1 + 16 * EPS)


# --- the bound of the third derivative -------------------------------------------------------------------------------


def turning(body, torque, times):
    """(times, 3, 3) rotation matrices of a body under a torque held in the world frame, by SciPy."""
    tensor = body.inertia

    def rate(_, s):
        R = s[:9].reshape(3, 3)
        w = R @ np.linalg.solve(tensor, R.T @ s[9:])
        return np.concatenate([np.cross(w, R.T).T.ravel(), torque])

    R = Rotation.from_quat(np.roll(body.quat, -1)).as_matrix()
    start = np.concatenate([R.ravel(), R @ tensor @ R.T @ body.angvel])
    path = solve_ivp(rate, (0.0, times[-1]), start, t_eval=times, method="DOP853", rtol=1e-12, atol=1e-12)
    return path.y[:9].T.reshape(-1, 3, 3)


def gaps(body, R, normal):
    """(features, times) gaps to a plane through the centre: of corners, or of an ellipsoid's lowest point."""
    local = R.transpose(0, 2, 1) @ normal
    if isinstance(body, physics.Block):
        corners = 0.5 * np.array(body.size) * [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
        return corners @ local.T
    return -np.linalg.norm(local * body.semi_axes, axis=1)[None]


@pytest.mark.parametrize("strength", [0.0, 5.0])
@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("kind", [physics.Block, physics.Ellipsoid])
def test_no_gap_has_a_larger_third_derivative_than_its_bound(kind, seed, strength):
    """Over a time in which the body turns by a radian: derivative of the Chebyshev series of degree 24 of the gap.

    Its coefficients fall below 1e-10 by then, and three derivatives of degree 24 raise what is left of them by less
    than 24⁶/15 = 1e7 times 8/time³ (Markov): 1e-2 of a bound that is off by more than that.
    """
    rng = np.random.default_rng(seed)
    q = rng.normal(size=4)
    size, turn = np.exp(rng.uniform(-1.5, 1.0, 3)), rng.normal(size=3)
    body = kind(tuple(size), 1.0, quat=tuple(q / np.linalg.norm(q)), angvel=tuple(turn))
    torque, normal = strength * rng.normal(size=3), np.array([0.0, 1.0, 0.0])
    scene = physics.Scene([body], [physics.HalfSpace(normal, -50.0)], [physics.Contact()])
    world = physics.World(scene, dt=1e-12, accuracy="precise")
    y = tuple(tuple(part.tolist()) for part in np.split(world.state[0, :13], [3, 7, 10]))
    world.step(np.array([[[0.0, 0.0, 0.0, *torque]]]))  # binds the body
    left = 1.0 / (1.0 + np.linalg.norm(body.angvel))
    bound = called(gap_jerk_bound, y, left, None, world.scratch[0]["body"][0])
    times = 0.5 * left * (1.0 - np.cos(np.pi * np.arange(49) / 48))
    for gap in gaps(body, turning(body, torque, times), normal):
        third = Chebyshev.fit(times, gap, 24).deriv(3)(times)
        assert np.abs(third).max() <= bound
