"""Names to import for a compiled task: decorators of kernels, and columns of the arrays that its kernel gets.

``Task.compiled`` is a kernel that takes ``(taken, state, record, walls, actions, obs, outcome)``. docs/tasks.md
explains these arrays and shows a whole task.
"""

from __future__ import annotations

from physics.compiler.decorators import inlined, kernel
from physics.kernels.math.quaternion import to_matrix
from physics.kernels.parallel.work_stealing import TAKEN_COUNT, TAKEN_FIRST_WORLD
from physics.kernels.state.layout import ANGVEL, LINVEL, POS, QUAT, WALL_NORMAL, WALL_OFFSET
from rigid_env.tasks.layout import FAILURE, INFO, REWARD, SUCCESS

__all__ = [
    "ANGVEL",
    "FAILURE",
    "INFO",
    "LINVEL",
    "POS",
    "QUAT",
    "REWARD",
    "SUCCESS",
    "TAKEN_COUNT",
    "TAKEN_FIRST_WORLD",
    "WALL_NORMAL",
    "WALL_OFFSET",
    "inlined",
    "kernel",
    "to_matrix",
]
