"""Contact that gives between bodies, on fixed ones, and of shapes that only the scheme of bodies that touch knows."""

from __future__ import annotations

import math

import numpy as np
import pytest

import physics
from tests.physics.test_compliance import FLOOR, G, K, M, R, ball, replay, slab
from tests.tiers.sweep import sweep

pytestmark = pytest.mark.interpreted

DT = 0.005
TABLE = physics.Block((4, 1, 4), fixed=True, pos=(0, -0.5, 0))
HEAVY = physics.Block((4, 1, 4), mass=1e9 * M, pos=(0, -0.5, 0))
PAIRS = [(K, 0.0), (K, 30.0), (1e6, 1e3), (1e9, 1e4)]
WEIGHT = np.array([0, -M * G, 0, 0, 0, 0])


def soft(k=K, c=0.0, *more):
    return [physics.Contact(stiffness=k, damping=c), *more]


def heights(bodies, walls, k, c, steps):
    """Path (steps, 3) of the last body under its weight, applied as a wrench, at balanced and 5 ms."""
    world = physics.World(physics.Scene(bodies, walls, soft(k, c)), dt=DT)
    wrench, found = np.zeros((1, len(bodies), 6)), []
    wrench[0, -1] = WEIGHT
    for _ in range(steps):
        world.step(wrench)
        found.append(world.pos[0, -1].copy())
    assert world.report.ok
    return np.array(found)


EVERY = [(make, base, k, c) for make in (ball, slab) for base in (TABLE, HEAVY) for k, c in PAIRS]


@pytest.mark.parametrize(("make", "base", "k", "c"), sweep(EVERY, [(ball, HEAVY, K, 30.0), (slab, TABLE, 1e9, 1e4)]))
def test_on_a_heavy_body_it_moves_as_at_a_wall(make, base, k, c):
    """It falls, lands and bobs. The heavy body gives way by 1e-9 of that, and contact problems are solved to 1e-6 of
    the speed of a step, so g dt² 1e-6 = 2.5e-10 m of the place a step."""
    body = make(pos=(0, 0.02 + (R if make is ball else 0.05), 0))
    steps = 40
    at_wall, on_body = (
        heights(bodies, walls, k, c, steps) for bodies, walls in (([body], [FLOOR]), ([base, body], []))
    )
    assert on_body == pytest.approx(at_wall, abs=steps * 2.5e-10)


def pressed_pair(k, c, squeeze, dt, steps):
    """Distances (steps,) of two equal balls without gravity that forces `squeeze` [N] press together, from touching."""
    bodies = [ball(pos=(-R, 0, 0)), ball(pos=(R, 0, 0))]
    world = physics.World(physics.Scene(bodies, effects=soft(k, c)), dt=dt)
    wrench, found = np.zeros((1, 2, 6)), []
    wrench[0, :, 0] = squeeze, -squeeze
    for _ in range(steps):
        world.step(wrench)
        found.append(world.pos[0, 1, 0] - world.pos[0, 0, 0])
    assert np.abs(world.linvel.sum(axis=1)).max() < 1e-14
    return np.array(found)


@pytest.mark.parametrize(("k", "c"), sweep([(K, 0.0), (K, 30.0), (K, 300.0), (1e6, 1e3)], [(K, 0.0), (1e6, 1e3)]))
def test_two_equal_balls_are_an_oscillator_of_half_the_mass(k, c):
    """Pressed together with 2 S they bob about the sag S/k, by the θ-method of the reduced mass m/2.

    `replay` has the mass m, so that k and c count twice there. A solve leaves 1e-6 of the speed 2 S dt/m of a step.
    """
    squeeze = 10.0
    found = pressed_pair(k, c, squeeze, 0.01, 60)
    assert found - 2 * R + squeeze / k == pytest.approx(
        replay(2 * k, 2 * c, 0.01, squeeze / k, 60), abs=2e-6 * squeeze / M * 0.01**2
    )


def rebound(zeta, dt, phase):
    """Relative speed after an impact of two equal balls at 1 m/s, which begins `phase` of a step after its start."""
    c, gap = 2 * zeta * math.sqrt(K * M / 2), (3 + phase) * dt
    bodies = [ball(pos=(-R - gap / 2, 0, 0), linvel=(0.5, 0, 0)), ball(pos=(R + gap / 2, 0, 0), linvel=(-0.5, 0, 0))]
    world = physics.World(physics.Scene(bodies, effects=soft(K, c)), dt=dt)
    world.step(steps=round(0.12 / dt))
    assert np.abs(world.linvel.sum(axis=1)).max() < 1e-14
    return world.linvel[0, 1, 0] - world.linvel[0, 0, 0]


@pytest.mark.parametrize("zeta", sweep([0.0, 0.1, 0.4], [0.1]))
def test_damping_is_the_restitution_of_two_balls(zeta):
    """e of Schwager and Pöschel 2007 with the reduced mass m/2: ζ = c/(2 √(k m/2)).

    The last step of contact cuts off at most (ω dt)²/4 of the energy (`test_compliance`), so half of that of e, and a
    step before it changes phases by as much: 2 (ω dt)² bounds the sum, and it falls by 4 with half the step.
    """
    omega = math.sqrt(2 * K / M)
    t = (math.pi - 2 * math.asin(zeta)) / (omega * math.sqrt(1 - zeta**2))
    e = math.exp(-zeta * omega * t)
    for dt in (0.002, 0.001):
        errors = [rebound(zeta, dt, phase) - e for phase in (0.2, 0.7)]
        assert np.abs(errors).max() < 2 * (omega * dt) ** 2


def test_a_depth_that_a_user_makes_is_energy():
    """Two balls that overlap by d fly apart with the energy ½ k d², and each has half of it in the diagnostics.

    The speed d √(k/(m/2)) is that of an undamped spring, less what the last step of contact cuts off.
    """
    d, dt = 0.02, 0.001
    bodies = [ball(pos=(-R + d / 2, 0, 0)), ball(pos=(R - d / 2, 0, 0))]
    world = physics.World(physics.Scene(bodies, effects=soft()), dt=dt)
    assert physics.diagnose(world).potential_energy[0] == pytest.approx([K * d * d / 4] * 2, rel=1e-12)
    world.step(steps=100)
    assert world.report.ok
    speed, omega = world.linvel[0, 1, 0] - world.linvel[0, 0, 0], math.sqrt(2 * K / M)
    assert speed == pytest.approx(d * omega, rel=(omega * dt) ** 2)
    assert speed <= d * omega


@pytest.mark.parametrize(
    ("make", "points", "count"),
    [
        (lambda y: ball(pos=(0, y + R, 0)), 1, 2),
        pytest.param(lambda y: ball(pos=(0, y + R, 0)), 1, 3, marks=pytest.mark.exhaustive),
        pytest.param(lambda y: physics.Block((1, 2 * R, 1), M, pos=(0, y + R, 0)), 4, 4, marks=pytest.mark.exhaustive),
    ],
)
def test_a_stack_is_pressed_by_the_weights_above(make, points, count):
    """Contact i carries (n - i) m g on its springs: body i stands Σ_{j <= i} (n - j) m g/(p k) below its rigid place.

    After 0.5 s for each body nothing is left of the oscillation, whose slowest mode falls as e^(-20 t) at least for up
    to four bodies. Solves leave 1e-6 of each force, on either side of a body.
    """
    k = 2e4
    c = 2 * math.sqrt(k * M / points)
    bodies = [make(2 * R * i) for i in range(count)]
    world = physics.World(physics.Scene(bodies, [FLOOR], soft(k, c, physics.Gravity())), dt=DT)
    world.step(steps=100 * count)
    sag = np.cumsum([(count - i) * M * G / (points * k) for i in range(count)])
    rigid = R * (2 * np.arange(count) + 1)
    assert rigid - world.pos[0, :, 1] == pytest.approx(sag, rel=count * 2e-6)


CORNERS = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.05, 0.05) for z in (-0.5, 0.5)]
LYING = (math.sqrt(0.5), 0, 0, math.sqrt(0.5))
PAIR = [physics.Sphere(0.2, M / 2, pos=(x, 0, 0)) for x in (-0.4, 0.4)]
SHAPES = {
    "hull": (physics.Hull(CORNERS, M, pos=(0, 0.05, 0)), 4),
    "standing capsule": (physics.Capsule(0.2, 0.6, M, pos=(0, 0.5, 0)), 1),
    "lying capsule": (physics.Capsule(0.2, 0.6, M, pos=(0, 0.2, 0), quat=LYING), 2),
    "compound": (physics.Compound(PAIR, pos=(0, 0.2, 0)), 2),
    "lying cylinder": (physics.Cylinder(0.2, 0.6, M, pos=(0, 0.2, 0), quat=LYING), 2),
    "standing cylinder": (physics.Cylinder(0.2, 0.6, M, pos=(0, 0.3, 0)), 8),
}


@pytest.mark.parametrize("name", sweep([*SHAPES], ["hull", "lying capsule", "lying cylinder"]))
def test_every_shape_sags_by_its_weight_over_its_points(name):
    """m g/(p k) for p contact points; critical damping leaves e^-15 of the oscillation after 0.5 s."""
    body, points = SHAPES[name]
    c = 2 * math.sqrt(K * M / points)
    effects = soft(K, c, physics.Gravity(), physics.Friction(0.5))
    world = physics.World(physics.Scene([body], [FLOOR], effects), dt=DT)
    world.step(steps=100)
    assert body.pos[1] - world.pos[0, 0, 1] == pytest.approx(M * G / (points * K), abs=1e-6 * G * DT**2 + 1e-7)
    stored = physics.diagnose(world).potential_energy[0, 0] - M * G * world.pos[0, 0, 1]
    assert stored == pytest.approx((M * G) ** 2 / (2 * points * K), rel=1e-4)


def test_a_hull_bobs_as_the_block_that_it_is():
    """The scheme of lone bodies serves the block, that of bodies that touch the hull; both solve to 1e-6 of a step."""
    found = []
    for body in (slab(pos=(0, 0.07, 0)), physics.Hull(CORNERS, M, pos=(0, 0.07, 0))):
        found.append(heights([body], [FLOOR], K, 30.0, 40))
    assert found[1] == pytest.approx(found[0], abs=40 * 2.5e-10)


def motion_energy(world):
    """Kinetic energy and that of gravity [J]: springs store what is missing, and never less than nothing."""
    mass = np.array([body.mass for body in world.scene.bodies])
    return physics.diagnose(world).kinetic_energy.sum(axis=1) + G * (mass * world.pos[:, :, 1]).sum(axis=1)


@pytest.mark.compiled
@pytest.mark.exhaustive
@pytest.mark.parametrize("k", [2e3, 1e5, 1e8, 1e12, 1e15])
def test_no_stiffness_gives_energy_to_a_heap(k):
    """Blocks and balls that tumble onto each other, undamped, steps of 10 ms: whatever points of contact come and go.

    A solve leaves 1e-6, and up to 1e-3 where it does not converge.
    """
    rng, worlds = np.random.default_rng(3), 50
    block = {"size": (1, 0.6, 0.4), "mass": M}
    bodies = [
        physics.Block(**block, pos=(0, 0.7, 0)),
        physics.Sphere(0.3, M, pos=(0, 2.0, 0)),
        physics.Block(**block, pos=(0, 3.3, 0)),
    ]
    effects = soft(k, 0.0, physics.Gravity(), physics.Friction(0.5))
    world = physics.World(physics.Scene(bodies, [FLOOR], effects), worlds=worlds, dt=0.01)
    quat = rng.normal(size=(worlds, 3, 4))
    quat /= np.linalg.norm(quat, axis=-1, keepdims=True)
    turn = 3 * rng.normal(size=(worlds, 3, 3))
    world.set_state(quat=quat, linvel=rng.normal(size=(worlds, 3, 3)), angvel=turn)
    start = motion_energy(world)
    for _ in range(200):
        world.step()
        assert (motion_energy(world) <= start * 1.001).all()


def test_springs_that_appear_do_not_push():
    """A stiff block lands and tumbles: points come and go, and none starts with energy that no force has given it.

    Springs of 1e12 N/m that a step does not resolve hold next to none, so that the motion gains none in any step.
    """
    quat = np.array([0.09, 0.09, 0.88, -0.46])
    start = {"pos": (0, 0.65, 0), "quat": quat / np.linalg.norm(quat), "angvel": (-1.5, 8.2, 2.6)}
    body = physics.Block((1, 0.6, 0.4), M, **start)
    effects = soft(1e12, 0.0, physics.Gravity(), physics.Friction(0.5))
    world = physics.World(physics.Scene([TABLE, body], effects=effects), dt=0.01)
    before = first = motion_energy_of_last(world)
    for _ in range(50):
        world.step()
        now = motion_energy_of_last(world)
        assert now <= before + 1e-6 * first
        before = now


def motion_energy_of_last(world):
    """Kinetic energy of the last body and its energy of gravity [J]."""
    return physics.diagnose(world).kinetic_energy[0, -1] + M * G * world.pos[0, -1, 1]


def test_a_soft_stack_falls_asleep_at_its_sag():
    bodies = [ball(), ball(pos=(0, 3 * R, 0))]
    c = 2 * math.sqrt(1e5 * M)
    effects = soft(1e5, c, physics.Gravity(), physics.Sleeping())
    world = physics.World(physics.Scene(bodies, [FLOOR], effects), dt=0.01)
    world.step(steps=300)
    assert world.asleep.all()
    sag = M * G / 1e5 * np.array([2, 3])
    assert [R, 3 * R] - world.pos[0, :, 1] == pytest.approx(sag, rel=1e-3)
