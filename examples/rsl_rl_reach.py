"""RSL-RL on the native batch: ``python examples/rsl_rl_reach.py`` needs rsl-rl-lib 5 and tensorboard."""

import argparse
from copy import deepcopy

import gymnasium as gym
import numpy as np
import torch
from rsl_rl.env import VecEnv
from rsl_rl.runners import OnPolicyRunner
from tensordict import TensorDict

import rigid_env  # noqa: F401 (registers the environments)

NETWORK = {"class_name": "MLPModel", "hidden_dims": [64, 64], "activation": "tanh"}
SETTINGS = {
    "num_steps_per_env": 32, "save_interval": 1000, "obs_groups": {"actor": ["policy"], "critic": ["policy"]},
    "actor": {**NETWORK, "distribution_cfg": {"class_name": "GaussianDistribution"}},
    "critic": NETWORK,
    "algorithm": {"class_name": "PPO", "num_mini_batches": 8, "entropy_coef": 0.0, "schedule": "fixed"},
}  # fmt: skip


class RslRlEnv(VecEnv):
    """A native batch in mode ``SameStep`` as RSL-RL's environment.

    RSL-RL adds γ V(s) to the reward of a step that ends by `time_outs`; s is the observation before this step.
    """

    def __init__(self, envs: gym.vector.VectorEnv, seed: int):
        self.envs, self.num_envs, self.num_actions = envs, envs.num_envs, envs.single_action_space.shape[0]
        self.max_episode_length, self.device, self.cfg = envs.max_episode_steps, "cpu", {}
        self.observations = envs.reset(seed=seed)[0]

    @property
    def episode_length_buf(self) -> torch.Tensor:
        """Control steps since each episode began (num_envs,), a copy: set all of them to change some."""
        return torch.from_numpy(self.envs.task.steps)

    @episode_length_buf.setter
    def episode_length_buf(self, steps: torch.Tensor) -> None:
        self.envs.task.adopt(np.arange(self.num_envs), steps.numpy())

    def get_observations(self):
        return TensorDict({"policy": torch.from_numpy(self.observations)}, batch_size=[self.num_envs])

    def step(self, actions):
        self.observations, rewards, terminated, truncated, _ = self.envs.step(actions.numpy())
        dones, time_outs = torch.from_numpy(terminated | truncated), torch.from_numpy(truncated & ~terminated)
        return self.get_observations(), torch.from_numpy(rewards).float(), dones, {"time_outs": time_outs}


def train(worlds: int, steps: int, seed: int = 0, folder: str = "runs/rsl_rl_reach", **arguments) -> float:
    """Train for `steps` steps of all worlds together: the mean return of the last 100 episodes."""
    torch.manual_seed(seed)
    native = {"vectorization_mode": "vector_entry_point", "autoreset_mode": "SameStep"}
    env = RslRlEnv(gym.make_vec("rigid_env/BlockReach-v0", num_envs=worlds, **native, **arguments), seed)
    runner = OnPolicyRunner(env, deepcopy(SETTINGS), log_dir=folder)  # without a folder it notes no returns
    runner.learn(max(1, steps // (32 * worlds)), init_at_random_ep_len=True)
    return float(np.mean(runner.logger.rewbuffer))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Train a little, and say the return.")
    parser.add_argument("--steps", type=int, default=200_000)
    print(f"return {train(worlds=128, steps=parser.parse_args().steps):.3f}")
