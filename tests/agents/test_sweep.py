"""Sweeps: names of trials, what is done again, and the same results wherever they run."""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest
import typer
import yaml
from rich.console import Console
from typer.testing import CliRunner

pytest.importorskip("stable_baselines3")

from agents import run as runs
from agents import sweep as program
from agents import train, worker
from agents.config import RunInUse
from agents.run import run_or_resume
from agents.sweep import complete, sweep
from agents.training import Interrupted
from agents.trials import make_trials, parse_grid, parse_seeds
from agents.worker import make_job, run_trial
from rigid_env.launchers import local, printed
from rigid_env.launchers.job import Ended, run_job
from tests.agents.conftest import NUM_ENVS, ROLLOUT, TINY_ALGORITHMS

QUIET = Console(quiet=True)
REACH = "rigid_env/BlockReach-v0"


@pytest.fixture
def hyperparameters(tmp_path) -> Path:
    entry = {
        "num_envs": NUM_ENVS,
        "max_steps": 2 * NUM_ENVS * ROLLOUT,
        "target": 1.0,
        "accuracy": {"tolerance": 1e-3},
        "env_kwargs": {"max_episode_steps": 5},
        "algorithm": {"learning_rate": 1e-3, **TINY_ALGORITHMS["ppo"]},
    }
    path = tmp_path / "tiny.yml"
    path.write_text(yaml.safe_dump({REACH: {"ppo": entry}}), encoding="utf-8")
    return path


@pytest.fixture
def trials(hyperparameters):
    return make_trials([REACH], [0, 1], {"algorithm.learning_rate": [1e-3, 3e-4]}, None, hyperparameters)


@pytest.fixture
def short(monkeypatch):
    monkeypatch.setattr(runs, "EVALUATION_EPISODES", 4)


def in_turn(jobs, folder, at_once, address=None):
    """A launcher without processes."""
    yield from map(run_job, jobs)


def without_times(value):
    """Results without what a clock says, nor the place of the folder."""
    if isinstance(value, dict):
        return {k: without_times(v) for k, v in value.items() if "second" not in k and k != "run"}
    return value


def results(out, trials) -> str:
    return json.dumps({name: without_times(each) for name, each in complete(trials, out).items()})


def test_trials_are_named_by_their_settings(trials, hyperparameters):
    assert [trial.name for trial in trials] == [
        f"BlockReach-v0-ppo-algorithm.learning_rate={rate}-s{seed}" for rate in ("0.001", "0.0003") for seed in (0, 1)
    ]
    wide = make_trials([REACH], [0], {"algorithm.policy_kwargs.net_arch": [[8], [64] * 9]}, None, hyperparameters)
    assert len({trial.name for trial in wide}) == 2
    assert all("/" not in trial.name and len(trial.name) < 80 for trial in wide)
    with pytest.raises(ValueError, match="twice in the sweep"):
        make_trials([REACH], [0, 0], {}, None, hyperparameters)


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("a=1e-3,3e-4", [1e-3, 3e-4]),
        ("a=[8, 8],[16]", [[8, 8], [16]]),
        ("a={x: 1, y: 2},none", [{"x": 1, "y": 2}, "none"]),
    ],
)
def test_a_grid_has_values_with_commas(text, values):
    assert parse_grid([text]) == {"a": values}


def test_seeds_are_numbers_and_ranges():
    assert parse_seeds("0-4") == [0, 1, 2, 3, 4]
    assert parse_seeds("1,3,7-9") == [1, 3, 7, 8, 9]
    for text in ("", "a", "3-1", "1,,2", "-1"):
        with pytest.raises(ValueError, match="seeds is"):
            parse_seeds(text)


def test_a_sweep_goes_on_where_it_was_ended(trials, tmp_path, short, monkeypatch):
    def ended(left, folder, at_once, address=None):
        yield from in_turn(left[:2], folder, at_once)
        raise KeyboardInterrupt

    out = tmp_path / "sweep"
    with pytest.raises(KeyboardInterrupt):
        sweep(trials, out, ended, 1, None, QUIET)
    seen = []

    def watched(left, folder, at_once, address=None):
        seen.extend(job.name for job in left)
        return in_turn(left, folder, at_once)

    outcomes = sweep(trials, out, watched, 1, None, QUIET)
    assert seen == [trial.name for trial in trials[2:]]
    assert [each.name for each in outcomes] == [trial.name for trial in trials]
    assert all(each.result["steps"] == trials[0].config.max_steps for each in outcomes)
    assert sweep(trials, out, ended, 1, None, QUIET) == outcomes  # complete: nothing is launched


def test_a_failed_trial_is_told_and_the_others_run(hyperparameters, tmp_path, short):
    trials = make_trials([REACH], [0], {"algorithm.gamm": [1]}, None, hyperparameters)
    trials += make_trials([REACH], [0], {}, None, hyperparameters)
    failed, good = sweep(trials, tmp_path / "sweep", in_turn, 1, None, QUIET)
    assert failed == Ended(failed.name, None, failed.error)
    assert "algorithm.gamm is no argument of ppo" in failed.error
    assert good.result is not None


def test_a_printed_line_runs_the_trial(trials, tmp_path, short, capsys, monkeypatch):
    here, there = tmp_path / "here", tmp_path / "there"
    assert list(printed.launch([make_job(trials[0], there)], there, 1)) == []
    line = shlex.split(capsys.readouterr().out)
    assert line[:3] == ["python", "-m", "agents.train"]
    app = typer.Typer()
    app.command()(train.main)
    done = CliRunner().invoke(app, line[3:])
    assert done.exit_code == 0, done.output
    sweep(trials[:1], here, in_turn, 1, None, QUIET)
    assert results(here, trials) == results(there, trials)


def test_the_command_refuses_what_it_does_not_know(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    app = typer.Typer()
    app.command()(program.main)
    for options, message in (
        (["--launcher", "cloud"], "launcher is 'cloud'; allowed are local, ray, submitit, print"),
        (["--seeds", "x"], "seeds is 'x'"),
        (["--set", "algorithm.gamma"], "--set is 'algorithm.gamma'; allowed is NAME=VALUE"),
        (["--accuracy", "sloppy"], "sloppy"),
        (["--set", "seed=3"], "--set names seed; allowed is --seed"),
        (["--set", "algorithm.gamm=0.9"], "algorithm.gamm is no argument of ppo; allowed are gamma"),
        (["--set", "env_kwargs.half_widt=9"], "unexpected keyword argument 'half_widt'"),
        (["--out", "/proc/none/x"], "--out is '/proc/none/x', which cannot be made"),
    ):
        done = CliRunner().invoke(app, [REACH, *options])
        assert done.exit_code == 2, done.output
        assert message in " ".join(done.output.replace("│", " ").split())
    assert list(tmp_path.iterdir()) == []


@pytest.mark.exhaustive
def test_processes_of_this_machine_have_the_same_results(trials, tmp_path):
    one, two = tmp_path / "one", tmp_path / "two"
    sweep(trials, one, in_turn, 1, None, QUIET)
    sweep(trials, two, local.launch, 2, None, QUIET)
    assert results(one, trials) == results(two, trials)


@pytest.mark.exhaustive
def test_a_process_that_is_killed_costs_no_trial(trials, tmp_path):
    """One worker is killed in its first trial."""
    out = tmp_path / "sweep"
    killed = []

    def kill_one():
        children = f"pgrep -P {os.getpid()} -f spawn_main"
        while not killed:
            found = subprocess.run(children, shell=True, capture_output=True, text=True, check=False).stdout.split()
            if found:
                time.sleep(2.0)
                subprocess.run(["kill", "-9", found[-1]], check=False)
                killed.append(found[-1])
            time.sleep(0.05)

    threading.Thread(target=kill_one, daemon=True).start()
    outcomes = sweep(trials, out, local.launch, 1, None, QUIET)
    assert killed
    assert all(each.result is not None for each in outcomes)
    straight = tmp_path / "straight"
    sweep(trials, straight, in_turn, 1, None, QUIET)
    assert results(out, trials) == results(straight, trials)


@pytest.mark.exhaustive
def test_processes_end_with_the_program_that_started_them(hyperparameters, tmp_path):
    command = [sys.executable, "-m", "agents.sweep", REACH, "--seeds", "0-1", "--set", "max_steps=10000000",
               "--hyperparameters", str(hyperparameters), "--out", str(tmp_path / "sweep")]  # fmt: skip
    parent = subprocess.Popen(command, stdout=subprocess.DEVNULL)
    children: list[str] = []
    limit = time.monotonic() + 60
    while len(children) < 2 and time.monotonic() < limit:
        time.sleep(0.2)
        found = subprocess.run(["pgrep", "-P", str(parent.pid), "-f", "spawn_main"], capture_output=True, text=True)
        children = found.stdout.split()
    time.sleep(3.0)  # both have begun
    parent.kill()
    parent.wait()
    while any(Path(f"/proc/{child}").exists() for child in children) and time.monotonic() < limit:
        time.sleep(0.2)
    assert len(children) == 2
    assert not any(Path(f"/proc/{child}").exists() for child in children)


@pytest.mark.exhaustive
def test_a_lost_node_of_a_ray_cluster_costs_no_trial(hyperparameters, tmp_path):
    ray = pytest.importorskip("ray")
    from ray.cluster_utils import Cluster

    from rigid_env.launchers import ray_tasks

    grid = {"algorithm.learning_rate": [1e-3, 3e-4], "max_steps": [20_000]}
    trials = make_trials([REACH], range(4), grid, None, hyperparameters)
    straight, out = tmp_path / "straight", tmp_path / "sweep"
    sweep(trials, straight, in_turn, 1, None, QUIET)
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    node, removed = cluster.add_node(num_cpus=1), []

    def remove():
        while len(complete(trials, out)) < 2:
            time.sleep(0.1)
        cluster.remove_node(node, allow_graceful=False)
        removed.append(len(complete(trials, out)))

    ray.init(address=cluster.address, log_to_driver=False)
    try:
        threading.Thread(target=remove, daemon=True).start()
        outcomes = sweep(trials, out, ray_tasks.launch, 2, cluster.address, QUIET)
    finally:
        ray.shutdown()
        cluster.shutdown()
    assert removed[0] < len(trials)
    assert all(each.result is not None for each in outcomes)
    assert results(out, trials) == results(straight, trials)


@pytest.mark.exhaustive
def test_local_jobs_of_submitit_have_the_same_results(trials, tmp_path):
    pytest.importorskip("submitit")
    from rigid_env.launchers import submitit_jobs

    one, two = tmp_path / "one", tmp_path / "two"
    sweep(trials, one, in_turn, 1, None, QUIET)
    sweep(trials, two, submitit_jobs.launch, 2, "local", QUIET)
    assert results(one, trials) == results(two, trials)


def test_ctrl_c_in_a_worker_ends_the_sweep_and_fails_no_trial(trials, tmp_path, monkeypatch):
    def interrupted(*given, **named):
        raise Interrupted("go on with ...")

    monkeypatch.setattr(worker, "run_or_resume", interrupted)
    with pytest.raises(KeyboardInterrupt, match="go on with"):
        sweep(trials, tmp_path, in_turn, 1, None, QUIET)


def test_a_run_in_use_is_not_written_into(trials, tmp_path, short):
    (trial, *_) = trials
    run_or_resume(trial.config, tmp_path / trial.name, console=QUIET)
    folder = runs.RunFolder(tmp_path / trial.name)
    folder.result.unlink()
    with folder.locked(), pytest.raises(RunInUse, match="which another process works on"):
        run_trial(trial.name, trial.config, str(tmp_path), 0.0)
    assert run_trial(trial.name, trial.config, str(tmp_path))["steps"] == trial.config.max_steps
