"""`rigid-env accuracy`: what it measures, shows, writes and draws, and what it says about mistakes."""

from __future__ import annotations

import io
import json
import math
import sys
from dataclasses import replace
from types import SimpleNamespace

import pytest
from rich.console import Console
from typer.testing import CliRunner

import physics
from physics import Frontier, FrontierPoint
from physics.work_precision import run as frontier_run
from rigid_env.cli import app
from rigid_env.lab.measure import accuracy, accuracy_jobs, accuracy_report, peers
from rigid_env.lab.measure.accuracy import QUICK, Found, Job, Ladder
from rigid_env.lab.measure.accuracy_table import answers, goals, make_table, summary
from rigid_env.lab.measure.truths import CASES
from rigid_env.launchers.job import Ended

pytestmark = pytest.mark.interpreted

runner = CliRunner()


def run(*arguments, code=0):
    result = runner.invoke(app, ["accuracy", *map(str, arguments)])
    assert result.exit_code == code, result.output
    return result.output


def found(points, own_error=0.0, is_complete=True, **job) -> Found:
    """A measurement of the slide, in which the goals are 1e-6 m in 500 µs and 1e-4 m in 150 µs."""
    case = next(case for case in CASES if case.key == "slide")
    about = {"skipped": (), "contenders": (), "case": case, **job}
    frontier = Frontier(
        tuple(points), "error", {"error": "m"}, {"error": own_error}, "closed form", 2.0, is_complete
    )  # fmt: skip
    return Found(Job("slide", case.what, case.scene(), 2.0, **about), frontier)


def point(engine, setting, dt, error, us, **more):
    return FrontierPoint(engine, setting, dt, {"error": error}, (1e-6 * us,), **more)


POINTS = (
    point("rigid-env", "fast", 0.02, 1e-3, 10.0),
    point("rigid-env", "fast", 0.01, 5e-5, 100.0),
    point("mujoco", "default", 0.02, 1e-2, 200.0),
    point("mujoco", "stiff", 0.02, 2e-2, 300.0),
    point("mujoco", "stiff", 0.01, math.nan, 600.0, is_lost=True),
    point("mujoco", "default", 0.01, 2e-2, 400.0),
)


def text(table) -> str:
    console = Console(width=112, record=True, file=io.StringIO())
    console.print(table)
    return console.export_text()


# numbers


def test_a_goal_needs_one_setting_that_meets_both():
    (_, _, hard), (_, _, easy) = found(POINTS).goals_met()
    assert hard is None
    assert easy is POINTS[1]
    slow = (point("rigid-env", "fast", 0.01, 5e-5, 151.0),)
    assert [met for _, _, met in found(slow).goals_met()] == [None, None]
    theirs = (point("mujoco", "default", 0.01, 1e-9, 1.0), *POINTS[:1])
    assert [met for _, _, met in found(theirs).goals_met()] == [None, None]  # a peer reaches no goal of ours


def test_every_scene_can_be_asked_for():
    alone = {name for name in physics.scenes.SCENES if len(physics.scenes.by_name(name).bodies) == 1}
    assert set(accuracy.names()) == {case.key for case in CASES} | alone
    assert alone == set(physics.scenes.SCENES) - {"ramp", "tower", "heap"}
    jobs = accuracy.make_jobs()
    assert [job.key for job in jobs] == [case.key for case in CASES] + list(accuracy.OPEN)
    (rest,) = accuracy.make_jobs(["rest", "rest"], ladder=QUICK)
    assert (rest.duration, rest.case, rest.goals) == (accuracy.DURATION, None, ())
    assert len(rest.contenders) == len(QUICK.accuracies) * len(QUICK.steps)
    assert accuracy.run_count([rest], QUICK) == 1 + 2 * len(rest.contenders)


def test_a_peer_takes_part_or_says_why_not():
    class Some:
        name, version = "some", "1"

        def settings(self, scene):
            return {"default": {}, "round": {"is_round": True}}

        def open(self, scene, dt, is_round=False):
            if is_round:
                raise peers.Unsupported("it has no blocks")

    (job,) = accuracy.make_jobs(["slide"], {"some": Some()}, QUICK)
    assert [(c.engine, c.setting, c.dt) for c in job.contenders if c.engine == "some"] == [("some", "default", 0.02)]
    assert job.skipped == ("some round: it has no blocks",)


def test_an_interruption_ends_the_run_after_what_was_done():
    jobs = accuracy.make_jobs(["tumble", "vertex"], ladder=QUICK)
    told = []

    def stop(what):
        told.append(what)
        if len(told) == 3:
            raise KeyboardInterrupt

    results = list(accuracy.run(jobs, QUICK, stop))
    assert [(r.job.key, len(r.frontier.points), r.frontier.is_complete) for r in results] == [("tumble", 1, False)]
    assert told[0].startswith("tumble: truth")
    assert "interrupted: not all was measured" in summary(results[0])


# tables


def test_the_table_shows_each_engines_front_and_the_best_of_each_setting():
    shown = text(make_table(found(POINTS)))
    assert "2 more points" in shown
    assert shown.count("mujoco") == 2
    assert shown.count("*") == 2
    everything = text(make_table(found(POINTS), is_full=True))
    assert everything.count("mujoco") == 4
    assert "!" in everything
    assert "inf" in everything
    assert "more points" not in text(make_table(found(POINTS[:2])))


def test_goals_are_told_apart():
    lines = goals(found(POINTS))
    assert "goal ≤ 0.0001 m at ≤ 150 µs: reached by fast at 10 ms in 100 µs" in lines
    assert "goal ≤ 1e-06 m at ≤ 500 µs: not reached" in lines


def test_the_summary_tells_orders_skips_and_trouble():
    lines = summary(found((*POINTS, point("rigid-env", "fast", 0.005, 1e-5, 500.0, note="oh")), skipped=("x: no",)))
    assert not any("goal" in line for line in lines)
    assert any(line.startswith("fast: observed order") for line in lines)
    assert "skipped: x: no" in lines
    assert "not all well: fast at 5 ms: oh" in lines


def test_answers_are_given_for_us_and_for_all():
    ours, everyone = answers(found(POINTS), 1e-4)
    assert ours.startswith("slide, ours: below 0.0001 m: fast at 10 ms")
    assert everyone.startswith("slide, all: ")
    assert len(answers(found(POINTS[:2]), 1e-4)) == 1


# the command


def test_it_measures_writes_and_answers(tmp_path):
    file = tmp_path / "deep" / "numbers.json"
    output = run("vertex", "--quick", "--below", "1e-3", "--json", file)
    assert "vertex: one vertex hits" in output
    assert "vertex, ours: below 0.001 m/s: " in output
    assert "goal" not in output
    content = json.loads(file.read_text())
    assert {"date", "processor", "versions", "git"} <= set(content["machine"])
    (scene,) = content["scenes"]
    assert scene["case"] == "vertex"
    assert [setting["setting"] for setting in scene["settings"]] == list(QUICK.accuracies)
    assert [(row["setting"], row["dt"]) for row in content["rows"]] == [
        (a, dt) for a in QUICK.accuracies for dt in QUICK.steps
    ]
    assert all(row["us"] > 0 and row["errors"]["penetration"] >= 0 for row in content["rows"])


@pytest.mark.compiled
def test_a_scene_without_closed_form_is_compared_with_the_reference(monkeypatch, is_exhaustive):
    if not is_exhaustive:
        monkeypatch.setattr(accuracy, "QUICK", replace(QUICK, accuracies=("balanced",)))
    output = run("tumble", "flight", "--quick")
    assert "truth: reference at 5 ms" in output
    assert "truth: DOP853" in output


def test_scene_files_are_measured(tmp_path):
    """Also those of MuJoCo."""
    paths = [tmp_path / "mine.toml", tmp_path / "mine.xml"]
    physics.save_scene(physics.scenes.tumble(), paths[0])
    physics.save_mjcf(physics.scenes.tumble(), paths[1])
    file = tmp_path / "numbers.json"
    output = run(paths[1], "--quick", "--duration", 0.2, "--json", file)
    (found,) = json.loads(file.read_text())["scenes"]
    assert (found["case"], found["duration"]) == (str(paths[1]), 0.2)
    assert f"{paths[1]}:" in output.replace("\n", "")  # a long path goes on in the next line
    (job,) = accuracy.make_jobs([str(paths[0])], ladder=QUICK)
    assert (job.scene, job.duration) == (physics.scenes.tumble(), accuracy.DURATION)
    assert "mine.txt" in run(tmp_path / "mine.txt", "--quick", code=2)
    assert "does not exist" in run(tmp_path / "none.toml", "--quick", code=2)
    assert "duration is 0" in run(paths[0], "--quick", "--duration", 0, code=2)


def test_a_peer_that_is_missing_is_skipped_with_a_message(monkeypatch):
    monkeypatch.setattr(peers, "is_installed", lambda name: False)
    output = run("vertex", "--quick", "--peers", "drake")
    assert "skipped: drake is not installed" in output
    assert 'pip install "rigid-env[peers]"' in output
    assert "rigid-env" in output


def test_mujoco_is_measured_beside_us():
    pytest.importorskip("mujoco")
    output = run("vertex", "--quick", "--peers", "mujoco")
    assert "peers: mujoco " in output
    assert "one-step" in output


def test_mistakes_are_named_with_what_is_allowed():
    assert "vertex_drop" in run("dorp", "--quick", code=2)
    assert "pybullet" in run("vertex", "--quick", "--peers", "bullet", code=2)
    assert "below" in run("vertex", "--quick", "--below", "-1", code=2)


@pytest.mark.exhaustive
def test_scenes_spread_over_processes_have_the_same_errors(tmp_path):
    here, there = tmp_path / "here.json", tmp_path / "there.json"
    run("slide", "--quick", "--json", here)
    run("slide", "--quick", "--launcher", "local", "--jobs", "1", "--json", there)
    errors = [[(row["setting"], row["dt"], row["error"]) for row in json.loads(path.read_text())["rows"]]
              for path in (here, there)]  # fmt: skip
    assert errors[0] == errors[1]


def test_scenes_are_printed_as_lines_for_a_shell(tmp_path):
    (line,) = run(
        "slide", "--quick", "--duration", "1.0", "--launcher", "print", "--json", tmp_path / "a.json"
    ).splitlines()
    where = tmp_path / "a" / "slide.json"
    assert line == f"rigid-env accuracy slide --duration 1.0 --quick --json {where}"


def test_a_scene_that_is_lost_is_an_error():
    (job,) = accuracy.make_jobs(["slide"], ladder=QUICK)
    with pytest.raises(ValueError, match="slide: its process ended"):
        list(accuracy_jobs.found([job], [Ended("slide", None, "its process ended")]))


def test_an_interrupted_command_writes_what_it_has_and_says_so(tmp_path, monkeypatch):
    def stop(jobs, ladder, tick):
        yield found(POINTS, is_complete=False)

    monkeypatch.setattr(accuracy, "run", stop)
    file = tmp_path / "a.json"
    output = run("slide", "--json", file, code=130)
    assert "interrupted: not all was measured" in output
    content = json.loads(file.read_text())
    assert content["is_complete"] is False
    assert [row["error"] for row in content["rows"]][-2:] == [None, 2e-2]


# the picture


def test_the_plot_has_a_panel_per_scene(tmp_path):
    pytest.importorskip("matplotlib")
    image = pytest.importorskip("PIL.Image")
    from rigid_env.lab.measure.accuracy_plot import write_plot

    exact = point("rigid-env", "exact", 0.02, 0.0, 50.0)
    results = [found((*POINTS, exact), own_error=1e-9), found(POINTS[:2]), found(POINTS[4:5])]
    write_plot(results[:1], tmp_path / "one.png")
    write_plot(results, tmp_path / "deep" / "three.png")
    with image.open(tmp_path / "one.png") as one, image.open(tmp_path / "deep" / "three.png") as three:
        assert three.size[0] == 3 * one.size[0]
        assert three.size[1] <= one.size[1]  # of a legend with fewer rows
    with pytest.raises(ValueError, match="results is empty"):
        write_plot([], tmp_path / "none.png")
    write_plot(results[:1], tmp_path / "with.png", has_goals=True)
    assert (tmp_path / "with.png").read_bytes() != (tmp_path / "one.png").read_bytes()
    with pytest.raises(ValueError, match="xyz"):
        write_plot(results, tmp_path / "one.xyz")


def test_the_legend_fits_below_the_panel(tmp_path):
    pytest.importorskip("matplotlib")
    long = point("rigid-env", "a preset of one's own with a long name", 0.02, 1e-3, 50.0)
    figure = found((*POINTS, long), own_error=1e-9).frontier.plot(tmp_path / "one.png")
    (legend,) = figure.legends
    extent = legend.get_window_extent(figure.canvas.get_renderer())
    assert 0 <= extent.x0 < extent.x1 <= figure.bbox.width
    assert (tmp_path / "one.png").stat().st_size > 0
    assert "rigid-env fast" in {text.get_text() for text in legend.get_texts()}


def test_without_matplotlib_the_extra_is_named_before_anything_is_measured(monkeypatch, tmp_path):
    monkeypatch.setitem(sys.modules, "matplotlib", None)

    def measure(console, *_):
        console.print("measured")
        return SimpleNamespace(results=(), is_complete=True)

    monkeypatch.setattr(accuracy_report, "measure_and_show", measure)
    output = run("vertex", "--plot", tmp_path / "a.png", code=1)
    assert output.index("rigid-env[plot]") < output.index("measured") < output.rindex("rigid-env[plot]")


def test_ladder_of_peers_is_finer_and_that_of_events_coarser():
    (job,) = accuracy.make_jobs(["sphere"])
    ours = {c.setting: [k.dt for k in job.contenders if k.setting == c.setting] for c in job.contenders}
    assert min(Ladder().peer_steps) < min(ours["balanced"]) == min(ours["precise"])
    assert max(ours["precise"]) == 0.1 > max(ours["balanced"])


@pytest.mark.parametrize("job", accuracy.make_jobs(), ids=lambda job: job.key)
def test_every_step_of_the_ladder_divides_the_whole_duration(job):
    """Or the measurement would end early, and a closed form of the end be compared with something before it."""
    duration, _ = frontier_run.common_times(job.duration, [c.dt for c in job.contenders])
    assert duration == pytest.approx(job.duration, rel=1e-12)
