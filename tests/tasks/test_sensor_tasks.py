"""Sensors in tasks: entries of observations, and what functions read of them."""

from __future__ import annotations

import numpy as np
import pytest

import physics
import rigid_env
from rigid_env.tasks import Task, Uniform, Wrench, observe
from rigid_env.tasks.describe import describe
from tests.tasks.conftest import started

pytestmark = pytest.mark.interpreted


class IntoGoal(Task):
    """Push a puck into a goal; another one hovers in it from the beginning."""

    scene = physics.Scene(
        bodies=[
            physics.Block((0.4, 0.2, 0.4), 1.0, pos=(0, 0.1, 0)),
            physics.Sphere(0.1, 1.0, pos=(2, 5, 0)),
        ],
        sensors=[
            physics.Sensor(physics.Block((1, 20, 1), fixed=True, pos=(2, 0, 0)), name="goal"),
            physics.Sensor(physics.Sphere(0.5, fixed=True, pos=(0.6, 0, 0)), 0),
        ],
    )
    actions = Wrench(0, force=0.5, torque=0.0, force_axes="x")
    observation = (observe.pos(), observe.sensor(), observe.sensor(0, 0), observe.sensor(0, 1), observe.sensor(1))
    draws = {"x": Uniform(1.0, 1.29)}  # noqa: RUF012

    def place(self, drawn):
        pos = np.tile([[(0.0, 0.1, 0.0), (2.0, 5.0, 0.0)]], (len(drawn["x"]), 1, 1))
        pos[:, 0, 0] = drawn["x"]
        return {"pos": pos}

    def success(self, worlds):
        return worlds.sensors[:, 0, 0]

    def rewards(self, worlds):
        return {"inside": worlds.sensors[:, 0, 0].astype(float)}


def test_an_observation_tells_who_is_in_a_sensor_and_an_episode_ends_with_it():
    task = started(IntoGoal(3))
    assert task.obs[:, 3:].tolist() == [[1, 0, 1, 0]] * 3
    for _ in range(200):
        task.step(np.ones((3, 1)))
        is_in = task.world.pos[:, 0, 0] + 0.2 >= 1.5  # the front of the puck has come to the goal
        assert task.obs[:, 4].tolist() == is_in.tolist()
        assert (task.outcome[:, 1] > 0).tolist() == is_in.tolist()
        if is_in.all():
            break
    assert is_in.all()
    assert task.obs[:, 3:].tolist() == [[1, 1, 1, 0]] * 3


def test_a_task_with_sensors_keeps_all_promises_of_environments():
    rigid_env.check_task(IntoGoal, steps=12, contexts=(), accuracy="fast")


def test_entries_name_the_sensor_and_are_refused_where_the_scene_has_none():
    assert "sensor 0 on body 1" in describe(IntoGoal())
    with pytest.raises(ValueError, match="sensor is -1; allowed"):
        observe.sensor(-1)
    with pytest.raises(ValueError, match="body is -2; allowed"):
        observe.sensor(0, -2)

    class Missing(IntoGoal):
        observation = observe.sensor(2)

    with pytest.raises(ValueError, match="allowed are parts of its scene, 2 bodies, 0 walls and 2 sensors"):
        Missing()
