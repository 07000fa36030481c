"""BlockReach's scene as a `MujocoEnv` of Gymnasium: what a user of MuJoCo would write instead."""

from __future__ import annotations

import tempfile
from pathlib import Path

import gymnasium
import mujoco
import numpy as np
from gymnasium import spaces
from gymnasium.envs.mujoco import MujocoEnv

from rigid_env.measure.mujoco_scene import BLOCK, model_xml
from rigid_env.measure.workloads import FORCE, STEP, TORQUE

ENV_ID = "MujocoBlockReach-v0"
GOAL_WIDTH = 6.0  # |x| and |z| of the goal and of the start are below this [m]
REACHED = 0.5  # distance and speed below which the goal is reached [m, m/s]
LIMITS = np.array([FORCE] * 3 + [TORQUE] * 3)
OBSERVATION_SIZE = 18  # rotation matrix, linear and angular velocity, way to the goal


class MujocoBlockReach(MujocoEnv):
    """Push the block to a goal on the floor; observation, reward and end as in BlockReach, in their plain form.

    Parameters
    ----------
    frame_skip : int
        MuJoCo steps in one environment step.
    """

    metadata = {"render_modes": ["human", "rgb_array", "depth_array"]}  # noqa: RUF012

    def __init__(self, frame_skip: int = 5, **more):
        self.metadata = {**type(self).metadata, "render_fps": round(1 / (STEP * frame_skip))}
        self.goal = np.zeros(3)
        box = spaces.Box(-np.inf, np.inf, (OBSERVATION_SIZE,), np.float32)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "block.xml"
            path.write_text(model_xml(), encoding="utf-8")
            super().__init__(str(path), frame_skip, box, **more)
        self.action_space = spaces.Box(-1.0, 1.0, (6,), np.float32)

    def step(self, action):
        """Hold the wrench that `action` scales for `frame_skip` steps."""
        self.data.xfrc_applied[BLOCK] = LIMITS * np.clip(action, -1.0, 1.0)
        mujoco.mj_step(self.model, self.data, nstep=self.frame_skip)
        way = self.goal - self.data.qpos[:3]
        distance = float(np.sqrt(way @ way))
        speed = float(np.sqrt(self.data.qvel @ self.data.qvel))
        is_success = distance < REACHED and speed < REACHED
        reward = -distance + 10.0 * is_success
        return self._observation(way), reward, is_success, False, {"is_success": is_success}

    def reset_model(self):
        """Start at rest at a random place, with a random goal."""
        height = self.init_qpos[1]
        qpos = self.init_qpos.copy()
        qpos[0], qpos[2] = self.np_random.uniform(-GOAL_WIDTH, GOAL_WIDTH, 2)
        goal_x, goal_z = self.np_random.uniform(-GOAL_WIDTH, GOAL_WIDTH, 2)
        self.goal = np.array([goal_x, height, goal_z])
        self.set_state(qpos, self.init_qvel)
        return self._observation(self.goal - qpos[:3])

    def _observation(self, way):
        return np.concatenate((self.data.xmat[BLOCK], self.data.qvel, way), dtype=np.float32)


def register(episode_steps: int) -> None:
    """Make `ENV_ID` known to Gymnasium, cut off after as many steps as our environment."""
    if ENV_ID not in gymnasium.registry:
        gymnasium.register(ENV_ID, MujocoBlockReach, max_episode_steps=episode_steps)
