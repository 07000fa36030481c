"""Kernel that a task's rollout calls after each control step of a block of worlds, to keep the results."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from physics.compiler.decorators import kernel
from physics.world.report import add_rows
from physics.world.rollout_loop import END, FIRST, STEP
from rigid_env.tasks import layout as col


class Kept(NamedTuple):
    """Arrays in which a rollout keeps its results, with the worlds first."""

    rewards: np.ndarray  # (worlds, length) float64
    success: np.ndarray  # (worlds, length) bool
    failure: np.ndarray  # (worlds, length) bool
    observations: np.ndarray  # (worlds, samples, entries) float32; (worlds, 0, entries): none are kept


@kernel
def end_control(moment, every, outcome, obs, report, total, kept):
    """Keep rewards, flags and observations of one control step, and add its report to the total.

    Parameters
    ----------
    moment : (MOMENT_SIZE,) int64
        First and last world and the step, see `physics.world.rollout_loop`.
    every : int
        Control steps from one kept observation to the next.
    outcome, obs : arrays of the task
        Results of this control step, see `Task`.
    report, total : (worlds, REPORT_SIZE) float64
        Report of this control step, and of all steps so far; the total is zero at first.
    kept : Kept
        Arrays that the results are written into.
    """
    first, end, k = moment[FIRST], moment[END], moment[STEP]
    add_rows(first, end, total, report)
    is_kept = kept.observations.shape[1] > 0 and (k + 1) % every == 0
    for world in range(first, end):
        kept.rewards[world, k] = outcome[world, col.REWARD]
        kept.success[world, k] = outcome[world, col.SUCCESS] > 0.0
        kept.failure[world, k] = outcome[world, col.FAILURE] > 0.0
        if is_kept:
            for c in range(obs.shape[1]):
                kept.observations[world, (k + 1) // every - 1, c] = obs[world, c]
