"""The suite's program: what is trained, judged and written, and that it goes on where it was ended."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import typer
import yaml
from rich.console import Console
from typer.testing import CliRunner

pytest.importorskip("stable_baselines3")

from agents import run as runs
from agents import suite as program
from rigid_env.launchers.job import run_job
from rigid_env.launchers.place import Place
from tests.agents.conftest import NUM_ENVS, ROLLOUT, TINY_ALGORITHMS

CURL = "rigid_env/BlockCurl-v0"
QUIET = Console(quiet=True)


@pytest.fixture
def hyperparameters(tmp_path) -> Path:
    entry = {
        "num_envs": NUM_ENVS,
        "max_steps": 2 * NUM_ENVS * ROLLOUT,
        "target": 1.0,
        "env_kwargs": {"max_episode_steps": 5},
        "algorithm": {"learning_rate": 1e-3, **TINY_ALGORITHMS["ppo"]},
    }
    path = tmp_path / "tiny.yml"
    path.write_text(yaml.safe_dump({CURL: {"ppo": entry}}), encoding="utf-8")
    return path


@pytest.fixture
def here(monkeypatch):
    """A place that runs jobs in this process, with few episodes; lists the names of the jobs."""
    seen = []

    def launch(jobs, folder, at_once, address=None):
        seen.extend(job.name for job in jobs)
        yield from map(run_job, jobs)

    monkeypatch.setattr(Place, "launch", property(lambda self: launch))
    monkeypatch.setattr(runs, "EVALUATION_EPISODES", 4)
    monkeypatch.setattr(program, "EVALUATION_EPISODES", 4)
    monkeypatch.setattr(program, "JUDGED_EPISODES", 2)
    monkeypatch.setattr(program, "PRESETS", ["fast", "balanced"])
    return seen


def run(*options, code=0):
    app = typer.Typer()
    app.command()(program.main)
    done = CliRunner().invoke(app, [*map(str, options)])
    assert done.exit_code == code, done.output
    return " ".join(done.output.split())


def told(hyperparameters, folder, seeds) -> list:
    return [
        "--hyperparameters", hyperparameters, "--seeds", seeds, "--out", folder / "o", "--results", folder / "r",
    ]  # fmt: skip


def test_it_trains_judges_and_writes_once(hyperparameters, here, tmp_path):
    options = told(hyperparameters, tmp_path, "0,1")
    output = run(*options)
    assert here == [
        "BlockCurl-v0-ppo-s0", "BlockCurl-v0-ppo-s1",
        "judge BlockCurl-v0-ppo-s0 at fast", "judge BlockCurl-v0-ppo-s0 at balanced",
        "judge BlockCurl-v0-ppo-s1 at fast", "judge BlockCurl-v0-ppo-s1 at balanced", f"floors of {CURL}",
    ]  # fmt: skip
    assert "BlockCurl-v0" in output
    kept = json.loads((tmp_path / "r" / "BlockCurl-v0-ppo-s0.json").read_text())
    assert set(kept["judged"]) == {"fast", "balanced"}
    assert kept["evaluation"]["episodes"] == 4
    assert kept["steps"] == 2 * NUM_ENVS * ROLLOUT == kept["curve"][-1]["steps"]
    assert {"processor", "versions"} <= set(kept["machine"])
    floors = json.loads((tmp_path / "r" / "BlockCurl-v0-floors.json").read_text())["floors"]
    assert floors["controller"]["success_rate"] == 1.0
    here.clear()
    assert run(*options).endswith(output.rpartition("suite")[2])
    assert here == []  # all is there


def test_a_preset_that_is_judged_is_not_judged_again(hyperparameters, here, tmp_path, monkeypatch):
    """An error at one preset leaves what the others have found; a policy that was trained anew is judged anew."""

    def fails(env, policy, episodes, seed, **arguments):
        if arguments["accuracy"] == "balanced":
            raise OSError("no more power")
        return evaluate(env, policy, episodes, seed, **arguments)

    evaluate = program.evaluate
    options, written = told(hyperparameters, tmp_path, "0"), tmp_path / "r" / "BlockCurl-v0-ppo-s0.json"
    with monkeypatch.context() as patch:
        patch.setattr(program, "evaluate", fails)
        patch.setattr(program, "measure_floors", lambda env: {})
        assert "at balanced: OSError: no more power" in run(*options, code=1)
    assert not written.exists()
    here.clear()
    run(*options)
    assert here == ["judge BlockCurl-v0-ppo-s0 at balanced"]
    assert list(json.loads(written.read_text())["judged"]) == ["fast", "balanced"]
    trial = program.make_trials([CURL], [0], {}, None, hyperparameters)[0]
    assert program.Judgements(tmp_path / "o", trial, {"evaluation": "another"}).missing == ["fast", "balanced"]


def test_trials_at_presets_stand_beside_the_others(hyperparameters, here, tmp_path):
    options = told(hyperparameters, tmp_path, "0")
    run(*options, "--accuracy", "fast")
    found, _ = program.read_results(tmp_path / "r", CURL)
    assert [(each["accuracy"], each["is_default"]) for each in found] == [("fast", False)]


def test_results_of_seeds_are_summed_up():
    found = [
        {"evaluation": {"success_rate": rate}, "steps": 1000 * k, "training_seconds": 1.0 * k}
        for k, rate in enumerate((0.1, 0.9, 0.92, 1.0), start=1)
    ]
    whole = program.aggregate(found)
    assert (whole["seeds"], whole["lowest"], whole["steps"]) == (4, 0.1, 2500)
    assert whole["success"] == pytest.approx(0.91)
    low, high = whole["interval"]
    assert 0.1 <= low < 0.91 < high <= 1.0


def test_mistakes_are_named(hyperparameters, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    options = ["--hyperparameters", hyperparameters]
    assert "launcher is 'print', which runs nothing" in run(*options, "--launcher", "print", code=2).replace("│ ", "")
    assert "env is 'no/Such-v0'" in run("no/Such-v0", *options, code=2)
    assert "seeds is 'x'" in run(*options, "--seeds", "x", code=2)
