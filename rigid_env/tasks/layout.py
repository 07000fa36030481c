"""Columns of the arrays `record` and `outcome`, which the kernels of the block's tasks read and write.

Each array has a row for each world. The block is the only body, so its state is row `world` of `physics.World.state`.
"""

from __future__ import annotations

# --- record (worlds, RECORD_SIZE): drawn values and memory of an episode of the block's tasks --------------
HALF = 0  # half edges along the body axes [m]
POTENTIAL = 3  # potential of the last observed state
HOLD = 4  # consecutive control steps on which goal and rest were met
GOAL = 5  # x and z of the goal on the floor [m]
FACE = 7  # face to be turned down: 0..5 = -x, +x, -y, +y, -z, +z
RECORD_SIZE = 8

# --- outcome (worlds, 3 + infos): results of a control step of any task -------------------------------------
REWARD = 0
SUCCESS = 1  # 0 or 1
FAILURE = 2  # 0 or 1
INFO = 3  # first of the numbers of `Task.info_names`, which for the block's tasks are those below
ERROR = 3  # distance to the goal [m] or angle to it [rad]
SPEED = 4  # speed of the block's centre [m/s]
SPIN = 5  # |angular velocity| [rad/s]
REWARD_PROGRESS = 6  # terms of the reward
REWARD_EFFORT = 7
REWARD_SUCCESS = 8
