"""Time to learn beside a user of MuJoCo: the end of a training, and the command. No test asserts a time."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

pytest.importorskip("mujoco")
pytest.importorskip("stable_baselines3")

from agents.config import make_config
from agents.curve import WINDOW
from benchmarks import learning
from rigid_env.lab.measure.timing import Spread


def told(successes):
    """Locals of a rollout of Stable-Baselines3 at a step in which one episode has ended for each of `successes`."""
    infos = [{"is_success": bool(success)} for success in successes]
    return {"dones": np.ones(len(infos), dtype=bool), "infos": infos}


def watch_at(rate):
    watch = learning.Watch(rate)
    watch.model = SimpleNamespace(num_timesteps=0)
    watch._on_training_start()
    return watch


def test_training_ends_with_the_first_window_that_reaches_the_rate():
    watch = watch_at(0.95)
    failures, needed = WINDOW // 2, int(0.95 * WINDOW)
    watch.locals = told([False] * failures)
    assert watch.on_step()
    watch.locals = told([True] * (needed - 1))
    assert watch.on_step()
    watch.locals = told([True])
    assert not watch.on_step()
    found = watch.result()
    assert found.is_reached
    assert found.rate == 0.95
    assert found.episodes == failures + needed


def test_a_short_window_and_worlds_in_mid_episode_do_not_count():
    watch = watch_at(0.95)
    watch.locals = told([True] * (WINDOW - 1))
    assert watch.on_step()
    watch.locals = {**told([True] * WINDOW), "dones": np.zeros(WINDOW, dtype=bool)}
    assert watch.on_step()
    assert not watch.result().is_reached
    watch.locals = told([True])
    assert not watch.on_step()
    assert watch.result().episodes == WINDOW


def test_the_user_of_mujoco_has_our_network_and_a_rollout_of_its_own():
    config = make_config("rigid_env/BlockReach-v0", "ppo", 3)
    peer = learning.peer_config(config)
    assert peer.num_envs == 64
    assert (peer.algorithm["n_steps"], peer.algorithm["batch_size"]) == (128, 1024)
    others = {key: value for key, value in peer.algorithm.items() if key not in learning.PEER_ROLLOUT}
    assert others == {key: config.algorithm[key] for key in others}
    assert peer.seed == config.seed


def test_the_ratio_is_that_of_the_peer_to_ours_seed_by_seed():
    cost = [learning.Training(10.0, 8.0, 1000, 600, 0.95, True), learning.Training(20.0, 10.0, 2000, 600, 0.95, True)]
    theirs = [learning.Training(60.0, 40.0, 900, 600, 0.95, True), learning.Training(80.0, 60.0, 900, 600, 0.95, True)]
    found = learning.summarise({learning.OURS: cost, "best": theirs}, "best")
    assert found["seconds"]["ratio"] == Spread((6.0, 4.0)).to_dict()
    assert found["cpu_seconds"]["ratio"]["median"] == 5.5
    assert found["steps"]["ours"]["samples"] == [1000, 2000]


@pytest.mark.exhaustive
def test_a_short_run_of_the_command_writes_both_sides(tmp_path):
    app, file = typer.Typer(), tmp_path / "learning.json"
    app.command()(learning.main)
    options = ["--seeds", "1", "--max-steps", "100", "--threads", "1", "--peer", "best", "--json", str(file)]
    found = CliRunner().invoke(app, options)
    assert found.exit_code == 0, found.output
    kept = json.loads(file.read_text())
    assert {side: len(rows) for side, rows in kept["trainings"].items()} == {"ours": 1, "best": 1}
    (ours,), (theirs,) = kept["trainings"].values()
    assert ours["steps"] == 512 * 32
    assert theirs["steps"] == 64 * 128
    assert not ours["is_reached"]
    assert CliRunner().invoke(app, ["--peer", "good"]).exit_code != 0
