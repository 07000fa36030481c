"""Contact that gives at `precise`: closed forms, and DOP853 for blocks that bob, tip and slide on their springs.

A part of a step may have the error 1e-8 (100 tolerances) of a body's size and speed, and halves it by the factor 4 at
least before it is extrapolated. So a body is off by some 1e-9 of its size and speed at most after a hundred parts.
Among several moving bodies, a part in which a spring begins or ends to push has 1/16 of the error 1e-8. Two of them
have 1.3e-9. The heavy body of 1e9 times the mass takes up 2e-9 of the speed of a bounce. All of it is below 5e-9.
"""

from __future__ import annotations

import math

import numpy as np
import pytest

import physics
from tests.physics.test_compliance import FLOOR, SAG, G, K, M, R, ball
from tests.physics.test_compliance_between import HEAVY, TABLE, WEIGHT, soft
from tests.reference.rigid_body import RigidState, integrate_rigid_body, orientation_error, rotation_matrix
from tests.reference.soft_contacts import soft_floor
from tests.tiers.sweep import sweep

pytestmark = pytest.mark.interpreted

DT = 0.005
LONE, COUPLED = 1e-9, 5e-9
BASES = {"wall": ([], [FLOOR], LONE), "fixed": ([TABLE], [], LONE), "heavy": ([HEAVY], [], COUPLED)}


def run(body, base, k, c, duration, *, weight=True, friction=None):
    """World after `duration` [s] at `precise`, whose last body is `body`; its weight acts as a wrench."""
    others, walls, _ = BASES[base]
    more = [] if friction is None else [physics.Friction(friction)]
    world = physics.World(physics.Scene([*others, body], walls, soft(k, c, *more)), dt=DT, accuracy="precise")
    wrench = np.zeros((1, len(others) + 1, 6))
    wrench[0, -1] = WEIGHT if weight else 0.0
    world.step(wrench, steps=round(duration / DT))
    assert world.report.ok
    assert world.report.fallbacks[0] == 0
    return world


@pytest.mark.parametrize(("base", "c"), sweep([(b, c) for b in BASES for c in (0.0, 30.0)], [("wall", 30.0)]))
def test_a_ball_bobs_on_its_spring(base, c, is_exhaustive):
    """A e^(-ζωt) (cos ω_d t + ζω/ω_d sin ω_d t) from rest; the heavy body gives way by 1e-9 of that."""
    t, amplitude, decay = 0.1 if is_exhaustive else 0.02, -0.5 * SAG, c / (2 * M)
    turn = math.sqrt(K / M - decay**2)
    exact = amplitude * math.exp(-decay * t) * (math.cos(turn * t) + decay / turn * math.sin(turn * t))
    world = run(ball(pos=(0, R - SAG + amplitude, 0)), base, K, c, t)
    assert world.pos[0, -1, 1] - R + SAG == pytest.approx(exact, abs=R * BASES[base][2])


def test_a_ball_lands_on_a_heavy_body_in_the_second_half_of_a_part():
    """The stage after the meeting is the same in the part and in its halves: they agree, whatever its error is."""
    gap, c = 0.0031, 20.0
    t, decay = DT - gap, c / (2 * M)
    turn = math.sqrt(K / M - decay**2)
    world = run(ball(pos=(0, R + gap, 0), linvel=(0, -1, 0)), "heavy", K, c, DT, weight=False)
    speed = -math.exp(-decay * t) * (math.cos(turn * t) - decay / turn * math.sin(turn * t))
    assert world.linvel[0, -1, 1] == pytest.approx(speed, abs=COUPLED)
    assert world.pos[0, -1, 1] - R == pytest.approx(-math.exp(-decay * t) * math.sin(turn * t) / turn, abs=R * LONE)


@pytest.mark.exhaustive
@pytest.mark.parametrize("c", [0.0, 20.0])
@pytest.mark.parametrize("base", BASES)
def test_a_ball_bounces_at_the_moment_and_with_the_speed_of_its_spring(base, c):
    """It hits within a step, at 1 m/s, and flies off: e, time and way of Schwager and Pöschel 2007."""
    gap, t, omega = 0.0123, 0.12, math.sqrt(K / M)
    zeta = c / (2 * math.sqrt(K * M))
    contact = (math.pi - 2 * math.asin(zeta)) / (omega * math.sqrt(1 - zeta**2))
    e = math.exp(-zeta * omega * contact)
    world = run(ball(pos=(0, R + gap, 0), linvel=(0, -1, 0)), base, K, c, t, weight=False)
    height = e * (t - gap - contact) - 2 * zeta * e / omega
    assert world.linvel[0, -1, 1] == pytest.approx(e, abs=BASES[base][2])
    assert world.pos[0, -1, 1] - R == pytest.approx(height, abs=R * BASES[base][2])


@pytest.mark.exhaustive
def test_a_ball_hits_another_one_at_rest():
    """About the place where they touch they oscillate with the reduced mass m/2, until their push ends."""
    gap, t, c, omega = 0.0123, 0.1, 20.0, math.sqrt(2 * K / M)
    zeta = c / math.sqrt(2 * K * M)
    contact = (math.pi - 2 * math.asin(zeta)) / (omega * math.sqrt(1 - zeta**2))
    e = math.exp(-zeta * omega * contact)
    bodies = [ball(pos=(0, 0, 0)), ball(pos=(2 * R + gap, 0, 0), linvel=(-1, 0, 0))]
    world = physics.World(physics.Scene(bodies, effects=soft(K, c)), dt=DT, accuracy="precise")
    world.step(steps=round(t / DT))
    (x, _, _), (y, _, _) = world.pos[0]
    (u, _, _), (v, _, _) = world.linvel[0]
    assert u + v == pytest.approx(-1, abs=1e-14)
    assert v - u == pytest.approx(e, abs=COUPLED)
    assert y - x - 2 * R == pytest.approx(e * (t - gap - contact) - 2 * zeta * e / omega, abs=R * COUPLED)


def pressed(c, t):
    """Distance of two equal balls, pressed together with 2 · 10 N from touching, after t [s]."""
    bodies = [ball(pos=(-R, 0, 0)), ball(pos=(R, 0, 0))]
    world = physics.World(physics.Scene(bodies, effects=soft(K, c)), dt=DT, accuracy="precise")
    wrench = np.zeros((1, 2, 6))
    wrench[0, :, 0] = 10.0, -10.0
    world.step(wrench, steps=round(t / DT))
    return world.pos[0, 1, 0] - world.pos[0, 0, 0]


def test_two_balls_have_half_the_mass(is_exhaustive):
    """About the sag S/k they oscillate with the reduced mass m/2, damped."""
    c, t = 30.0, 0.06 if is_exhaustive else 0.015
    decay, sag = c / M, 10.0 / K
    turn = math.sqrt(2 * K / M - decay**2)
    way = sag * math.exp(-decay * t) * (math.cos(turn * t) + decay / turn * math.sin(turn * t))
    assert pressed(c, t) - 2 * R + sag == pytest.approx(way, abs=R * COUPLED)


SIZE = np.array([1.0, 0.2, 0.6])
CORNERS = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) * SIZE
TILTED = np.array([1, 0.02, 0.0, 0.05]) / math.sqrt(1 + 0.02**2 + 0.05**2)


@pytest.mark.parametrize(
    ("base", "c", "mu", "duration"),
    [
        ("wall", 20.0, 0.3, 0.005),
        *[
            pytest.param(base, c, mu, 0.03, marks=pytest.mark.exhaustive)
            for base in ("wall", "fixed") for c in (0.0, 20.0) for mu in (0.0, 0.3)
        ],
    ],
)  # fmt: skip
def test_a_block_bobs_tips_and_slides(base, c, mu, duration):
    """It is pushed 2 to 8 cm deep, slides fast, and its corners leave the springs one by one; against DOP853.

    Friction acts at a corner on a wall, and in the middle of the depth between two bodies. Springs of the stiffness k
    let the velocity change by ω = √(4 k/m) = 63 /s of the place.
    """
    body = physics.Block(SIZE, M, pos=(0, 0.08, 0), quat=TILTED, linvel=(6, 0, 1), angvel=(0, 0.5, 0))
    inertia, R0 = body.inertia, rotation_matrix(TILTED)
    start = RigidState(
        np.array([0, 0.08, 0]), TILTED, M * np.array([6.0, 0, 1]), R0 @ inertia @ R0.T @ np.array([0, 0.5, 0])
    )
    floor = soft_floor(M, inertia, CORNERS, K, c, mu, 0.5 if base == "fixed" else 0.0)
    exact = integrate_rigid_body(M, inertia, start, duration, (0, -G, 0), floor, rtol=1e-12)
    world = run(body, base, K, c, duration, friction=mu or None)
    assert world.pos[0, -1] == pytest.approx(exact.pos, abs=LONE)
    assert orientation_error(world.quat[0, -1], exact.quat) < LONE
    assert world.linvel[0, -1] == pytest.approx(exact.momentum / M, abs=63 * LONE)


@pytest.mark.exhaustive
def test_a_slab_on_a_soft_slope_holds():
    """It sinks in and slides by a little until friction holds it, and then moves no more, in one part for each step."""
    slope = 0.3
    gravity = physics.Gravity((G * math.sin(slope), -G * math.cos(slope), 0))
    effects = soft(1e5, 300.0, physics.Friction(0.5), gravity)
    body = physics.Block((1.0, 0.1, 1.0), M, pos=(0, 0.05, 0))
    world = physics.World(physics.Scene([body], [FLOOR], effects), dt=0.01, accuracy="precise")
    world.step(steps=8)
    before = world.pos.copy()
    world.step(steps=50)
    assert np.abs(world.pos - before).max() < 1e-9
    assert world.contacts(0)[1].sum(axis=0) == pytest.approx(
        [-M * G * math.sin(slope), M * G * math.cos(slope), 0], abs=1e-6
    )


@pytest.mark.compiled
@pytest.mark.exhaustive
@pytest.mark.parametrize("k", [1e3, 1e5, 1e7])
def test_blocks_without_friction_tumble_without_loss_and_without_a_part_that_fails(k):
    """Undamped springs give back what they take: energy to the error of parts, 1e-8 each, some hundred of them."""
    rng, worlds = np.random.default_rng(1), 20
    block = physics.Block((1, 0.6, 0.4), M, pos=(0, 0.75, 0))
    scene = physics.Scene([block], [FLOOR], soft(k, 0.0, physics.Gravity()))
    world = physics.World(scene, worlds=worlds, dt=0.01, accuracy="precise")
    quat = rng.normal(size=(worlds, 1, 4))
    quat /= np.linalg.norm(quat, axis=-1, keepdims=True)
    world.set_state(quat=quat, linvel=rng.normal(size=(worlds, 1, 3)), angvel=4 * rng.normal(size=(worlds, 1, 3)))
    start = physics.diagnose(world).energy[:, 0]
    for _ in range(60):
        world.step()
        assert (world.report.fallbacks == 0).all()
    assert physics.diagnose(world).energy[:, 0] == pytest.approx(start, rel=1e-6)
