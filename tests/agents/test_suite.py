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
    done = CliRunner().invoke(app, [*map(str, options)], env={"COLUMNS": "200"})
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
    assert "code in" not in output  # of models that it has made
    here.clear()
    assert run(*options).endswith(output.rpartition(" suite ")[2])
    assert "BlockCurl-v0 ppo 1 " in run(*told(hyperparameters, tmp_path, "1"))  # of one seed
    assert here == []  # all is there


def test_results_lie_beside_the_runs_and_replaced_ones_are_told(hyperparameters, here, tmp_path):
    options = ["--hyperparameters", hyperparameters, "--seeds", "0", "--out", tmp_path / "o"]
    assert "replaced" not in run(*options)
    written = tmp_path / "o" / "results" / "BlockCurl-v0-ppo-s0.json"
    kept = json.loads(written.read_text())
    other = {**kept, "evaluation": {**kept["evaluation"], "success_rate": 0.75, "successes": 3}}
    other["machine"] = {"git": {"commit": "abcdef0123456789"}, "date": "2026-01-02T03:04:05"}
    written.write_text(json.dumps(other))
    output = run(*options)
    rate = f"{kept['evaluation']['success_rate']:.1%}"
    assert f"is replaced: it had success 75.0%, made at abcdef0123 on 2026-01-02; it is {rate} now" in output
    assert json.loads(written.read_text())["evaluation"] == kept["evaluation"]


def test_code_in_models_of_an_earlier_command_is_told_once(hyperparameters, here, tmp_path):
    options = told(hyperparameters, tmp_path, "0")
    run(*options)
    folder = tmp_path / "o" / "BlockCurl-v0-ppo-s0"
    for path in (folder / "result.json", folder / "judged.json", tmp_path / "r" / f"{folder.name}.json"):
        path.unlink()
    here.clear()
    output = run(*options)
    assert len(here) == 3  # the trial goes on from its checkpoint, and is judged twice
    assert output.count("code in") == 1
    assert "o holds models of Stable-Baselines3: code in them runs" in output


def test_ctrl_c_says_what_goes_on(hyperparameters, here, tmp_path, monkeypatch):
    def interrupted(*given):
        raise KeyboardInterrupt

    options = told(hyperparameters, tmp_path, "0")
    monkeypatch.setattr(program, "judge_trial", interrupted)
    output = run(*options, code=130)
    assert "1 trial to run" in output
    assert "goes on, with the policies that are not judged yet" in output
    monkeypatch.setattr(program, "sweep", interrupted)
    assert "goes on, from the last checkpoint of each trial" in run(*options, code=130)


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
    assert "BlockCurl-v0 ppo at fast 1 " in run(*options, "--accuracy", "fast")
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
    output = run("mine:no/Such-v0", *options, code=2).replace("│ ", "")
    assert "env is 'mine:no/Such-v0'; allowed are those of tiny.yml" in output
    assert "another file, --hyperparameters FILE, may have an entry 'no/Such-v0'" in output


@pytest.mark.parametrize("option", ["--out", "--results"])
def test_folders_are_checked_before_any_trial(option, hyperparameters, here, tmp_path):
    (tmp_path / "file").touch()
    options = told(hyperparameters, tmp_path, "0")
    output = run(*options, option, tmp_path / "file", code=2).replace("│ ", "")
    assert f"Invalid value for '{option}'" in output
    assert "allowed are folders" in output
    output = run(*options, option, "/proc/none/x", code=2).replace("│ ", "")
    assert f"{option} is '/proc/none/x', which cannot be made" in output
    assert here == []
