"""The examples: as short as promised, and tasks as good as any."""

from __future__ import annotations

import importlib
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from rigid_env import TaskVectorEnv, check_task
from tests.tiers.sweep import sweep

FOLDER = Path(__file__).parents[2] / "examples"
CLASSES = {"edge_balance": "EdgeBalance", "two_blocks": "TwoBlocks", "sphere_in_wind": "SphereInWind"}


@pytest.fixture(autouse=True)
def found(monkeypatch):
    """The examples are modules, as for a user in their folder."""
    monkeypatch.syspath_prepend(str(FOLDER))


def test_these_are_all():
    tasks = {path.stem for path in FOLDER.glob("*.py") if "register_task(" in path.read_text(encoding="utf-8")}
    assert tasks == set(CLASSES)


@pytest.mark.parametrize("name", CLASSES)
def test_they_have_forty_lines_at_most(name):
    assert len((FOLDER / f"{name}.py").read_text(encoding="utf-8").splitlines()) <= 40


QUICK = ("edge_balance", "two_blocks")
"""Examples that the default tier steps: kernels for wind take long to compile."""


@pytest.mark.parametrize("name", sweep(CLASSES, QUICK))
def test_they_pass_their_checks_in_workers_too(name, is_exhaustive):
    is_spawned = is_exhaustive or name == "edge_balance"
    check_task(f"{name}:{CLASSES[name]}", contexts=("fork", "spawn") if is_spawned else ("fork",))


@pytest.mark.parametrize("name", CLASSES)
def test_gymnasium_finds_them_and_draws_them(name):
    importlib.import_module(name)
    env = gym.make(f"examples/{CLASSES[name]}-v0", render_mode="rgb_array", width=64, height=48)
    env.reset(seed=0)
    assert env.render().shape == (48, 64, 3)
    assert np.ptp(env.render()) > 0
    envs = gym.make_vec(f"examples/{CLASSES[name]}-v0", num_envs=2)
    assert envs.max_episode_steps == 400


@pytest.mark.parametrize("name", sweep(CLASSES, QUICK))
def test_stable_baselines3_takes_them(name):
    pytest.importorskip("stable_baselines3")
    from rigid_env import RigidVecEnv

    task = getattr(importlib.import_module(name), CLASSES[name])
    envs = RigidVecEnv(TaskVectorEnv(2, task=task, autoreset_mode="SameStep", max_episode_steps=3))
    envs.reset()
    for _ in range(4):
        obs, rewards, dones, infos = envs.step(np.zeros((2, *envs.action_space.shape)))
    assert obs.shape == (2, *envs.observation_space.shape)
    assert np.isfinite(rewards).all()
    assert len(infos) == len(dones) == 2


def test_an_upright_block_stays_upright_for_a_while_and_falls_without_help():
    import edge_balance

    env = gym.make("examples/EdgeBalance-v0")
    env.reset(seed=0, options={"lean": 0.03, "friction": 1.0})
    ends = []
    while not ends or not (ends[-1] or len(ends) == 400):
        ends.append(env.step(np.zeros(2))[2])
    assert 5 < len(ends) < 400
    turn = np.arctan2(3.0, 5.0)
    assert abs(edge_balance.EDGE - turn) < 1e-15
