"""Commands: files, mistakes, help, completion, interruptions and missing packages."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

import physics
from physics import scenes
from rigid_env import extras
from rigid_env.cli import app, files
from rigid_env.cli.common import INTERRUPTED
from rigid_env.lab import warmup
from rigid_env.lab.demo import LARGEST_GIF, Demo
from rigid_env.lab.measure import effects as costs
from rigid_env.terminal.console import UNBROKEN

runner = CliRunner()
COMMANDS = {
    "demo": (), "run": ("rest",), "replay": ("none.npz",), "explain": ("rest",), "warmup": (), "bench": (),
    "effects": (), "accuracy": (), "tosses": ("none.npz",), "hard-cases": (), "describe": ("rigid_env/BlockReach-v0",),
    "view": ("rest",), "play": ("rigid_env/BlockReach-v0",), "scenes": (),
}  # fmt: skip

CART = Path(__file__).parents[2] / "examples" / "cart.toml"
BALL = physics.Scene([physics.Sphere(0.5, 2.0, linvel=(1.0, 0.0, 0.0))], effects=[physics.Gravity()])


def run(*arguments, code=0, **environment):
    result = runner.invoke(app, list(map(str, arguments)), env={"COLUMNS": None, **environment})
    assert result.exit_code == code, result.output
    return result.output


@pytest.fixture
def ball(tmp_path):
    """A scene file."""
    path = tmp_path / "ball.toml"
    physics.save_scene(BALL, path)
    return path


# help


def commands():
    return {name: command.params for name, command in typer.main.get_command(app).commands.items()}


def test_every_command_is_looked_at():
    assert set(COMMANDS) == set(commands())


@pytest.mark.parametrize("command", COMMANDS)
def test_help_is_printed_as_it_is_written(command):
    """Units in square brackets are there: ``[s]`` is no markup."""
    text = " ".join(run(command, "--help", COLUMNS="80").split())
    assert max(map(len, run(command, "--help", COLUMNS="80").splitlines())) <= 80
    for parameter in commands()[command]:
        told = getattr(parameter, "help", None)
        if told:
            assert " ".join(told.split()) in text


def test_help_names_tasks_of_ones_own():
    for command in ("view", "describe"):
        assert "module:Class" in " ".join(run(command, "--help").split())
    assert "'module:Class'" in run("view", "nothing", code=2)


def test_units_are_there():
    assert "Simulated time [s]." in run("demo", "--help")
    assert "Step [s]." in run("hard-cases", "--help")


def test_no_summary_of_a_command_is_cut():
    output = run("--help", COLUMNS="80")
    assert "..." not in output[output.index("Commands") :]


# files


def written_options():
    return [
        (name, parameter.opts[0])
        for name, parameters in commands().items()
        for parameter in parameters
        if getattr(parameter, "metavar", None) == "FILE" and parameter.opts[0].startswith("--")
    ]


def test_every_command_that_measures_has_json():
    assert {name for name, option in written_options() if option == "--json"} == set(COMMANDS) - {"view", "play"}


ENDINGS = {
    "--json": ".json",
    "--npz": ".npz",
    "--csv": ".csv",
    "--plot": ".png",
    "--markdown": ".md",
    "--export": ".html",
    "--video": ".gif",
}


@pytest.mark.parametrize(("command", "option"), written_options())
def test_files_are_refused_before_anything_is_computed(command, option, tmp_path, monkeypatch):
    """The same rule for each of them; nothing is made."""
    monkeypatch.chdir(tmp_path)
    ending = ENDINGS[option]
    (tmp_path / "file").write_text("kept")
    (tmp_path / f"folder{ending}").mkdir()
    before = sorted(tmp_path.rglob("*"))
    for name, words in (
        ("x.xyz", ("ends in '.xyz'", ending)),
        ("x", ("ends in ''", ending)),
        (f"folder{ending}", ("is a folder", ending)),
        (f"file/deep/x{ending}", ("is a file", "file")),
    ):
        output = run(command, *COMMANDS[command], option, name, code=2)
        assert f"'{option}'" in output
        assert name in output
        for word in words:
            assert word in output
    assert sorted(tmp_path.rglob("*")) == before


def test_what_cannot_be_written_is_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(files.os, "access", lambda path, mode: False)
    output = run("run", "rest", "--json", tmp_path / "x.json", code=2)
    assert "read-only" in output


def test_devices_need_no_ending():
    path = files.Path(os.devnull)
    assert files.checked(path, [".json"]) == path


def test_run_makes_missing_folders(ball, tmp_path):
    pytest.importorskip("PIL")
    pytest.importorskip("pygame")
    made = {
        option: tmp_path / "a" / option[2:] / f"x{ENDINGS[option]}" for option in ("--npz", "--csv", "--plot", "--json")
    }
    output = run("run", ball, "--duration", 0.1, *(part for pair in made.items() for part in pair))
    for path in made.values():
        assert path.stat().st_size > 0
        assert str(path) in output
    with np.load(made["--npz"]) as found:
        assert found["t"][-1] == pytest.approx(0.1)
    assert len(made["--csv"].read_text().splitlines()) == 12
    assert json.loads(made["--json"].read_text())["sample_dt"] == 0.01


# run and demo


def test_run_takes_a_step(ball, tmp_path):
    numbers = tmp_path / "x.json"
    run("run", ball, "--duration", 1, "--dt", 0.05, "--json", numbers)
    found = json.loads(numbers.read_text())
    assert (found["sample_dt"], found["duration"]) == (0.05, 1.0)
    assert found["final"]["pos"][0] == pytest.approx([1.0, -9.81 / 2, 0.0], abs=1e-12)
    assert "dt is 0" in run("run", ball, "--dt", 0, code=2)


def test_run_and_demo_take_scenes_and_files_alike(ball, tmp_path):
    pytest.importorskip("PIL")
    pytest.importorskip("pygame")
    assert "tumble, accuracy balanced" in run("run", "tumble", "--duration", 0.05)
    out = tmp_path / "pictures"
    assert "ball, accuracy balanced" in run("demo", ball, "--duration", 0.05, "--out", out)
    assert sorted(path.name for path in out.iterdir()) == ["ball.gif", "ball.png"]


def test_scenes_are_listed(tmp_path):
    file = tmp_path / "scenes.json"
    output = run("scenes", "--json", file)
    rows = {row["scene"]: row for row in json.loads(file.read_text())["scenes"]}
    assert list(rows) == list(scenes.SCENES)
    for name, row in rows.items():
        assert f"{name} " in output
        assert row["what"] in output
        assert "`" not in row["what"]
    assert (rows["heap"]["bodies"], rows["heap"]["walls"]) == (100, 5)


def test_run_takes_files_of_mujoco(tmp_path):
    path = tmp_path / "ball.xml"
    physics.save_mjcf(BALL, path)
    assert "pos         (0.1000, -0.0490, 0.0000) m" in run("run", path, "--duration", 0.1)
    path.write_text("<mujoco><worldbody>")
    assert "ball.xml: no element found" in run("run", path, code=2)
    assert "does not exist" in run("explain", tmp_path / "none.xml", code=2)


@pytest.mark.interpreted
def test_run_takes_the_scene_of_an_environment():
    assert "cart, accuracy balanced" in run("run", CART, "--duration", 0.05)


def test_warmup_knows_the_environment_of_any_scene():
    names = {job.name: job for job in warmup.jobs() if job.accuracy == "balanced"}
    names["environment rigid_env/Scene-v0"].run()


def test_gif_keeps_the_time_of_the_motion():
    for dt in (0.003, 0.01, 0.04, 0.07):
        run_ = Demo("ball", 0.5, "balanced", BALL, dt)
        assert run_.frame_time >= 0.04
        assert run_.frame_time == pytest.approx(round(run_.frame_time, 2), abs=1e-12)
        assert abs((run_.frame_count - 1) * run_.frame_time - run_.duration) <= run_.frame_time
        assert run_.speed == 1.0


def test_gif_of_a_long_motion_is_short():
    long = Demo("ball", 100.0, "balanced", BALL, 1.0)
    assert long.frame_count <= LARGEST_GIF
    assert long.speed == pytest.approx(long.frame_time / 0.04)


def test_many_bodies_are_summarised(tmp_path):
    path, numbers = tmp_path / "many.toml", tmp_path / "many.json"
    bodies = [physics.Sphere(0.1, 1.0, pos=(2.0 * k, 0, 0)) for k in range(50)]
    physics.save_scene(physics.Scene(bodies, effects=[physics.Gravity()]), path)
    output = run("run", path, "--duration", 0.05, "--json", numbers)
    assert len(output.splitlines()) < 20
    assert "50 Sphere" in output
    assert len(json.loads(numbers.read_text())["final"]["pos"]) == 50


# mistakes


def test_mistakes_name_field_value_and_what_is_allowed(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.toml").write_text('[[bodies]]\nkind = "Sphere"\nradius = -1\nmass = 2\n')
    (tmp_path / "folder.toml").mkdir()
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    for arguments, words in (
        (("run", "dorp"), ("scene is 'dorp'", "allowed are drop,")),
        (("explain", "tumbel"), ("scene is 'tumbel'", "allowed are tumble,")),
        (("demo", "nix.toml"), ("scene is 'nix.toml'", "does not exist")),
        (("run", "folder.toml"), ("folder.toml", "is a folder")),
        (("run", "bad.toml"), ("bad.toml, line 3", "radius is -1")),
        (("run", "binary.toml"), ("binary.toml", "byte 0 is no UTF-8")),
        (("run", "rest", "--accuracy", "best"), ("'--accuracy': 'best'; allowed are fast, balanced, precise",)),
        (("run", "rest", "--duration", "-1"), ("--duration", "-1.0; allowed")),
        (("run", "rest", "--duration", "long"), ("--duration",)),
        (("tosses", "none.npz", "--threads", "0"), ("--threads", "0; allowed")),
        (("tosses", "none.npz", "--seed", "-1"), ("--seed", "-1; allowed")),
        (("run", "rest", "--frames", "3"), ("--frames",)),
        (("replay", "none.npz"), ("file is 'none.npz'", "does not exist")),
        (("effects", "gravitation"), ("effect is 'gravitation'", "allowed are gravity,")),
        (("accuracy", "tumbel"), ("scene is 'tumbel'", "allowed are tumble,")),
        (("accuracy", "--peers", "mujocco"), ("peer is 'mujocco'", "allowed are mujoco,")),
        (("hard-cases", "zenno"), ("case is 'zenno'", "zeno")),
        (("runn", "rest"), ("runn",)),
    ):
        output = run(*arguments, code=2)
        assert "Traceback" not in output
        lines = [line for line in output.splitlines() if line.startswith("Error")]
        assert len(lines) == 1, output  # not broken, not framed
        for word in words:
            assert word in lines[0]


# Of each command that takes a preset: a shell user cannot type what Python takes besides.
@pytest.mark.parametrize(
    "arguments",
    [("run", "rest"), ("explain", "rest"), ("demo",), ("hard-cases",), ("tosses", "x.npz"), ("view", "rest")],
)
def test_a_preset_that_is_none_is_told_in_words_of_the_shell(arguments):
    (line,) = [each for each in run(*arguments, "--accuracy", "balaced", code=2).splitlines() if "Error" in each]
    assert line.endswith("'balaced'; allowed are balanced, fast, precise, reference")


def test_a_subject_that_is_none_is_told_in_words_of_the_shell():
    output = run("view", "BlockRech", code=2)
    assert "such as rigid_env/BlockReach-v0" in output
    assert "physics." not in output


# Ctrl-C


def test_a_measurement_that_is_interrupted_shows_what_was_done(tmp_path, monkeypatch):
    measure, count = costs.effect_row, []

    def interrupted(name, *rest):
        count.append(name)
        if len(count) == 2:
            raise KeyboardInterrupt
        return measure(name, *rest)

    monkeypatch.setattr(costs, "effect_row", interrupted)
    numbers = tmp_path / "x.json"
    output = run("effects", "gravity", "contact", "drag", "--quick", "--json", numbers, code=INTERRUPTED)
    assert "interrupted" in output
    found = json.loads(numbers.read_text())
    assert found["is_complete"] is False
    assert [row["key"] for row in found["rows"]] == ["gravity"]


def test_interrupting_a_simulation_ends_it_cleanly(monkeypatch):
    def interrupted(*arguments, **more):
        raise KeyboardInterrupt

    monkeypatch.setattr(physics, "simulate", interrupted)
    assert "interrupted" in run("run", "rest", code=INTERRUPTED)


ENDLESS = """
import pathlib, signal, physics
from rigid_env.cli import app

def endless(scene, *arguments, **more):
    world = physics.World(scene)
    world.step()
    pathlib.Path("stepping").touch()
    while True:
        world.step(steps=1000)

signal.signal(signal.SIGINT, signal.default_int_handler)  # a test run in the background has it ignored
physics.simulate = endless
app(["run", "tumble"])
"""


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_a_signal_ends_a_process_cleanly(tmp_path):
    process = subprocess.Popen(
        [sys.executable, "-c", ENDLESS], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=tmp_path
    )
    try:
        while not (tmp_path / "stepping").exists():
            assert process.poll() is None, process.communicate()
            time.sleep(0.1)
        process.send_signal(signal.SIGINT)
        _, told = process.communicate(timeout=120)
    finally:
        process.kill()
    assert process.returncode == INTERRUPTED
    assert "interrupted" in told
    assert "Traceback" not in told


# shell completion


COMPLETING = """
import contextlib, io, json, os, sys
from rigid_env.cli import app

def completions(shell, *words):
    line = " ".join(("rigid-env", *words))
    os.environ.update(_RIGID_ENV_COMPLETE=f"complete_{shell}", _TYPER_COMPLETE_ARGS=line, COMP_WORDS=line)
    os.environ["COMP_CWORD"] = str(len(words))
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.suppress(SystemExit):
        app(prog_name="rigid-env")
    return out.getvalue()

print(json.dumps([completions(*words) for words in json.loads(sys.argv[1])]))
"""


def test_commands_scenes_presets_and_cases_are_completed(tmp_path):
    """In a process of its own, as typer takes the shell's variables from the environment."""
    expected = {
        ("bash", "e"): {"explain", "effects"},
        ("bash", "explain", "t"): {name for name in scenes.SCENES if name.startswith("t")},
        ("bash", "run", "drop", "--accuracy", "bal"): {"balanced"},
        ("bash", "hard-cases", "zen"): {"zeno"},
        ("bash", "hard-cases", "--accuracy", "fast,bal"): {"fast,balanced"},
        ("bash", "accuracy", "--peers", "mu"): {"mujoco"},
        ("bash", "effects", "grav"): {"gravity"},
    }
    words = [*expected, ("bash", "accuracy", "cr"), ("zsh", "e")]
    done = subprocess.run(
        [sys.executable, "-c", COMPLETING, json.dumps(words)], capture_output=True, text=True, cwd=tmp_path
    )
    assert not done.stderr, done.stderr
    *found, truths, zsh = json.loads(done.stdout)
    assert [set(text.split()) for text in found] == list(expected.values())
    assert "creep" in truths
    assert "explain" in zsh


def test_scene_files_are_completed(tmp_path, monkeypatch):
    from rigid_env.cli.names import complete_scene, complete_truth

    monkeypatch.chdir(tmp_path)
    (tmp_path / "dropped.toml").touch()
    (tmp_path / "tumbling.xml").touch()
    (tmp_path / "deep").mkdir()
    (tmp_path / "deep" / "one.toml").touch()
    (tmp_path / "data.csv").touch()
    assert complete_scene("d") == ["drop", "deep/", "dropped.toml"]
    assert complete_scene("tum") == complete_truth("tum") == ["tumble", "tumbling.xml"]
    assert complete_scene("deep/") == ["deep/one.toml"]
    assert complete_scene(f"{tmp_path}/deep/o") == [f"{tmp_path}/deep/one.toml"]


def test_completion_can_be_shown(monkeypatch):
    code = "from rigid_env.cli import app; app(prog_name='rigid-env')"
    given = {**os.environ, "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"}
    done = subprocess.run(
        [sys.executable, "-c", code, "--show-completion", "bash"], capture_output=True, text=True, env=given
    )  # fmt: skip
    assert "_RIGID_ENV_COMPLETE" in done.stdout
    assert "--install-completion" in run("--help")


# packages that are missing

HIDING = """
import sys
class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {hidden}:
            raise ModuleNotFoundError(name)
sys.meta_path.insert(0, Hidden())
{first}
from rigid_env.cli import app
app({arguments}, prog_name="rigid-env")
"""

REFUSING = """
import physics
def refuse(*arguments, **more):
    raise AssertionError("something was computed")
physics.simulate = physics.World.step = refuse
"""


def run_hidden(arguments, hidden, first, folder):
    """Run a command in a folder, with packages hidden from every import and some code before it."""
    code = HIDING.format(hidden=hidden, first=first, arguments=arguments)
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, cwd=folder)


@pytest.fixture
def run_without(tmp_path, monkeypatch, is_exhaustive):
    """Run a command in a folder where packages are missing: status, what it told, and its errors.

    In the default tier a few run in a process of their own, where an import of what is missing fails; the others run
    here, where only the question whether it is there says no.
    """

    def runs(arguments, hidden, first="", is_alone=False):
        if is_alone or is_exhaustive:
            done = run_hidden(arguments, hidden, first, tmp_path)
            return done.returncode, done.stdout, done.stderr
        is_installed = extras.is_installed
        monkeypatch.setattr(extras, "is_installed", lambda module: module not in hidden and is_installed(module))
        monkeypatch.chdir(tmp_path)
        if first:
            for owner, name in ((physics, "simulate"), (physics.World, "step")):
                monkeypatch.setattr(owner, name, lambda *_, **__: pytest.fail("something was computed"))
        done = runner.invoke(app, arguments, env={"COLUMNS": None})
        return done.exit_code, done.stdout, done.stderr

    return runs


@pytest.mark.parametrize(
    "arguments", [["view", "rest"], ["view", "rest", "--export", "x.html"]], ids=lambda arguments: arguments[-1]
)
def test_missing_packages_are_named_before_anything_runs(arguments, run_without, tmp_path):
    """A command that has nothing to give without them."""
    status, _, errors = run_without(arguments, {"viser"}, REFUSING, is_alone="--export" in arguments)
    assert status == 1, errors
    assert "Traceback" not in errors
    for word in ("pip install", "viser", "rigid-env[view]"):
        assert word in errors
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("hidden", "words"),
    [
        ({"pygame"}, "needs pygame, which is"),
        ({"PIL"}, "needs Pillow, which is"),
        ({"pygame", "PIL"}, "pygame and Pillow"),
    ],
)
def test_a_demo_without_a_picture_ends_with_the_line_that_brings_it(hidden, words, run_without, tmp_path):
    arguments = ["demo", "rest", "--duration", "0.05", "--json", "x.json"]
    status, told, errors = run_without(arguments, hidden, is_alone=len(hidden) > 1)
    assert status == 0, errors
    lines = told.splitlines()
    assert "rest, accuracy balanced" in lines[0]
    assert words in lines[-1]
    assert 'pip install "rigid-env[render]"' in lines[-1]
    assert json.loads((tmp_path / "x.json").read_text())["files"] == {}
    assert [path.name for path in tmp_path.iterdir()] == ["x.json"]


@pytest.mark.parametrize(
    ("arguments", "hidden", "words", "told"),
    [
        (
            ["run", "rest", "--duration", "0.05", "--plot", "x.gif", "--csv", "x.csv"],
            {"pygame", "PIL"}, ("pygame and Pillow", "rigid-env[render]"), "rest, accuracy balanced",
        ),
        pytest.param(
            ["accuracy", "creep", "--quick", "--plot", "x.png", "--json", "x.json"],
            {"matplotlib"}, ("matplotlib", "rigid-env[plot]"), "creep", marks=pytest.mark.exhaustive,
        ),
        (
            ["hard-cases", "parabola", "--quick", "--plot", "x.png", "--json", "x.json"],
            {"matplotlib"}, ("matplotlib", "rigid-env[plot]"), "parabola",
        ),
    ],
    ids=["run", "accuracy", "hard-cases"],
)  # fmt: skip
def test_a_plot_that_cannot_be_drawn_costs_nothing_else(arguments, hidden, words, told, run_without, tmp_path):
    """Numbers are printed and written, the line ends the output, and the status says that a file is missing."""
    status, output, errors = run_without(arguments, hidden, is_alone=arguments[0] == "run")
    assert status == 1, errors
    assert "Traceback" not in errors
    assert told in output
    for word in ("pip install", *words):
        assert word in errors.splitlines()[-1]
    assert [path.name for path in tmp_path.iterdir()] == [arguments[-1]]


def test_a_measurement_says_at_its_start_that_it_will_not_draw(tmp_path, monkeypatch):
    """Whoever wants the plot need not wait: the line comes before anything is measured."""
    from rigid_env.lab.measure import accuracy_report

    def refuse(*arguments, **more):
        raise ValueError("something was measured")

    monkeypatch.setattr(accuracy_report, "measure_and_show", refuse)
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    output = run("accuracy", "--plot", tmp_path / "x.png", code=2)
    assert output.startswith("without the plot: a plot needs matplotlib")


# piped


def test_output_in_a_pipe_is_not_broken():
    output = run("explain", "drop")
    assert any(len(line) > 100 for line in output.splitlines())
    assert max(map(len, output.splitlines())) < UNBROKEN
    narrow = run("explain", "drop", COLUMNS="80")
    assert max(map(len, narrow.splitlines())) <= 80
    for word in ("effect", "state", "why", "compiled", "acceleration", "declared:"):
        assert word in narrow
