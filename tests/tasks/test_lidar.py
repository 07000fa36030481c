"""The lidar observation: closed forms in a room, turns with its body, and is the same in every batch."""

from __future__ import annotations

import math

import numpy as np
import pytest

import physics
from rigid_env.envs.checks import check_task
from rigid_env.tasks import Task, Uniform, observe
from tests.tasks.conftest import started

ROOM = [physics.HalfSpace((0, 1, 0)), physics.HalfSpace((1, 0, 0), -4.0), physics.HalfSpace((-1, 0, 0), -4.0)]
FAN = [(1, 0, 0), (-1, 0, 0), (0, 0, 1), (0, -2, 0)]
REACH = 8.0


class Room(Task):
    """A block that sees a ball and the walls of a room."""

    scene = physics.Scene(
        [physics.Block((1, 1, 1), 1.0, pos=(0, 0.5, 0)), physics.Sphere(0.5, 1.0, pos=(2, 0.5, 0))],
        ROOM,
        [physics.Gravity((0, -9.81, 0)), physics.Contact(), physics.Friction(0.5)],
    )
    draws = {"angle": Uniform(-math.pi, math.pi)}  # noqa: RUF012
    observation = (observe.lidar(0, FAN, REACH), observe.lidar(1, [(0, 0, 1)], 2.0, (0, 0.1, 0)))

    def place(self, drawn):
        half = 0.5 * drawn["angle"]
        quat = np.zeros((len(half), 2, 4))
        quat[:, :, 0] = 1.0
        quat[:, 0] = np.stack((np.cos(half), 0 * half, np.sin(half), 0 * half), axis=1)
        return {"pos": np.tile([(0, 0.5, 0), (2, 0.5, 0)], (len(half), 1, 1)), "quat": quat}

    def rewards(self, worlds):
        return {}


def test_distances_are_closed_forms_and_turn_with_the_body():
    """Turned by an angle a about y, body x is (cos a, 0, -sin a), and body z is (sin a, 0, cos a)."""
    task = started(Room(16))
    for k, angle in enumerate(task.drawn["angle"]):
        c, s = math.cos(angle), math.sin(angle)
        ways = np.array([(c, 0, -s), (-c, 0, s), (s, 0, c), (0, -1, 0)])
        expected = []
        for way in ways:
            wall = 4.0 / abs(way[0]) if way[0] else math.inf
            down = 0.5 if way[1] < 0 else math.inf
            square = 0.25 - 4.0 * (1 - way[0] ** 2) if way[1] == 0 else -1.0  # the ball, at (2, 0, 0) from the block
            ball = 2 * way[0] - math.sqrt(square) if square > 0 and way[0] > 0 else math.inf
            expected.append(min(wall, down, ball, REACH) / REACH)
        np.testing.assert_allclose(task.obs[k, :4], expected, rtol=1e-6)
        assert task.obs[k, 4] == 1.0  # the ball sees nothing along z
    assert len(np.unique(task.obs[:, 0])) > 4


def test_it_is_named_scaled_and_bounded():
    first, second = Room.observation
    assert first.names == ("lidar 0", "lidar 1", "lidar 2", "lidar 3")
    assert second.names == ("lidar of body 1 0",)
    assert (first.told_unit, first.low, first.high) == ("8 m", 0.0, 1.0)


@pytest.mark.parametrize("threads", [1, 2])
def test_single_equals_batch_bit_for_bit(threads):
    batch = started(Room(5, threads=threads))
    actions = np.random.default_rng(3).uniform(-1, 1, (6, 5, batch.action.shape[1]))
    seen = [batch.obs.copy()]
    for step in actions:
        batch.step(step)
        seen.append(batch.obs.copy())
    for k in range(5):
        alone = started(Room(1), seed=k)
        np.testing.assert_array_equal(alone.obs[0], seen[0][k])
        for before, step in enumerate(actions, 1):
            alone.step(step[k : k + 1])
            np.testing.assert_array_equal(alone.obs[0], seen[before][k])


def test_the_task_passes_all_checks():
    check_task(Room, contexts=())


@pytest.mark.parametrize(("arguments", "message"), [
    ((0, [(0, 0, 0)], 1.0), r"directions\[0\] is \(0, 0, 0\); allowed"),
    ((0, [(0, 1)], 1.0), "directions has shape"),
    ((0, FAN, 0.0), "max_distance is 0.0; allowed"),
    ((0, FAN, np.inf), "max_distance is inf; allowed"),
    ((0, FAN, 1.0, (0, np.nan, 0)), "origin is"),
    ((-1, FAN, 1.0), "body is -1; allowed"),
])  # fmt: skip
def test_mistakes_are_named(arguments, message):
    with pytest.raises(ValueError, match=message):
        observe.lidar(*arguments)


def test_a_body_that_is_not_there_is_refused():
    with pytest.raises(ValueError, match="carrier is 2; allowed are indices from 0 to 1"):
        type("Wrong", (Room,), {"observation": (observe.lidar(2, FAN, 1.0),)})(1)
