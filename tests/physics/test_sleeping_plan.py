"""Declaring sleep: what is compiled and stored for it, where it is off and why, and what is refused."""

from __future__ import annotations

import pytest

import physics
from physics.accuracy import resolve
from physics.plan.explanation import Row
from tests.physics.test_sleeping import BLOCK


def plan(*effects, accuracy="balanced", walls=BLOCK.walls):
    scene = physics.Scene(BLOCK.bodies, walls, [*BLOCK.effects, *effects])
    return physics.make_plan(scene, resolve(accuracy))


def row_of(plan):
    return next(row for row in plan.rows if row.effect == "sleeping")


def test_undeclared_nothing_of_it_is_there():
    assert physics.World(BLOCK).sleep.size == 0
    assert not physics.World(BLOCK).asleep.any()
    with_it, without = plan(physics.Sleeping()), plan()
    assert [(a, b) for a, b in zip(with_it.key, without.key) if a != b] == [(True, None)]
    assert row_of(without) == Row("sleeping", False, "not declared", "")
    assert row_of(with_it).is_on
    assert row_of(with_it).reason == "declared: Sleeping(slops=4.0, time=None)"
    assert "nothing can touch" in plan(physics.Sleeping(), walls=()).explain()


@pytest.mark.parametrize("accuracy", ["fast", "balanced", "precise", "reference"])
def test_it_acts_at_every_preset(accuracy):
    with_it, without = plan(physics.Sleeping(), accuracy=accuracy), plan(accuracy=accuracy)
    assert [(a, b) for a, b in zip(with_it.key, without.key) if a != b] == [(True, None)]
    assert row_of(with_it).is_on
    assert with_it.scheme is without.scheme


def test_under_loads_that_may_change_by_themselves_nothing_sleeps():
    gusts = (physics.Sleeping(), physics.Drag(), physics.Wind(gust=1.0))
    assert not plan(*gusts).sleeping
    assert "nothing rests under what may change on its own: wind" in plan(*gusts).explain()
    calm = (physics.Sleeping(), physics.Drag(), physics.Wind(gust=0.0))
    assert plan(*calm).sleeping
    world = physics.World(physics.Scene(BLOCK.bodies, BLOCK.walls, [*BLOCK.effects, *calm]))
    with pytest.raises(ValueError, match=r"Wind.*may change on its own, in a scene in which bodies sleep"):
        world.set_parameters(effects=[physics.Wind(gust=1.0)])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: physics.Sleeping(slops=0), "Sleeping.slops is 0"),
        (lambda: physics.Sleeping(time=-1), "Sleeping.time is -1"),
        (lambda: physics.Scene(BLOCK.bodies, effects=[physics.Sleeping()]), "Sleeping without Contact"),
    ],
)
def test_what_is_asked_wrongly_is_refused(make, message):
    with pytest.raises(ValueError, match=message):
        make()
