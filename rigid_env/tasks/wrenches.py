"""Kernels that convert the numbers of an action to the wrenches on bodies."""

from __future__ import annotations

import math

from physics.compiler.decorators import entry_kernel, inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.state import layout as at
from physics.world.rollout_loop import END, FIRST, STEP

KIND, BODY, FIRST_NUMBER, IN_BODY_FRAME = 0, 1, 2, 5  # columns of `action_table.ActionTable.table`
TORQUE, IMPULSE = 1, 2  # kinds, as in `rigid_env.tasks.actions`


@inlined
def clip(x, low, high):
    """Limit x to the interval from low to high."""
    return min(max(x, low), high)


@inlined
def _number(actions, i, k):
    """Number `k` of world i's action, clipped to ±1; 0 if k is -1, for an axis without a number."""
    return clip(actions[i, k], -1.0, 1.0) if k >= 0 else 0.0


@kernel
def write_wrench(i, actions, table, points, limits, state, wrench, kick):
    """Write the wrenches on all bodies of world i from row i of `actions`; arguments as of `write_wrenches`."""
    bodies = wrench.shape[1]
    for b in range(bodies):
        for k in range(6):
            wrench[i, b, k] = 0.0
            kick[i, b, k] = 0.0
    for v in range(table.shape[0]):
        x = _number(actions, i, table[v, FIRST_NUMBER])
        y = _number(actions, i, table[v, FIRST_NUMBER + 1])
        z = _number(actions, i, table[v, FIRST_NUMBER + 2])
        scale = limits[i, v] / max(1.0, math.sqrt(x * x + y * y + z * z))
        vector = (scale * x, scale * y, scale * z)
        kind, body = table[v, KIND], table[v, BODY]
        row = i * bodies + body
        q = (state[row, at.QUAT], state[row, at.QUAT + 1], state[row, at.QUAT + 2], state[row, at.QUAT + 3])
        R = qt.to_matrix(q)
        if table[v, IN_BODY_FRAME] == 1:
            vector = qt.matvec(R, vector)
        out = kick if kind == IMPULSE else wrench
        first = 3 if kind == TORQUE else 0
        out[i, body, first] += vector[0]
        out[i, body, first + 1] += vector[1]
        out[i, body, first + 2] += vector[2]
        if points[v, 0] != 0.0 or points[v, 1] != 0.0 or points[v, 2] != 0.0:
            torque = qt.cross(qt.matvec(R, (points[v, 0], points[v, 1], points[v, 2])), vector)
            out[i, body, 3] += torque[0]
            out[i, body, 4] += torque[1]
            out[i, body, 5] += torque[2]


@entry_kernel
def write_wrenches(given, actions, table, points, limits, state, wrench, kick):
    """Convert actions to wrenches: clip numbers to ±1, shorten each vector to length 1, multiply it by its limit.

    Parameters
    ----------
    given : (worlds, numbers) float64
        Actions.
    actions : (worlds, numbers) float64, out
        Copy of `given`.
    table, points : (loads, 6) int64, (loads, 3) float64
        As of `action_table.ActionTable`.
    limits : (worlds, loads) float64
        Largest lengths of the loads [N, N m].
    state : (worlds * bodies, STATE_SIZE) float64
        State of the bodies, whose attitudes turn vectors from body frames.
    wrench, kick : (worlds, bodies, 6) float64, out
        World frame: wrenches of forces and torques, and wrenches of impulses, which are given as forces. The same array
        if there are no impulses.

    Returns
    -------
    int
        -1 after the outputs are written. Else the index of the first world whose action is not finite; then nothing is
        written.
    """
    for i in range(given.shape[0]):
        for k in range(given.shape[1]):
            if not math.isfinite(given[i, k]):
                return i
    for i in range(given.shape[0]):
        for k in range(given.shape[1]):
            actions[i, k] = given[i, k]
        write_wrench(i, actions, table, points, limits, state, wrench, kick)
    return -1


@kernel
def begin_control(moment, actions, action, table, points, limits, state, wrench, kick):
    """Take the actions of one control step of a rollout, and write their wrenches.

    Parameters
    ----------
    moment : (MOMENT_SIZE,) int64
        First and last world and the step, see `physics.world.rollout_loop`.
    actions : (worlds, length, numbers) float64
        Actions of all control steps.
    action : (worlds, numbers) float64, out
        Actions of this control step.
    table, points, limits, state, wrench, kick
        As of `write_wrenches`.
    """
    for i in range(moment[FIRST], moment[END]):
        for k in range(action.shape[1]):
            action[i, k] = actions[i, moment[STEP], k]
        write_wrench(i, action, table, points, limits, state, wrench, kick)
