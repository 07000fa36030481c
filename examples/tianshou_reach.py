"""Tianshou on the native batch: ``python examples/tianshou_reach.py`` needs tianshou 2."""

import argparse

import gymnasium as gym
import numpy as np
import torch
from tianshou.algorithm import PPO
from tianshou.algorithm.modelfree.reinforce import ProbabilisticActorPolicy
from tianshou.algorithm.optim import AdamOptimizerFactory
from tianshou.data import Collector, VectorReplayBuffer
from tianshou.env import BaseVectorEnv
from tianshou.trainer import OnPolicyTrainerParams
from tianshou.utils.net.common import Net
from tianshou.utils.net.continuous import ContinuousActorProbabilistic, ContinuousCritic

import rigid_env  # noqa: F401 (registers the environments)


class TianshouEnvs(BaseVectorEnv):
    """A native batch in mode ``Disabled`` as Tianshou's vector environment; its collector resets ended worlds."""

    def __init__(self, envs: gym.vector.VectorEnv):
        self.envs, self.env_num = envs, envs.num_envs
        self.is_async = self.is_closed = False

    def get_env_attr(self, key, id=None):
        values = self.envs.get_attr(key)
        return [values[i] for i in self._wrap_id(id)]

    def reset(self, env_id=None, options=None, seed=None):
        """Start some worlds anew; a `seed` gives world i the seed + i."""
        rows = np.array(self._wrap_id(env_id))
        mask = np.isin(np.arange(self.env_num), rows)
        observations, infos = self.envs.reset(seed=seed, options={**(options or {}), "reset_mask": mask})
        return observations[rows], self._rows_of(infos, rows)

    def step(self, action, id=None):
        """Step some worlds; the others keep their state."""
        rows = np.array(self._wrap_id(id))
        idle = np.setdiff1d(np.arange(self.env_num), rows)
        kept, actions = self.envs.get_state(idle), np.zeros(self.envs.action_space.shape)
        actions[rows] = action
        *results, infos = self.envs.step(actions)
        self.envs.set_state(kept, idle)
        return *(result[rows] for result in results), self._rows_of(infos, rows)

    def seed(self, seed=None):
        self.reset(seed=seed)
        return [[one] for one in self.envs.np_random_seed]

    def close(self):
        self.envs.close()

    def _rows_of(self, infos, rows):
        names = [name for name in infos if not name.startswith("_")]
        return np.array([{**{name: infos[name][i] for name in names}, "env_id": i} for i in rows])


def make_envs(worlds: int, **arguments) -> TianshouEnvs:
    """BlockReach, its worlds in one batch."""
    native = {"vectorization_mode": "vector_entry_point", "autoreset_mode": "Disabled"}
    return TianshouEnvs(gym.make_vec("rigid_env/BlockReach-v0", num_envs=worlds, **native, **arguments))


def make_ppo(envs: TianshouEnvs) -> PPO:
    """PPO with two hidden layers of 64."""
    actions, shape = envs.action_space[0], envs.observation_space[0].shape
    body, critic = (Net(state_shape=shape, hidden_sizes=(64, 64), activation=torch.nn.Tanh) for _ in range(2))
    policy = ProbabilisticActorPolicy(
        actor=ContinuousActorProbabilistic(preprocess_net=body, action_shape=actions.shape, unbounded=True),
        dist_fn=lambda given: torch.distributions.Independent(torch.distributions.Normal(*given), 1),
        action_space=actions,
    )
    optim = AdamOptimizerFactory(lr=1e-3)
    return PPO(policy=policy, critic=ContinuousCritic(preprocess_net=critic), optim=optim, max_grad_norm=0.5)


def train(worlds: int, steps: int, seed: int = 0, **arguments) -> float:
    """Train for `steps` steps of all worlds together: the mean return of an episode of each world."""
    torch.manual_seed(seed)
    envs = make_envs(worlds, **arguments)
    algorithm, rollout = make_ppo(envs), 32 * worlds
    collector = Collector(algorithm, envs, VectorReplayBuffer(rollout, worlds))
    collector.reset(gym_reset_kwargs={"seed": seed})
    algorithm.run_training(
        OnPolicyTrainerParams(
            training_collector=collector, max_epochs=max(1, steps // rollout), epoch_num_steps=rollout,
            collection_step_num_env_steps=rollout, batch_size=rollout // 8, update_step_num_repetitions=5,
        )
    )  # fmt: skip
    return Collector(algorithm, envs).collect(n_episode=worlds, reset_before_collect=True).returns.mean()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description="Train a little, and say the return.")
    parser.add_argument("--steps", type=int, default=200_000)
    print(f"return {train(worlds=128, steps=parser.parse_args().steps):.3f}")
