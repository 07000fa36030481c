"""Small tasks that the tests of the interface share."""

from __future__ import annotations

import numpy as np
import pytest

import physics
from rigid_env.tasks import Entry, Task, Wrench, observe


class Slide(Task):
    """A block on a floor without friction, pushed along x."""

    scene = physics.Scene(
        bodies=[physics.Block(size=(2, 1, 1), mass=3.0, pos=(0, 0.5, 0))],
        walls=[physics.HalfSpace((0, 1, 0), 0.0)],
        effects=[physics.Gravity(), physics.Contact()],
    )
    actions = Wrench(0, force=0.5, torque=0.0, force_axes="x")
    observation = (observe.pos(), observe.linvel())

    def rewards(self, worlds):
        return {"speed": worlds.linvel[:, 0, 0], "effort": -(worlds.action[:, 0] ** 2)}


class Free(Task):
    """A block that floats, without gravity."""

    scene = physics.Scene([physics.Block(size=(5, 3, 2), mass=6.0)], effects=[])
    observation = (observe.pos(), Entry("x", "m", -9, 9, lambda worlds: worlds.pos[:, 0, 0]))


@pytest.fixture
def slide():
    return Slide


@pytest.fixture
def free():
    return Free


def started(task: Task, seed: int = 0) -> Task:
    """The same task with an episode begun in each of its worlds."""
    for world in range(task.worlds):
        task.seed(world, seed + world)
    task.start(np.arange(task.worlds))
    return task
