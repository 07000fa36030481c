"""Mistakes in a table [environment] are told with file and line; those in arguments by their names."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import physics
from rigid_env import SceneEnv, SceneVectorEnv
from rigid_env.tasks.scene_settings import GOAL_KEYS, KEYS, START_KEYS

CART = Path(__file__).parents[2] / "examples" / "cart.toml"
TEXT = CART.read_text(encoding="utf-8")
LINES = TEXT.splitlines()
GOAL = LINES.index("[environment.goal]") + 1
START = LINES.index("[environment.start]") + 1
TABLE = LINES.index("[environment]") + 1

# A line of the file, what stands there instead, and the message behind "cart.toml, line ...: ".
MISTAKES = {
    "key": ("driven", "drivn = [0]", "environment: drivn is not known; allowed are driven, force"),
    "list": (
        "driven",
        "driven = 1.5",
        "environment: driven holds 1.5; allowed are cart, crate, or indices from 0 to 1",
    ),
    "name": ("driven", "driven = ['crat']", "environment: driven holds 'crat'; allowed are crate, cart, or indices"),
    "index": ("driven", "driven = ['cart', 2]", "environment: driven holds 2; allowed are cart, crate, or indices"),
    "bool": ("driven", "driven = [true]", "environment: driven holds True; allowed are cart, crate, or indices"),
    "none": ("driven", "driven = []", "environment: driven is []; allowed is at least one body"),
    "twice": ("driven", "driven = ['crate', 1]", "environment: driven holds body 1 twice; allowed is each body once"),
    "force": ("force", "force = -1", "environment: force is -1.0; allowed are"),
    "torque": ("torque", "torque = 'much'", "environment: torque is 'much'; allowed is one number"),
    "skip": ("frame_skip", "frame_skip = 0", "environment: frame_skip is 0; allowed are integers of at least 1"),
    "dt": ("frame_skip", "dt = inf", "environment: dt is inf; allowed are"),
    "frame": ("frame_skip", "frame = 'bdy'", "environment: frame is 'bdy'; allowed are body, world"),
    "length": ("frame_skip", "length = 0", "environment: length is 0.0; allowed are"),
    "steps": ("max_episode_steps", "max_episode_steps = 2.5", "environment: max_episode_steps is 2.5; allowed are"),
    "goal-key": ("tolerance", "tolerence = 1", "environment.goal: tolerence is not known; allowed are tolerance"),
    "goal-body": ("body", "body = 'cat'", "environment.goal: body is 'cat'; allowed are cart, crate, or indices"),
    "goal-low": ("low", "low = [1, 2]", "environment.goal: low has shape (2,); allowed is shape (3,)"),
    "goal-both": (
        "high",
        "pos = [1, 2, 3]",
        "environment.goal: pos and low are given; allowed is pos, or low and high",
    ),
    "goal-order": ("high", "high = [1, 1, 1]", "environment.goal: low is [1.5, 0.4, -1.0] and high is [1.0, 1.0, 1.0]"),
    "goal-far": (
        "high",
        "high = [51, 1, 1]",
        "environment.goal: high is [51.0, 1.0, 1.0]; allowed are coordinates from",
    ),
    "goal-tolerance": ("tolerance", "tolerance = 0", "environment.goal: tolerance is 0.0; allowed are"),
    "goal-speed": ("speed", "speed = nan", "environment.goal: speed is nan; allowed are"),
    "start-key": ("pos", "velocity = [0, 0, 0]", "environment.start: velocity is not known; allowed are linvel, pos"),
    "start-one": ("pos", "pos = 0.1", "environment.start: pos is 0.1; allowed is shape (3,)"),
    "start-negative": ("pos", "pos = [0, 0, -1]", "environment.start: pos is [ 0., 0., -1.]; allowed are"),
    "start-sunk": (
        "pos",
        "pos = [0, 1, 0]",
        "environment.start: pos: a start as far off as it may be: pos [-2.0, -0.75",
    ),
}


def place(key: str) -> int:
    """Line of a key of the file's tables."""
    after = START if key == "pos" else GOAL if key in GOAL_KEYS else TABLE
    return next(k for k, line in enumerate(LINES, 1) if k > after and line.startswith(f"{key} ="))


def refused(tmp_path, text: str) -> str:
    """Message about a file with this text, its folder left out."""
    path = tmp_path / "cart.toml"
    path.write_text(text)
    with pytest.raises(ValueError) as found:  # noqa: PT011 (its text is looked at)
        SceneEnv(path)
    return str(found.value).removeprefix(f"{tmp_path}/")


@pytest.mark.parametrize("name", MISTAKES)
def test_a_mistake_is_told_with_its_line(name, tmp_path):
    key, instead, message = MISTAKES[name]
    line = place(key)
    text = "\n".join([*LINES[: line - 1], instead, *LINES[line:]])
    assert refused(tmp_path, text).startswith(f"cart.toml, line {line}: {message}")


@pytest.mark.parametrize(
    ("key", "line", "message"),
    [
        (
            "driven",
            TABLE,
            "environment: driven is missing; allowed is a list of bodies: cart, crate, or indices from 0",
        ),
        ("low", GOAL, "environment.goal: low is missing; allowed is pos [x, y, z], or low and high"),
        ("high", GOAL, "environment.goal: high is missing; allowed is pos [x, y, z], or low and high"),
        ("tolerance", GOAL, "environment.goal: tolerance is missing; allowed is the farthest from the goal [m]"),
    ],
)
def test_what_is_missing_is_told_with_its_table(key, line, message, tmp_path):
    at = place(key)
    told = refused(tmp_path, "\n".join([*LINES[: at - 1], "#", *LINES[at:]]))
    assert told.startswith(f"cart.toml, line {line}: {message}")


def test_tables_that_are_none_are_told(tmp_path):
    head = "\n".join(LINES[: GOAL - 1])
    message = (
        f"cart.toml, line {GOAL}: environment: goal is 3; allowed is a table [environment.goal] with keys of body,"
    )
    assert refused(tmp_path, f"{head}\ngoal = 3\n").startswith(message)
    message = (
        f"cart.toml, line {GOAL}: environment: start is []; allowed is a table [environment.start] with keys of pos"
    )
    assert refused(tmp_path, f"{head}\nstart = []\n").startswith(message)
    message = f"cart.toml, line {GOAL}: environment.goal: speed is -1.0; allowed are"
    assert refused(tmp_path, f"{head}\ngoal = {{pos = [1, 1, 1], tolerance = 1, speed = -1}}\n").startswith(message)
    text = TEXT.replace("force = 0.9", "force = 0").replace("torque = 0.5", "torque = 0")
    message = f"cart.toml, line {place('force')}: environment: force and torque are 0; allowed is at least one above 0"
    assert refused(tmp_path, text) == message


BALL = physics.Scene([physics.Sphere(0.5, 1.0)])
ARGUMENTS = {
    "none": (
        {},
        "scene is None; allowed are a scene file (.toml, .xml or .urdf), its content as a dict, a canonical scene, "
        "or a physics.Scene",
    ),
    "name": ({"scene": "tumbel"}, "scene is 'tumbel'; allowed are tumble,"),
    "file": ({"scene": "nix.toml"}, "scene is 'nix.toml', which does not exist; allowed is a scene file"),
    "number": ({"scene": 3}, "scene is 3; allowed are a scene file"),
    "driven": ({"scene": BALL, "driven": [1]}, "driven holds 1; allowed are the index 0"),
    "missing": ({"scene": "tower"}, "driven is missing; allowed is a list of bodies: indices from 0 to 9"),
    "force": ({"scene": BALL, "force": np.nan}, "force is nan; allowed are"),
    "goal": ({"scene": BALL, "goal": (1, 2, 3)}, "goal is (1, 2, 3); allowed is a dict with keys of body, pos, low"),
    "goal-key": ({"scene": BALL, "goal": {"tolerence": 1}}, "goal: tolerence is not known; allowed are tolerance"),
    "goal-pos": ({"scene": BALL, "goal": {"pos": "up", "tolerance": 1}}, "goal: pos is 'up'; allowed are numbers"),
    "start": ({"scene": BALL, "start": {"pos": (1, 2)}}, "start: pos has shape (2,); allowed is shape (3,)"),
    "of-file": ({"scene": CART, "driven": ["crat"]}, "driven holds 'crat'; allowed are crate, cart, or indices"),
    "effects": ({"scene": BALL, "effects": 3}, "effects is 3; allowed is a sequence of effects"),
}


def test_a_misspelt_file_is_told_with_the_nearest_in_its_folder(tmp_path):
    physics.save_scene(BALL, tmp_path / "small.toml")
    with pytest.raises(ValueError, match=r"smal.toml', which does not exist; .* file, such as '.*small.toml', or"):
        SceneEnv(tmp_path / "smal.toml")


def test_a_file_without_a_table_of_the_environment_says_so(tmp_path):
    bodies = [physics.Sphere(0.5, 1.0, pos=(2 * k, 0, 0), name=name) for k, name in enumerate(("cart", "crate"))]
    physics.save_scene(physics.Scene(bodies), tmp_path / "two.toml")
    told = r"two.toml, line 1: there is no table \[environment\]; allowed is one with driven, .*: cart, crate, or"
    with pytest.raises(ValueError, match=told):
        SceneEnv(tmp_path / "two.toml")
    assert SceneEnv(tmp_path / "two.toml", driven="cart").task is not None


@pytest.mark.parametrize("name", ARGUMENTS)
def test_a_wrong_argument_is_named(name):
    arguments, message = ARGUMENTS[name]
    for make in (SceneEnv, SceneVectorEnv, lambda **given: gym.make("rigid_env:rigid_env/Scene-v0", **given)):
        with pytest.raises(ValueError, match=f"^{re.escape(message)}"):
            make(**arguments)


def test_an_unknown_argument_lists_the_known_ones():
    with pytest.raises(TypeError, match=r"SceneEnv .* keyword argument 'drivn' \(given: 0\); allowed are driven, "):
        gym.make("rigid_env:rigid_env/Scene-v0", scene="drop", drivn=0)


@pytest.mark.parametrize("goal", [(51.0, 0.0, 0.0), (np.inf, 0.0, 0.0), (1.0, 2.0)])
def test_a_goal_that_cannot_be_seen_is_no_option(goal):
    env = SceneEnv("drop", goal={"pos": (1, 2, 0), "tolerance": 1.0})
    env.reset(seed=0)
    before = env.task.drawn["goal"].copy()
    with pytest.raises(ValueError, match=r"options goal is .*; allowed"):
        env.reset(options={"goal": goal})
    np.testing.assert_array_equal(env.task.drawn["goal"], before)


def test_the_page_shows_the_example_its_defaults_and_its_mistake(tmp_path):
    page = (CART.parents[1] / "docs" / "scene-files.md").read_text(encoding="utf-8")
    assert TEXT.endswith(page.split("```toml\n")[2].split("```")[0])
    told = page.split("    cart.toml, ")[1].split("\n")[0]
    assert refused(tmp_path, TEXT.replace('driven = ["cart"]', 'driven = ["crat"]')) == f"cart.toml, {told}"
    rows = re.findall(r"^\| (`[^|]+`) \| ([^|]*?) ?\|", page, re.MULTILINE)
    keys = [(key, default) for names, default in rows for key in re.findall(r"`([\w.]+)`", names)]
    named = [*(f"goal.{key}" for key in GOAL_KEYS), *(f"start.{key}" for key in START_KEYS)]
    assert {key for key, _ in keys} == {*KEYS, *named} - {"goal", "start"}
    settings = SceneEnv("drop", goal={"pos": (0, 0, 0), "tolerance": 1}).task.settings
    for key, default in keys:
        owner, _, field = key.rpartition(".")
        value = getattr(settings.goal if owner == "goal" else settings, field, None)
        if re.match(r'[\d`"]', default) and owner != "start":
            assert ast.literal_eval(default.strip("`")) == value, key


def test_each_key_has_a_mistake_above():
    told = {re.match(r"environment(\.\w+)?: (\w+)", message)[2] for _, _, message in MISTAKES.values()}
    assert {*KEYS, *GOAL_KEYS, *START_KEYS} - told == {"goal", "start", "linvel", "angvel"}  # tables, and as pos
