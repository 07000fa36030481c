"""Kernels of the block's tasks: starting poses, observations, rewards and success.

All of them are in this one file, because Numba's disk cache checks only the file of the function that is called. A
change in another file would go unnoticed, apart from files of `physics.kernels`, which the name of the cache folder
covers.

The reward is the gain of a potential of the state, minus costs, plus a bonus for success. Gains of a potential do not
change the best policy (Ng, Harada and Russell, *Policy invariance under reward transformations*, ICML 1999; here with
discount 1).
"""

from __future__ import annotations

import math

from physics.compiler.decorators import entry_kernel, inlined, kernel
from physics.kernels.math.quaternion import multiply, to_matrix
from physics.kernels.parallel.work_stealing import TAKEN_COUNT, TAKEN_FIRST_WORLD
from physics.kernels.state import layout as at
from rigid_env.tasks import layout as col

AXES = 6  # numbers of an action: force x, y, z, torque x, y, z

# --- scales and bounds of observations: an entry is value / scale, clipped to ± bound ---------------------
LENGTH_SCALE = 5.0  # [m]
LENGTH_BOUND = 10.0
NEAR_SCALE = 1.0  # [m] scale of tanh of the goal's offset, which changes much near the goal and little far away
HEIGHT_SCALE = 2.5  # [m]
SPEED_SCALE = 5.0  # [m/s]
SPIN_SCALE = 5.0  # [rad/s]
RATE_BOUND = 5.0
GAP_SCALE = 5.0  # [m]

# --- success ----------------------------------------------------------------------------------------------
REACH_TOLERANCE = 0.3  # horizontal distance of the centre from the goal [m]
REORIENT_TOLERANCE = 0.1  # angle between the target face's normal and straight down [rad]
REST_SPEED = 0.1  # of the centre [m/s]
REST_SPIN = 0.1  # [rad/s]
HOLD_STEPS = 10  # consecutive control steps

# --- rewards ----------------------------------------------------------------------------------------------
SUCCESS_BONUS = 5.0
STEP_COST = 0.01
ACTION_COST = 0.0005  # times the sum of the squared action
HOLD_VALUE = 1.0  # potential of a completed hold
REACH_VALUE = 0.5  # potential lost per metre of distance [1/m]
BRAKE_VALUE = 0.2  # potential lost per m/s at the goal [s/m]; it decays with the distance from the goal
BRAKE_RANGE = 2.0  # distance at which this loss is 1/e of the loss at the goal [m]
TURN_VALUE = 2.0  # potential lost per radian off the goal [1/rad]
CALM_VALUE = 0.1  # potential lost per m/s and per rad/s with the face down; it decays with the angle
CALM_RANGE = 0.3  # angle at which this loss is 1/e of the loss with the face down [rad]


@inlined
def clip(x, low, high):
    """Limit x to the interval from low to high."""
    return min(max(x, low), high)


@inlined
def norm3(a, b, c):
    """Length of (a, b, c)."""
    return math.sqrt(a * a + b * b + c * c)


@entry_kernel
def start_poses(place, yaw, faces, half, pos, quat):
    """Write the poses of blocks that lie on the floor y = 0.

    Parameters
    ----------
    place : (n, 2) float64
        x and z of the block's centre [m].
    yaw : (n,) float64
        Angle about the vertical [rad].
    faces : (n,) float64
        Face on the floor: 0 to 5 for -x, +x, -y, +y, -z, +z.
    half : (n, 3) float64
        Half edges [m].
    pos : (n, 1, 3) float64, out
        Centres [m].
    quat : (n, 1, 4) float64, out
        Unit quaternions, body to world.
    """
    s = math.sqrt(0.5)
    for i in range(place.shape[0]):
        face = int(faces[i])
        if face == 0:  # -x down
            q = (s, 0.0, 0.0, s)
        elif face == 1:  # +x
            q = (s, 0.0, 0.0, -s)
        elif face == 2:  # -y
            q = (1.0, 0.0, 0.0, 0.0)
        elif face == 3:  # +y
            q = (0.0, 0.0, 0.0, 1.0)
        elif face == 4:  # -z
            q = (s, -s, 0.0, 0.0)
        else:  # +z
            q = (s, s, 0.0, 0.0)
        turn = 0.5 * yaw[i]
        q = multiply((math.cos(turn), 0.0, math.sin(turn), 0.0), q)
        for k in range(4):
            quat[i, 0, k] = q[k]
        pos[i, 0, 0] = place[i, 0]
        pos[i, 0, 1] = half[i, face // 2]
        pos[i, 0, 2] = place[i, 1]


@inlined
def observe_motion(world, first, state, obs):
    """Write the block's height and velocities, scaled and clipped, into obs[world, first : first + 7].

    Returns speed [m/s] and spin [rad/s].
    """
    vx, vy, vz = state[world, at.LINVEL], state[world, at.LINVEL + 1], state[world, at.LINVEL + 2]
    wx, wy, wz = state[world, at.ANGVEL], state[world, at.ANGVEL + 1], state[world, at.ANGVEL + 2]
    obs[world, first] = clip(state[world, at.POS + 1] / HEIGHT_SCALE, 0.0, LENGTH_BOUND)
    obs[world, first + 1] = clip(vx / SPEED_SCALE, -RATE_BOUND, RATE_BOUND)
    obs[world, first + 2] = clip(vy / SPEED_SCALE, -RATE_BOUND, RATE_BOUND)
    obs[world, first + 3] = clip(vz / SPEED_SCALE, -RATE_BOUND, RATE_BOUND)
    obs[world, first + 4] = clip(wx / SPIN_SCALE, -RATE_BOUND, RATE_BOUND)
    obs[world, first + 5] = clip(wy / SPIN_SCALE, -RATE_BOUND, RATE_BOUND)
    obs[world, first + 6] = clip(wz / SPIN_SCALE, -RATE_BOUND, RATE_BOUND)
    return norm3(vx, vy, vz), norm3(wx, wy, wz)


@inlined
def observe_gaps(world, first, state, R, record, walls, obs):
    """Write the gaps between the block and the three walls, scaled and clipped, into obs[world, first : first + 3].

    `R` has the rotation matrix of the block, nine numbers row by row; `record` has its half edges.
    """
    for k in range(3):
        nx, ny, nz = walls[k, at.WALL_NORMAL], walls[k, at.WALL_NORMAL + 1], walls[k, at.WALL_NORMAL + 2]
        gap = nx * state[world, at.POS] + ny * state[world, at.POS + 1] + nz * state[world, at.POS + 2]
        gap -= walls[k, at.WALL_OFFSET]
        for j in range(3):
            gap -= record[world, col.HALF + j] * abs(R[j] * nx + R[3 + j] * ny + R[6 + j] * nz)
        obs[world, first + k] = clip(gap / GAP_SCALE, -1.0, LENGTH_BOUND)


@inlined
def attitude(world, state):
    """Rotation matrix of the block in a world, body to world: nine numbers row by row."""
    return to_matrix(
        (
            state[world, at.QUAT],
            state[world, at.QUAT + 1],
            state[world, at.QUAT + 2],
            state[world, at.QUAT + 3],
        )
    )


@inlined
def conclude(world, is_met, potential, error, speed, spin, actions, record, outcome):
    """Count the hold of one world, and write its reward and success.

    Parameters
    ----------
    world : int
    is_met : bool
        Whether the goal is reached now; speed and spin are checked here.
    potential : float
        Potential of the state, without the part of the hold.
    error, speed, spin : float
        Distance [m] or angle [rad] to the goal, speed [m/s] and spin [rad/s] of the block.
    actions : (worlds, 6) float64 or None
        Actions of the last control step; None at the start of an episode, which gives no reward.
    record : (worlds, RECORD_SIZE) float64, in and out
        POTENTIAL and HOLD are updated.
    outcome : (worlds, OUTCOME_SIZE) float64, out

    Returns
    -------
    float
        Share of the hold that is completed, for the observation.
    """
    hold = effort = 0.0
    if actions is not None and is_met and speed <= REST_SPEED and spin <= REST_SPIN:
        hold = record[world, col.HOLD] + 1.0
    potential += HOLD_VALUE * hold / HOLD_STEPS
    success = 1.0 if hold >= HOLD_STEPS else 0.0
    reward = 0.0
    if actions is not None:
        for k in range(AXES):
            a = clip(actions[world, k], -1.0, 1.0)
            effort += a * a
        reward = potential - record[world, col.POTENTIAL] - STEP_COST - ACTION_COST * effort
        reward += SUCCESS_BONUS * success
        outcome[world, col.REWARD_PROGRESS] = potential - record[world, col.POTENTIAL]
        outcome[world, col.REWARD_EFFORT] = -(STEP_COST + ACTION_COST * effort)
        outcome[world, col.REWARD_SUCCESS] = SUCCESS_BONUS * success
    record[world, col.HOLD] = hold
    record[world, col.POTENTIAL] = potential
    outcome[world, col.REWARD] = reward
    outcome[world, col.SUCCESS] = success
    outcome[world, col.ERROR] = error
    outcome[world, col.SPEED] = speed
    outcome[world, col.SPIN] = spin
    return min(hold / HOLD_STEPS, 1.0)


@kernel
def observe_reach(taken, state, record, walls, actions, obs, outcome):
    """Write observation, reward and success of the task BlockReach for some worlds.

    Parameters
    ----------
    taken : (TAKEN_FIRST_WORLD + n or more,) int64
        List of the n worlds, as in `physics.kernels.parallel.work_stealing`; output rows of other worlds stay
        unchanged.
    state : (worlds, STATE_SIZE) float64
    record : (worlds, RECORD_SIZE) float64, in and out
        POTENTIAL and HOLD are updated.
    walls : (3, WALL_SIZE) float64
    actions : (worlds, 6) float64 or None
        Actions of the last control step; None at the start of an episode.
    obs : (worlds, 24) float32, out
    outcome : (worlds, OUTCOME_SIZE) float64, out
    """
    for i in range(taken[TAKEN_COUNT]):
        world = taken[TAKEN_FIRST_WORLD + i]
        dx = record[world, col.GOAL] - state[world, at.POS]
        dz = record[world, col.GOAL + 1] - state[world, at.POS + 2]
        obs[world, 0] = clip(dx / LENGTH_SCALE, -LENGTH_BOUND, LENGTH_BOUND)
        obs[world, 1] = clip(dz / LENGTH_SCALE, -LENGTH_BOUND, LENGTH_BOUND)
        obs[world, 2] = math.tanh(dx / NEAR_SCALE)
        obs[world, 3] = math.tanh(dz / NEAR_SCALE)
        speed, spin = observe_motion(world, 4, state, obs)
        R = attitude(world, state)
        for k in range(9):
            obs[world, 11 + k] = clip(R[k], -1.0, 1.0)
        observe_gaps(world, 20, state, R, record, walls, obs)
        distance = math.sqrt(dx * dx + dz * dz)
        potential = -REACH_VALUE * distance - BRAKE_VALUE * speed * math.exp(-distance / BRAKE_RANGE)
        obs[world, 23] = conclude(
            world, distance <= REACH_TOLERANCE, potential, distance, speed, spin, actions, record, outcome
        )


@kernel
def observe_reorient(taken, state, record, walls, actions, obs, outcome):
    """Write observation, reward and success of the task BlockReorient for some worlds.

    Arguments as of `observe_reach`, with obs (worlds, 23) float32. The observation has the body axes in the order of
    the goal: first the outward normal of the target face, then the next two body axes in cyclic order. The half edges
    have the same order. So the policy need not know which face is the target.
    """
    for i in range(taken[TAKEN_COUNT]):
        world = taken[TAKEN_FIRST_WORLD + i]
        face = int(record[world, col.FACE])
        axis = face // 2
        sign = 1.0 if face % 2 == 1 else -1.0
        R = attitude(world, state)
        for j in range(3):
            k = (axis + j) % 3
            s = sign if j == 0 else 1.0
            column = (R[0], R[3], R[6]) if k == 0 else ((R[1], R[4], R[7]) if k == 1 else (R[2], R[5], R[8]))
            obs[world, 3 * j] = clip(s * column[0], -1.0, 1.0)
            obs[world, 3 * j + 1] = clip(s * column[1], -1.0, 1.0)
            obs[world, 3 * j + 2] = clip(s * column[2], -1.0, 1.0)
            obs[world, 9 + j] = clip(record[world, col.HALF + k] / HEIGHT_SCALE, 0.0, LENGTH_BOUND)
        height = sign * (R[3] if axis == 0 else (R[4] if axis == 1 else R[5]))  # world y of the normal
        speed, spin = observe_motion(world, 12, state, obs)
        observe_gaps(world, 19, state, R, record, walls, obs)
        angle = math.acos(clip(-height, -1.0, 1.0))
        potential = -TURN_VALUE * angle - CALM_VALUE * (speed + spin) * math.exp(-angle / CALM_RANGE)
        obs[world, 22] = conclude(
            world, angle <= REORIENT_TOLERANCE, potential, angle, speed, spin, actions, record, outcome
        )
