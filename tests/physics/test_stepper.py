"""A prepared step is `World.step`, bit for bit, and survives what a world survives."""

from __future__ import annotations

import copy
import gc
import pickle
import weakref

import numpy as np
import pytest

import physics
from physics import scenes
from physics.kernels.state import layout as at
from physics.kernels.time_stepping.step import step_worlds
from physics.world.report import StepReport

WORLDS = 5
STEPS = 5


def shoved(threads=1, accuracy="fast"):
    world = physics.World(scenes.shove(), worlds=WORLDS, dt=0.005, accuracy=accuracy, threads=threads)
    world.set_state(linvel=np.random.default_rng(1).uniform(-4, 4, (WORLDS, 1, 3)))
    return world


@pytest.fixture
def loads(rng):
    return 50 * rng.uniform(-1, 1, (60, WORLDS, 1, 6))


@pytest.mark.parametrize("threads", [1, 2])
def test_a_stepper_takes_the_steps_of_step(loads, threads):
    """States, time, reports and status after each of 60 calls."""
    plain, prepared = shoved(), shoved(threads)
    stepper = physics.Stepper(prepared, STEPS)
    for load in loads:
        report = plain.step(load, steps=STEPS)
        stepper.wrench[...] = load
        stepper()
        np.testing.assert_array_equal(prepared.state, plain.state)
        assert prepared.time == plain.time
        np.testing.assert_array_equal(prepared.report.iterations, report.iterations)
        np.testing.assert_array_equal(prepared.report.status, report.status)


@pytest.mark.parametrize(
    "effects",
    [[physics.Drag(0.47), physics.Wind(gust=3.0, seed=5)], [physics.Actuator(limit_force=5.0)], [physics.Gravity()]],
    ids=["told the time", "limited", "alone"],
)
def test_what_else_has_a_part_in_a_step_has_it(effects):
    """Gusts, which are told the time; an actuator; and a recorder, that comes and goes between calls."""
    scene = physics.Scene([physics.Sphere(0.3, 0.5)], effects=effects)
    plain, prepared = (physics.World(scene, dt=0.01) for _ in range(2))
    stepper = physics.Stepper(prepared, STEPS)
    for turn in range(4):
        stepper.wrench[..., 0] = 20.0 * (-1.0) ** turn
        recorder = physics.Recorder(prepared) if turn == 2 else None
        plain.step(stepper.wrench, steps=STEPS)
        stepper()
        np.testing.assert_array_equal(prepared.state, plain.state)
        assert prepared.time == plain.time
        if recorder is not None:
            assert len(recorder.recording().wrenches) == 1
            recorder.stop()


@pytest.mark.parametrize("accuracy", ["balanced", "precise"])
@pytest.mark.parametrize("threads", [1, 2])
def test_a_world_whose_steps_differ_takes_those_of_steppers(loads, accuracy, threads):
    """Its calls are prepared once, and told of other numbers and lengths of steps."""
    plain, prepared = shoved(threads, accuracy), shoved(1, accuracy)
    steppers = {key: physics.Stepper(prepared, *key) for key in ((1, 0.01), (3, 0.004), (2, 0.01), (1, 0.0025))}
    for k, load in enumerate(loads[:24]):
        steps, dt = list(steppers)[k * k % 4 if k < 12 else k % 4]
        plain.step(load, steps=steps, dt=dt)
        steppers[steps, dt].wrench[...] = load
        steppers[steps, dt]()
        np.testing.assert_array_equal(prepared.state, plain.state)
        assert prepared.time == plain.time


def test_without_wrench_and_with_its_own_dt():
    plain, prepared = shoved(), shoved()
    stepper = physics.Stepper(prepared, dt=0.002)
    assert not stepper.wrench.any()
    for _ in range(50):
        plain.step(dt=0.002)
        stepper()
    np.testing.assert_array_equal(prepared.state, plain.state)
    assert prepared.time == plain.time == pytest.approx(0.1)


@pytest.mark.parametrize("copier", [copy.deepcopy, lambda w: pickle.loads(pickle.dumps(w))])
def test_a_copy_steps_its_own_world(loads, copier):
    stepper = physics.Stepper(shoved(), STEPS)
    stepper.wrench[...] = loads[0]
    stepper()
    other = copier(stepper)
    before = stepper.world.state.copy()
    other()
    np.testing.assert_array_equal(stepper.world.state, before)
    stepper()
    np.testing.assert_array_equal(other.world.state, stepper.world.state)


def test_changes_of_arguments_between_steps_of_a_world_are_heeded():
    """step() prepares for the last call: other steps, dt or wrench must not meet what is prepared."""
    world, push = shoved(), np.full((WORLDS, 1, 6), 20.0)
    world.step(push)
    assert world.time == pytest.approx(0.005)
    world.step(push, steps=2)
    assert world.time == pytest.approx(0.015)
    world.step(push, steps=2, dt=0.001)
    assert world.time == pytest.approx(0.017)
    pushed, free = copy.deepcopy(world), copy.deepcopy(world)
    pushed.step(push)
    pushed.restore(world.snapshot())
    pushed.step()
    free.step()
    np.testing.assert_array_equal(pushed.state, free.state)


def test_a_world_is_freed_with_its_last_user():
    """Prepared steps hold the world's arrays, not the world: no cycle for the collector to find."""
    world = shoved()
    world.step()
    gone = weakref.ref(world)
    gc.disable()
    try:
        del world
        assert gone() is None
    finally:
        gc.enable()


def test_a_wrench_in_any_memory_runs_the_same_code(loads):
    """Read-only, in another order or in another precision: nothing is compiled for it."""
    load = loads[0].astype(np.float32)
    frozen = load.astype(float)
    frozen.flags.writeable = False
    kinds = [load.astype(float), load, frozen, np.asfortranarray(load, dtype=float), load.tolist()]
    ends = []
    for k, kind in enumerate(kinds):
        world = shoved()
        world.step(kind, steps=STEPS)
        ends.append(world.state.copy())
        if k == 0:
            compiled = len(step_worlds.signatures)
    assert all(np.array_equal(end, ends[0]) for end in ends)
    assert len(step_worlds.signatures) == compiled


def test_a_wrench_that_is_not_finite_is_a_fault():
    world = shoved()
    stepper, before = physics.Stepper(world), world.pos.copy()
    stepper.wrench[2] = np.nan
    stepper()
    assert world.report.status.tolist() == [0, 0, physics.Status.FAULT, 0, 0]
    np.testing.assert_array_equal(world.pos[2], before[2])
    assert np.isfinite(world.state).all()


def test_the_wrench_cannot_be_replaced():
    """The calls are bound to its memory: another array would be ignored."""
    with pytest.raises(AttributeError):
        physics.Stepper(shoved()).wrench = np.ones((WORLDS, 1, 6))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"steps": 0}, "steps is 0; allowed are integers of at least 1"),
        ({"steps": 1.5}, "steps is 1.5"),
        ({"dt": 0.0}, "dt is 0.*greater than 0"),
        ({"dt": np.zeros(2)}, r"dt has shape \(2,\)"),
    ],
)
def test_bad_arguments_are_refused(arguments, message):
    world = shoved()
    with pytest.raises(ValueError, match=message):
        physics.Stepper(world, **arguments)
    with pytest.raises(ValueError, match=message):
        world.step(**arguments)
    assert world.time == 0


def test_the_status_is_the_gravest_thing_whatever_else_is_in_the_batch():
    """An unresolved substep is told of its world even when every other world is well."""
    table = np.zeros((5, at.REPORT_SIZE))
    table[1, at.UNRESOLVED] = 1
    table[2, [at.UNRESOLVED, at.UNCONVERGED]] = 1
    table[3, [at.UNRESOLVED, at.UNCONVERGED, at.FAULTS]] = 1
    table[4, at.SPLITS] = 3
    status = physics.Status
    expected = [status.OK, status.UNRESOLVED, status.UNCONVERGED, status.FAULT, status.OK]
    assert StepReport(table).status.tolist() == expected
    assert [int(StepReport(row[None]).status[0]) for row in table] == expected
