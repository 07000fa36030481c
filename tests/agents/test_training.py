"""Training: files, checkpoints, interruption, going on with the same bits, learning."""

from __future__ import annotations

import csv
import json
import tempfile

import numpy as np
import pytest
from rich.console import Console

pytest.importorskip("stable_baselines3")

import torch

from agents.checkpoint import KEPT, list_checkpoints, load_checkpoint, load_policy
from agents.config import RunFolder, change, make_config
from agents.environments import make_vector_env
from agents.evaluate import run_episodes
from agents.supervisor import Supervisor
from agents.training import Interrupted, train
from tests.agents.conftest import HINDSIGHT, TINY_ALGORITHMS
from tests.tiers.sweep import sweep

QUIET = Console(quiet=True)


def parameters(run):
    """All numbers of the policy of a run, and of its optimiser."""
    model, _ = load_checkpoint(run, run.read_config())
    optimiser = getattr(model.policy, "optimizer", None) or model.actor.optimizer
    moments = [entry["exp_avg"] for entry in optimiser.state_dict()["state"].values()]
    return torch.cat([tensor.flatten() for tensor in [*model.policy.state_dict().values(), *moments]])


def monitored(run):
    """Rows of the monitor file, as SB3's `load_results` reads them (that takes pandas)."""
    with run.monitor.open(encoding="utf-8") as file:
        assert json.loads(file.readline().removeprefix("#"))["t_start"] == 0.0
        return list(csv.DictReader(file))


def interrupt_at(monkeypatch, step):
    """Press Ctrl-C at a step of training; the supervisor that was interrupted, in a list."""
    on_step, stopped = Supervisor._on_step, []

    def stepped(supervisor):
        stopped[:] = [supervisor]
        if supervisor.num_timesteps >= step:
            raise KeyboardInterrupt
        return on_step(supervisor)

    monkeypatch.setattr(Supervisor, "_on_step", stepped)
    return stopped


@pytest.fixture
def limited(tiny, is_exhaustive):
    """A configuration, and the number of steps in which each of its 8 worlds ends an episode."""
    if is_exhaustive:
        return tiny, 300
    return change(tiny, env_kwargs={"max_episode_steps": 30, **tiny.env_kwargs}), 30


def test_run_writes_its_files(limited, tmp_path, monkeypatch):
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    monkeypatch.delenv("SB3_LOGDIR", raising=False)
    tiny, length = limited
    run = RunFolder(tmp_path / "run")
    config = change(tiny, max_steps=8 * (length + 1))  # every world ends its first episode
    result = train(config, run, console=QUIET)
    assert result["steps"] >= config.max_steps
    assert not result["is_target_reached"]
    assert run.read_config() == config
    assert run.curve.with_suffix(".png").read_bytes().startswith(b"\x89PNG")
    rows = list(csv.DictReader(run.curve.open(encoding="utf-8")))
    assert int(rows[-1]["steps"]) == result["steps"]
    episodes = monitored(run)
    most = tiny.env_kwargs.get("max_episode_steps", 300)
    assert len(episodes) == int(rows[-1]["episodes"]) >= 8
    assert set(episodes[0]) == {"r", "l", "t", "is_success"}
    assert all(1 <= int(episode["l"]) <= most for episode in episodes)
    assert 1 <= len(list_checkpoints(run.checkpoints)) <= KEPT
    _, policy = load_policy(run)
    observations = make_vector_env(tiny.env, 2).reset(seed=1)[0]
    np.testing.assert_array_equal(policy(observations), result["policy"](observations))
    assert list((tmp_path / "temporary").glob("SB3-*")) == []  # and no others


def test_resumed_run_ends_with_the_bits_of_an_uninterrupted_one(tiny, tmp_path):
    whole, halves = RunFolder(tmp_path / "whole"), RunFolder(tmp_path / "halves")
    longer = change(tiny, max_steps=2 * tiny.max_steps)
    train(longer, whole, console=QUIET)
    train(tiny, halves, console=QUIET)
    result = train(longer, halves, is_resumed=True, console=QUIET)
    assert result["steps"] == longer.max_steps
    assert torch.equal(parameters(whole), parameters(halves))


@pytest.mark.parametrize("tiny", sweep(TINY_ALGORITHMS, ("ppo", HINDSIGHT)), indirect=True)
def test_interrupted_run_keeps_its_checkpoint_and_goes_on(tiny, tmp_path, monkeypatch, capsys):
    run = RunFolder(tmp_path / "run")
    with monkeypatch.context() as patch:
        patch.setattr("agents.supervisor.CHECKPOINT_EVERY", 0.0)
        patch.setattr("agents.supervisor.CHECKPOINT_SHARE", float("inf"))
        interrupt_at(patch, tiny.max_steps - 3 * tiny.num_envs)
        with pytest.raises(Interrupted, match=f"--resume {run.path}"):
            train(tiny, run, console=QUIET)
    kept = int(list_checkpoints(run.checkpoints)[-1].name)
    assert 0 < kept < tiny.max_steps
    capsys.readouterr()
    load_policy(run)  # of the checkpoint: there is no model.zip yet
    assert not run.model.exists()
    assert "model.zip is a model of Stable-Baselines3: code in it runs" in capsys.readouterr().err
    assert train(tiny, run, is_resumed=True, console=QUIET)["steps"] == tiny.max_steps
    assert "model.zip is a model of Stable-Baselines3: code in it runs" in capsys.readouterr().err
    straight = RunFolder(tmp_path / "straight")
    train(tiny, straight, console=QUIET)
    assert torch.equal(parameters(run), parameters(straight))
    points = list(csv.DictReader(run.curve.open(encoding="utf-8")))
    steps, seconds = ([float(point[key]) for point in points] for key in ("steps", "seconds"))
    assert steps == sorted(set(steps))
    assert seconds == sorted(seconds)


def test_interrupted_monitor_file_is_cut_at_the_checkpoint(tmp_path, monkeypatch, limited):
    tiny, length = limited
    run = RunFolder(tmp_path / "run")
    config = change(tiny, max_steps=8 * (length + 20))  # first episodes end at 8 * length, after the checkpoint
    with monkeypatch.context() as patch:
        stopped = interrupt_at(patch, 8 * (length + 10))
        with pytest.raises(Interrupted):
            train(config, run, console=QUIET)
    assert stopped[0]._monitor.closed  # else its last rows would come into the file of the resumed run, some time
    train(config, run, is_resumed=True, console=QUIET)
    straight = RunFolder(tmp_path / "straight")
    train(config, straight, console=QUIET)
    episodes, expected = ([{**row, "t": None} for row in monitored(folder)] for folder in (run, straight))
    assert len(expected) >= 8
    assert episodes == expected  # what the checkpoint does not know is run again, and stands there once


def test_partial_checkpoint_is_not_found(tmp_path):
    (tmp_path / "000000000512").mkdir()
    (tmp_path / "000000001024.partial").mkdir()
    assert [path.name for path in list_checkpoints(tmp_path)] == ["000000000512"]


@pytest.mark.exhaustive
@pytest.mark.train
def test_learns_to_reach_in_a_narrow_box(tmp_path):
    config = make_config("rigid_env/BlockReach-v0", "ppo", seed=0, target=0.7, max_steps=1_500_000, num_envs=128)
    algorithm = {**config.algorithm, "batch_size": 512}
    config = change(config, env_kwargs={"half_width": 4.0}, algorithm=algorithm, threads=1)
    run = RunFolder(tmp_path / "run")
    result = train(config, run, console=QUIET)
    assert result["is_target_reached"]
    assert result["training_success_rate"] >= config.target
    fresh = run_episodes(config.env, result["policy"], range(200), **config.evaluation_arguments)
    assert fresh.success.mean() >= 0.5  # confirmed at 0.7 of 500; six standard errors of 200 below
