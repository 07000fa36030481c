"""Action and observation spaces of the tasks."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from rigid_env.tasks import Task
from rigid_env.tasks.kernels import AXES


def action_space() -> spaces.Box:
    """Six numbers from -1 to 1: force x, y, z and torque x, y, z as shares of their limits, world frame."""
    return spaces.Box(-1.0, 1.0, (AXES,), dtype=np.float32)


def observation_space(task: Task) -> spaces.Box:
    """The box whose bounds the task's entries name."""
    low = np.array([entry.low for entry in task.observation], dtype=np.float32)
    high = np.array([entry.high for entry in task.observation], dtype=np.float32)
    return spaces.Box(low, high, dtype=np.float32)
