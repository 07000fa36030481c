"""The wrench of a force at a point."""

from __future__ import annotations

import numpy as np
import pytest

import physics

pytestmark = pytest.mark.interpreted

EPS = np.finfo(float).eps


def test_a_force_at_a_point_of_a_body_is_what_a_push_is(rng):
    """`Push` computes the same in its kernel: points along body axes, forces along those of the world or the body."""
    arm, force = (0.2, 0.1, -0.1), (1.0, -2.0, 3.0)
    q = rng.normal(size=4)
    body = physics.Block((0.5, 0.3, 0.2), 2.0, pos=(1, 2, 3), quat=q / np.linalg.norm(q))
    for frame in ("world", "body"):
        world = physics.World(physics.Scene([body], effects=[physics.Push(force, arm, frame)]))
        expected = physics.look_at(world)[0]
        assert physics.wrench_at(world, force, arm, frame)[0] == pytest.approx(expected, abs=16 * EPS)


def test_points_of_the_world_and_bodies_that_nothing_acts_on():
    bodies = [physics.Sphere(1, 1, pos=(1, 2, 3)), physics.Sphere(1, 1, pos=(5, 5, 5))]
    world = physics.World(physics.Scene(bodies), worlds=3)
    force = np.array([[0.0, 2.0, 0.0], [0.0, 0.0, 0.0]])
    wrench = physics.wrench_at(world, force, (2.0, 2.0, 3.0), point_frame="world")
    assert wrench.shape == (3, 2, 6)
    assert np.array_equal(wrench[2, 0], [0, 2, 0, 0, 0, 2])
    assert not wrench[:, 1].any()
    world.step(wrench)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (((1, 2),), r"force has shape \(2,\); allowed is shape \(3,\), \(1, 3\) or \(1, 1, 3\)"),
        (((1, 2, 3), (0, 0, np.nan)), "point is .*allowed are finite"),
        (((1, 2, 3), (0, 0, 0), "air"), "frame is 'air'; allowed are world, body"),
        (((1, 2, 3), (0, 0, 0), "body", "air"), "point_frame is 'air'; allowed are world, body"),
    ],
)
def test_a_wrong_argument_is_named(arguments, message):
    world = physics.World(physics.Scene([physics.Sphere(1, 1)]))
    with pytest.raises(ValueError, match=message):
        physics.wrench_at(world, *arguments)
