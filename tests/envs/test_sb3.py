"""The Stable-Baselines3 adapter."""

from __future__ import annotations

import tempfile
import warnings

import numpy as np
import pytest

from rigid_env.envs.block_reach import BlockReachVectorEnv

pytest.importorskip("stable_baselines3")

from stable_baselines3 import PPO
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.monitor import Monitor
from stable_baselines3.common.vec_env import VecCheckNan, VecMonitor, VecNormalize

from rigid_env.envs.sb3 import RigidVecEnv
from tests.envs.conftest import push, random_actions


@pytest.fixture(autouse=True)
def warnings_are_errors():
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        yield


def make(num_envs=3, monitor=True, **arguments):
    return RigidVecEnv(BlockReachVectorEnv(num_envs, autoreset_mode="SameStep", **arguments), monitor=monitor)


def test_only_same_step_autoreset_is_taken():
    """The error says which argument that is."""
    with pytest.raises(ValueError, match=r"NEXT_STEP; allowed is .*SAME_STEP") as error:
        RigidVecEnv(BlockReachVectorEnv(2))
    assert 'BlockReachVectorEnv(..., autoreset_mode="SameStep")' in str(error.value)


def test_options_are_arrays_or_a_dict_for_each_environment():
    venv = make()
    goals = np.array([(0.0, 0.0), (1.0, 2.0), (3.0, 3.0)])
    venv.set_options({"goal": goals, "mass": np.array([5.0, 6.0, 7.0])})
    together = venv.reset()
    assert [info["goal"] for info in venv.reset_infos] == goals.tolist()
    assert [info["mass"] for info in venv.reset_infos] == [5.0, 6.0, 7.0]
    for each in (True, False):  # of all, and of some of them
        venv.seed(3)
        venv.set_options([{"goal": goal, "mass": 5.0} if each or i != 1 else {} for i, goal in enumerate(goals)])
        obs, infos = venv.reset(), venv.reset_infos
        assert obs.shape == together.shape
        chosen = [0, 1, 2] if each else [0, 2]
        assert [infos[i]["goal"] for i in chosen] == goals[chosen].tolist()
        assert [info["mass"] for info in infos] == [5.0, 5.0 if each else 6.0, 5.0]
    venv.seed(3)
    drawn = venv.reset()
    np.testing.assert_array_equal(drawn[1], obs[1])  # no option is left, and that of one is no other's
    assert not np.array_equal(drawn[0], obs[0])


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ([{}], "allowed are a dict, or a list of 3 dicts"),
        ("goal", "allowed are a dict, or a list of 3 dicts"),
        ({"reset_mask": np.array([True, False, True])}, "options holds reset_mask"),
        ([{}, {"reset_mask": True}, {}], r"options\[1\] holds reset_mask"),
        ([{"goal": (0, 0)}, {"goal": 1.0}, {"goal": (1, 1)}], r"options\[1\] has goal of shape \(\)"),
        ([{"gaol": (0, 0)}, {}, {}], "gaol"),
    ],
)
def test_options_that_fit_no_environment_are_refused(options, words):
    def start(venv):
        venv.set_options(options)
        venv.reset()

    with pytest.raises(ValueError, match=words):
        start(make())


def test_options_of_some_that_are_refused_change_nothing():
    """Environments with other keys start in a call of their own; an error in a later call takes back the first."""
    venv, twin = make(), make()
    first = [each.seed(3) and each.reset() for each in (venv, twin)]
    np.testing.assert_array_equal(*first)
    venv.set_options([{"goal": (1.0, 2.0)}, {}, {"mass": -1.0}])
    with pytest.raises(ValueError, match="mass"):
        venv.reset()
    venv.set_options(None)
    np.testing.assert_array_equal(venv.step(np.zeros((3, 6)))[0], twin.step(np.zeros((3, 6)))[0])
    np.testing.assert_array_equal(venv.reset(), twin.reset())


def test_truncation_is_told_apart_and_the_final_observation_kept(rng):
    venv, twin = make(max_episode_steps=5), BlockReachVectorEnv(3, max_episode_steps=5)
    venv.seed(7)
    obs = venv.reset()
    expected, _ = twin.reset(seed=7)
    np.testing.assert_array_equal(obs, expected)
    returns = np.zeros(3)
    for k, actions in enumerate(random_actions(rng, 5, 3)):
        obs, rewards, dones, infos = venv.step(actions)
        expected, twin_rewards, *_ = twin.step(actions)
        returns += twin_rewards
        assert rewards.dtype == np.float32
        assert dones.tolist() == [k == 4] * 3
        assert k == 4 or infos == [{}, {}, {}]
    for i, info in enumerate(infos):
        np.testing.assert_array_equal(info["terminal_observation"], expected[i])
        assert info["TimeLimit.truncated"] is True
        assert info["is_success"] is False
        assert info["episode"]["l"] == 5
        assert info["episode"]["r"] == pytest.approx(returns[i], abs=1e-6)
    np.testing.assert_array_equal(obs, twin.step(np.zeros((3, 6)))[0])


def test_success_is_no_truncation():
    venv = make(2, max_episode_steps=10)
    venv.set_options({"place": (0.0, 0.0), "goal": [(0.0, 0.0), (3.0, 3.0)], "face": 2})
    venv.reset()
    for _ in range(10):
        _, _, dones, infos = venv.step(np.zeros((2, 6)))
    assert dones.all()
    assert [info["is_success"] for info in infos] == [True, False]
    assert [info["TimeLimit.truncated"] for info in infos] == [False, True]  # success on the last step


def test_seeds_are_used_once():
    venv = make()
    assert venv.seed(3) == [3, 4, 5]
    first = venv.reset()
    assert not np.array_equal(first, venv.reset())
    venv.seed(3)
    np.testing.assert_array_equal(first, venv.reset())
    assert len(venv.reset_infos) == 3
    drawn = {"mass", "size", "friction", "restitution", "gravity", "place", "yaw", "face", "goal"}
    terms = {"reward_progress", "reward_effort", "reward_success"}
    assert venv.reset_infos[0].keys() == {"is_success", "distance", "speed", "spin", "physics_status"} | terms | drawn


def test_attributes_and_methods():
    venv = make()
    assert venv.get_attr("max_episode_steps") == [300] * 3
    assert venv.get_attr("render_mode", [0]) == [None]
    venv.set_attr("max_episode_steps", 4)
    assert venv.vector_env.max_episode_steps == 4
    with pytest.raises(ValueError, match="set_attr got indices 0"):
        venv.set_attr("max_episode_steps", 5, indices=0)
    assert venv.has_attr("task")
    assert not venv.has_attr("tusk")
    assert venv.env_method("call", "mass") == [(6.0,) * 3] * 3
    assert venv.env_is_wrapped(Monitor) == [True] * 3
    assert make(monitor=False).env_is_wrapped(Monitor) == [False] * 3


def test_pictures_are_tiled():
    venv = make(2, render_mode="rgb_array", width=40, height=30)
    venv.reset()
    assert venv.render().shape == (60, 40, 3)


def test_wrappers_of_sb3(rng):
    venv = VecNormalize(VecCheckNan(VecMonitor(make(monitor=False, max_episode_steps=6)), raise_exception=True))
    obs = venv.reset()
    assert obs.shape == (3, 24)
    for actions in random_actions(rng, 6, 3):
        obs, _, dones, infos = venv.step(actions)
    assert dones.all()
    assert infos[0]["episode"]["l"] == 6
    # VecNormalize has replaced the final observation by its normalised value.
    original = venv.unnormalize_obs(infos[0]["terminal_observation"])
    assert np.abs(infos[0]["terminal_observation"]).max() <= 10.0
    assert np.isfinite(original).all()


def test_evaluate_policy_counts_the_scripted_controllers_successes():
    class Pusher:
        def predict(self, obs, **_):
            return push(obs), None

    successes = []
    evaluate_policy(
        Pusher(), make(8), n_eval_episodes=8,
        callback=lambda scope, _: successes.append(scope["info"]["is_success"]) if scope["done"] else None,
    )  # fmt: skip
    assert len(successes) >= 8
    assert np.mean(successes) > 0.8


def test_ppo_runs_and_logs_success(monkeypatch, tmp_path):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    model = PPO("MlpPolicy", make(4, max_episode_steps=8), n_steps=16, batch_size=32, n_epochs=1, device="cpu")
    model.learn(128)
    assert len(model.ep_success_buffer) > 0
    assert model.ep_info_buffer[0]["l"] == 8
    assert list(tmp_path.glob("SB3-*")) == []  # logs of tests stay among the files of tests
