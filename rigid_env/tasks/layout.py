"""Columns of the arrays that the task kernels share: the place of each number of a task.

Row `world` of each array belongs to one world; the block is the only body, so that row `world` of
`physics.World.state` is its state.
"""

from __future__ import annotations

# --- record (worlds, RECORD_SIZE): what an episode fixes or carries along ---------------------------------
FORCE_LIMIT = 0  # longest force vector [N]
TORQUE_LIMIT = 1  # longest torque vector [N m]
HALF = 2  # half edges along the body axes [m]
POTENTIAL = 5  # of the last observed state
HOLD = 6  # consecutive control steps on which goal and rest were met
GOAL = 7  # x and z of the goal on the floor [m]
FACE = 9  # face to be turned down: 0..5 = -x, +x, -y, +y, -z, +z
RECORD_SIZE = 10

# --- outcome (worlds, OUTCOME_SIZE): what a control step leaves behind ------------------------------------
REWARD = 0
SUCCESS = 1  # 0 or 1
ERROR = 2  # distance to the goal [m] or angle to it [rad]
SPEED = 3  # of the centre [m/s]
SPIN = 4  # |angular velocity| [rad/s]
OUTCOME_SIZE = 5

# --- start (rows, START_SIZE): what is sampled of a start pose --------------------------------------------
PLACE = 0  # x and z of the centre [m]
YAW = 2  # about the vertical [rad]
START_FACE = 3  # face that is down
START_SIZE = 4
