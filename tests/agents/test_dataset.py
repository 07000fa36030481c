"""Data sets of a policy's episodes: their names, their policies, and what is refused."""

from __future__ import annotations

import sys
import types

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


@pytest.fixture
def minari_without_episodes(tmp_path, monkeypatch):
    """A stand-in of Minari that has data sets in a folder, and fails when episodes are to be collected."""

    def collects(*given, **named):
        raise AssertionError("episodes are run")

    storage = types.SimpleNamespace(get_dataset_path=lambda name: tmp_path / name)
    monkeypatch.setitem(sys.modules, "minari", types.SimpleNamespace(DataCollector=collects, storage=storage))
    monkeypatch.setitem(sys.modules, "minari.storage", storage)
    monkeypatch.setattr(program, "require", lambda *names, purpose: None)
    return tmp_path


def refused(*options) -> str:
    return run(CURL, "--policy", "random", *options, code=2).replace("│ ", "")


@pytest.mark.parametrize("name", ["foo", "foo-v", "a b/c-v0", "x/y-v0", "rigid.env/c-v0", ""])
def test_a_name_of_another_form_is_refused_before_any_episode(name, minari_without_episodes):
    output = refused("--name", name)
    assert f"--name is {name!r}; allowed is --name namespace/name-v0" in output


def test_a_data_set_that_exists_is_left_alone_before_any_episode(minari_without_episodes):
    (minari_without_episodes / "mine" / "curl-v9").mkdir(parents=True)
    output = refused("--name", "mine/curl-v9")
    assert "--name is 'mine/curl-v9', which exists already; allowed is a new version, as --name mine/curl-v10" in output
    assert "minari delete mine/curl-v9" in output
    (minari_without_episodes / default_name(CURL, "random")).mkdir(parents=True)
    assert "without --name the data set is 'rigid_env/BlockCurl/random-v0', which exists" in refused()


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
    for episode in kept.iterate_episodes():
        is_success = episode.infos["is_success"]
        assert is_success.shape == (len(episode.actions) + 1,)
        assert is_success[-1]
        assert not is_success[0]
    assert kept.recover_environment().unwrapped.spec.id == CURL
    assert "which exists already" in run(CURL, "--policy", "controller", code=2).replace("│ ", "")
