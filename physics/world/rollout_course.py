"""The steps of a rollout: in machine code, or one by one where something is to be done between them."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NoReturn

import numpy as np

from physics.kernels.compile.compiler_choice import COMPILER, FUSED
from physics.kernels.parallel import work_stealing
from physics.kernels.state.groups import WorkQueue
from physics.kernels.time_stepping.workspace import body_records
from physics.parallel.bound_call import Work, compiled_entry
from physics.scene.field_errors import raised
from physics.world.batch import Batch
from physics.world.report import add_report
from physics.world.rollout_steps import Course, Follow, Samples, roll_out
from physics.world.stepper import kernel_calls, takes_each_step

if TYPE_CHECKING:
    from physics.world.rollout import Rollout

# Worlds that a thread steps through all of time before the next ones: few enough for the cache of a processor, and
# enough that the call of the step kernel is a small part of the step.
BLOCK = 8

NOTHING = np.zeros((0, 0, 0, 0))


def advance(world: Batch, wrenches: np.ndarray, into: Rollout, steps: int, dt: float, every: int) -> None:
    """Take `steps` steps of `dt` [s] with each of the wrenches (worlds, length, bodies, 6), and keep states.

    Every `every` wrenches they go to `into`.
    """
    into.report_table[...] = 0.0
    if world.recorder is not None or _needs_python(world, steps):
        _one_by_one(world, wrenches, into, steps, dt, every)
    else:
        moments = np.full(1 + wrenches.shape[1], steps * dt)
        moments[0] = world.time
        np.add.accumulate(moments, out=moments)  # as times add up step by step
        _all_at_once(world, wrenches, into, steps, dt, every, moments[:-1])
        into.times[...] = moments[every::every]
        world.time = float(moments[-1])


def _needs_python(world: Batch, steps: int) -> bool:
    """True if the actuator has to be asked between two steps."""
    if world.actuation is None:
        return False
    return world.actuation.actuator.delay > 0.0 or (steps > 1 and takes_each_step(world))


def _one_by_one(world: Batch, wrenches, into: Rollout, steps: int, dt: float, every: int) -> None:
    wrench = world.no_wrench()
    calls = kernel_calls(world, wrench, steps, dt)
    for k in range(wrenches.shape[1]):
        wrench[...] = wrenches[:, k]
        world.advance(calls, wrench, steps, dt)
        add_report(into.report_table, world.report_table)
        if (k + 1) % every == 0:
            place = (k + 1) // every - 1
            into.times[place] = world.time
            for name in into.columns:
                getattr(into, name)[:, place] = getattr(world, name)


def _all_at_once(world: Batch, wrenches, into: Rollout, steps: int, dt: float, every: int, starts) -> None:
    inner = [WorkQueue(work_stealing.make_ranges(1, world.worlds, BLOCK),
                       work_stealing.make_taken_lists(1, world.worlds)[0]) for _ in world.team.queues]  # fmt: skip
    held = world.no_wrench()
    stepping = kernel_calls(world, held, steps, dt, inner)
    if world.actuation is not None:
        held = world.actuation.applied
    follow = _follow(world, dt)
    samples = Samples(*(NOTHING if array is None else array
                        for array in (into.pos, into.quat, into.linvel, into.angvel)))  # fmt: skip
    calls = []
    for k, outer in enumerate(world.team.queues):
        course = Course(wrenches, held.reshape(-1, 6), starts, _clock(world, k), follow)
        arguments = (
            outer, inner[k], BLOCK, stepping[k].jobs if COMPILER == FUSED else stepping[k], course, every,
            world.state, world.report_table, into.report_table, samples,
        )  # fmt: skip
        calls.append(_prepared(arguments))
    try:
        world.team.run(calls)
        for call in stepping:
            call.raise_again()
    except Exception as error:
        _raise_again(error, world)


def _raise_again(error: Exception, world: Batch) -> NoReturn:
    raise raised(error, world.plan.fields)


def _clock(world: Batch, k: int) -> np.ndarray:
    """Time that the fields of a thread read, (records,) [s]."""
    return np.atleast_1d(body_records(world.scratch[k])["call_start"]) if world.plan.fields else np.zeros(0)


def _follow(world: Batch, dt: float) -> Follow | None:
    """Numbers of the actuator for each step; None without one."""
    if world.actuation is None:
        return None
    actuator, gone, kept = world.actuation.actuator, 1.0, 0.0
    if actuator.lag > 0.0:
        x = dt / actuator.lag
        gone = -math.expm1(-x)
        kept = gone / x
    limits = (np.inf if limit is None else limit for limit in (actuator.limit_force, actuator.limit_torque))
    return Follow(*limits, gone, kept, np.empty_like(world.actuation.output), world.actuation.output)


class _Loop:
    """`roll_out` run by Python, in a thread of a pool."""

    def __init__(self, arguments: tuple):
        self._arguments = arguments

    def perform(self) -> bool:
        """Run it; raises what a step raises."""
        roll_out(*self._arguments)
        return False


def _prepared(arguments: tuple):
    if COMPILER != FUSED:
        return _Loop(arguments)
    key = (arguments[4].clock.flags.c_contiguous, arguments[4].follow is None)
    if key not in _ENTRIES:
        _ENTRIES[key] = compiled_entry(roll_out, arguments)
    return Work([(_ENTRIES[key], arguments)])


_ENTRIES: dict[tuple, object] = {}
