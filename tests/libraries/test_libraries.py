"""Libraries that train on our environments: each takes some steps on them (docs/libraries.md).

A test is skipped where its library is not installed.
"""

from __future__ import annotations

from functools import partial

import gymnasium as gym
import numpy as np
import pytest

import physics
import rigid_env
from rigid_env.tasks import Task, Uniform, Wrench, observe
from tests.tasks.conftest import Slide

REACH = "rigid_env/BlockReach-v0"
WORLDS = 4

pytestmark = pytest.mark.exhaustive


def batch(mode: str, **arguments):
    """The native batch, in a mode of starting anew."""
    return gym.make_vec(
        REACH, num_envs=WORLDS, vectorization_mode="vector_entry_point", autoreset_mode=mode, **arguments
    )


def test_torchrl_takes_an_id_processes_and_the_native_batch():
    pytest.importorskip("torchrl")
    from torchrl.envs import ParallelEnv
    from torchrl.envs.libs.gym import GymEnv, GymWrapper
    from torchrl.envs.utils import check_env_specs

    env = GymEnv(REACH)
    check_env_specs(env)
    assert env.rollout(5).shape == (5,)
    assert GymWrapper(batch("Disabled")).rollout(5, break_when_any_done=False).shape == (WORLDS, 5)
    workers = ParallelEnv(2, partial(GymEnv, f"rigid_env:{REACH}"))  # a process imports the module
    assert workers.rollout(3).shape == (2, 3)
    workers.close()


def test_torchrl_reads_the_infos_of_the_native_batch():
    pytest.importorskip("torchrl")
    from torchrl.envs.libs.gym import GymWrapper

    env = GymWrapper(batch("Disabled", mass=(4.0, 8.0))).auto_register_info_dict()
    found = env.rollout(3, break_when_any_done=False)
    assert found["next", "goal"].shape == (WORLDS, 3, 2)
    assert (found["mass"] == found["next", "mass"]).all()


def test_skrl_takes_the_native_batch():
    pytest.importorskip("skrl")
    import torch
    from skrl.envs.wrappers.torch import wrap_env

    env = wrap_env(batch("SameStep", max_episode_steps=3), wrapper="gymnasium")
    observations, _ = env.reset()
    assert observations.shape == (WORLDS, 24)
    for _ in range(5):
        observations, rewards, terminated, truncated, _ = env.step(torch.zeros(WORLDS, 6))
        assert observations.shape == (WORLDS, 24)
        assert rewards.shape == terminated.shape == truncated.shape == (WORLDS, 1)


@pytest.mark.parametrize(("name", "policy"), [("TRPO", "MlpPolicy"), ("RecurrentPPO", "MlpLstmPolicy")])
def test_sb3_contrib_trains_on_the_native_batch(name, policy):
    contrib = pytest.importorskip("sb3_contrib")
    from rigid_env import RigidVecEnv

    model = getattr(contrib, name)(policy, RigidVecEnv(batch("SameStep")), n_steps=16, batch_size=64, device="cpu")
    assert model.learn(128).num_timesteps == 128


class TwoPushers(Task):
    """Bring a block to a place on the floor, by two agents whose forces add up."""

    scene = physics.Scene(
        bodies=[physics.Block((2, 1, 2), 4.0, pos=(0, 0.5, 0))],
        walls=physics.three_walls(half_width=10.0),
        effects=[physics.Gravity(), physics.Contact(), physics.Friction(0.3)],
    )
    actions = tuple(Wrench(0, force=0.45, torque=0.25, agent=agent) for agent in ("left", "right"))
    observation = (observe.pos(), observe.linvel(), observe.rotation(), observe.drawn("goal", 2, "m", 5.0))
    draws = {"goal": Uniform((-4, -4), (4, 4))}  # noqa: RUF012
    max_episode_steps = 40

    def measure(self, worlds):
        return {"distance": np.linalg.norm(worlds.drawn["goal"] - worlds.pos[:, 0, ::2], axis=1)}

    def success(self, worlds):
        return worlds.measured["distance"] < 0.3

    def rewards(self, worlds):
        return {"near": -0.01 * worlds.measured["distance"], "success": 5.0 * worlds.success}


@pytest.mark.parametrize("task", [TwoPushers, REACH])
@pytest.mark.filterwarnings("error::UserWarning")
def test_pettingzoo_passes_its_own_tests(task):
    pytest.importorskip("pettingzoo")
    from pettingzoo.test import parallel_api_test, parallel_seed_test
    from pettingzoo.utils import parallel_to_aec

    from rigid_env.envs.pettingzoo import parallel_env

    env = parallel_env(task)
    parallel_api_test(env, num_cycles=100)
    parallel_seed_test(lambda: parallel_env(task), num_cycles=50)
    turns = parallel_to_aec(parallel_env(task))
    turns.reset(seed=0)
    for agent in turns.agent_iter(max_iter=3):
        turns.step(turns.action_space(agent).sample())
    assert env.num_agents == len(env.agents)
    assert env.max_num_agents == (2 if task is TwoPushers else 1)


def test_a_minari_data_set_has_the_bits_of_the_episodes(tmp_path, monkeypatch):
    minari = pytest.importorskip("minari")
    pytest.importorskip("h5py")
    pytest.importorskip("jax")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    arguments = {"mass": (4.0, 8.0), "accuracy": physics.Accuracy(tolerance=1e-3), "effects": [physics.Drag(0.2)]}
    env = minari.DataCollector(gym.make(REACH, max_episode_steps=20, **arguments), record_infos=True)
    env.action_space.seed(0)
    seen, masses = [], []
    for seed in range(2):
        observation, info = env.reset(seed=seed)
        seen.append([observation])
        masses.append(info["mass"])
        is_over = False
        while not is_over:
            observation, _, terminated, truncated, _ = env.step(env.action_space.sample())
            seen[-1].append(observation)
            is_over = terminated or truncated
    env.create_dataset("rigid/reach/random-v0", algorithm_name="random")
    kept = minari.load_dataset("rigid/reach/random-v0")
    assert kept.total_episodes == 2
    again = kept.recover_environment()
    for episode, observations, mass in zip(kept.iterate_episodes(), seen, masses):
        np.testing.assert_array_equal(episode.observations, np.array(observations))
        assert episode.infos["mass"].tolist() == [mass] * len(observations)
        assert episode.infos["goal"].shape == (len(observations), 2)
        replayed = [again.reset(seed=int(episode.id))[0], *(again.step(action)[0] for action in episode.actions)]
        np.testing.assert_array_equal(episode.observations, np.array(replayed))
    assert again.unwrapped.spec.id == REACH


def test_minari_recovers_a_task_that_was_registered_by_class(tmp_path, monkeypatch):
    minari = pytest.importorskip("minari")
    pytest.importorskip("h5py")
    pytest.importorskip("jax")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    rigid_env.register_task("mine/Slide-v0", Slide)
    env = minari.DataCollector(gym.make("mine/Slide-v0", max_episode_steps=3))
    env.reset(seed=0)
    while not env.step(env.action_space.sample())[3]:
        pass
    env.create_dataset("mine/slide/random-v0", algorithm_name="random")
    again = minari.load_dataset("mine/slide/random-v0").recover_environment()
    del gym.registry["mine/Slide-v0"]
    assert type(again.unwrapped.task) is Slide
