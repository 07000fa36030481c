"""Every environment of the suite: what each of them must hold. What is special to one has a file of its own."""

from __future__ import annotations

import hashlib
import importlib
import json
import re
import warnings
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import rigid_env  # noqa: F401 (registers)
from physics import PRESETS
from rigid_env import check_task
from rigid_env.envs.controllers import CONTROLLERS, load_controller
from rigid_env.envs.registration import GOALS, MAX_EPISODE_STEPS, SUITE
from rigid_env.tasks import kernels
from tests.suite.rates import RATES
from tests.tiers.sweep import sweep

HASHES = Path(__file__).with_name("hashes.json")
BALLS = ("BallKick", "BallJuggle")
"""Environments whose kernels no other test of the default tier needs: 20 s of compiling each."""

STEPS, EARLY, WORLDS = 200, 20, 2  # control steps of a hash, of those that are compared on other processors, and worlds


def env_id(name: str) -> str:
    return f"rigid_env/{name}-v0"


def quick(name: str) -> bool:
    """Answer whether the default tier steps an environment."""
    return name not in BALLS


def task_of(name: str) -> type:
    module, _, kind = gym.spec(env_id(name)).kwargs["task"].partition(":")
    return getattr(importlib.import_module(module), kind)


@pytest.mark.parametrize("name", SUITE)
def test_the_registered_limit_is_that_of_the_task(name):
    assert gym.spec(env_id(name)).max_episode_steps == SUITE[name] == task_of(name).max_episode_steps


@pytest.mark.parametrize("name", sweep(SUITE, quick))
def test_it_passes_the_checks(name, is_exhaustive):
    check_task(gym.spec(env_id(name)).kwargs["task"], contexts=("fork", "spawn") if is_exhaustive else ())


@pytest.mark.exhaustive
@pytest.mark.parametrize("name", SUITE)
def test_it_passes_the_checkers_without_a_warning(name):
    from gymnasium.utils.env_checker import check_env
    from stable_baselines3.common.env_checker import check_env as sb3_check_env

    env = gym.make(env_id(name), render_mode="rgb_array", width=64, height=48)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)
        sb3_check_env(env.unwrapped, warn=True)
    env.close()


@pytest.mark.parametrize("name", SUITE)
def test_its_documentation_has_every_section(name):
    doc = task_of(name).__doc__
    titles = re.findall(r"^ *## (.+)$", doc, re.MULTILINE)
    assert titles == ["Description", "Rewards", "Starting State", "Episode End", "Version History"]
    assert f"{SUITE[name]}" in " ".join(doc.split("## Episode End")[1].split())


@pytest.mark.interpreted
@pytest.mark.parametrize("name", [*SUITE, *GOALS, *MAX_EPISODE_STEPS])
def test_its_documentation_explains_every_number_once(name):
    text = gym.make(env_id(name)).unwrapped.describe()
    for vague in ("the task's own |", "measured by the task", "term of the reward"):
        assert vague not in text
    assert text.count("Truncation") == 1


@pytest.mark.parametrize("name", GOALS)
def test_success_with_a_goal_ends_no_episode(name):
    text = " ".join(gym.make(env_id(name)).unwrapped.describe().split())
    assert "Termination: never. Success is `s <= 1`, in every control step anew" in text
    tolerances = (kernels.REACH_TOLERANCE if "Reach" in name else kernels.REORIENT_TOLERANCE,
                  kernels.REST_SPEED, kernels.REST_SPIN)  # fmt: skip
    letter = "d" if "Reach" in name else "a"
    ratios = ", ".join(f"{each} / {number:g}" for each, number in zip((letter, "v", "w"), tolerances))
    assert f"the shortfall `s = max({ratios})`" in text


@pytest.mark.parametrize("name", sweep([name for name in SUITE if env_id(name) in CONTROLLERS], quick))
def test_its_controller_solves_it_and_chance_does_not(name):
    pytest.importorskip("stable_baselines3")
    from agents.baselines import baseline_policy
    from agents.evaluate import run_episodes

    least, most = RATES[name]
    seeds = range(100)
    assert run_episodes(env_id(name), load_controller(env_id(name)), seeds).success.mean() >= least
    assert run_episodes(env_id(name), baseline_policy("random", env_id(name)), seeds).success.mean() <= most


def digest(name: str, accuracy: str) -> tuple[str, list[float]]:
    """Hash of all observations and rewards of 200 steps, and a number for each of the first steps."""
    envs = gym.make_vec(env_id(name), num_envs=WORLDS, accuracy=accuracy)
    rng, found, early = np.random.default_rng(0), hashlib.sha256(), []
    observations, _ = envs.reset(seed=0)
    for _ in range(STEPS):
        observations, rewards, terminated, truncated, _ = envs.step(rng.uniform(-1, 1, envs.action_space.shape))
        for part in (observations, rewards, terminated, truncated):
            found.update(np.ascontiguousarray(part).tobytes())
        early.append(float(np.abs(observations).sum() + rewards.sum()))
    envs.close()
    return found.hexdigest()[:16], early[:EARLY]


@pytest.mark.parametrize("accuracy", sweep(PRESETS, ["balanced"]))
@pytest.mark.parametrize("name", sweep(SUITE, quick))
def test_its_dynamics_are_those_of_its_version(name, accuracy):
    """An id's dynamics never change: ``python -m tests.suite.test_suite`` writes the hashes of a new id.

    Another processor or version of NumPy may round otherwise. There the first steps are compared: a roundoff of 1e-16
    grows at most 1e8 times in the half second that they last.
    """
    known = json.loads(HASHES.read_text(encoding="utf-8"))[f"{name} {accuracy}"]
    found, early = digest(name, accuracy)
    if found != known["hash"]:
        np.testing.assert_allclose(early, known["early"], rtol=1e-6, err_msg=f"{name} at {accuracy}: make it v1")


def write_hashes() -> None:
    """Write the hashes of ids and presets that have none yet; known ones stay."""
    known = json.loads(HASHES.read_text(encoding="utf-8")) if HASHES.exists() else {}
    for name in SUITE:
        for accuracy in PRESETS:
            if (key := f"{name} {accuracy}") not in known:
                found, early = digest(name, accuracy)
                known[key] = {"hash": found, "early": early}
                HASHES.write_text(json.dumps(known, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write_hashes()
