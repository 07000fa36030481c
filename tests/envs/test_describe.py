"""Documentation of tasks, made of what they declare, against docstrings and spaces."""

from __future__ import annotations

import inspect
import json
import re
import sys
from ast import literal_eval
from importlib.util import find_spec
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from typer.testing import CliRunner

import physics
from rigid_env import BlockReachEnv, Force, Impulse, Push, SceneEnv, Task, TaskEnv, Wrench, observe, register_task
from rigid_env.cli import app
from rigid_env.envs.env import RigidEnv
from rigid_env.tasks.describe import describe
from rigid_env.tasks.written import SENTENCE_END
from tests.envs.test_documentation import SECTIONS, check_rows, section, table

GOAL = {"pos": (3.0, 1.5, 0.0), "tolerance": 0.5}
EXAMPLES = ["edge_balance:EdgeBalance", "sphere_in_wind:SphereInWind", "two_blocks:TwoBlocks"]


@pytest.fixture(params=EXAMPLES)
def example(request) -> TaskEnv:
    return TaskEnv(f"examples.{request.param}")


def rows(text: str, title: str) -> list[list[str]]:
    return table(section(text, title))


def plain(cells) -> list[str]:
    return [cell.strip("`") for cell in cells]


def test_bodies_are_told_by_their_names():
    balls = [physics.Sphere(0.5, 2.0, name="cart"), physics.Sphere(0.5, 2.0, pos=(5, 0, 0), name="crate")]
    text = SceneEnv(physics.Scene(balls, effects=[physics.Gravity()]), driven="crate").describe()
    assert "Bodies: 0 cart (Sphere) of 2 kg; 1 crate (Sphere) of 2 kg." in " ".join(text.split())
    assert rows(text, "Action Space")[0][1] == "force along x of body 1 (crate)"
    assert rows(text, "Observation Space")[18][1] == "position of body 1 (crate) x"


# --- against the docstrings written by hand -------------------------------------------------------------------


def test_sections_stand_in_gymnasiums_order(env_class):
    found = re.findall(r"^## (.+)$", env_class().describe(), re.M)
    assert found == SECTIONS


@pytest.mark.parametrize("title", ["Action Space", "Observation Space"])
def test_tables_of_spaces_are_those_written_by_hand(env_class, title):
    assert rows(env_class().describe(), title) == rows(env_class.__doc__, title)
    first = section(env_class().describe(), title).strip().partition(" float32")[0]
    assert first == section(env_class.__doc__, title).strip().partition(" float32")[0]


def test_options_info_and_limit_are_those_written_by_hand(env_class):
    text, doc = env_class().describe(), env_class.__doc__
    options = plain(row[0] for row in rows(text, "Starting State"))
    keys = plain(row[0] for row in rows(text, "Episode End"))
    told = section(doc, "Episode End").split("`info` holds")[1]
    assert {*keys, *options} == set(re.findall(r"`(\w+)`", told)) - {"reset", "effects"}
    assert plain(row[1] for row in rows(text, "Rewards")) == [key for key in keys if key.startswith("reward_")]
    (limit,) = re.findall(r"after \d+ control steps \([\d.]+ s\)", text)
    assert limit in section(doc, "Episode End")


def test_arguments_are_those_written_by_hand(env_class):
    """Their order, defaults and meanings."""
    ours = rows(env_class().describe(), "Arguments")
    hand = rows(BlockReachEnv.__doc__, "Arguments")
    assert [row[:2] for row in ours] == [row[:2] for row in hand]
    assert all(row[2] for row in ours)
    if env_class is BlockReachEnv:  # the docstring of the other one refers to it
        assert ours == hand


def test_the_description_is_the_docstrings(env_class):
    first, *_, last = section(env_class().describe(), "Description").strip().split("\n\n")
    assert first == env_class.__doc__.split("\n\n")[0]
    assert last.startswith("Bodies: 0 Block of 6 kg.")


@pytest.mark.parametrize("make", [BlockReachEnv, lambda: SceneEnv("rest", goal=GOAL)], ids=["BlockReach", "Scene"])
def test_every_sentence_of_the_docstring_is_there(make):
    """Those apart that give way to tables and limits of the environment as it is."""
    env = make()
    doc = inspect.cleandoc(type(env).__doc__)
    told = " ".join(env.describe().split())
    prose = [block for block in doc.split("\n\n") if not block.startswith(("|", "#"))]
    missing = [each for text in prose for each in SENTENCE_END.split(" ".join(text.split())) if each not in told]
    assert all("float32" in each or each.endswith(":") or each.startswith("Truncation") for each in missing)
    assert len(missing) <= 5


# --- against the spaces of any task ---------------------------------------------------------------------------


def test_tables_hold_the_spaces_of_the_examples(example):
    text = example.describe()
    check_rows(rows(text, "Action Space"), example.action_space)
    found = rows(text, "Observation Space")
    check_rows(found, example.observation_space)
    assert [row[1] for row in found] == [name for entry in example.task.observation for name in entry.names]
    assert f"`Box` of {len(found)} float32" in text
    assert f"Box(-1, 1, ({example.action_space.shape[0]},), float32)" in text


def test_tables_hold_what_episodes_of_the_examples_tell(example):
    text = example.describe()
    options = plain(row[0] for row in rows(text, "Starting State"))
    _, info = example.reset(seed=3)
    assert set(info) == {*plain(row[0] for row in rows(text, "Episode End")), *options}
    example.reset(seed=3, options={name: info[name] for name in options})
    lengths = {name: np.size(info[name]) for name in options}
    assert {row[0].strip("`"): int(row[2]) for row in rows(text, "Starting State")} == lengths


def test_arguments_of_an_example_are_its_constructors(example):
    found = {row[0].strip("`"): literal_eval(row[1].strip("`")) for row in rows(example.describe(), "Arguments")}
    owners = type(example.task).__init__, RigidEnv.__init__
    given = [each for owner in owners for each in inspect.signature(owner).parameters.values()]
    assert found == {each.name: each.default for each in given if each.name not in ("self", "task", "worlds")}


def test_disturbances_are_told():
    text = TaskEnv("examples.sphere_in_wind:SphereInWind").describe()
    assert rows(text, "Disturbances") == [
        ["Gust", "0", "force uniform from 0.2 to 0.8 m g, lasts uniform from 0.2 to 0.6 s", "xz", "1 s"]
    ]
    assert "## Disturbances" not in TaskEnv("examples.two_blocks:TwoBlocks").describe()


# --- a task of one's own --------------------------------------------------------------------------------------


class Pair(Task):
    """Two blocks and two agents.

    A second paragraph.

    Parameters
    ----------
    reach : float
        Distance that counts
        as near [m].
    """

    scene = physics.Scene([physics.Block((1, 1, 1), 2.0), physics.Block((1, 1, 1), 3.0, pos=(3, 0, 0))])
    actions = (
        Force(1, 0.5, point=(0.5, 0, 0), axes="y", frame="body", agent="right"),
        Impulse(0, 0.1, axes="x", agent="left"),
        Wrench(1, 0.0, 0.25, torque_axes="z", agent="right"),
    )
    observation = (observe.pos(1, scale=2.0),)
    draws = {"mass[1]": (1.0, 2.0), "side": 1.0}  # noqa: RUF012
    disturbances = (Push(1, speed=0.5, every=2.5, axes="y"),)

    def __init__(self, worlds=1, *, reach=2.0, name):
        super().__init__(worlds)

    def success(self, worlds):
        """Both are near."""
        return np.zeros(len(worlds), dtype=bool)

    def rewards(self, worlds):
        """Count | steps."""
        return {"a|b": np.ones(len(worlds))}


def test_a_task_of_ones_own_is_described_from_its_declaration():
    task = Pair(name="x")
    text = describe(task)
    assert section(text, "Description").strip().split("\n\n")[1:] == [
        "A second paragraph.", "Bodies: 0 Block of 2 kg; 1 Block, mass drawn. Walls: 0. Effects: none.",
    ]  # fmt: skip
    assert rows(text, "Action Space") == [
        ["0", "force along body axis y of body 1 at (0.5, 0, 0) m", "-1", "1", "0.5 m g", "right"],
        ["1", "impulse along x of body 0", "-1", "1", "0.1 m g s", "left"],
        ["2", "torque about z of body 1", "-1", "1", "0.25 m g a", "right"],
    ]
    assert "An impulse acts in the first physics step." in " ".join(text.split())
    assert rows(text, "Observation Space")[0][1:] == ["position of body 1 x", "-10", "10", "2 m"]
    assert "Count | steps." in text
    assert "| a\\|b | `reward_a\\|b` |" in text  # a bar in a cell would end it
    assert rows(text, "Starting State") == [
        ["`mass[1]`", "uniform from 1 to 2", "1", "mass [kg] of body 1"], ["`side`", "1", "1", "the task's own"],
    ]  # fmt: skip
    assert rows(text, "Disturbances") == [["Push", "1", "speed 0.5 m/s", "y", "2.5 s"]]
    assert "Termination: on success. Both are near.\n\nTruncation: none." in text
    assert rows(text, "Arguments")[:2] == [
        ["`reach`", "2.0", "Distance that counts as near [m]."], ["`name`", "required", ""],
    ]  # fmt: skip


class Explained(Pair):
    explanations = {"side": "side [m]", "apart": "distance [m]", "reward_a|b": "count"}  # noqa: RUF012
    ends_on_success = False

    def measure(self, worlds):
        return {"apart": np.ones(len(worlds))}


class Again(Explained):
    explanations = {"apart": "distance of both [m]"}  # noqa: RUF012


def test_a_task_explains_its_draws_measures_and_terms():
    text = describe(Again(name="x"))
    assert rows(text, "Starting State")[1] == ["`side`", "1", "1", "side [m]"]
    assert "| `apart` | distance of both [m] |" in text
    assert "| `reward_a\\|b` | count |" in text


def test_an_explanation_of_nothing_is_refused():
    class Wrong(Explained):
        explanations = {"aprat": "distance [m]"}  # noqa: RUF012

    with pytest.raises(ValueError, match="explanations of Wrong have 'aprat'; allowed are apart, reward_a"):
        Wrong(name="x")


def test_success_that_ends_no_episode_is_no_termination():
    text = section(describe(Explained(name="x")), "Episode End")
    assert text.startswith("\nTermination: never. Success does not end an episode. Both are near.\n")


def test_a_mass_that_is_drawn_is_no_number():
    assert "1 Block, mass drawn." in describe(Pair(name="x"))
    assert "Bodies: 0 Block, mass drawn." in BlockReachEnv(mass=(4.0, 8.0)).describe()


def test_effects_take_draws_out_of_the_tables():
    text = BlockReachEnv(effects=[physics.Friction(0.3)]).describe()
    assert "`friction`" not in {row[0] for row in rows(text, "Starting State")}


def test_defaults_are_those_of_the_registered_id():
    register_task("tests/Fast-v0", "examples.two_blocks:TwoBlocks", accuracy="fast")
    env = gym.make("tests/Fast-v0", dt=0.0025).unwrapped
    assert {"`accuracy`": '`"fast"`', "`dt`": "0.005"}.items() <= {
        row[0]: row[1] for row in rows(env.describe(), "Arguments")
    }.items()


# --- the command ----------------------------------------------------------------------------------------------


def run(*arguments, code=0, **environment):
    result = CliRunner().invoke(app, ["describe", *map(str, arguments)], env={"COLUMNS": None, **environment})
    assert result.exit_code == code, result.output
    return result.output


@pytest.mark.parametrize("task", ["rigid_env/BlockReach-v0", *(f"examples.{name}" for name in EXAMPLES)])
@pytest.mark.parametrize("columns", [80, 40])
def test_the_command_fits_a_terminal_and_leaves_nothing_out(task, columns):
    lines = run(task, COLUMNS=str(columns)).splitlines()
    assert max(map(len, lines)) <= columns
    env = TaskEnv(task) if ":" in task else BlockReachEnv()
    words = " ".join(lines).split()
    for each in env.documentation():
        for cell in (each.title, *(cell for row in each.rows for cell in row)):
            assert set(cell.replace("`", "").split()) <= set(words), cell
    if columns == 80:  # a row of numbers is one line
        heads = [line.split() for line in lines if line.startswith("Num ")]
        assert heads == [["Num", "Action", "Min", "Max", "Unit"], ["Num", "Observation", "Min", "Max", "Unit"]]


def test_the_command_takes_scenes(tmp_path):
    path = tmp_path / "ball.toml"
    physics.save_scene(physics.Scene([physics.Sphere(0.5, 2.0, name="ball")], effects=[physics.Gravity()]), path)
    assert "Bodies: 0 ball (Sphere) of 2 kg." in run(path)
    output = run("rigid_env/Scene-v0")
    assert "closeness is -log(1 + d / t)" in output
    assert "names or indices of driven bodies" in output
    assert "goal 2" in output
    assert "none.toml" in run("none.toml", code=2)


def test_the_command_writes_markdown_and_json(tmp_path):
    page, numbers = tmp_path / "new" / "task.md", tmp_path / "task.json"
    output = run("rigid_env:rigid_env/BlockReorient-v0", "--markdown", page, "--json", numbers)
    assert f"written     {page}" in output
    env = gym.make("rigid_env/BlockReorient-v0").unwrapped
    assert page.read_text(encoding="utf-8") == env.describe()
    found = json.loads(numbers.read_text())
    assert found["task"] == "rigid_env:rigid_env/BlockReorient-v0"
    assert [each["title"] for each in found["sections"]] == [each.title for each in env.documentation()]
    assert len(found["sections"][2]["rows"]) == 23


def test_the_command_finds_files_of_the_working_folder(tmp_path, monkeypatch):
    source = Path(find_spec("examples.two_blocks").origin).read_text(encoding="utf-8")
    (tmp_path / "of_a_user.py").write_text(source.replace("examples/", "user/"), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    assert "Push the heavy block" in run("of_a_user:TwoBlocks")
    assert "Push the heavy block" in run("of_a_user:user/TwoBlocks-v0")


@pytest.mark.parametrize(
    ("task", "words"),
    [
        ("CartPole-v1", ("'CartPole-v1', a CartPoleEnv", "environments of rigid_env")),
        ("nothing-v0", ("'nothing-v0', which is not there; allowed are names such as 'rigid_env/BlockReach-v0'",)),
        ("Crate", ("'Crate', which is not there; allowed are names such as 'rigid_env/", "'module:Class'")),
        ("BlockRech", ("'BlockRech', which is not there; allowed are names such as 'rigid_env/BlockReach-v0'",)),
        ("rigid_env/BlockReorent-v0", ("which is not there; allowed are names such as 'rigid_env/BlockReorient-v0'",)),
        ("BlockReachEnv", ("which is not there; allowed are names such as 'rigid_env/BlockReach-v0'",)),
        ("dorp", ("which is not there; allowed are names such as 'drop'",)),
        ("rigid_env.tasks:BlockRech", ("which is not there", "allowed is rigid_env.tasks:BlockReach, rigid_env")),
        ("none.here:Task", ("'none.here:Task', which is not there", "'module:Class'")),
        ("none_here:rigid_env/X-v0", ("'none_here:rigid_env/X-v0', which is not there", "'module:id'")),
        ("physics:Scene", ("'physics:Scene'", "a subclass of rigid_env.Task")),
    ],
)
def test_the_command_names_what_is_wrong(task, words):
    output = run(task, code=2)
    for word in words:
        assert word in output
    assert "Did you mean" not in output  # as Gymnasium says, which knows CartPole
