"""The equations of an ellipsoid that slides and sticks, against closed forms, and the truths that are stored."""

from __future__ import annotations

import numpy as np
import pytest

from rigid_env.hard_cases.cases import letting_go
from tests.reference import restick
from tests.reference.restick import Ellipsoid, State

G = 9.81


def test_a_ball_sticks_when_it_rolls():
    """v falls with μ g and r ω grows with 5/2 μ g: the slip v₀ ends after 2 v₀/(7 μ g), v is then 5/7 of v₀."""
    radius, mu, slip = 0.2, 0.3, np.array([0.6, -0.8])
    ball = Ellipsoid(np.full(3, radius), 2.0, mu, G)
    end = restick.slide(ball, State(0.0, np.zeros(2), np.array([1.0, 0, 0, 0]), np.zeros(3), slip))
    time = 2 / (7 * mu * G)
    assert end.t == pytest.approx(time, abs=1e-14)
    assert end.place == pytest.approx(slip * (time - mu * G * time**2 / 2), abs=1e-14)
    assert restick.velocity(ball, end.quat, end.angvel, end.slip)[[0, 2]] == pytest.approx(5 / 7 * slip, abs=1e-13)


def test_a_body_that_rolls_keeps_its_energy_and_loses_what_friction_takes():
    """½ m v² + ½ ω·Iω + m g y of what rolls is constant: friction at a point that stands still does no work."""
    truth = restick.load()[0]
    body = truth.body

    def energy(state):
        R = restick.rotation_matrix(state.quat)
        v = restick.velocity(body, state.quat, state.angvel, state.slip)
        r, _ = restick.arm_and_rate(body, R, state.angvel)
        spin = R.T @ state.angvel
        return 0.5 * body.mass * v @ v + 0.5 * spin @ (body.inertia * spin) - body.mass * G * r[1]

    slipping, holds = restick.roll(body, truth.start, 0.3)
    assert not holds
    assert slipping.t == pytest.approx(truth.slips, abs=1e-12)
    assert energy(slipping) == pytest.approx(energy(truth.start), rel=1e-12)
    assert energy(truth.sticks) < energy(slipping)


@pytest.mark.parametrize("k", [0, pytest.param(12, marks=pytest.mark.exhaustive)])
def test_the_stored_truths_can_be_had_again_with_a_slip_half_as_stiff(k, monkeypatch):
    """From a tenth of the speed with which a slip begins, and to ten times that up to which it is called stiff."""
    truth = restick.load()[k]
    monkeypatch.setattr(restick, "FIRST", 0.1 * restick.FIRST)
    monkeypatch.setattr(restick, "MOVING", 10 * restick.MOVING)
    again = restick.run(truth.body, truth.start)
    assert again.slips == pytest.approx(truth.slips, abs=1e-12)
    assert again.sticks.t == pytest.approx(truth.sticks.t, abs=1e-12)
    assert again.sticks.place == pytest.approx(truth.sticks.place, abs=1e-12)


def test_the_hard_case_is_one_of_them():
    truth = next(one for one in restick.load() if one.body.friction == letting_go.FRICTION)
    assert (*truth.body.axes, truth.body.mass) == (*letting_go.AXES, letting_go.WEIGHS)
    assert (*truth.start.quat, *truth.start.angvel) == (*letting_go.START, *letting_go.SPIN)
    assert (truth.slips, truth.sticks.t) == (letting_go.SLIPS, letting_go.STICKS)
    assert (*truth.sticks.place, *truth.sticks.quat) == (*letting_go.PLACE, *letting_go.ATTITUDE)
