"""Wrong input to running worlds."""

from __future__ import annotations

import numpy as np

import physics
from tests.wrong_input.case import Case


def one_body() -> physics.World:
    """A block that has fallen for a little while."""
    scene = physics.Scene(
        [physics.Block((1, 1, 1), 1.0, pos=(0, 2, 0))],
        physics.three_walls(),
        [physics.Gravity(), physics.Contact(), physics.Friction()],
    )
    world = physics.World(scene)
    world.step(steps=10)
    return world


SUBJECTS = {"one": one_body}


def state_of(world: physics.World) -> tuple:
    """Everything that decides how a world goes on."""
    actuation = None if world.actuation is None else world.actuation.kept()
    return world.kept(), world.time, actuation


CASES = [
    Case("steps-zero", lambda world: world.step(steps=0), ("steps", "0", "at least 1"), "one"),
    Case("pos-nan", lambda world: world.set_state(pos=np.full((1, 1, 3), np.nan)), ("pos", "nan", "finite"), "one"),
]
