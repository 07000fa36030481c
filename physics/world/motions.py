"""Prescribed motions of fixed bodies in single worlds of a batch: their numbers in the table of parameters."""

from __future__ import annotations

import numpy as np

from physics import validation
from physics.kernels.flight.prescribed_motion import (
    KIND,
    KNOT_PLACE,
    KNOT_QUAT,
    KNOT_SIZE,
    MOTION_SIZE,
    SPIN,
    STEADY,
    SURFACE,
    TABLE,
    VELOCITY,
)
from physics.kernels.state import layout as at
from physics.plan.plan import Plan
from physics.scene.body_names import body_label
from physics.scene.motion import Motion
from physics.scene.scene import Scene
from physics.summary import shown


def motion_columns(params: np.ndarray, plan: Plan) -> np.ndarray:
    """View (..., motion_columns) of the columns of motions, the last ones of parameters (..., PARAM_SIZE + ...)."""
    return params[..., params.shape[-1] - plan.motion_columns :]


def has_tables(params: np.ndarray, plan: Plan) -> bool:
    """True if a body moves by a table, which depends on the time, in one of the rows of parameters."""
    return bool(plan.motion_columns) and bool((motion_columns(params, plan)[:, KIND] == TABLE).any())


def write_scene_motions(scene: Scene, plan: Plan, state: np.ndarray, params: np.ndarray, time: float) -> None:
    """Let the bodies of some worlds begin the motions that the scene gives them, at a `time` of the world [s].

    Written are rows of `state` and `params`, one for each body of each world. A body without a motion stands.
    """
    if not plan.motion_columns:
        return
    count = len(scene.bodies)
    for b, body in enumerate(scene.bodies):
        rows, columns = state[b::count], motion_columns(params, plan)[b::count]
        columns[:] = 0.0
        if body.motion is not None:
            columns[:] = body.motion.row(plan.motion_columns, body.pos, body.quat, time)
        if body.fixed:
            write_motion_state(rows, columns)


def new_columns(motion: Motion, plan: Plan, rows: np.ndarray, time: float) -> np.ndarray:
    """Columns (k, motion_columns) of a motion that begins at a `time` [s], for k bodies with the states `rows`.

    Raises
    ------
    ValueError
        The table has more knots than any table of the scene.
    """
    if motion.column_count > plan.motion_columns:
        most = (plan.motion_columns - MOTION_SIZE) // KNOT_SIZE
        allowed = f"at most {most}, as in the scene's longest table" if most else "no table, as in the scene"
        raise ValueError(f"motion has a table of {len(motion.times or ())} times; allowed is {allowed}")
    if motion.times is None or (motion.pos is not None and motion.quat is not None):
        return np.tile(motion.row(plan.motion_columns, (0, 0, 0), (1, 0, 0, 0), time), (len(rows), 1))
    poses = rows[:, at.POS : at.POS + 3], rows[:, at.QUAT : at.QUAT + 4]
    return np.array([motion.row(plan.motion_columns, x, q, time) for x, q in zip(*poses)])


def changed_columns(old: np.ndarray, velocity, spin, surface_velocity) -> np.ndarray:
    """Columns (k, motion_columns) of steady motions: those of `old` with new numbers (3,) or (k, 3).

    None keeps the old numbers. A table in `old` ends, and its velocities count as 0.
    """
    new = np.zeros_like(old)
    new[:, KIND] = STEADY
    new[:, SURFACE : SURFACE + 3] = old[:, SURFACE : SURFACE + 3]
    was_steady = old[:, KIND] == STEADY
    new[was_steady, VELOCITY : SPIN + 3] = old[was_steady, VELOCITY : SPIN + 3]
    given = (("velocity", velocity, VELOCITY), ("spin", spin, SPIN), ("surface_velocity", surface_velocity, SURFACE))
    for name, value, first in given:
        if value is None:
            continue
        numbers = validation.floats(value, name, f"are numbers in shape (3,) or ({len(old)}, 3)")
        if numbers.shape not in ((3,), (len(old), 3)):
            raise ValueError(f"{name} has shape {numbers.shape}; allowed are (3,) and ({len(old)}, 3)")
        new[:, first : first + 3] = validation.finite(numbers, numbers.shape, name)
    return new


def write_motion_state(rows: np.ndarray, columns: np.ndarray) -> None:
    """Write the velocities at the start of motions, and the poses at the start of tables, into k rows of a state.

    `columns` (k, motion_columns) are the motions. A body that stands gets zero velocities.
    """
    v, w = columns[:, VELOCITY : VELOCITY + 3].copy(), columns[:, SPIN : SPIN + 3].copy()
    table = columns[:, KIND] == TABLE
    if table.any():
        knot = columns[table, MOTION_SIZE : MOTION_SIZE + KNOT_SIZE]
        q, rate = knot[:, KNOT_QUAT : KNOT_QUAT + 4], knot[:, KNOT_QUAT + 4 : KNOT_QUAT + 8]
        rows[table, at.POS : at.POS + 3] = knot[:, KNOT_PLACE : KNOT_PLACE + 3]
        rows[table, at.QUAT : at.QUAT + 4] = q
        v[table] = knot[:, KNOT_PLACE + 3 : KNOT_PLACE + 6]
        w[table] = 2.0 * (q[:, :1] * rate[:, 1:] - rate[:, :1] * q[:, 1:] - np.cross(rate[:, 1:], q[:, 1:]))
    rows[:, at.LINVEL : at.LINVEL + 3], rows[:, at.ANGVEL : at.ANGVEL + 3] = v, w


def check_tables_kept(world, chosen: np.ndarray, old: np.ndarray, new: np.ndarray, params: np.ndarray) -> None:
    """Raise a ValueError if new rows of the state place a body elsewhere whose motion is a table.

    `old`, `new` and `params` have a row for each body of the worlds `chosen`.
    """
    if not world.plan.motion_columns:
        return
    pose = slice(at.POS, at.QUAT + 4)
    moved = (old[:, pose] != new[:, pose]).any(axis=1) & (motion_columns(params, world.plan)[:, KIND] == TABLE)
    if moved.any():
        k, b = divmod(int(np.flatnonzero(moved)[0]), world.body_count)
        raise ValueError(
            f"set_state places body {body_label(b, world.names)} in world {int(chosen[k])} at "
            f"{new[k * world.body_count + b, at.POS : at.POS + 3].tolist()}, but its motion is a table; allowed is its "
            f"own place, or World.set_motion first"
        )


def check_one_way(motion, numbers: tuple) -> None:
    """Raise a ValueError unless either a `Motion` or one of the `numbers` was given to `World.set_motion`."""
    given = any(number is not None for number in numbers)
    if motion is not None and not isinstance(motion, Motion):
        raise ValueError(f"motion is {shown(motion)}; allowed is a physics.Motion: Motion() stands still")
    if (motion is not None) == given:
        raise ValueError(
            f"motion is {shown(motion)}, and velocity, spin and surface_velocity are {shown(numbers)}; allowed is a "
            "motion, or some of the three"
        )
