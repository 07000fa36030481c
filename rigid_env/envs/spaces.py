"""Action space of a task."""

from __future__ import annotations

import numpy as np
from gymnasium import spaces

from rigid_env.tasks import Task


def action_space(task: Task) -> spaces.Box:
    """Make the action space: numbers from -1 to 1, which are forces, torques and impulses as shares of their limits."""
    return spaces.Box(-1.0, 1.0, (task.action_size,), dtype=np.float32)
