"""Nothing of one step is read in the next but the state and the contact memory: scratch may hold anything before.

A thread steps many worlds with one scratch. What a kernel reads of it before writing it would carry over from whatever
world was there before, and results would depend on the batch, or be nonsense.
"""

from __future__ import annotations

import itertools

import numpy as np
import pytest

import physics
from physics import scenes

# What scratch says of the scene, not of a step.
GIVEN = {
    "settings", "scene", "walls", "relative_slop", "is_sequential",
}  # fmt: skip

# Anything: what is not a number shows in whatever it gets into; 1 is in range of whatever an integer counts.
ANY_NUMBER, ANY_COUNT = np.nan, 1


def spoil_record(record: np.ndarray) -> None:
    """Write over every field that a step has to set itself, also in the groups of a workspace."""
    for name in record.dtype.names:
        if record.dtype[name].names and name not in GIVEN:
            spoil_record(record[name])
        elif name not in GIVEN:
            record[name] = ANY_NUMBER if record.dtype[name].base.kind == "f" else ANY_COUNT


def spoil_arrays(arrays: tuple) -> None:
    """`spoil_record` for the arrays of worlds whose bodies touch each other; those that index others stay."""
    for name, array in zip(arrays._fields, arrays):
        if name in GIVEN or array is None:
            continue
        if hasattr(array, "_fields"):
            spoil_arrays(array)
        elif array.dtype.names:
            spoil_record(array)
        elif array.dtype.kind == "f":
            array[...] = ANY_NUMBER


def spoil(world: physics.World) -> None:
    """Write over all scratch of a world."""
    for scratch in (*world.scratch, *world.motions):
        if hasattr(scratch, "_fields"):
            spoil_arrays(scratch)
        elif scratch is not None:
            spoil_record(scratch)


def slender() -> physics.Scene:
    """A rod-like ellipsoid that is pushed into a wall so hard that no force is consistent: first-order leaps."""
    body = physics.Ellipsoid(
        (0.07868843, 0.09786638, 1.25914593), 660.42961745, pos=(-5.81312896, -5.60702696, 2.84347781),
        linvel=(-0.2808171, 0.07838032, 0.38298866),
    )  # fmt: skip
    walls = [physics.HalfSpace(tuple(s * n for n in normal), -10.0) for normal in np.eye(3) for s in (1.0, -1.0)]
    return physics.Scene([body], walls, [physics.Gravity((0, -2.0, 0)), physics.Contact(), physics.Friction(0.8)])


def pushed(build) -> tuple[physics.Scene, np.ndarray]:
    """A scene, and a wrench of some weights on its body."""
    scene = build()
    weight = 9.81 * scene.bodies[0].mass
    return scene, weight * np.array([0.5, -0.3, 0.4, 0.6, -0.2, 0.3])


NAMES = ("corner_drop", "closed_box", "shove", "bounce")
CASES = {name: lambda name=name: pushed(scenes.SCENES[name]) for name in NAMES}


def heap():
    """A heap, of which one block is no cube: a kernel that other tests need, too."""
    scene = scenes.heap(6)
    slab = physics.Block((1.0, 0.5, 1.0), 1.0, pos=scene.bodies[0].pos, quat=scene.bodies[0].quat)
    return physics.Scene([slab, *scene.bodies[1:]], scene.walls, scene.effects)


CASES["slender"] = lambda: (slender(), np.array([-8.21590761e07, 9.83922068e06, -1.09285187e06, 3.5e3, -1.6e2, -2.0e3]))


CASES["heap"] = lambda: (heap(), np.array([3.0, 20.0, -5.0, 1.0, -4.0, 2.0]))


def tier_of(case, accuracy):
    """Marks of a case: events under a steady push are many, and piles are faster compiled."""
    if case in ("shove", "slender") and accuracy == "precise":
        return pytest.mark.exhaustive
    return pytest.mark.compiled if case == "heap" else pytest.mark.interpreted


@pytest.mark.parametrize(
    ("case", "accuracy"),
    [pytest.param(*each, marks=tier_of(*each)) for each in itertools.product(CASES, ["fast", "balanced", "precise"])],
)
def test_scratch_may_hold_anything(case, accuracy, is_exhaustive):
    scene, wrench = CASES[case]()
    clean, spoilt = (physics.World(scene, dt=0.01, accuracy=accuracy, threads=1) for _ in range(2))
    for world in (clean, spoilt):
        world.step()  # the scratch is there from then on
    for k in range(20 if case == "slender" and not is_exhaustive else 40):
        now = wrench if k % 10 < 5 else np.zeros(6)
        spoil(spoilt)
        for world in (clean, spoilt):
            world.step(np.broadcast_to(now, (1, world.body_count, 6)))
        np.testing.assert_array_equal(spoilt.state, clean.state, err_msg=f"step {k}")
        assert not clean.report.faults.any()


@pytest.mark.parametrize("accuracy", ["fast", "balanced", "precise"])
def test_a_world_that_overflows_leaves_the_others_alone(accuracy):
    """Bodies that meet at 1e200 m/s: squares of that are beyond the largest number."""
    scene = heap()
    alone, beside = (
        physics.World(scene, 1, dt=0.01, accuracy=accuracy),
        physics.World(scene, 2, dt=0.01, accuracy=accuracy, threads=1),
    )
    faults = 0
    for k in range(80):
        if k == 60:  # some lie, some fall
            speeds = 1e200 * np.where(np.arange(6) % 2 == 0, 1.0, -1.0)[None, :, None] * np.ones(3)
            beside.set_state(linvel=speeds, angvel=speeds, worlds=[0])
        alone.step()
        faults += beside.step().faults[0]
    np.testing.assert_array_equal(beside.state[6:], alone.state)
    assert faults > 0
