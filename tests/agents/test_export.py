"""A trained policy as plain arrays acts as the model does."""

from __future__ import annotations

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

pytest.importorskip("stable_baselines3")

from stable_baselines3 import PPO, SAC

from agents import export
from agents.environments import make_vector_env
from agents.export import network_of
from agents.features import GoalDifference
from rigid_env import RigidVecEnv, load_policy


@pytest.fixture(scope="module")
def env():
    return RigidVecEnv(make_vector_env("rigid_env/BlockCurl-v0", 2, autoreset_mode="SameStep"))


@pytest.mark.parametrize("kind", [PPO, SAC])
def test_it_acts_as_the_model(kind, env, tmp_path):
    model = kind("MlpPolicy", env, seed=0, device="cpu", policy_kwargs={"net_arch": [16, 8]})
    observations = np.random.default_rng(0).normal(size=(50, 6)).astype(np.float32)
    network = network_of(model)
    # single precision: sums of at most 16 products of order 1, 16 * 6e-8 each
    np.testing.assert_allclose(network(observations), model.predict(observations, deterministic=True)[0], atol=1e-5)
    path = network.save(tmp_path / "policy.npz")
    np.testing.assert_array_equal(load_policy(path)(observations), network(observations))
    with np.load(path) as file:
        assert file["w0"].dtype == np.float32


@pytest.mark.parametrize(
    ("kind", "features"), [(PPO, {}), *((kind, {"features_extractor_class": GoalDifference}) for kind in (PPO, SAC))]
)
def test_goals_are_compared_as_in_the_model(kind, features):
    goals = RigidVecEnv(make_vector_env("rigid_env/BlockReachGoal-v0", 2, autoreset_mode="SameStep"))
    model = kind("MultiInputPolicy", goals, seed=0, device="cpu", policy_kwargs={"net_arch": [16, 8], **features})
    rng = np.random.default_rng(0)
    seen = {
        name: rng.normal(size=(50, *part.shape)).astype(np.float32)
        for name, part in model.observation_space.spaces.items()
    }
    # single precision: sums of at most 40 products of order 1, 40 * 6e-8 each
    np.testing.assert_allclose(network_of(model)(seen), model.predict(seen, deterministic=True)[0], atol=1e-5)


def test_other_policies_are_refused(env):
    model = PPO("MlpPolicy", env, seed=0, device="cpu", policy_kwargs={"net_arch": []})
    with pytest.raises(ValueError, match="allowed is a fully connected network"):
        network_of(model)


def test_the_command_writes_a_run(env, tmp_path, monkeypatch):
    model = PPO("MlpPolicy", env, seed=0, device="cpu")
    monkeypatch.setattr(export, "load_trained", lambda run: (None, model))
    app = typer.Typer()
    app.command()(export.main)
    path = tmp_path / "policy.npz"
    done = CliRunner().invoke(app, [str(tmp_path), str(path)])
    assert done.exit_code == 0, done.output
    assert "kB" in done.output
    assert load_policy(path).inputs == 6
