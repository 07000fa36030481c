"""All or nothing: an exception or an interrupt in a block puts back what was remembered before it."""

from __future__ import annotations

import numpy as np
import pytest

import physics
from physics.undo import undo_on_error
from tests.physics.test_field_errors import Reaching

pytestmark = pytest.mark.interpreted


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_a_block_that_raises_is_undone_in_the_order_given(error):
    done = []
    with pytest.raises(error), undo_on_error(lambda: done.append(1), None, lambda: done.append(2)):
        raise error
    assert done == [1, 2]


def test_a_block_that_ends_is_not_undone():
    with undo_on_error(lambda: 1 / 0):
        pass


def interrupted(make):
    """`World.make` that is interrupted once the steps are taken, in its third call."""
    calls = []

    def made(world, *arguments):
        make(world, *arguments)
        calls.append(1)
        if len(calls) == 3:
            raise KeyboardInterrupt

    return made


@pytest.mark.parametrize(
    ("call", "steps"),
    [
        (lambda world: [world.step() for _ in range(3)], 2),
        (lambda world: physics.rollout(world, np.zeros((2, 5, 6))), 0),
    ],
    ids=["step", "rollout"],
)
def test_an_interrupt_leaves_whole_steps_or_nothing(call, steps, monkeypatch):
    world = physics.World(physics.Scene([physics.Sphere(0.5, 2.0, linvel=(1, 0, 0))], effects=[Reaching()]), 2)
    physics.Recorder(world)  # so that a rollout is made step by step
    world.step()
    twin = physics.World(world.scene, 2)
    for _ in range(1 + steps):
        twin.step()
    monkeypatch.setattr(physics.World, "make", interrupted(physics.World.make))
    with pytest.raises(KeyboardInterrupt):
        call(world)
    monkeypatch.undo()
    np.testing.assert_array_equal(world.state, twin.state)
    assert world.time == twin.time
    assert not world.is_in_use
