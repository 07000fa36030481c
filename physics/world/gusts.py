"""Winds of single worlds of a batch: their mean, gusts that begin anew, and whether a field depends on time."""

from __future__ import annotations

import math

import numpy as np

from physics.kernels.forces.wind import WIND_GUST, WIND_MEAN, WIND_PHASES, WIND_TIME_SCALE, WIND_WAVES
from physics.kernels.state import layout as at
from physics.plan.plan import Plan
from physics.scene.force_fields import Wind
from physics.world.batch import Batch
from physics.world.motions import has_tables

PHASES = 3 * WIND_WAVES
"""Number of phases that decide the gusts of one `Wind`: one for each of its waves and components."""


def reads_time(plan: Plan, params: np.ndarray) -> bool:
    """True if the time counts: for wind with gusts, a user's field not declared steady, or a motion by a table.

    `params` is the parameter table of a batch, which holds the strengths of the gusts.
    """
    if has_tables(params, plan):
        return True
    if any(slot.is_users and not all(effect.is_steady for effect in slot.effects) for slot in plan.fields):
        return True
    return any(params[:, first + WIND_GUST].any() for first in _winds(plan))


def gust_phases(plan: Plan) -> int:
    """Number of phases that decide the gusts of all winds of one world; 0 if no wind of the plan has gusts."""
    return PHASES * len(_winds(plan)) if any(_has_gusts(slot) for slot in plan.fields) else 0


def begin_gusts(world: Batch, worlds: np.ndarray, shares: np.ndarray) -> None:
    """Restart the gusts of some worlds with given phases, as if their time were 0 now.

    A wave cos(ω t + φ) of the gusts gets the phase φ - ω t₀, where t₀ is the present time of the batch. The gusts are
    then those of a new batch up to the rounding of ω t₀, and exactly those if t₀ = 0.

    Parameters
    ----------
    world : Batch
        Batch, whose parameters are changed.
    worlds : (k,) int64
        Indices of the worlds whose gusts restart.
    shares : (k, n) float
        Phases φ as shares of a turn, 0 to 1; n is `gust_phases`.
    """
    params = world.params.reshape(world.worlds, world.body_count, -1)
    turns = 2.0 * math.pi * shares.reshape(len(worlds), -1, 3, WIND_WAVES)
    for first, phases in zip(_winds(world.plan), turns.swapaxes(0, 1)):
        time_scale = params[worlds, 0, first + WIND_TIME_SCALE, None, None]
        begun = phases - _frequencies() / time_scale * world.time
        columns = slice(first + WIND_PHASES, first + WIND_PHASES + PHASES)
        params[worlds, :, columns] = begun.reshape(len(worlds), 1, PHASES)
    if world.recorder is not None:
        world.recorder.changed(worlds)


def set_winds(world: Batch, worlds: np.ndarray, velocity: np.ndarray) -> None:
    """Give worlds their own mean winds; gusts stay.

    Parameters
    ----------
    world : Batch
        Batch of a scene with `physics.Wind`.
    worlds : (k,) int64
    velocity : (k, 3) float
        Mean velocities of the wind, world frame, finite [m/s].
    """
    params = world.params.reshape(world.worlds, world.body_count, -1)
    for first in _winds(world.plan):
        params[worlds, :, first + WIND_MEAN : first + WIND_MEAN + 3] = velocity[:, None]
    if world.recorder is not None:
        world.recorder.changed(worlds)


def _frequencies() -> np.ndarray:
    """Products ω τ (waves,) of the angular frequencies of a wind's waves and its time scale, as in `gust_frequency`."""
    return np.tan(0.5 * math.pi * (np.arange(WIND_WAVES) + 0.5) / WIND_WAVES)


def _winds(plan: Plan) -> list[int]:
    """Index of the first column of each `Wind` of a plan in the parameter table."""
    return [
        at.PARAM_SIZE + slot.first + slot.term.size * k
        for slot in plan.fields
        if slot.kind is Wind
        for k in range(slot.term.count)
    ]


def _has_gusts(slot) -> bool:
    return slot.kind is Wind and any(effect.gust > 0.0 for effect in slot.effects)
