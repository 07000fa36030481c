"""A compound of one part does whatever the part does, bit for bit, with every effect that bodies in contact know."""

from __future__ import annotations

import numpy as np
import pytest

import physics

pytestmark = [pytest.mark.interpreted, pytest.mark.exhaustive]

FLOOR = physics.HalfSpace((0, 1, 0))
LAWS = [physics.Gravity(), physics.Contact(0.3), physics.Friction(0.5)]
PLATE = physics.Block((4, 1, 4), fixed=True)
BRICK = physics.Block((1, 0.6, 0.4), 2.0)
START = {"pos": (0.1, 0.9, 0), "quat": (0.8, 0.6, 0, 0), "linvel": (1, -2, 0.5), "angvel": (1, 2, -3)}
BALL = physics.Sphere(0.3, 1.0, pos=(0, 2.5, 0))
SPRING = physics.Spring(
    body=0, other=1, anchor=(0, 0, 0), point=(0.1, 0, 0.1), stiffness=100.0, damping=1.0, length=1.0
)
DRIVE = physics.Motion(spin=(0, 1, 0), surface_velocity=(0.3, 0, 0))
TURNTABLE = {"fixed": True, "pos": (0, -0.5, 0), "motion": DRIVE}
FAST = {**START, "angvel": (100, 300, -200)}

# Part, its start, other bodies, effects, accuracy, steps.
SCENES = {
    "springs": (BRICK, START, [BALL], [*LAWS, SPRING, physics.Push((1, 0, 0))], "balanced", 60),
    "sleep": (BRICK, {"pos": (0, 0.31, 0)}, [BALL], [*LAWS, physics.Sleeping()], "balanced", 150),
    "a motion": (PLATE, TURNTABLE, [BALL, physics.Sphere(0.3, 1.0, pos=(0.5, 0.4, 0))], LAWS, "balanced", 40),
    "error control": (BRICK, START, [BALL], LAWS, "precise", 20),
    "a fast spin": (BRICK, FAST, [physics.Block((0.5, 0.5, 0.5), 1.0, pos=(0, 2, 0))], LAWS, "balanced", 30),
    "impacts in turn": (BRICK, START, [BALL], LAWS, physics.Accuracy(collisions="sequential"), 40),
    "a friction of its own": (BRICK, {**START, "friction": 0.9}, [BALL], LAWS, "balanced", 40),
}  # fmt: skip


@pytest.mark.parametrize("name", SCENES)
def test_it_moves_as_the_part(name):
    part, start, others, laws, accuracy, steps = SCENES[name]
    states = []
    for body in (type(part)(**{**vars(part), **start}), physics.Compound([part], **start)):
        world = physics.World(physics.Scene([body, *others], [FLOOR], laws), dt=0.01, accuracy=accuracy)
        world.step(steps=steps)
        states.append(world.state)
    np.testing.assert_array_equal(*states)
