"""Parts of a rollout before each step of a block of worlds, and after it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from physics.compiler.decorators import kernel
from physics.kernels.forces.actuator_lag import apply_actuator_lag, clamp_command
from physics.kernels.state import layout as at
from physics.world.report import add_rows
from physics.world.rollout_loop import END, FIRST, STEP


class Follow(NamedTuple):
    """Numbers of an actuator without delay, for one step."""

    limit_force: float  # [N], inf where there is none
    limit_torque: float  # [N m]
    gone: float  # share of the way to the command that its output goes
    kept: float  # share that is left in the mean
    command: np.ndarray  # (rows, 6) scratch
    output: np.ndarray  # (rows, 6) wrench that its lag has reached


class Course(NamedTuple):
    """Loads of a rollout, and the arrays from which a step reads them."""

    wrenches: np.ndarray  # (worlds, length, bodies, 6) force [N], torque [N m]
    held: np.ndarray  # (rows, 6) wrench of the next step
    follow: Follow | None


class Samples(NamedTuple):
    """Kept states, (worlds, samples, bodies, k) each; (0, 0, 0, 0) for a column that is not kept."""

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
    """Replace the held wrench by the actuator's response to it."""
    if follow is not None:
        command, output, applied = follow.command[rows], follow.output[rows], held[rows]
        for i in range(command.shape[0]):
            for c in range(6):
                command[i, c] = applied[i, c]
        clamp_command(command, follow.limit_force, follow.limit_torque)
        apply_actuator_lag(command, follow.gone, follow.kept, 1.0, True, output, applied)


@kernel
def begin_moment(moment, course):
    """Hold the wrenches of a step."""
    first, end, k = moment[FIRST], moment[END], moment[STEP]
    count = course.wrenches.shape[2]
    for world in range(first, end):
        for b in range(count):
            for c in range(6):
                course.held[world * count + b, c] = course.wrenches[world, k, b, c]
    _follow(slice(first * count, end * count), course.follow, course.held)


@kernel
def end_moment(moment, every, state, report, total, samples):
    """Add up reports of a step, and keep states after each `every` steps.

    Parameters
    ----------
    moment : (MOMENT_SIZE,) int64
        Of `physics.world.rollout_loop`.
    every : int
        Steps from one state that is kept to the next.
    state, report : arrays of the world
    total : (worlds, REPORT_SIZE) float64
        Report of all steps, zero at first.
    samples : Samples
    """
    first, end, k = moment[FIRST], moment[END], moment[STEP]
    add_rows(first, end, total, report)
    if (k + 1) % every == 0:
        place = (k + 1) // every - 1
        _keep(first, end, place, at.POS, state, samples.pos)
        _keep(first, end, place, at.QUAT, state, samples.quat)
        _keep(first, end, place, at.LINVEL, state, samples.linvel)
        _keep(first, end, place, at.ANGVEL, state, samples.angvel)
