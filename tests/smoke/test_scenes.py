"""Seven small scenes over shapes, presets and effects, each against a law in closed form.

They need the package and the extra `smoke` alone. `.ci/smoke` runs them on every Python, the whole suite runs on one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

import physics

G = 9.81
FLOOR = physics.HalfSpace(normal=(0, 1, 0))
GRAVITY = physics.Gravity((0, -G, 0))


def _floor(bodies, *effects, restitution=None) -> physics.Scene:
    return physics.Scene(bodies, [FLOOR], [GRAVITY, physics.Contact(restitution), *effects])


def test_a_block_flies_along_a_parabola_and_keeps_its_angular_momentum():
    block = physics.Block((5, 3, 2), mass=6.0, pos=(0, 6, 0), linvel=(1, 2, 0), angvel=(0.3, 2.0, 0.1))
    flight = physics.simulate(physics.Scene([block], effects=[GRAVITY]), 2.0, accuracy="reference", sample_dt=0.1)
    t = flight.t
    np.testing.assert_allclose(flight.pos[:, 0, 0], t, atol=1e-12)
    np.testing.assert_allclose(flight.pos[:, 0, 1], 6.0 + 2.0 * t - 0.5 * G * t * t, atol=1e-11)
    inertia = np.array([6.5, 14.5, 17.0])
    w, x, y, z = flight.quat[:, 0].T
    R = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    body = np.einsum("jik,kj->ki", R, flight.angvel[:, 0])
    momentum = np.einsum("ijk,kj->ki", R, inertia * body)
    np.testing.assert_allclose(momentum, np.broadcast_to(inertia * (0.3, 2.0, 0.1), momentum.shape), atol=1e-11)


def test_a_block_slides_until_friction_has_taken_its_energy():
    block = physics.Block((2, 0.5, 2), mass=3.0, pos=(0, 0.25, 0), linvel=(3, 0, 0))
    scene = _floor([block], physics.Friction(0.5), restitution=0.0)
    slide = physics.simulate(scene, 1.0, accuracy="precise", sample_dt=0.1)
    assert slide.ok
    assert slide.pos[-1, 0, 0] == pytest.approx(3.0**2 / (2 * 0.5 * G), abs=1e-6)
    assert np.abs(slide.linvel[-1]).max() < 1e-9


def test_a_sphere_that_slides_ends_up_rolling_with_five_sevenths_of_its_speed():
    sphere = physics.Sphere(radius=0.5, mass=2.0, pos=(0, 0.5, 0), linvel=(2, 0, 0))
    path = physics.simulate(_floor([sphere], physics.Friction(0.4)), 1.0, accuracy="balanced")
    assert path.ok
    assert path.linvel[-1, 0, 0] == pytest.approx(5 / 7 * 2.0, rel=1e-3)
    assert path.angvel[-1, 0, 2] == pytest.approx(-path.linvel[-1, 0, 0] / 0.5, rel=1e-3)


def test_an_ellipsoid_rebounds_with_its_share_of_the_speed():
    body = physics.Ellipsoid((0.5, 0.3, 0.4), mass=2.0, pos=(0, 1.3, 0))
    scene = physics.Scene([body], [FLOOR], [GRAVITY, physics.Contact(restitution=0.6)])
    fall = math.sqrt(2 * 1.0 / G)
    drop = physics.simulate(scene, fall + 0.1, accuracy="reference", sample_dt=0.1)
    speed = 0.6 * G * fall
    assert drop.linvel[-1, 0, 1] == pytest.approx(speed - G * 0.1, abs=1e-8)
    assert drop.pos[-1, 0, 1] == pytest.approx(0.3 + speed * 0.1 - 0.5 * G * 0.01, abs=1e-8)


# The next two scenes have the same kernels: those of blocks, hulls and spheres that touch each other and a floor.


def _hull(mass: float, corners, **start) -> physics.Hull:
    return physics.Hull([(x, y, z) for z in (-1, 1) for x, y in corners], mass=mass, **start)


@pytest.mark.interpreted
def test_spheres_that_meet_a_hull_keep_their_momentum():
    wedge = _hull(2.0, [(-1, -1), (1, -1), (0, 1)], pos=(0, 50, 0))
    ball = physics.Sphere(radius=0.5, mass=1.0, pos=(0, 50, 4.0), linvel=(0.1, 0, -6))
    block = physics.Block((1, 1, 1), mass=4.0, pos=(0, 20, 0))
    weightless = [physics.Gravity((0, 0, 0)), physics.Contact(restitution=0.5), physics.Friction(0.3)]
    world = physics.World(physics.Scene([wedge, ball, block], [FLOOR], weightless), dt=0.01)
    for _ in range(100):
        assert world.step().ok
    momentum = (world.linvel[0] * np.array([[2.0], [1.0], [4.0]])).sum(axis=0)
    np.testing.assert_allclose(momentum, (0.1, 0, -6.0), atol=1e-12)
    assert world.linvel[0, 0, 2] < -1.0  # the wedge was hit


@pytest.mark.interpreted
def test_a_tower_stands():
    blocks = [physics.Block((2, 1, 2), mass=2.0**k, pos=(0, k + 0.5, 0)) for k in range(2)]
    hull = _hull(4.0, [(-1, -0.5), (1, -0.5), (1, 0.5), (-1, 0.5)], pos=(0, 2.5, 0))
    ball = physics.Sphere(radius=0.5, mass=8.0, pos=(0, 3.5, 0))
    scene = _floor([*blocks, hull, ball], physics.Friction(0.5), restitution=0.0)
    tower = physics.simulate(scene, 0.3, accuracy="balanced", sample_dt=0.01)
    assert tower.ok
    np.testing.assert_allclose(tower.pos[-1], tower.pos[0], atol=1e-5)


@physics.field_function
def brake(state, p, t):
    """Force against the velocity."""
    return (-p[0] * state.v[0], -p[0] * state.v[1], -p[0] * state.v[2]), (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Brake(physics.Field):
    """A force of one's own, ``-c v``."""

    c: float = 0.5  # [N s/m]
    function: ClassVar = brake


def test_a_spring_with_a_force_of_ones_own_is_a_damped_oscillator():
    sphere = physics.Sphere(radius=0.1, mass=1.0, pos=(1.0, 0, 0))
    scene = physics.Scene([sphere], effects=[physics.Spring(stiffness=25.0), Brake(0.5)])
    path = physics.simulate(scene, 2.0, accuracy="precise", sample_dt=0.1)
    decay, rate = 0.25, math.sqrt(25.0 - 0.25**2)
    x = np.exp(-decay * path.t) * (np.cos(rate * path.t) + decay / rate * np.sin(rate * path.t))
    np.testing.assert_allclose(path.pos[:, 0, 0], x, atol=1e-6)
