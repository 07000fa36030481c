"""The loop over time of a rollout, in each thread: all steps of a few worlds, before those of the next ones.

Worlds are independent, so that no thread waits for another one between two steps, and a block of worlds stays in the
cache of its processor. `fused` has the whole loop in machine code, which calls the step kernel by its address. The
other compilers call it from Python, once for each step and block.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from physics.kernels.compile.compiler_choice import COMPILER, FUSED
from physics.kernels.compile.decorators import entry_kernel, kernel
from physics.kernels.forces.actuator_lag import apply_actuator_lag, clamp_command
from physics.kernels.parallel.work_stealing import RANGE_CHUNK, RANGE_END, TAKEN_CHUNK_END, begin_taking, take_chunk
from physics.kernels.state import layout as at
from physics.world.report import add_rows

if COMPILER == FUSED:
    from physics.kernels.compile.fused.prepared_calls import enter_prepared as enter
else:

    def enter(work):
        """Make a prepared call; 0, or the exception that it raised."""
        work.perform()
        return 0


class Follow(NamedTuple):
    """An actuator without delay, over one step."""

    limit_force: float  # [N], inf where there is none
    limit_torque: float  # [N m]
    gone: float  # share of the way to the command that its output goes
    kept: float  # share that is left in the mean
    command: np.ndarray  # (rows, 6) scratch
    output: np.ndarray  # (rows, 6) wrench that its lag has reached


class Course(NamedTuple):
    """Loads of a rollout, and where a step reads them."""

    wrenches: np.ndarray  # (worlds, length, bodies, 6) force [N], torque [N m]
    held: np.ndarray  # (rows, 6) wrench of the next step
    starts: np.ndarray  # (length,) time at which each step begins [s]
    clock: np.ndarray  # (records,) time that the fields of this thread read [s]; (0,) without fields
    follow: Follow | None


class Samples(NamedTuple):
    """States that are kept, (worlds, samples, bodies, k) each; (0, 0, 0, 0) where a column is not."""

    pos: np.ndarray
    quat: np.ndarray
    linvel: np.ndarray
    angvel: np.ndarray


@kernel
def _keep(first, end, place, column, state, kept):
    count = kept.shape[2]
    for world in range(first, first if count == 0 else end):
        for b in range(count):
            for c in range(kept.shape[3]):
                kept[world, place, b, c] = state[world * count + b, column + c]


@kernel
def _follow(rows, follow, held):
    """Let what is held be what an actuator makes of it."""
    if follow is not None:
        command, output, applied = follow.command[rows], follow.output[rows], held[rows]
        for i in range(command.shape[0]):
            for c in range(6):
                command[i, c] = applied[i, c]
        clamp_command(command, follow.limit_force, follow.limit_torque)
        apply_actuator_lag(command, follow.gone, follow.kept, 1.0, True, output, applied)


@entry_kernel
def begin_moment(first, end, k, course):
    """Hold the wrenches of step k of the worlds from `first` to `end`, and set the clock."""
    count = course.wrenches.shape[2]
    for world in range(first, end):
        for b in range(count):
            for c in range(6):
                course.held[world * count + b, c] = course.wrenches[world, k, b, c]
    _follow(slice(first * count, end * count), course.follow, course.held)
    for record in range(course.clock.shape[0]):
        course.clock[record] = course.starts[k]


@entry_kernel
def end_moment(first, end, k, every, state, report, total, samples):
    """Add up reports of step k of the worlds from `first` to `end`, and keep their states after each `every` steps."""
    add_rows(first, end, total, report)
    if (k + 1) % every == 0:
        place = (k + 1) // every - 1
        _keep(first, end, place, at.POS, state, samples.pos)
        _keep(first, end, place, at.QUAT, state, samples.quat)
        _keep(first, end, place, at.LINVEL, state, samples.linvel)
        _keep(first, end, place, at.ANGVEL, state, samples.angvel)


def roll_out(outer, inner, block, step, course, every, state, report, total, samples):
    """Take all steps of the worlds that no other thread has taken, a block of them at a time.

    A step that raises an exception ends it.

    Parameters
    ----------
    outer, inner : WorkQueue
        Of this thread among the others, and of the step kernel, which is given one block.
    block : int
        Worlds of a block.
    step : int
        Prepared call of the step kernel with `inner`: address of a job, or without `fused` its `Work`.
    course : Course
    every : int
        Steps from one state that is kept to the next.
    state, report : arrays of the world
    total : (worlds, REPORT_SIZE) float64
        Report of all steps, zero at first.
    samples : Samples
    """
    begin_taking(outer.turns, outer.taken)
    while True:
        start = take_chunk(outer.turns, outer.taken)
        if start < 0:
            break
        stop = outer.taken[TAKEN_CHUNK_END]
        for first in range(start, stop, block):
            end = min(first + block, stop)
            inner.turns[0, RANGE_CHUNK] = end - first
            inner.turns[0, RANGE_END] = first
            inner.turns[1, RANGE_END] = end
            for k in range(course.wrenches.shape[1]):
                begin_moment(first, end, k, course)
                if enter(step) != 0:
                    return
                end_moment(first, end, k, every, state, report, total, samples)


if COMPILER == FUSED:
    roll_out = kernel(roll_out)
