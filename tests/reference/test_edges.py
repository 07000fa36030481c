"""The planar truths at edges: energy, closed forms, and limits that they do not use."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.reference.edges import GRAVITY, BallOnBall, RampEnd


def energy(ramp: RampEnd, time: float) -> float:
    """Energy of the block per mass [m²/s²]: kinetic, of rotation, of gravity."""
    state = ramp.state(time)
    inertia = (ramp.length**2 + ramp.height**2) / 12.0
    return 0.5 * state.velocity @ state.velocity + 0.5 * inertia * state.spin**2 + GRAVITY * state.place[1]


@pytest.mark.parametrize("later", [0.01, 0.05, 0.1, 0.15, 0.3])
def test_ramp_without_friction_keeps_energy(later):
    """An independent check of the pressure: a wrong one would do work, since the face moves. To DOP853's 1e-13."""
    ramp = RampEnd(friction=0.0)
    assert energy(ramp, ramp.tipping_time + later) == pytest.approx(energy(ramp, 0.0), abs=1e-11)


def test_friction_takes_energy_at_the_edge():
    """While the block tips the loss is the work μ N u of the slip u = t·v, integrated here by Simpson's rule."""
    ramp, first, last = RampEnd(), RampEnd().tipping_time, RampEnd().tipping_time + 0.1
    times = np.linspace(first, last, 201)
    power = []
    for time in times:
        state = ramp.state(time)
        t = np.array([math.cos(state.angle), math.sin(state.angle)])
        arm = -state.place
        point = state.velocity + state.spin * np.array([-arm[1], arm[0]])
        y = np.array([*state.place, state.angle, *state.velocity, state.spin])
        power.append(ramp.friction * ramp.pressure(y)[0] * (t @ point))
    weights = np.tile([2.0, 4.0], 100)
    work = (times[1] - times[0]) / 3.0 * (np.dot([*weights, 2.0], power) - power[0] - power[-1])
    # Simpson's error: 4th derivative of a smooth power over (0.1 s/200)⁴.
    assert energy(ramp, first) - energy(ramp, last) == pytest.approx(work, rel=1e-8)


def test_tipping_begins_smoothly():
    """At the tipping time the pressure is that of the slide, m g cos of the slope, and nothing turns the block."""
    ramp = RampEnd()
    start = ramp.sliding(ramp.tipping_time)
    y = np.array([*start.place, start.angle, *start.velocity, start.spin])
    pressure, _, turning = ramp.pressure(y)
    assert pressure == pytest.approx(GRAVITY * math.cos(ramp.slope), rel=1e-12)
    assert turning == pytest.approx(0.0, abs=1e-11)


@pytest.mark.parametrize("start", [0.1, 0.3, 0.8])
def test_ball_leaves_a_ball_at_two_thirds_of_the_cosine(start):
    """Energy and pressure together: g cos θ = R θ'² = 2 g (cos θ0 - cos θ)."""
    _, angle, _ = BallOnBall(start=start).leaving
    assert math.cos(angle) == pytest.approx(2.0 / 3.0 * math.cos(start), abs=1e-12)
