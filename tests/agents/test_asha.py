"""Trials that a scheduler stops: at a checkpoint, told as such, and the same command goes on."""

from __future__ import annotations

import json
import pickle
from functools import partial
from pathlib import Path

import pytest
import typer
import yaml
from rich.console import Console
from typer.testing import CliRunner

pytest.importorskip("stable_baselines3")

from agents import asha, supervisor
from agents import run as runs
from agents import sweep as program
from agents.asha import LOG, AskJudge, Judge, make_scheduler, read_stopped, stop_message
from agents.curve import CurvePoint
from agents.sweep import make_table, sweep
from agents.trials import make_trials
from agents.worker import make_job
from rigid_env.launchers.job import Ended, Stopped, run_job
from tests.agents.conftest import NUM_ENVS, ROLLOUT, TINY_ALGORITHMS

QUIET = Console(quiet=True)
REACH = "rigid_env/BlockReach-v0"
STEPS = 4 * NUM_ENVS * ROLLOUT


class Halves:
    """A scheduler that stops a trial which is worse than the first at the same number of steps."""

    STOP = "stop"

    def __init__(self, max_steps: int):
        self.max_steps, self.first = max_steps, {}

    def on_trial_add(self, controller, trial):
        pass

    def on_trial_result(self, controller, trial, seen):
        first = self.first.setdefault(seen["steps"], seen["success_rate"])
        return self.STOP if seen["success_rate"] < first else "go on"


@pytest.fixture
def trials(tmp_path):
    entry = {
        "num_envs": NUM_ENVS, "max_steps": STEPS, "target": 1.0, "accuracy": {"tolerance": 1e-3},
        "env_kwargs": {"max_episode_steps": 5}, "algorithm": TINY_ALGORITHMS["ppo"],
    }  # fmt: skip
    path = tmp_path / "tiny.yml"
    path.write_text(yaml.safe_dump({REACH: {"ppo": entry}}), encoding="utf-8")
    return make_trials([REACH], [0, 1], {}, None, path)


@pytest.fixture
def short(monkeypatch):
    monkeypatch.setattr(runs, "EVALUATION_EPISODES", 4)
    monkeypatch.setattr(supervisor, "POINT_EVERY", 0.0)
    monkeypatch.setattr(supervisor, "CHECKPOINT_EVERY", 0.0)
    monkeypatch.setattr(supervisor, "CHECKPOINT_SHARE", float("inf"))  # a checkpoint after each rollout


def point(steps: int, success_rate: float) -> CurvePoint:
    return CurvePoint(steps, 1.0, 1, success_rate, 0.0, 5.0)


def judged(trials, jobs, folder, at_once, address=None, report=None):
    """A launcher without processes or Ray."""
    stopped, by_name = read_stopped(folder), {trial.name: trial for trial in trials}
    for job in jobs:
        if job.name in stopped:
            yield Ended(job.name, None, stopped=stop_message(stopped[job.name]))
        else:
            trial = by_name[job.name]
            yield run_job(make_job(trial, folder, AskJudge(report, trial.name, trial.config)))


def test_a_judge_made_anew_knows_what_it_was_told(trials, tmp_path):
    good, bad = (trial.name for trial in trials)
    judge = Judge(trials, tmp_path, Halves)
    assert not judge.report(good, 100, 0.5, False)
    assert not judge.report(bad, 100, 0.5, False)
    assert judge.report(bad, 200, 0.1, False) is False  # the first that is there
    with (tmp_path / LOG).open("a", encoding="utf-8") as file:
        file.write('{"trial": "cut o')  # by a crash
    judge = Judge(trials, tmp_path, Halves)
    assert judge.report(good, 200, 0.05, False)
    assert judge.report(good, 300, 1.0, False)  # stopped is stopped
    assert read_stopped(tmp_path) == {good: 200}
    assert len((tmp_path / LOG).read_text(encoding="utf-8").splitlines()) == 4


def test_a_trial_that_is_over_is_not_stopped(trials, tmp_path):
    good, bad = trials
    judge = Judge(trials, tmp_path, Halves)
    for steps in (100, STEPS):
        AskJudge(judge.report, good.name, good.config)(tmp_path, point(steps, 0.5))
    ask = AskJudge(judge.report, bad.name, bad.config)
    ask(tmp_path, point(STEPS, 0.1))
    with pytest.raises(Stopped, match="stopped by asha at 100 steps"):
        ask(tmp_path, point(100, 0.1))


def test_a_trial_without_an_episode_is_not_compared(trials, tmp_path):
    judge = Judge(trials, tmp_path, Halves)
    AskJudge(judge.report, trials[0].name, trials[0].config)(tmp_path, CurvePoint(0, 0.0, 0, *[float("nan")] * 3))
    assert (tmp_path / LOG).read_text(encoding="utf-8") == ""


def test_environments_are_judged_apart(trials, tmp_path):
    other = make_trials(["rigid_env/BlockReorient-v0"], [0], {})
    made = []

    def make(max_steps):
        made.append(Halves(max_steps))
        return made[-1]

    judge = Judge([*trials, *other], tmp_path, make)
    assert sorted(each.max_steps for each in made) == [STEPS, other[0].config.max_steps]
    assert not judge.report(trials[0].name, 100, 0.9, False)
    assert not judge.report(other[0].name, 100, 0.1, False)


def test_a_callback_can_be_sent_to_a_worker(trials):
    ask = AskJudge(partial(asha._report, "a handle"), trials[0].name, trials[0].config)
    sent = pickle.loads(pickle.dumps(ask))
    assert (sent.name, sent.config) == (ask.name, ask.config)
    assert sent.report.args == ("a handle",)


def test_a_stopped_trial_is_told_and_the_same_command_goes_on(trials, tmp_path, short):
    """The second trial is stopped at its second checkpoint; a sweep without the scheduler goes on with it."""
    out = tmp_path / "sweep"
    stopped = trials[1].name

    class Scheduler(Halves):
        def on_trial_result(self, controller, trial, seen):
            return self.STOP if trial.trial_id == stopped and seen["steps"] >= STEPS // 2 else "go on"

    out.mkdir()
    outcomes = sweep(trials, out, partial(judged, trials, report=Judge(trials, out, Scheduler).report), 1, None, QUIET)
    assert outcomes[0].result["steps"] == STEPS
    assert outcomes[1] == Ended(stopped, None, stopped=f"stopped by asha at {STEPS // 2} steps")
    console = Console(width=120)
    with console.capture() as shown:
        console.print(make_table(outcomes))
    assert f"{stopped} stopped by asha at {STEPS // 2} steps" in " ".join(shown.get().split())

    def refused(*row):
        raise AssertionError("nothing is left to run")

    assert sweep(trials, out, partial(judged, trials, report=refused), 1, None, QUIET) == outcomes

    def in_turn(jobs, folder, at_once, address=None):
        return map(run_job, jobs)

    straight = tmp_path / "straight"
    assert [each.result["steps"] for each in sweep(trials, out, in_turn, 1, None, QUIET)] == [STEPS, STEPS]
    sweep(trials, straight, in_turn, 1, None, QUIET)
    for trial in trials:
        assert evaluation(out, trial.name) == evaluation(straight, trial.name)


def evaluation(out: Path, name: str) -> dict:
    told = json.loads((out / name / "evaluation.json").read_text(encoding="utf-8"))
    return {key: value for key, value in told.items() if key != "seconds"}


def test_the_command_refuses_a_scheduler_without_effect(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    app = typer.Typer()
    app.command()(program.main)
    for options, message in (
        (["--scheduler", "asha"], "scheduler is 'asha' with the launcher 'local'; allowed is --launcher ray with it"),
        (["--scheduler", "median", "--launcher", "ray"], "scheduler is 'median'; allowed are asha"),
    ):
        done = CliRunner().invoke(app, [REACH, *options])
        assert done.exit_code == 2, done.output
        assert message in " ".join(done.output.replace("│", " ").split())
    assert list(tmp_path.iterdir()) == []


@pytest.mark.exhaustive
def test_tune_compares_trials_at_three_places():
    pytest.importorskip("ray")
    scheduler = make_scheduler(6400)
    assert sorted(milestone for milestone, _ in scheduler._brackets[0]._rungs)[:3] == [100, 400, 1600]


@pytest.mark.exhaustive
def test_asha_stops_a_trial_that_learns_nothing(tmp_path):
    """The good one runs first, since only what was there before is compared."""
    pytest.importorskip("ray")
    grid = {"algorithm.learning_rate": [1e-3, 1e-9], "max_steps": [1_600_000], "target": [0.5]}
    trials = make_trials([REACH], [0], grid)
    launch = partial(asha.launch, trials)
    good, bad = outcomes = sweep(trials, tmp_path, launch, 1, None, QUIET)
    assert good.result["steps"] > 400_000
    assert bad.result is None
    assert bad.error == ""
    assert bad.stopped.startswith("stopped by asha at ")
    assert 25_000 <= read_stopped(tmp_path)[bad.name] < 1_600_000
    assert sweep(trials, tmp_path, launch, 1, None, QUIET) == outcomes
