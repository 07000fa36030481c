"""Steps of a rollout: all in machine code, or one after another from Python if it has to act between them."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from physics.parallel.bound_call import bound_alike
from physics.world.batch import Batch
from physics.world.report import add_report
from physics.world.rollout_loop import RolloutLoop
from physics.world.rollout_steps import Course, Follow, Samples, begin_moment, end_moment
from physics.world.stepper import kernel_calls, takes_each_step

NOTHING = np.zeros((0, 0, 0, 0))


class Room(NamedTuple):
    """Arrays into which a rollout is written."""

    columns: dict[str, np.ndarray]  # states to keep by name, as `pos`: (worlds, samples, bodies, 3|4|3|3)
    times: np.ndarray  # (samples,) [s]
    report_table: np.ndarray  # (worlds, REPORT_SIZE)


def run_wrenches(world: Batch, wrenches: np.ndarray, into: Room, steps: int, dt: float, every: int) -> None:
    """Take `steps` steps of `dt` [s] with each of the wrenches (worlds, length, bodies, 6), and keep states.

    After every `every` wrenches the states of all worlds are written into `into`, which also gets times and report.
    """
    into.report_table[...] = 0.0
    if world.recorder is not None or _needs_python(world, steps):
        _one_by_one(world, wrenches, into, steps, dt, every)
    else:
        _all_at_once(world, wrenches, into, steps, dt, every)


def _needs_python(world: Batch, steps: int) -> bool:
    """True if Python must call the actuator between two steps: it has a delay, or `takes_each_step` is true."""
    if world.actuation is None:
        return False
    return world.actuation.actuator.delay > 0.0 or (steps > 1 and takes_each_step(world))


def _one_by_one(world: Batch, wrenches, into: Room, steps: int, dt: float, every: int) -> None:
    wrench = world.no_wrench()
    calls = kernel_calls(world, wrench, steps, dt)
    for k in range(wrenches.shape[1]):
        wrench[...] = wrenches[:, k]
        world.advance(calls, wrench, steps, dt)
        add_report(into.report_table, world.report_table)
        if (k + 1) % every == 0:
            place = (k + 1) // every - 1
            into.times[place] = world.time
            for name, array in into.columns.items():
                array[:, place] = getattr(world, name)


def _all_at_once(world: Batch, wrenches, into: Room, steps: int, dt: float, every: int) -> None:
    held = world.no_wrench()
    applied = held if world.actuation is None else world.actuation.applied
    course = Course(wrenches, applied.reshape(-1, 6), _follow(world, dt))
    samples = Samples(*(into.columns.get(name, NOTHING) for name in Samples._fields))
    loop = RolloutLoop(world, held, steps, dt)
    arrays = (world.state, world.report_table, into.report_table, samples)
    before = [bound_alike(course.follow is None, begin_moment, moment, course) for moment in loop.moments]
    after = [bound_alike(None, end_moment, moment, every, *arrays) for moment in loop.moments]
    into.times[...] = loop.run(wrenches.shape[1], before, after)[every - 1 :: every]


def _follow(world: Batch, dt: float) -> Follow | None:
    """Numbers with which the kernel applies the actuator before each step of `dt` [s]; None without an actuator."""
    if world.actuation is None:
        return None
    actuator, gone, kept = world.actuation.actuator, 1.0, 0.0
    if actuator.lag > 0.0:
        x = dt / actuator.lag
        gone = -math.expm1(-x)
        kept = gone / x
    limits = (np.inf if limit is None else limit for limit in (actuator.limit_force, actuator.limit_torque))
    return Follow(*limits, gone, kept, np.empty_like(world.actuation.output), world.actuation.output)
