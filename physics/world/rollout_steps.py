"""Kernels of a rollout that run before and after each step of a block of worlds: wrenches, states and reports."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from physics.compiler.decorators import kernel
from physics.kernels.forces.actuator_lag import apply_actuator_lag, clamp_command
from physics.kernels.state import layout as at
from physics.world.report import add_rows
from physics.world.rollout_loop import END, FIRST, STEP


class Follow(NamedTuple):
    """Numbers with which an actuator without delay follows its command over one step."""

    limit_force: float  # [N], inf where there is none
    limit_torque: float  # [N m]
    gone: float  # share of the way to the command that the output goes in a step
    kept: float  # share of the way that is left, as a mean over the step
    command: np.ndarray  # (rows, 6) scratch
    output: np.ndarray  # (rows, 6) wrench that its lag has reached


class Course(NamedTuple):
    """Wrenches of a rollout, and the array from which the step kernel reads the wrench of the next step."""

    wrenches: np.ndarray  # (worlds, length, bodies, 6) force [N], torque [N m]
    held: np.ndarray  # (rows, 6) wrench of the next step
    follow: Follow | None  # None without an actuator


class Samples(NamedTuple):
    """States that a rollout keeps, (worlds, samples, bodies, 3|4) each; (0, 0, 0, 0) for a column that is not kept."""

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
    """Replace the commanded wrenches in these rows of `held` by the actuator's mean response over the step."""
    if follow is not None:
        command, output, applied = follow.command[rows], follow.output[rows], held[rows]
        for i in range(command.shape[0]):
            for c in range(6):
                command[i, c] = applied[i, c]
        clamp_command(command, follow.limit_force, follow.limit_torque)
        apply_actuator_lag(command, follow.gone, follow.kept, 1.0, True, output, applied)


@kernel
def begin_moment(moment, course):
    """Write the wrenches of the present step of a block into `course.held`, through the actuator if there is one."""
    first, end, k = moment[FIRST], moment[END], moment[STEP]
    count = course.wrenches.shape[2]
    for world in range(first, end):
        for b in range(count):
            for c in range(6):
                course.held[world * count + b, c] = course.wrenches[world, k, b, c]
    _follow(slice(first * count, end * count), course.follow, course.held)


@kernel
def end_moment(moment, every, state, report, total, samples):
    """Add the reports of a step of a block to `total`, and after every `every` steps keep the states in `samples`.

    Parameters
    ----------
    moment : (MOMENT_SIZE,) int64
        Present block and step, as in `physics.world.rollout_loop`.
    every : int
        Steps from one kept state to the next.
    state : (worlds * bodies, STATE_SIZE) float64
        States of the batch.
    report : (worlds, REPORT_SIZE) float64
        Reports of the step.
    total : (worlds, REPORT_SIZE) float64, changed
        Report of all steps, zero at first.
    samples : Samples, out
        Arrays of kept states.
    """
    first, end, k = moment[FIRST], moment[END], moment[STEP]
    add_rows(first, end, total, report)
    if (k + 1) % every == 0:
        place = (k + 1) // every - 1
        _keep(first, end, place, at.POS, state, samples.pos)
        _keep(first, end, place, at.QUAT, state, samples.quat)
        _keep(first, end, place, at.LINVEL, state, samples.linvel)
        _keep(first, end, place, at.ANGVEL, state, samples.angvel)
