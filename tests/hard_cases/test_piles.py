"""Hard cases of bodies on bodies, at the default accuracy and a step of 10 ms: towers, pyramids, overhangs, a run."""

from __future__ import annotations

import math

import numpy as np
import pytest

import physics

G = 9.81
CUBE = (1.0, 1.0, 1.0)


def pile(bodies, friction=0.5):
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(), physics.Friction(friction)]
    return physics.World(physics.Scene(bodies, [physics.HalfSpace((0, 1, 0))], effects), dt=0.01)


def farthest(world, start) -> float:
    """Largest displacement of any body [m]."""
    return float(np.abs(world.pos - start).max())


def loads(world) -> dict[int, float]:
    """Vertical force from below on every body of world 0 [N]."""
    found = dict.fromkeys(range(world.body_count), 0.0)
    for (a, b), force in zip(world.contact_ends(), world.contacts()[1]):
        found[int(a) if b < 0 else int(b)] += float(force[1] if b < 0 else -force[1])
    return found


# A gap of one slop (1e-6 bounding radii) is what a contact may have; a minute at rest may use up one at each interface.
SLOP = 1e-6 * math.sqrt(0.75)


@pytest.mark.parametrize("count", [10, 20, 50])
def test_a_tower_stands_for_a_minute(count):
    world = pile([physics.Block(CUBE, 1.0, pos=(0, k + 0.5, 0)) for k in range(count)])
    start = world.pos.copy()
    for _ in range(60):
        assert world.step(steps=100).ok
    assert farthest(world, start) <= count * SLOP
    # The load of an interface is the weight above it: to the residual, 1e-6 of the free speed g h, which every body
    # above may have used up.
    for k, load in loads(world).items():
        assert load == pytest.approx((count - k) * G, abs=2e-6 * G * count**2)


def test_a_tower_with_offsets_of_a_hundredth_stands_for_a_minute():
    rng = np.random.default_rng(0)
    shifts = rng.uniform(-0.01, 0.01, (15, 2))
    world = pile([physics.Block(CUBE, 1.0, pos=(x, k + 0.5, z)) for k, (x, z) in enumerate(shifts)])
    start = world.pos.copy()
    for _ in range(60):
        assert world.step(steps=100).ok
    assert farthest(world, start) <= 15 * SLOP


@pytest.mark.parametrize("top", [1.0, 1e2, 1e4, 1e6])
def test_a_heavy_block_stands_on_a_light_one(top):
    world = pile([physics.Block(CUBE, 1.0, pos=(0, 0.5, 0)), physics.Block(CUBE, top, pos=(0, 1.5, 0))])
    start = world.pos.copy()
    for _ in range(60):
        report = world.step(steps=100)
        assert report.ok
        assert report.penetration[0] <= 2 * SLOP
    assert farthest(world, start) <= 2 * SLOP
    assert loads(world)[1] == pytest.approx(top * G, rel=1e-5)
    assert loads(world)[0] == pytest.approx((top + 1) * G, rel=1e-5)


@pytest.mark.parametrize("base", [10, 20])
def test_a_pyramid_stands(base):
    rows = [(row, i) for row in range(base) for i in range(base - row)]
    world = pile([physics.Block(CUBE, 1.0, pos=(1.02 * (i - (base - row - 1) / 2), row + 0.5, 0)) for row, i in rows])
    start = world.pos.copy()
    world.step(steps=500)
    assert farthest(world, start) <= base * SLOP
    assert sum(load for k, load in loads(world).items() if rows[k][0] == 0) == pytest.approx(len(rows) * G, rel=1e-5)


@pytest.mark.parametrize(("share", "stands"), [(0.98, True), (1.02, False)])
def test_an_overhang_of_the_harmonic_sum(share, stands):
    # Block k from the top may reach length/(2 k) beyond the one below: their common centre is then above its edge.
    count, x, places = 5, 0.0, []
    for k in range(count):
        places.append(x)
        x -= share * 0.5 / (k + 1)
    bodies = [physics.Block((1.0, 0.2, 0.5), 1.0, pos=(places[count - 1 - k], 0.1 + 0.2 * k, 0)) for k in range(count)]
    world = pile(bodies)
    start = world.pos.copy()
    world.step(steps=1000)
    if stands:
        assert farthest(world, start) <= count * SLOP
    else:
        assert world.pos[0, -1, 1] < 0.5  # it lies on the floor


def test_twenty_dominoes_fall_in_order():
    tilt = 0.15  # of half the angle of the first one: beyond its edge, atan(0.2/1)
    first = physics.Block((0.2, 1, 0.5), 1.0, pos=(0.1, 0.55, 0), quat=(math.cos(tilt), 0, 0, -math.sin(tilt)))
    world = pile([first, *(physics.Block((0.2, 1, 0.5), 1.0, pos=(0.6 * k, 0.5, 0)) for k in range(1, 20))])
    fallen = np.full(20, np.inf)
    for k in range(1000):
        world.step()
        low = world.pos[0, :, 1] < 0.45
        fallen[low & np.isinf(fallen)] = k
        if low.all():
            break
    assert (np.diff(fallen) >= 0).all()
    assert np.isfinite(fallen).all()
