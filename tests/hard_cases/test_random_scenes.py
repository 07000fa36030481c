"""Draws of hard case 47 in which something once went wrong, and what was mended for them."""

from __future__ import annotations

import numpy as np
import pytest

import physics
from rigid_env.hard_cases.cases import random_draws, random_scenes

# Family, worlds, seed, accuracy: before resting stages, places put right and failed solves were kept from giving energy
# (decision 14), 1, 3 and 2 worlds of ellipsoids broke a law in these, 5, 7 and 5 of several bodies, and 2, 1 and 1 of
# blocks at `fast`, which has no method beyond sweeps: they gained up to 9 times what was put in.
DRAWS = [
    *(("ellipsoid", 1000, seed, "balanced") for seed in (0, 1, 6)),
    *(("bodies", 500, seed, "balanced") for seed in (0, 1, 2)),
    *(("block", 1000, seed, "fast") for seed in (2, 21, 23)),
]


@pytest.mark.exhaustive
@pytest.mark.parametrize(("family", "worlds", "seed", "accuracy"), DRAWS)
def test_no_law_is_broken(family, worlds, seed, accuracy):
    world = physics.World(random_draws.scene_of(family), worlds=worlds, dt=0.01, accuracy=accuracy)
    limit = random_scenes.gain_limit(accuracy)
    outcome = random_scenes.drive(world, np.random.default_rng(seed))
    broken = np.flatnonzero(outcome.broken_laws(limit))
    assert [(k, outcome.law(k, limit)) for k in broken.tolist()] == []


@pytest.mark.interpreted
def test_what_is_deep_in_a_wall_is_taken_out_under_any_load():
    """Strong loads let a contact set reach far: the error of pushing apart is a share of the depth, not of that."""
    block = physics.Block((1, 1, 1), 1.0, pos=(0, 0.492, 0))  # 8 mm deep
    far = physics.Sphere(0.5, 1.0, pos=(50, 10, 0))
    floor = physics.HalfSpace((0, 1, 0))
    scene = physics.Scene([block, far], [floor], [physics.Gravity(), physics.Contact(), physics.Friction(0.5)])
    world = physics.World(scene, dt=0.01)
    wrench = np.zeros((1, 2, 6))
    wrench[0, 0, 1] = -1e6 * 9.81
    world.step(wrench)
    # Out to a hundred slops (`position_correction._DEEP_SLOPS`) of a bounding radius of 0.87 m; halves of what is left
    # are taken per step.
    assert physics.diagnose(world).gap[0, 0] >= -100 * 1e-6 * 0.87
    assert np.abs(world.linvel[0, 0]).max() <= 1e-6 * 1e6 * 9.81 * 0.01  # the tolerance, of the speed its loads give


@pytest.mark.interpreted
def test_a_ball_between_three_rough_walls_holds_no_stress_beyond_its_loads():
    """Three rough walls let a ball hold any stress; loads of a million times its weight leave none when they end."""
    walls = [physics.HalfSpace(tuple(float(k == axis) for k in range(3))) for axis in range(3)]
    balls = [physics.Sphere(1.0, 0.04, pos=(1, 1, 1)), physics.Sphere(1.0, 0.04, pos=(40, 40, 40))]
    scene = physics.Scene(balls, walls, [physics.Gravity((-3, -4, -4)), physics.Contact(1.0), physics.Friction(0.8)])
    world = physics.World(scene, dt=0.01)
    rng = np.random.default_rng(0)
    wrench = np.zeros((1, 2, 6))
    for _ in range(20):
        wrench[0, 0] = rng.normal(size=6) * np.array([1e6] * 3 + [1e3] * 3) * 0.04 * 6.4
        wrench[0, 0, :3] = -np.abs(wrench[0, 0, :3])  # into the corner
        world.step(wrench)
    before = physics.diagnose(world).energy.sum()
    for _ in range(10):
        world.step()
        now = physics.diagnose(world).energy.sum()
        assert now <= before + 1e-5 * abs(before)  # 4 tolerances of each of nine solves, of the kinetic energy
        before = now
