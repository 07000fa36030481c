"""Policies from files: plain arrays, models of Stable-Baselines3, and files that are neither."""

from __future__ import annotations

import json
import re
from itertools import pairwise

import gymnasium as gym
import numpy as np
import pytest

from rigid_env.envs.policy_files import ACTIVATIONS, Network, act, load_policy


def made(rng, activation="tanh", output="linear", sizes=(5, 7, 3)) -> Network:
    layers = [(rng.normal(size=pair), rng.normal(size=pair[1])) for pair in pairwise(sizes)]
    return Network(layers, activation, output, rng.normal(size=sizes[0]), rng.uniform(0.5, 2.0, sizes[0]))


@pytest.mark.parametrize("activation", ACTIVATIONS)
def test_a_network_is_read_as_it_was_written(activation, rng, tmp_path):
    network = made(rng, activation, "tanh")
    seen = rng.normal(size=(20, 5))
    actions = load_policy(network.save(tmp_path / "policy.npz"))(seen)
    assert actions.tobytes() == network(seen).tobytes()
    assert actions.shape == (20, 3)
    assert np.abs(actions).max() <= 1.0


def test_a_network_is_what_the_table_says(rng):
    """By hand, one observation at a time; beyond ±1 it is clipped."""
    network = made(rng, "relu")
    (w0, b0), (w1, b1) = network.layers
    seen = rng.normal(size=(50, 5))
    wanted = []
    for x in seen:
        inner = [max(0.0, v) for v in (x - network.mean) / network.std @ w0 + b0]
        wanted.append(np.clip(inner @ w1 + b1, -1.0, 1.0))
    assert network(seen) == pytest.approx(np.array(wanted), abs=1e-6)
    assert (np.abs(wanted) == 1.0).any()


def test_parts_of_an_observation_follow_each_other_by_name(rng):
    network = made(rng)
    b, a = rng.normal(size=(2, 2)), rng.normal(size=(2, 3))
    assert np.array_equal(network({"b": b, "a": a}), network(np.concatenate([a, b], axis=1)))


def test_one_observation_gets_the_action_of_a_batch_of_one(rng):
    network, x = made(rng), rng.normal(size=5)
    np.testing.assert_array_equal(act(network, x), network(x[None])[0])
    np.testing.assert_array_equal(act(network, {"b": x[3:], "a": x[:3]}), network(x[None])[0])


def test_arrays_alone_are_a_policy(tmp_path):
    """Without what may be missing: the inner activation is tanh, the last none."""
    np.savez(tmp_path / "p.npz", w0=[[0.5]], b0=[0.25], w1=[[2.0]], b1=[0.0])
    assert load_policy(tmp_path / "p.npz")(np.array([[0.1]]))[0, 0] == pytest.approx(2.0 * np.tanh(0.3))


def test_squashed_inputs_follow_the_others(rng, tmp_path):
    plain, squash = made(rng, sizes=(5, 7, 3)), rng.normal(size=(3, 2))
    network = Network(plain.layers, mean=rng.normal(size=3), std=[1.0, 2.0, 3.0], squash=squash)
    assert network.inputs == 3
    seen = rng.normal(size=(20, 3))
    x = (seen - network.mean) / network.std
    wanted = Network(plain.layers)(np.concatenate([x, np.tanh(x @ squash)], axis=1))
    np.testing.assert_array_equal(network(seen), wanted)
    np.testing.assert_array_equal(load_policy(network.save(tmp_path / "policy.npz"))(seen), wanted)


@pytest.mark.parametrize(
    ("arrays", "told"),
    [
        ({"w0": np.zeros((3, 2)), "b0": np.zeros(3)}, r"w0 has shape \(3, 2\), b0 \(3,\); allowed"),
        ({"w0": np.zeros((3, 2))}, "there is no 'b0"),
        ({"w0": np.zeros((3, 2)), "b0": np.zeros(2), "w2": np.zeros((2, 2)), "b2": np.zeros(2)}, "there is no 'w1"),
        ({"w0": np.full((3, 2), np.nan), "b0": np.zeros(2)}, "w0 has shape .*allowed are finite numbers"),
        ({"w0": np.array([["a"]]), "b0": np.zeros(1)}, "w0 has shape .*allowed are finite numbers"),
        ({"w0": np.zeros((3, 2)), "b0": np.zeros(2), "activation": "gelu"}, "activation is 'gelu'; allowed are"),
        ({"w0": np.zeros((3, 2)), "b0": np.zeros(2), "std": np.zeros(3)}, "std"),
        ({"w0": np.zeros((3, 2)), "b0": np.zeros(2), "squash": np.zeros((3, 1))}, r"squash has .*allows \(2, n\)"),
        ({"w0": np.array([{}]), "b0": np.zeros(2)}, "allow_pickle"),
    ],
)
def test_arrays_that_are_no_network_are_refused(arrays, told, tmp_path):
    path = tmp_path / "policy.npz"
    np.savez(path, **arrays)
    with pytest.raises(
        ValueError, match=rf"policy is '{path}', which holds no network.*{told}" if told[0] != "h" else told
    ):
        load_policy(path)


def test_observations_of_another_length_are_refused(rng):
    with pytest.raises(ValueError, match=r"observations have shape \(2, 4\); the policy allows \(n, 5\)"):
        made(rng)(np.zeros((2, 4)))


def test_other_files_are_refused(tmp_path):
    """Each error names the file, and what its ending allows."""
    (tmp_path / "text.zip").write_text("no archive")
    (tmp_path / "text.npz").write_text("no archive")
    (tmp_path / "empty.npz").write_bytes(b"")
    np.savez(tmp_path / "other.npz", x=np.zeros(3))
    np.savez(tmp_path / "arrays", w0=np.ones((1, 1)), b0=np.ones(1))
    (tmp_path / "arrays.npz").rename(tmp_path / "arrays.zip")
    for name, told in (
        ("none.npz", "is no file; allowed are a model of Stable-Baselines3"),
        ("text.zip", "is none; allowed with the ending .zip is a model"),
        ("arrays.zip", "is none; allowed with the ending .zip is a model"),
        ("text.npz", "holds no network"),
        ("empty.npz", "holds no network"),
        ("other.npz", "holds no network"),
    ):
        with pytest.raises(ValueError, match=rf"policy is '.*{name}', which {re.escape(told)}"):
            load_policy(tmp_path / name)


def test_a_network_is_saved_under_the_ending_that_is_read(rng, tmp_path):
    with pytest.raises(ValueError, match=r"path is '.*policy.zip'; allowed is the ending .npz"):
        made(rng).save(tmp_path / "policy.zip")
    assert not (tmp_path / "policy.zip").exists()


@pytest.mark.parametrize("algorithm", ["PPO", "SAC", "TD3", "DDPG", "A2C"])
def test_models_of_stable_baselines3(algorithm, tmp_path):
    """Each is told by its file, and acts as it did."""
    sb3 = pytest.importorskip("stable_baselines3")
    env = gym.make("Pendulum-v1")
    model = getattr(sb3, algorithm)("MlpPolicy", env, device="cpu", seed=0, policy_kwargs={"net_arch": [8]})
    model.save(tmp_path / "model.zip")
    seen = np.stack([env.observation_space.sample() for _ in range(5)])
    assert np.array_equal(load_policy(tmp_path / "model.zip")(seen), model.predict(seen, deterministic=True)[0])


def test_a_model_with_hindsight_acts_without_its_environment(tmp_path):
    sb3 = pytest.importorskip("stable_baselines3")
    env = gym.make("rigid_env:rigid_env/BlockReachGoal-v0")
    model = sb3.SAC("MultiInputPolicy", env, replay_buffer_class=sb3.HerReplayBuffer, buffer_size=1000, device="cpu",
                    policy_kwargs={"net_arch": [8]})  # fmt: skip
    model.save(tmp_path / "model.zip")
    observation, _ = env.reset(seed=0)
    batch = {name: part[None] for name, part in observation.items()}
    assert np.array_equal(
        load_policy(tmp_path / "model.zip")(batch)[0], model.predict(observation, deterministic=True)[0]
    )


def test_an_archive_of_something_else_is_no_model(tmp_path):
    import zipfile

    pytest.importorskip("stable_baselines3")
    with zipfile.ZipFile(tmp_path / "model.zip", "w") as file:
        file.writestr("data", '{"tree": 3}')
    with pytest.raises(ValueError, match="of an unknown algorithm; allowed are PPO"):
        load_policy(tmp_path / "model.zip")


@pytest.mark.parametrize(
    ("source", "why"),
    [
        ("sb3_contrib.common.recurrent.policies", "which remembers earlier observations"),
        ("sb3_contrib.crossq.policies", "which Stable-Baselines3 cannot load"),
    ],
)
def test_a_policy_that_would_act_in_another_way_is_refused(source, why, tmp_path):
    """The settings of its algorithm are those of PPO or SAC, by which the file would be read."""
    import zipfile

    with zipfile.ZipFile(tmp_path / "model.zip", "w") as file:
        file.writestr("data", json.dumps({"clip_range": 0.2, "policy_class": {"__module__": source}}))
    with pytest.raises(ValueError, match=rf"model.zip', of {source}, {why}; allowed are PPO"):
        load_policy(tmp_path / "model.zip")
