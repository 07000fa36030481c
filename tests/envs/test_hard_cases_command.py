"""The command `rigid-env hard-cases`: what it prints, writes and returns."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console
from typer.testing import CliRunner

import physics
from rigid_env.cli import app
from rigid_env.hard_cases import registry
from rigid_env.hard_cases.case import Case, Check, Setting, UnsupportedError, within
from rigid_env.lab.hard_cases.report import Report, measure
from rigid_env.lab.hard_cases.run import Outcome, Status, run_case, run_peer
from rigid_env.lab.measure.peers import load
from rigid_env.launchers.job import Ended
from rigid_env.launchers.place import Place

runner = CliRunner()


def run(*arguments, code=0):
    result = runner.invoke(app, ["hard-cases", *map(str, arguments)])
    assert result.exit_code == code, result.output
    return result.output


def replace_cases(monkeypatch, *runs):
    """Cases that need no kernel."""
    cases = tuple(Case(k + 1, f"case-{k + 1}", "a case", "to hold", run) for k, run in enumerate(runs))
    monkeypatch.setattr(registry, "CASES", cases)
    return cases


def holds(on: Setting):
    return [Check("a number", 1.0, 4.0, "m")]


def fails(on: Setting):
    return [Check("a number", 1.0, 4.0, "m"), Check("another", float("nan"), 4.0)]


def cannot(on: Setting):
    raise UnsupportedError("not at this accuracy")


def fails_when_coarse(on: Setting):
    return [Check("a number", on.dt, 0.02, "s")]


def test_a_small_case_in_the_terminal_and_as_json(tmp_path):
    numbers = tmp_path / "numbers.json"
    output = run("parabola", "--quick", "--json", numbers)
    assert "parabola" in output
    assert "1 holds" in output
    found = json.loads(numbers.read_text())
    assert {"date", "processor", "versions", "git"} <= set(found["machine"])
    assert found["is_complete"] is True
    (row,) = found["rows"]
    assert (row["number"], row["engine"], row["accuracy"], row["dt"]) == (4, "rigid-env", "balanced", 0.01)
    assert row["status"] == "holds"
    assert [check["what"] for check in row["checks"]] == ["error of the place", "error of the velocity"]
    assert all(check["passes"] for check in row["checks"])


def test_a_case_that_fails_is_shown_and_told_to_the_shell(monkeypatch, tmp_path):
    replace_cases(monkeypatch, holds, fails, cannot)
    numbers = tmp_path / "numbers.json"
    output = run("--json", numbers, code=1)
    assert "1 holds, 1 fails, 1 not supported" in output
    assert "not at this accuracy" in output
    rows = json.loads(numbers.read_text())["rows"]
    assert [row["status"] for row in rows] == ["holds", "fails", "not supported"]
    assert rows[1]["checks"][1]["value"] is None  # JSON has no NaN


def test_a_grid_of_steps_shows_where_each_holds_and_only_the_default_step_counts(monkeypatch):
    replace_cases(monkeypatch, fails_when_coarse)
    output = run("--steps", "1e-3,5e-2", "--accuracy", "balanced,precise")
    line = next(line for line in output[output.index("at which steps") :].splitlines() if "case-1" in line)
    assert line.split()[2:] == ["✓", "✓", "✗"] * 2


def test_what_is_done_before_an_interruption_is_kept(monkeypatch, tmp_path):
    def interrupted(on):
        raise KeyboardInterrupt

    replace_cases(monkeypatch, holds, interrupted, holds)
    numbers = tmp_path / "numbers.json"
    output = run("--json", numbers, code=130)
    assert "interrupted" in output
    found = json.loads(numbers.read_text())
    assert found["is_complete"] is False
    assert [row["number"] for row in found["rows"]] == [1]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("zino",), ("'zino'", "zeno")),
        (("--accuracy", "best"), ("'best'", "balanced")),
        (("--dt", "0"), ("dt", "greater than 0")),
        (("--steps", "1e-3,x"), ("steps", "'1e-3,x'")),
    ],
)
def test_mistakes_are_named_before_anything_runs(arguments, words):
    output = " ".join(run(*arguments, code=2).split())
    for word in words:
        assert word in output


def test_the_picture_is_drawn(monkeypatch, tmp_path):
    pytest.importorskip("matplotlib")
    replace_cases(monkeypatch, holds, fails)
    picture = tmp_path / "images" / "picture.png"
    output = run("--steps", "1e-3", "--plot", picture, code=1)
    assert picture.stat().st_size > 1000
    assert str(picture) in output.replace("\n", "")


def test_other_engines_stand_beside_ours(monkeypatch):
    monkeypatch.setattr(registry, "CASES", (Case(1, "case-1", "a case", "to hold", holds, peers=True),))
    found = Report(registry.find(), ("balanced", "precise"))
    (case,) = found.cases
    ours = [run_case(case, Setting(name)) for name in found.accuracies]
    theirs = Outcome(case, "other", "default", 0.01, Status.FAILS, tuple(fails(Setting())))
    found.outcomes = [*ours, theirs]
    assert found.beside == [ours[0], theirs]
    assert not found.has_failed
    found.outcomes = ours
    assert found.beside == []


def test_another_engine_runs_a_case_at_the_first_setting_that_holds():
    pytest.importorskip("mujoco")
    (parabola,) = registry.find(("parabola",))
    outcome = run_peer(parabola, load("mujoco"), Setting(is_thorough=False))
    # Its default integrator is of first order; RK4 is exact on a parabola.
    assert (outcome.status, outcome.engine, outcome.accuracy) == (Status.HOLDS, "mujoco", "RK4")


class Still:
    """Engine in which nothing moves, with more settings for scenes with walls."""

    name, version = "still", "1"

    def settings(self, scene):
        return {name: {"index": k} for k, name in enumerate(("default", "fine", "finest")[: 3 if scene.walls else 2])}

    def open(self, scene, dt, index):
        pos = np.full((1, 3), float(index))
        state = (pos, np.zeros((1, 4)), np.zeros((1, 3)), np.zeros((1, 3)))
        return SimpleNamespace(restart=lambda: None, advance=lambda steps: None, state=lambda: state)


@pytest.mark.parametrize(
    ("walls", "must_be", "outcome"),
    [((), 1, "fine"), ((), 9, "default"), ((physics.HalfSpace((0, 1, 0)),), 2, "finest")],
)
def test_another_engine_is_tried_at_all_settings_that_it_has_for_the_scene(walls, must_be, outcome):
    tried = []

    def place(on: Setting):
        tried.append(on.world(physics.Scene([physics.Sphere(1.0, 1.0)], walls, [physics.Contact()])).pos[0, 0, 0])
        return [within("place", tried[-1], must_be, 0.0)]

    found = run_peer(Case(1, "a", "a", "a", place), Still(), Setting())
    assert (found.engine, found.accuracy) == ("still", outcome)
    assert tried == list(range(len(tried)))
    assert len(tried) == (3 if walls else 2)


def test_what_another_engine_cannot_express_is_said():
    pytest.importorskip("mujoco")
    (pushed,) = registry.find(("tips-when-pushed",))
    outcome = run_peer(pushed, load("mujoco"), Setting(is_thorough=False))
    assert outcome.status is Status.UNSUPPORTED
    assert "wrench" in outcome.reason


@pytest.mark.exhaustive
def test_cases_spread_over_processes_have_the_same_outcomes(tmp_path):
    here, there = tmp_path / "here.json", tmp_path / "there.json"
    run("parabola", "--quick", "--steps", "0.02", "--json", here)
    run("parabola", "--quick", "--steps", "0.02", "--launcher", "local", "--jobs", "1", "--json", there)
    rows, spread = ([{**row, "seconds": 0} for row in json.loads(path.read_text())["rows"]] for path in (here, there))
    assert rows == spread
    assert len(rows) == 2


def test_cases_are_printed_as_lines_for_a_shell(tmp_path):
    numbers = tmp_path / "numbers.json"
    lines = run("parabola", "--quick", "--steps", "0.02", "--launcher", "print", "--json", numbers).splitlines()
    assert [line.split()[:7] for line in lines] == [
        ["rigid-env", "hard-cases", "4", "--accuracy", "balanced", "--dt", dt] for dt in ("0.01", "0.02")
    ]
    assert not numbers.exists()
    run(*lines[0].split()[2:])  # a line runs
    assert (tmp_path / "numbers" / "4-balanced-0.01.json").exists()


def test_a_run_that_is_lost_fails_and_says_why(monkeypatch, tmp_path):
    report = Report(replace_cases(monkeypatch, holds))

    class Losing(Place):
        def run(self, jobs):
            return (Ended(job.name, None, "its process ended") for job in jobs)

    measure(report, Console(quiet=True), Losing("local", tmp_path))
    (outcome,) = report.outcomes
    assert outcome.status is Status.FAILS
    assert outcome.reason == "its process ended"


def test_options_of_launchers_are_refused_where_they_do_nothing(tmp_path):
    assert "peers is True with a launcher" in run("parabola", "--peers", "--launcher", "local", code=2)
    assert "address is '10.0.0.1' without a launcher" in run("parabola", "--address", "10.0.0.1", code=2)
    assert "launcher is 'cloud'" in run("parabola", "--launcher", "cloud", code=2)
