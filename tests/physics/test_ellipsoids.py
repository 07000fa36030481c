"""Ellipsoids among bodies: closed forms of impacts and rest, a ball by another name, nothing compiled without any."""

from __future__ import annotations

import math

import numpy as np
import pytest

import physics

pytestmark = pytest.mark.interpreted

G = 9.81
AXES = (1.0, 0.6, 0.8)
FLOOR = [physics.HalfSpace((0, 1, 0))]
FREE = [physics.Contact(0.7), physics.Friction(0.0)]
RUBBING = [physics.Gravity((0, -G, 0)), physics.Contact(0.0), physics.Friction(0.5)]


def turn(axis, angle):
    axis = np.asarray(axis) / np.linalg.norm(axis)
    return (math.cos(angle / 2), *(math.sin(angle / 2) * axis))


def totals(world):
    """Momentum, angular momentum about the origin, energy."""
    d = physics.diagnose(world)
    orbital = np.cross(world.pos, d.momentum)
    return d.momentum.sum(axis=1), (d.angular_momentum + orbital).sum(axis=1), d.energy.sum()


@pytest.mark.parametrize("other", ["block", "sphere", "ellipsoid"])
@pytest.mark.parametrize("ellipsoid_first", [True, False])
def test_an_oblique_impact_is_that_of_one_contact(other, ellipsoid_first):
    """v_n' = -e v_n at the points that meet, j = -(1+e) v_n/(n·(W_a + W_b) n); both momenta are kept."""
    flying = physics.Ellipsoid(AXES, 2.0, pos=(-3, 0.2, 0.1), quat=turn((1, 2, 3), 0.8), linvel=(4, 0, 0))
    target = {
        "block": physics.Block((1, 2, 1), 5.0, quat=turn((1, 0, 1), 0.3)),
        "sphere": physics.Sphere(0.9, 5.0),
        "ellipsoid": physics.Ellipsoid((0.5, 0.9, 0.7), 5.0, quat=turn((0, 1, 1), 0.4)),
    }[other]
    bodies = [flying, target] if ellipsoid_first else [target, flying]
    world = physics.World(physics.Scene(bodies, (), FREE), dt=0.01)
    before, seen = totals(world), None
    for _ in range(100):
        state = world.pos.copy(), world.quat.copy(), world.linvel.copy(), world.angvel.copy()
        world.step()
        if not np.allclose(world.linvel, state[2], atol=1e-9):
            seen = state
            break
    assert seen is not None
    after = totals(world)
    np.testing.assert_allclose(after[0], before[0], atol=1e-12 * 8)
    # The bodies do not touch in one point but up to a slop of 1e-6 m apart: the impulse of 8 kg m/s has that lever.
    np.testing.assert_allclose(after[1], before[1], atol=1e-4)
    change = world.linvel[0] - seen[2][0]
    normal = change[1] / np.linalg.norm(change[1])  # of body 0 on body 1, without friction
    f = 0 if ellipsoid_first else 1
    assert np.linalg.norm(np.cross(normal, change[0])) <= 1e-9
    # Work of a frictionless impulse: ΔE = ½ j (v_n + v_n') = ½ (1 - e) j v_n, v_n = (4, 0, 0)·n of the one that flies.
    j = np.linalg.norm(change[f]) * 2.0
    closing = abs(normal @ np.array([4.0, 0, 0]))
    assert before[2] - after[2] == pytest.approx(0.5 * (1 - 0.7) * j * closing, rel=1e-5)


def test_a_ball_by_another_name_does_the_same(is_exhaustive):
    def run(ball):
        block = physics.Block((2, 1, 2), 3.0, pos=(0, 0.5, 0))
        world = physics.World(
            physics.Scene([block, ball(pos=(0.2, 2.5, 0.1), angvel=(1, 2, 3))], FLOOR, RUBBING), dt=0.01
        )
        world.step(steps=150 if is_exhaustive else 80)  # it lands after 0.45 s
        return world

    one = run(lambda **start: physics.Sphere(0.5, 2.0, **start))
    two = run(lambda **start: physics.Ellipsoid((0.5, 0.5, 0.5), 2.0, **start))
    # Directions of an ellipsoid are found to 1e-10 rad, or where the separation grows no more by rounding; a ball that
    # rolls on a block for a second keeps such errors as they are.
    np.testing.assert_allclose(two.pos, one.pos, atol=1e-6)
    np.testing.assert_allclose(two.linvel, one.linvel, atol=1e-6)
    assert one.plan.ellipsoids is None
    assert two.plan.ellipsoids


def test_an_egg_rests_on_a_block_and_carries_its_weight():
    """On its flattest side: stable, since both radii of curvature there, a²/b and c²/b, are larger than b."""
    block = physics.Block((3, 1, 3), 5.0, pos=(0, 0.5, 0))
    egg = physics.Ellipsoid(AXES, 2.0, pos=(0, 1.6, 0))
    world = physics.World(physics.Scene([block, egg], FLOOR, RUBBING), dt=0.01)
    start = world.pos.copy()
    world.step(steps=500)
    # Nothing but rounding and what a solve to 1e-6 of g h leaves per step, over 5 s.
    np.testing.assert_allclose(world.pos, start, atol=500 * 1e-6 * G * 0.01 * 0.01 + 3e-6)
    ends, (_, forces) = world.contact_ends(), world.contacts()
    on_egg = np.array([np.array([0, 1, 0]) @ f for e, f in zip(ends, forces) if set(e.tolist()) == {0, 1}])
    assert abs(on_egg.sum()) == pytest.approx(2.0 * G, rel=1e-5)


def test_an_egg_rocks_on_a_block_with_the_period_of_small_swings(is_exhaustive):
    """ω² = g (ρ - b)/(b² + k²): a body of centre height b and radius of curvature ρ = a²/b that rolls on a plane.

    Turned by θ about z its centre is (ρ - b) (1 - cos θ) above its lowest, to second order, and it turns about the
    point of contact with the moment m (k² + b²), k² = (a² + b²)/5. Amplitude 0.02 rad: off by some θ²/16, 1e-4.
    """
    a, b = AXES[0], AXES[1]
    theta, dt, periods = 0.02, *((0.005, 2.2) if is_exhaustive else (0.02, 1.7))
    height = math.hypot(a * math.sin(theta), b * math.cos(theta))
    block = physics.Block((6, 1, 6), 500.0, pos=(0, 0.5, 0))
    egg = physics.Ellipsoid(AXES, 2.0, pos=(0, 1 + height, 0), quat=turn((0, 0, 1), theta))
    world = physics.World(physics.Scene([block, egg], FLOOR, RUBBING), dt=dt)
    period = 2 * math.pi / math.sqrt(G * (a * a / b - b) / (b * b + (a * a + b * b) / 5))
    times, spins = [], []
    for k in range(int(periods * period / dt)):
        world.step()
        times.append((k + 1) * dt)
        spins.append(world.angvel[0, 1, 2])
    spins = np.array(spins)
    crossings = np.flatnonzero(spins[:-1] * spins[1:] < 0)  # at half periods
    share = spins[crossings] / (spins[crossings] - spins[crossings + 1])
    halves = np.array(times)[crossings] + dt * share
    assert len(halves) >= 3
    # Second order in the step, (ω h)²/12 = 6e-4 at 20 ms; the amplitude's 1e-4; friction and slop take a little of it.
    assert halves[2] - halves[0] == pytest.approx(period, rel=2e-3)


@pytest.mark.exhaustive
def test_many_eggs_come_to_rest_and_none_goes_through():
    rng = np.random.default_rng(1)
    bodies = [physics.Block((8, 1, 8), 1000.0, pos=(0, 0.5, 0))]
    for k in range(12):
        q = rng.standard_normal(4)
        place = (2.2 * (k % 3 - 1), 2.3 + 2.2 * (k // 3), 0.2 * (k % 2))
        bodies.append(physics.Ellipsoid(AXES, 1.0, pos=place, quat=q / np.linalg.norm(q)))
    walls = [*FLOOR, *(physics.HalfSpace(n, -4.0) for n in ((1, 0, 0), (-1, 0, 0), (0, 0, 1), (0, 0, -1)))]
    world = physics.World(physics.Scene(bodies, walls, RUBBING), dt=0.01)
    start = physics.diagnose(world).energy.sum()
    worst = 0.0
    for _ in range(400):
        report = world.step()
        worst = max(worst, float(report.penetration[0]))
    assert physics.diagnose(world).energy.sum() < start
    assert worst < 0.01 * min(AXES)  # what turning within a step may push in before the next one sees it
    assert (np.abs(world.pos[0, :, [0, 2]]) < 4.0).all()
    assert (world.pos[0, 1:, 1] > min(AXES)).all()
