"""Rolling and spin friction where bodies touch each other: against the same at a wall, and against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

import physics

pytestmark = pytest.mark.interpreted

G = 9.81
R, M = 0.5, 2.0
ROLLING, SPIN = 0.2, 0.02
FLOOR = physics.HalfSpace((0, 1, 0))
TABLE = physics.Block((8, 1, 8), fixed=True, pos=(0, -0.5, 0))
PUSHED = (physics.Contact(), physics.Friction(0.8))


def ball(**start) -> physics.Sphere:
    return physics.Sphere(R, M, **{"pos": (0, R, 0), **start})


def on(ground: str, body: physics.Body, *effects, **options) -> physics.World:
    """World of a body on the wall y = 0, on a fixed block, or on a block 1e9 times heavier than the body."""
    laws = [physics.Gravity((0, -G, 0)), *PUSHED, *effects]
    heavy = physics.Block((8, 1, 8), 1e9 * M, pos=(0, -0.5, 0))
    scene = {
        "wall": lambda: physics.Scene([body], [FLOOR], laws),
        "fixed": lambda: physics.Scene([body, TABLE], (), laws),
        "heavy": lambda: physics.Scene([body, heavy], [physics.HalfSpace((0, 1, 0), -1.0)], laws),
    }[ground]()
    return physics.World(scene, **options)


def slowed(ground: str, accuracy: str, dt: float) -> tuple[physics.World, float]:
    """World after 0.5 s in which a ball rolls to rest from 1 m/s and goes on spinning; error of its place [m].

    It goes v²/(2 a), with a = (5/7) ρ g/r (`test_rolling`).
    """
    start = ball(linvel=(1, 0, 0), angvel=(0, 3, -1 / R))
    effects = physics.RollingFriction(ROLLING), physics.SpinFriction(SPIN)
    built = on(ground, start, *effects, dt=dt, accuracy=accuracy)
    assert built.step(steps=round(0.5 / dt)).ok
    return built, built.pos[0, 0, 0] - 1 / (2 * 5 / 7 * ROLLING * G / R)


@pytest.mark.parametrize("ground", ["fixed", "heavy"])
def test_a_body_slows_a_ball_as_a_wall_does(ground):
    """At `balanced` and 5 ms. The bound is the tolerance of the solve, 1e-6, in speeds of up to 1 m/s over 0.5 s."""
    wall, _ = slowed("wall", "balanced", 0.005)
    body, error = slowed(ground, "balanced", 0.005)
    assert np.abs(body.pos[0, 0] - wall.pos[0, 0]).max() < 1e-6
    assert np.abs(body.linvel[0, 0] - wall.linvel[0, 0]).max() < 1e-6
    assert np.abs(body.angvel[0, 0] - wall.angvel[0, 0]).max() < 1e-6
    assert abs(error) < 5 / 7 * ROLLING * G / R * 0.005**2  # the step in which it stops, as at a wall


@pytest.mark.parametrize(
    "ground", ["wall", *(pytest.param(name, marks=pytest.mark.exhaustive) for name in ("fixed", "heavy"))]
)  # fmt: skip
def test_a_ball_slows_to_rest_at_precise(ground):
    """Error control meets the end of the rolling in time: parts have an error of 100 tolerances of 1e-10."""
    built, error = slowed(ground, "precise", 0.05)
    assert abs(error) < 1e-8
    assert np.abs(built.linvel[0, 0]).max() < 1e-8
    spin = 3 - 2.5 * SPIN * G / R**2 * 0.5
    assert built.angvel[0, 0] == pytest.approx([0, spin, 0], abs=1e-8)


@pytest.mark.parametrize("share", [0.99, 1.01])
def test_a_ramp_holds_a_ball_up_to_the_angle_of_rolling_friction(share):
    """It rolls iff tan θ > ρ/r, then with (5/7) g (sin θ - ρ/r cos θ); within the tolerance of the solve."""
    rho, steps, dt = 0.05, 200, 0.01
    angle = math.atan(share * rho / R)
    gravity = physics.Gravity((G * math.sin(angle), -G * math.cos(angle), 0))
    scene = physics.Scene([ball(), TABLE], (), [gravity, *PUSHED, physics.RollingFriction(rho)])
    built = physics.World(scene, dt=dt)
    assert built.step(steps=steps).ok
    a, t = max(5 / 7 * G * (math.sin(angle) - rho / R * math.cos(angle)), 0.0), steps * dt
    assert built.linvel[0, 0, 0] == pytest.approx(a * t, abs=1e-6)
    assert built.pos[0, 0, 0] == pytest.approx(a * t * t / 2, abs=1e-6)


@pytest.mark.parametrize("spin", [40.0, 1.0])
def test_two_balls_that_spin_on_each_other_exchange_angular_momentum(spin):
    """Pressed together by F, each has (2/5) m r² ω' = -b F: both end with half the spin, whose sum stays."""
    force, t, dt = 30.0, 1.0, 0.01
    bodies = [ball(pos=(-R, 0, 0), angvel=(spin, 0, 0)), ball(pos=(R, 0, 0))]
    pushes = [physics.Push((force, 0, 0), body=0), physics.Push((-force, 0, 0), body=1)]
    built = physics.World(physics.Scene(bodies, (), [*PUSHED, physics.SpinFriction(SPIN), *pushes]), dt=dt)
    assert built.step(steps=round(t / dt)).ok
    lost = min(2.5 * SPIN * force / (M * R**2) * t, spin / 2)
    assert built.angvel[0, :, 0] == pytest.approx([spin - lost, lost], abs=1e-6 * spin)
    assert built.angvel[0, :, 0].sum() == pytest.approx(spin, rel=1e-12)
    assert np.abs(built.linvel).max() < 1e-9


@pytest.mark.exhaustive
def test_a_plank_on_four_balls_slows_by_the_power_of_all_contacts():
    """(P + n 7/20 m) V V' = -Σ ρ N ω with ω = V/2r, over the n contacts below the plank P and the n below the balls."""
    plank, rho, speed, t, dt, n = 10.0, 0.02, 1.0, 0.5, 0.01, 4
    places = [(x, R, z) for x in (-1.5, 1.5) for z in (-1.0, 1.0)]
    balls = [ball(pos=place, linvel=(speed / 2, 0, 0), angvel=(0, 0, -speed / 2 / R)) for place in places]
    top = physics.Block((6, 0.2, 4), plank, pos=(0, 2 * R + 0.1, 0), linvel=(speed, 0, 0))
    scene = physics.Scene([top, *balls], [FLOOR], [physics.Gravity((0, -G, 0)), *PUSHED, physics.RollingFriction(rho)])
    built = physics.World(scene, dt=dt)
    assert built.step(steps=round(t / dt)).ok
    slowing = rho * (2 * plank + n * M) * G / (2 * R) / (plank + n * 7 / 20 * M)
    assert built.linvel[0, 0, 0] == pytest.approx(speed - slowing * t, abs=1e-5)
    assert built.linvel[0, 1:, 0] == pytest.approx((speed - slowing * t) / 2 * np.ones(n), abs=1e-5)
    assert built.pos[0, 0, 0] == pytest.approx(speed * t - slowing * t * t / 2, abs=1e-5)


def test_a_capsule_rolls_to_rest_across_its_axis():
    """v' = -ρ g/r/(1 + I/(m r²)), with the moment I of the capsule about its axis."""
    rho, speed, t = 0.02, 1.0, 0.5
    body = physics.Capsule(
        R, 1.0, M, pos=(0, R, 0), quat=(0.5**0.5, 0.5**0.5, 0, 0), linvel=(speed, 0, 0), angvel=(0, 0, -speed / R)
    )
    built = on("wall", body, physics.RollingFriction(rho), dt=0.01)
    assert built.step(steps=round(t / 0.01)).ok
    slowing = rho * G / R / (1 + body.inertia[1, 1] / (M * R**2))
    assert built.linvel[0, 0] == pytest.approx([speed - slowing * t, 0, 0], abs=1e-6)
    assert built.pos[0, 0] == pytest.approx([speed * t - slowing * t * t / 2, R, 0], abs=1e-6)


def test_coefficients_of_single_worlds_and_beside_a_motion():
    """Rolling friction of one of two worlds changes; the columns of a motion are behind those of the laws."""
    belt = physics.Block((8, 1, 8), fixed=True, pos=(0, -0.5, 0), motion=physics.Motion())
    start = ball(linvel=(1, 0, 0), angvel=(0, 0, -1 / R))
    laws = [physics.Gravity((0, -G, 0)), *PUSHED, physics.RollingFriction(0.0)]
    built = physics.World(physics.Scene([start, belt], (), laws), worlds=2, dt=0.01)
    built.set_parameters(effects=[physics.RollingFriction(0.05)], worlds=[1])
    built.step(steps=20)
    assert built.linvel[:, 0, 0] == pytest.approx([1.0, 1 - 5 / 7 * 0.05 * G / R * 0.2], abs=1e-9)


def test_blocks_among_round_bodies_feel_no_torque():
    """A block that slides on a table beside a ball slows by friction alone, to the last bit."""
    block = physics.Block((1, 1, 1), M, pos=(-3, 0.5, 0), linvel=(2, 0, 0))
    laws = [physics.Gravity((0, -G, 0)), *PUSHED]
    plain, rolling = (
        physics.World(physics.Scene([block, ball(pos=(3, R, 0)), TABLE], (), [*laws, *more]), dt=0.01)
        for more in ((), (physics.RollingFriction(ROLLING), physics.SpinFriction(SPIN)))
    )
    plain.step(steps=20)
    rolling.step(steps=20)
    assert (plain.pos[0, 0] == rolling.pos[0, 0]).all()
    assert (plain.linvel[0, 0] == rolling.linvel[0, 0]).all()
