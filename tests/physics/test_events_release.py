"""Contacts that end in motion: when a wall lets a body go, with and without `Friction(0.0)`, at any step."""

from __future__ import annotations

import math

import mpmath
import numpy as np
import pytest

import physics
from tests.reference.release import ellipse, ladder, release
from tests.tiers.sweep import sweep

pytestmark = pytest.mark.interpreted

G = 9.81
FLOOR, LEFT = physics.HalfSpace((0, 1, 0)), physics.HalfSpace((1, 0, 0))
STEPS = (0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1)

# A step of the scheme is off by its tolerance, in speeds of the body; a push that falls by some weights in the body's
# time is then zero as much of that time too early or too late. Some ten steps, 0.1 s: 1e-10 s and 1e-13 s. Rounding of
# half a million parts of a second, which the motion amplifies, is below that. These are the numbers that are promised.
LATE = {"precise": 1e-9, "reference": 1e-10}  # [s]


def simulated(body, walls, friction, accuracy, dt, duration):
    """The trajectory over whole steps that take at least `duration`."""
    effects = [physics.Gravity((0, -G, 0)), physics.Contact()]
    if friction is not None:
        effects.append(physics.Friction(friction))
    return physics.simulate(physics.Scene([body], walls, effects), math.ceil(duration / dt) * dt, accuracy, dt)


def releases(trajectory, wall):
    return [event.t for event in trajectory.events if event.kind == "release" and event.wall == wall]


# Turned over its tip fast and slowly, the latter let go for 0.07 rad only; flat, so that the push falls within 0.1 rad.
SPINNING = {"fast": (0.3, 0.15, 14.0), "slow": (0.3, 0.15, 13.22), "flat": (0.3, 0.03, 18.1)}


@pytest.mark.parametrize("accuracy", sweep(LATE, ["precise"]))
@pytest.mark.parametrize("friction", sweep([None, 0.0], [0.0]))
@pytest.mark.parametrize("spinning", SPINNING)
def test_a_smooth_ellipsoid_lifts_off_as_it_turns_over_its_tip(spinning, friction, accuracy, is_exhaustive):
    a, b, rate = SPINNING[spinning]
    mass = 2.0
    truth = release(ellipse(a, b, mass, G), 0.0, rate, math.pi / 2, "floor")
    body = physics.Ellipsoid((a, b, 0.2), mass, pos=(0, b, 0), angvel=(0, 0, rate))
    after = 0.002  # in the air, above the floor
    for dt in STEPS if is_exhaustive else STEPS[1::2]:
        found = simulated(body, [FLOOR], friction, accuracy, dt, float(truth.time) + after)
        assert releases(found, 0) == pytest.approx([float(truth.time)], abs=LATE[accuracy]), dt


def leaning(width, rate):
    """A smooth ladder that slides down a wall, and its release."""
    length, depth, mass, start = 2.0, 0.4, 3.0, 1.2
    shape = ladder(length, width, mass, G)
    truth = release(shape, start, rate, 0.05, "left")
    turn = math.pi - start
    vel = [rate * float(mpmath.diff(f, start)) for f in (shape.x, shape.y)]
    body = physics.Block(
        (length, width, depth), mass, pos=(float(shape.x(start)), float(shape.y(start)), 0), linvel=(*vel, 0),
        quat=(math.cos(turn / 2), 0, 0, math.sin(turn / 2)), angvel=(0, 0, -rate),
    )  # fmt: skip
    return body, truth


@pytest.mark.parametrize("accuracy", LATE)
@pytest.mark.parametrize("friction", sweep([None, 0.0], [None]))
@pytest.mark.parametrize(("width", "rate"), [(0.05, 0.0), (0.4, -0.5)])
def test_a_smooth_ladder_leaves_the_wall(width, rate, friction, accuracy, is_exhaustive):
    body, truth = leaning(width, rate)
    for dt in STEPS if is_exhaustive else STEPS[2::3]:
        found = simulated(body, [FLOOR, LEFT], friction, accuracy, dt, float(truth.time) + 0.002)
        assert releases(found, 1) == pytest.approx([float(truth.time)], abs=LATE[accuracy]), dt
        assert not releases(found, 0)


@pytest.mark.parametrize("friction", sweep([None, 0.0], [None]))
@pytest.mark.parametrize(("width", "rate"), [(0.05, 0.0), (0.4, -0.5)])
def test_time_stepping_logs_a_release_within_a_step(width, rate, friction):
    """It is let go at the end of the last step in which it was pushed, however long it stays within its slop after."""
    body, truth = leaning(width, rate)
    for dt in STEPS[:-1]:
        found = simulated(body, [FLOOR, LEFT], friction, "balanced", dt, float(truth.time) + 0.03 + 3 * dt)
        assert releases(found, 1) == pytest.approx([float(truth.time)], abs=dt), dt
        assert [event.t for event in found.events] == sorted(event.t for event in found.events)


@pytest.mark.parametrize("accuracy", LATE)
def test_a_push_that_ends_for_less_than_a_step_is_seen_to_end(accuracy, is_exhaustive):
    """Ellipsoids that are let go by a little as they turn over their tips, for 0.01 rad to 0.1 rad; steps turn by 0.25.

    Near the tip the time depends on the start: by how much a change of the spin moves it stands beside the limit.
    """
    rng, mass = np.random.default_rng(1), 2.0
    for _ in range(10 if is_exhaustive else 2):
        a = rng.uniform(0.2, 0.4)
        b = a * rng.uniform(0.1, 0.8)
        inertia, tip = mass * (a * a + b * b) / 5, G * a / (a * a - b * b)  # tip: ω² for which the push just ends there
        spin = math.sqrt(tip + 2 * mass * G * (a - b) / inertia) * (1 + 10 ** rng.uniform(-5, -2))
        truth, moved = (
            release(ellipse(a, b, mass, G), 0.0, rate, math.pi / 2, "floor") for rate in (spin, spin * (1 + 1e-9))
        )
        limit = LATE[accuracy] * max(1.0, abs(float(moved.time - truth.time)) / 1e-9)
        body = physics.Ellipsoid((a, b, 0.2), mass, pos=(0, b, 0), angvel=(0, 0, spin))
        for dt in (0.01, 0.1):
            found = simulated(body, [FLOOR], None, accuracy, dt, float(truth.time) + 0.001)
            assert releases(found, 0)[:1] == pytest.approx([float(truth.time)], abs=limit), (a, b, dt)
