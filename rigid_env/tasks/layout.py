"""Columns of the arrays that the block's kernels share: one for each number of a task.

Row `world` of each array belongs to one world; the block is the only body, so that row `world` of
`physics.World.state` is its state.
"""

from __future__ import annotations

# --- record (worlds, RECORD_SIZE): what an episode of the block's tasks fixes or carries along -------------
HALF = 0  # half edges along the body axes [m]
POTENTIAL = 3  # of the last observed state
HOLD = 4  # consecutive control steps on which goal and rest were met
GOAL = 5  # x and z of the goal on the floor [m]
FACE = 7  # face to be turned down: 0..5 = -x, +x, -y, +y, -z, +z
RECORD_SIZE = 8

# --- outcome (worlds, 3 + infos): what a control step of any task leaves behind ----------------------------
REWARD = 0
SUCCESS = 1  # 0 or 1
FAILURE = 2  # 0 or 1
INFO = 3  # from here on: the numbers of `Task.info_names`; of the block's tasks these
ERROR = 3  # distance to the goal [m] or angle to it [rad]
SPEED = 4  # of the centre [m/s]
SPIN = 5  # |angular velocity| [rad/s]
REWARD_PROGRESS = 6  # terms of the reward
REWARD_EFFORT = 7
REWARD_SUCCESS = 8
