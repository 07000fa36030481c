"""BlockReach's scene as a `MujocoEnv` of Gymnasium: what a user of MuJoCo would write instead."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import ClassVar

import gymnasium
import mujoco
import numpy as np
from gymnasium import spaces
from gymnasium.envs.mujoco import MujocoEnv

from physics import scenes
from rigid_env.lab.measure.environments import ENV_ID, SUBSTEPS, EnvPeer
from rigid_env.lab.measure.mujoco_scene import BLOCK, model_xml
from rigid_env.lab.measure.workloads import STEP
from rigid_env.tasks.block import FORCE_SHARE, TORQUE_SHARE

PEER_ID = "MujocoBlockReach-v0"
GOAL_WIDTH = 6.0  # |x| and |z| of the goal and of the start are below this [m]
REACHED = 0.3  # distance below which the goal is reached [m]
CALM = 0.1  # speed, and spin, below which the block rests [m/s, rad/s]
WEIGHT = scenes.MASS * scenes.GRAVITY  # [N]
# As in BlockReach, where an action is scaled back into a ball: here the box lies inside of it, at no cost.
LIMITS = WEIGHT / np.sqrt(3) * np.repeat([FORCE_SHARE, TORQUE_SHARE * max(scenes.SIZE) / 2], 3)
OBSERVATION_SIZE = 18  # rotation matrix, linear and angular velocity, way to the goal


class MujocoBlockReach(MujocoEnv):
    """Push the block to a goal on the floor: the plain form of BlockReach, with a smaller observation.

    Parameters
    ----------
    frame_skip : int
        MuJoCo steps in one environment step.
    """

    metadata: ClassVar[dict] = {
        "render_modes": ["human", "rgb_array", "depth_array"],
        "render_fps": round(1 / (STEP * SUBSTEPS)),
    }

    def __init__(self, frame_skip: int = SUBSTEPS, **more):
        self.goal = np.zeros(3)
        box = spaces.Box(-np.inf, np.inf, (OBSERVATION_SIZE,), np.float32)
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "block.xml"
            path.write_text(model_xml(), encoding="utf-8")
            super().__init__(str(path), frame_skip, box, **more)
        self.action_space = spaces.Box(-1.0, 1.0, (6,), np.float32)

    def step(self, action):
        """Hold the wrench that `action` scales for `frame_skip` steps.

        `MujocoEnv.do_simulation` would compute contact forces on each body besides; nothing here needs them.
        """
        self.data.xfrc_applied[BLOCK] = LIMITS * np.clip(action, -1.0, 1.0)
        mujoco.mj_step(self.model, self.data, nstep=self.frame_skip)
        way = self.goal - self.data.qpos[:3]
        distance, speed = float(np.sqrt(way @ way)), float(np.sqrt(self.data.qvel @ self.data.qvel))
        is_success = distance < REACHED and speed < CALM
        reward = -distance + 5.0 * is_success
        return self._observation(way), reward, is_success, False, {"is_success": is_success}

    def reset_model(self):
        """Start at rest at a random place, with a random goal."""
        qpos = self.init_qpos.copy()
        qpos[0], qpos[2] = self.np_random.uniform(-GOAL_WIDTH, GOAL_WIDTH, 2)
        self.goal = self.init_qpos[:3].copy()
        self.goal[0], self.goal[2] = self.np_random.uniform(-GOAL_WIDTH, GOAL_WIDTH, 2)
        self.set_state(qpos, self.init_qvel)
        return self._observation(self.goal - qpos[:3])

    def _observation(self, way):
        return np.concatenate((self.data.xmat[BLOCK], self.data.qvel, way), dtype=np.float32)


def make_peer() -> EnvPeer:
    """`MujocoBlockReach`, registered, with the wrappers and the length of episodes that BlockReach has."""
    if PEER_ID not in gymnasium.registry:
        steps = gymnasium.spec(ENV_ID).max_episode_steps
        gymnasium.register(PEER_ID, MujocoBlockReach, max_episode_steps=steps)

    def make():
        return gymnasium.make(PEER_ID, disable_env_checker=True)

    return EnvPeer("MujocoEnv", make, lambda number: gymnasium.vector.SyncVectorEnv([make] * number))
