"""Tangential restitution where bodies touch each other: against the same at a wall, and against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

import physics

pytestmark = pytest.mark.interpreted

G = 9.81
R, M = 0.5, 2.0
FLOOR = physics.HalfSpace((0, 1, 0))
TABLE = physics.Block((8, 1, 8), fixed=True, pos=(0, -0.5, 0))
START = {"pos": (0, R + 1, 0), "linvel": (3, -2, 1), "angvel": (0.5, 0.3, 2)}


def thrown(ground: str, tangential: float, e: float, **options) -> physics.World:
    """Ball above the wall y = 0, above a fixed block, or above a ball of 1e9 times its mass and no gravity of its own.

    The top of the heavy ball is at y = 0 below the place where the other one lands.
    """
    gravity = physics.Gravity((0, -G, 0))
    effects = [physics.Contact(e, tangential=tangential), physics.Friction(5.0)]
    ball = physics.Sphere(R, M, **START)
    if ground == "wall":
        return physics.World(physics.Scene([ball], [FLOOR], [gravity, *effects]), **options)
    if ground == "fixed":
        return physics.World(physics.Scene([ball, TABLE], (), [gravity, *effects]), **options)
    fall = (math.sqrt(4 + 2 * G) - 2) / G
    heavy = physics.Sphere(R, 1e9 * M, pos=(3 * fall, -R, fall))
    hold = physics.Push((0, -G * M, 0), body=0)  # gravity of the light ball alone
    return physics.World(physics.Scene([ball, heavy], (), [*effects, hold]), **options)


def expected(tangential: float, e: float, t: float) -> tuple[np.ndarray, ...]:
    """Place, velocity and angular velocity after one impact and t seconds (`test_rolling`)."""
    v, w = np.array([3.0, 0.0, 1.0]), np.array(START["angvel"])
    hit = math.sqrt(4 + 2 * G)
    fall = (hit - 2) / G
    change = -2 / 7 * (1 + tangential) * (v + np.cross(w, [0, -R, 0]))
    after = v + change + [0, e * hit, 0]
    place = v * fall + after * (t - fall) + [0, R - G * (t - fall) ** 2 / 2, 0]
    return place, after - [0, G * (t - fall), 0], w + 2.5 / R**2 * np.cross([0, -R, 0], change)


@pytest.mark.parametrize("ground", ["fixed", "heavy"])
@pytest.mark.parametrize(("tangential", "e"), [(1.0, 0.8), (0.4, 0.8), (-1.0, 0.8)])
def test_a_body_throws_a_ball_back_as_a_wall_does(ground, tangential, e):
    """At `balanced` and 5 ms: the solve leaves 1e-6 of a velocity of up to 6 m/s at most, over 0.3 s."""
    wall, body = (thrown(where, tangential, e, dt=0.005) for where in ("wall", ground))
    for each in (wall, body):
        assert each.step(steps=100).ok
    assert np.abs(body.pos[0, 0] - wall.pos[0, 0]).max() < 1e-6
    assert np.abs(body.linvel[0, 0] - wall.linvel[0, 0]).max() < 1e-6
    assert np.abs(body.angvel[0, 0] - wall.angvel[0, 0]).max() < 1e-6


@pytest.mark.parametrize("ground", ["fixed", "heavy"])
def test_a_ball_is_thrown_back_in_closed_form_at_precise(ground):
    built = thrown(ground, 0.4, 0.8, dt=0.05, accuracy="precise")
    assert built.step(steps=6).ok
    place, v, w = expected(0.4, 0.8, 0.3)
    assert built.linvel[0, 0] == pytest.approx(v, abs=1e-8)
    assert built.pos[0, 0] == pytest.approx(place, abs=1e-8)
    assert built.angvel[0, 0] == pytest.approx(w, abs=1e-8)


@pytest.mark.exhaustive
def test_a_plastic_impact_at_precise_is_that_at_a_wall():
    """It leaves along the floor only, and rolls then."""
    wall, body = (thrown(where, 0.4, 0.0, dt=0.05, accuracy="precise") for where in ("wall", "fixed"))
    for each in (wall, body):
        each.step(steps=8)
    assert np.abs(wall.linvel[0, 0] - body.linvel[0, 0]).max() < 1e-8
    assert np.abs(wall.pos[0, 0] - body.pos[0, 0]).max() < 1e-8


@pytest.mark.parametrize(("mu", "tangential"), [(5.0, 0.7), (0.1, 0.7), (5.0, -1.0)])
def test_two_balls_in_space(mu, tangential):
    """The impulse along the plane is -(1 + e_t) u/(2/m + 2 R²/I), at most μ times the normal one (Walton 1993)."""
    e, speed = 0.5, 2.0
    balls = [
        physics.Sphere(R, M, pos=(-0.75, 0, 0), linvel=(speed, 0, 0), angvel=(0.4, 1.0, 3.0)),
        physics.Sphere(R, M, pos=(0.75, 0, 0), angvel=(0.1, -2.0, 1.0)),
    ]
    effects = [physics.Contact(e, tangential=tangential), physics.Friction(mu)]
    built = physics.World(physics.Scene(balls, (), effects), dt=0.05)
    assert built.step(steps=8).ok
    moment, arm = 0.4 * M * R**2, np.array([R, 0, 0])
    spins = np.array([[0.4, 1.0, 3.0], [0.1, -2.0, 1.0]])
    slip = np.cross(spins[0], arm) - np.cross(spins[1], -arm)
    normal = (1 + e) * speed * M / 2
    p = -(1 + tangential) * slip / (2 / M + 2 * R**2 / moment)
    p *= min(1.0, mu * normal / np.linalg.norm(p)) if p.any() else 1.0
    push = p - [normal, 0, 0]
    assert built.linvel[0] == pytest.approx(np.array([[speed, 0, 0] + push / M, -push / M]), abs=1e-6)
    turned = np.array([spins[0] + np.cross(arm, push) / moment, spins[1] + np.cross(-arm, -push) / moment])
    assert built.angvel[0] == pytest.approx(turned, abs=1e-6)


def test_superballs_in_a_box_create_no_energy():
    """Elastic impacts of two superballs with each other and with walls keep it to the tolerances of solves."""
    walls = [physics.HalfSpace(n, -1.2) for n in ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))]
    balls = [
        physics.Sphere(R, M, pos=pos, linvel=linvel, angvel=(1, 2, -3))
        for pos, linvel in (((-0.6, 0, 0.1), (3, 1, 0)), ((0.6, 0.1, 0), (-2, 0, 1)))
    ]
    effects = [physics.Contact(1.0, tangential=1.0), physics.Friction(50.0)]
    built = physics.World(physics.Scene(balls, walls, effects), dt=0.02)
    before = physics.diagnose(built).energy[0].sum()
    built.step(steps=100)
    assert physics.diagnose(built).energy[0].sum() == pytest.approx(before, rel=1e-4)


def test_a_ball_in_a_corner_has_friction_alone():
    """A body that bounces at two contacts at once gets the velocities without tangential restitution, bit for bit."""
    ends = []
    for tangential in (1.0, None):
        balls = [
            physics.Sphere(R, M, pos=(R + 0.05, R + 0.05, 0), linvel=(-1, -1, 0)),
            physics.Sphere(R, M, pos=(5, 5, 5)),
        ]
        effects = [physics.Contact(1.0, tangential=tangential), physics.Friction(50.0)]
        walls = [physics.HalfSpace((1, 0, 0)), physics.HalfSpace((0, 1, 0))]
        built = physics.World(physics.Scene(balls, walls, effects), dt=0.02)
        built.step(steps=10)
        ends.append((built.linvel[0], built.angvel[0]))
    assert abs(ends[0][1][0]).max() > 1.0  # friction has turned it
    np.testing.assert_array_equal(ends[0], ends[1])


def test_another_shape_that_moves_is_refused():
    scene = physics.Scene(
        [physics.Sphere(R, M, pos=(0, 2, 0)), physics.Block((1, 1, 1), M)],
        effects=[physics.Contact(0.5, tangential=0.5), physics.Friction(0.5)],
    )
    with pytest.raises(ValueError, match=r"Scene.bodies\[1\] is a block; allowed where every body that moves is a"):
        physics.World(scene)
