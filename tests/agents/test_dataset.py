"""Data sets of a policy's episodes: their names, their policies, and what is refused."""

from __future__ import annotations

import sys

import gymnasium as gym
import numpy as np
import pytest
import typer
from typer.testing import CliRunner

pytest.importorskip("stable_baselines3")

import rigid_env  # noqa: F401 (registers)
from agents import dataset as program
from agents.dataset import default_name, find_policy, record_episodes

CURL = "rigid_env/BlockCurl-v0"


def run(*options, code=0):
    app = typer.Typer()
    app.command()(program.main)
    done = CliRunner().invoke(app, [*map(str, options)])
    assert done.exit_code == code, done.output
    return " ".join(done.output.split())


def test_a_data_set_is_named_by_environment_and_policy():
    assert default_name(CURL, "pretrained") == "rigid_env/BlockCurl/pretrained-v0"
    assert default_name(f"rigid_env:{CURL}", "runs/mine/model.zip") == "rigid_env/BlockCurl/model-v0"


def test_policies_are_found_by_name():
    observations = np.zeros((3, 6), dtype=np.float32)
    assert find_policy("random", CURL, 0)(observations).shape == (3, 2)
    assert find_policy("controller", CURL, 0)(observations).shape == (3, 2)
    with pytest.raises(ValueError, match="which is no file"):
        find_policy("nothing.npz", CURL, 0)


def test_each_seed_gets_one_episode():
    told = []
    env = gym.wrappers.RecordEpisodeStatistics(gym.make(CURL))
    assert record_episodes(env, find_policy("controller", CURL, 0), range(3), lambda: told.append(1)) == 3
    assert len(told) == 3
    assert env.episode_count == 3


def test_without_minari_the_extra_is_named(monkeypatch):
    monkeypatch.setitem(sys.modules, "minari", None)
    assert "rigid-env[minari]" in run(CURL, "--policy", "random", code=1)


@pytest.mark.exhaustive
def test_minari_reads_what_was_written(tmp_path, monkeypatch):
    minari = pytest.importorskip("minari")
    pytest.importorskip("h5py")
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    output = run(CURL, "--policy", "controller", "--episodes", "4")
    assert "rigid_env/BlockCurl/controller-v0: 4 episodes, 100% successes" in output
    kept = minari.load_dataset("rigid_env/BlockCurl/controller-v0")
    assert kept.total_episodes == 4
    assert all(episode.terminations[-1] for episode in kept.iterate_episodes())
    assert kept.recover_environment().unwrapped.spec.id == CURL
