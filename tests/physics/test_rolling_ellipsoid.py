"""Ellipsoids that roll and rock: the floor that carries them is hit once, when they land."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import physics
from rigid_env.hard_cases.cases.rolling import Ellipse
from rigid_env.hard_cases.cases.scenery import on_floor
from tests.reference import ellipsoid_on_floor as truth

pytestmark = pytest.mark.interpreted

G = 9.81
SECONDS = 2.0
STEPS = (2e-3, 1e-2, 2e-2)  # at 50 ms the push of some grows twentyfold within a step
ELLIPSE = Ellipse(0.5, 0.3)


def started(seed: int, mode: str) -> physics.Ellipsoid:
    """On the floor, of random half-axes and attitude, spinning at up to some rad/s; rolling or sliding on it."""
    rng = np.random.default_rng(seed)
    axes, q = 10 ** rng.uniform(-0.7, 0.0, 3), rng.normal(size=4)
    q, w = q / np.linalg.norm(q), rng.choice([0.3, 1.0, 3.0]) * rng.normal(size=3)
    r = truth.contact_point(axes, truth.rotation_matrix(q))
    v = -np.cross(w, r)
    if mode == truth.SMOOTH:
        v[[0, 2]] = rng.normal(size=2)
    return physics.Ellipsoid(axes, 1.0, pos=(0, -r[1], 0), quat=q, linvel=v, angvel=w)


@pytest.mark.parametrize("accuracy", ["fast", "balanced"])
@pytest.mark.parametrize(("mode", "mu"), [(truth.SMOOTH, 0.0), (truth.ROLLS, 10.0)])
def test_what_is_pressed_to_the_floor_neither_hits_nor_leaves_it(mode, mu, accuracy, is_exhaustive):
    """No body does whose push stays above a twentieth of its weight (and within the cone), by DOP853."""
    times, tried = np.linspace(0.0, SECONDS, 101), 0
    for seed in range(12):
        if tried == 1 and not is_exhaustive:
            break
        body = started(seed, mode)
        motion = truth.move(body, mode, times, mu=mu)
        if motion.push.min() < 0.05 * G or (mu > 0.0 and motion.grip.max() > 0.5 * mu):
            continue
        tried += 1
        for dt in STEPS:
            duration = SECONDS if is_exhaustive else min(SECONDS, 100 * dt)
            run = physics.simulate(on_floor(body, 0.5, mu), duration, accuracy, dt=dt, sample_dt=dt)
            assert {event.kind for event in run.events} <= {"touch"}, (seed, dt)
    assert tried >= (3 if is_exhaustive else 1)


def test_the_reference_keeps_the_energy_and_the_contact():
    """½ m v² + ½ ω·I ω + m g y stays, and so does the height of the lowest point: forces without power, u·n = 0."""
    for mode, mu in ((truth.SMOOTH, 0.0), (truth.ROLLS, 10.0)):
        body = started(3, mode)
        motion = truth.move(body, mode, np.linspace(0.0, SECONDS, 21), mu=mu)
        scene = on_floor(body, 0.0, mu)
        parts = (x[:, None] for x in (motion.pos, motion.quat, motion.linvel, motion.angvel))
        energy = physics.work_precision.errors.mechanical_energy(scene, *parts).sum(axis=-1)
        np.testing.assert_allclose(energy, energy[0], rtol=1e-9)
        gaps = [
            x[1] + truth.contact_point(np.array(body.semi_axes), truth.rotation_matrix(q))[1]
            for x, q in zip(motion.pos, motion.quat)
        ]
        np.testing.assert_allclose(gaps, 0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("body", "mode", "least"),
    [
        (ELLIPSE.body(0.5), truth.SMOOTH, 0.65),
        (ELLIPSE.body(math.pi / 2, spin=1.0), truth.ROLLS, 0.76),
    ],
)
def test_the_pushes_that_hard_case_55_states(body, mode, least):
    motion = truth.move(body, mode, np.linspace(0.0, 4.0, 801), mu=2.0 * (mode == truth.ROLLS))
    assert least < motion.push.min() / G < least + 0.01
    assert mode == truth.SMOOTH or motion.grip.max() < 0.29


@pytest.mark.parametrize("accuracy", ["fast", "balanced"])
@pytest.mark.parametrize("dt", [1e-3, 5e-3, 1e-2, 2e-2])
def test_what_lifts_off_and_lands_again_hits_once(dt, accuracy):
    """Smooth, plane: upright it turns so fast that g + H''θ̇² < 0: it leaves the floor at once, flies, and lands.

    In the air θ̇ and the speed of fall are known, so that the landing is a root.
    """
    a, b, start, spin = 0.5, 0.3, math.pi / 2, 7.0
    e = 1e-5

    def bend(angle):
        return (ELLIPSE.slope(angle + e) - ELLIPSE.slope(angle - e)) / (2 * e)

    assert G + bend(start) * spin**2 < 0.0  # it leaves at once
    landing = brentq(lambda t: a - G * t * t / 2 - ELLIPSE.height(start + spin * t), 0.05, 1.0)
    body = physics.Ellipsoid((a, b, 0.4), 1.0, pos=(0, a, 0), quat=(math.cos(start / 2), 0, 0, math.sin(start / 2)),
                             angvel=(0, 0, spin))  # fmt: skip
    run = physics.simulate(on_floor(body, 0.0, 0.0), landing + 0.05, accuracy, dt=dt, sample_dt=dt)
    hits = [event.t for event in run.events if event.kind == "impact"]
    assert len(hits) == 1
    assert hits[0] == pytest.approx(landing, abs=dt)
