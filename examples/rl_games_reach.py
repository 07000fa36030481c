"""rl_games on the native batch: ``python examples/rl_games_reach.py`` needs rl-games 1.6."""

import argparse

import gymnasium as gym
import numpy as np
import torch
from rl_games.algos_torch.a2c_continuous import A2CAgent
from rl_games.common import env_configurations, vecenv
from rl_games.common.ivecenv import IVecEnv
from rl_games.torch_runner import Runner

import rigid_env  # noqa: F401 (registers the environments)


class RlGamesEnv(IVecEnv):
    """A native batch in mode ``SameStep`` as the vector environment of rl_games.

    rl_games adds γ V(s) to the reward of a step that ends by `time_outs`; s is the observation before this step.
    """

    def __init__(self, _name: str, num_actors: int, env: str, seed: int, **arguments):
        native = {"vectorization_mode": "vector_entry_point", "autoreset_mode": "SameStep"}
        self.envs = gym.make_vec(env, num_envs=num_actors, **native, **arguments)
        self.seed = seed

    def get_env_info(self):
        return {"action_space": self.envs.single_action_space, "observation_space": self.envs.single_observation_space}

    def reset(self):
        seed, self.seed = self.seed, None  # later resets let the generators go on
        return self.envs.reset(seed=seed)[0]

    def step(self, actions):
        observations, rewards, terminated, truncated, _ = self.envs.step(actions)
        return observations, rewards, terminated | truncated, {"time_outs": np.float32(truncated & ~terminated)}


vecenv.register("RIGID", RlGamesEnv)
env_configurations.register("native batch", {"vecenv_type": "RIGID"})

NETWORK = {
    "name": "actor_critic", "separate": True,
    "mlp": {"units": [64, 64], "activation": "tanh", "initializer": {"name": "default"}},
    "space": {"continuous": {
        "mu_activation": "None", "sigma_activation": "None", "fixed_sigma": True,
        "mu_init": {"name": "default"}, "sigma_init": {"name": "const_initializer", "val": 0.0},
    }},
}  # fmt: skip
PPO = {
    "name": "reach", "env_name": "native batch", "device": "cpu", "torch_compile": False,
    "horizon_length": 32, "mini_epochs": 5, "gamma": 0.99, "tau": 0.95, "e_clip": 0.2, "clip_value": False,
    "learning_rate": 1e-3, "lr_schedule": None, "entropy_coef": 0.0, "critic_coef": 1.0, "bounds_loss_coef": 0.0,
    "truncate_grads": True, "grad_norm": 0.5, "normalize_advantage": True, "normalize_input": False,
    "reward_shaper": {"scale_value": 1.0},
}  # fmt: skip


def make_agent(worlds: int, epochs: int = 1, seed: int = 0, folder: str = "runs", **arguments) -> A2CAgent:
    """PPO of an environment `env`, made with `arguments`; an epoch is 32 steps of each world."""
    torch.manual_seed(seed)  # of the weights: rl_games seeds nothing where the seed is 0
    config = {
        **PPO, "num_actors": worlds, "minibatch_size": 4 * worlds, "max_epochs": epochs, "train_dir": folder,
        "env_config": {"seed": seed, **arguments},
    }  # fmt: skip
    algorithm = {"algo": {"name": "a2c_continuous"}, "model": {"name": "continuous_a2c_logstd"}, "network": NETWORK}
    runner = Runner()
    runner.load({"params": {"seed": seed, "torch_threads": 1, "config": config, **algorithm}})  # the networks are small
    return runner.algo_factory.create(runner.algo_name, base_name="reach", params=runner.params)


def train(worlds: int, steps: int, env: str = "rigid_env/BlockReach-v0", **arguments) -> float:
    """Train for `steps` steps of all worlds together: the mean return of the last 100 episodes."""
    agent = make_agent(worlds, epochs=max(1, steps // (32 * worlds)), env=env, **arguments)
    agent.train()
    return float(agent.game_rewards.get_mean()[0])


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Train a little, and say the return.")
    parser.add_argument("--steps", type=int, default=200_000)
    print(f"return {train(worlds=128, steps=parser.parse_args().steps):.3f}")
