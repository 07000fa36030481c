"""Scenes as files: every canonical scene comes back equal, and mistakes are told with their line."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import pytest

import physics
from physics import scenes
from physics.io.toml import file_from_toml, from_toml, to_toml

EVERYTHING = physics.Scene(
    [
        physics.Block((5, 3, 2), 6.0, pos=(0.1, 0.2, 0.3), quat=(0.5, 0.5, -0.5, 0.5), center=(0.1, 0, 0),
                      inertia_body=((3, 0.1, 0), (0.1, 4, 0), (0, 0, 5))),
        physics.Sphere(0.1, 1 / 3, linvel=(1e-300, -2.5e17, 0), name="ball"),
        physics.Ellipsoid((1, 2, 3), 4.0, angvel=(1, 2, 3)),
    ],
    [physics.HalfSpace((1, 2, 3), -0.7)],
    [
        physics.Gravity((0.1, -9.81, 0)), physics.Contact(0.3, tangential=-0.2), physics.Friction(0.7),
        physics.RollingFriction(0.02), physics.SpinFriction(0.003), physics.Actuator(5.0, lag=0.1, delay=0.02),
        physics.Sleeping(8.0, time=0.5),
        physics.Drag(0.4, linear=0.1),
        physics.AngularDrag(0.1, 0.2), physics.Magnus(0.9), physics.Wind((1, 2, 3), 0.5, seed=7),
        physics.Buoyancy(998.0, (0.1, 1, 0)), physics.Spring((1, 2, 3), body=1), physics.Spring(damping=3.0, body=2),
        physics.Spring((1, 0, 0), (0, 0.5, 0), body=2, other=0),
        physics.Push((1, 2, 3), frame="body"),
    ],
)  # fmt: skip


@pytest.mark.parametrize("name", [*scenes.SCENES, "everything"])
def test_a_scene_comes_back_equal(name, tmp_path):
    scene = EVERYTHING if name == "everything" else scenes.by_name(name)
    path = tmp_path / "scene.toml"
    physics.save_scene(scene, path)
    back = physics.load_scene(path)
    assert back == scene
    assert to_toml(back) == path.read_text(encoding="utf-8")


def test_what_is_left_out_has_its_default():
    scene = from_toml('[[bodies]]\nkind = "Sphere"\nradius = 1\nmass = 2\n\n[[effects]]\nkind = "Gravity"\n')
    assert scene == physics.Scene([physics.Sphere(1.0, 2.0)], effects=[physics.Gravity()])


BALL = '[[bodies]]\nkind = "Sphere"\nradius = 1\nmass = 2\n'
MISTAKES = [
    ("bodies = 3", "line 1: bodies is 3"),
    (
        BALL + "[[bodies]]\nkind = 'Cube'\n",
        r"line 6: bodies\[1\]: kind is 'Cube'; allowed are Block, Sphere",
    ),
    (BALL + "colour = 1\n", r"line 5: bodies\[0\]: colour is not known; allowed are .*radius"),
    (BALL + "pos = [1, 2]\n", r"line 5: bodies\[0\]: Sphere.pos has shape \(2,\)"),
    ('[[bodies]]\nkind = "Sphere"\nmass = 2\n', r"line 1: bodies\[0\]: radius is missing"),
    ("\n" + BALL.replace("mass = 2", "mass = -2"), r"line 5: bodies\[0\]: Sphere.mass is -2"),
    (BALL + "[[walls]]\noffset = 1\n", r"line 5: walls\[0\]: normal is missing"),
    (BALL + "[[effects]]\nkind = 'Drag'\n\nlinear = -1\n", r"line 8: effects\[0\]: Drag.linear is -1"),
    (BALL + "[[effects]]\nkind = 'Friction'\n", "Friction without Contact"),
    (BALL + "[[effect]]\n", "line 5: effect is not known; allowed are effects, format, bodies, walls"),
    ("format = 2\n" + BALL, "line 1: format is 2; allowed is 1"),
    ("mass = \n", "line 1, column 8: Invalid value, in 'mass ='; allowed is TOML"),
    ("\n[[bodies]\n", r"line 2, column 9: .*, in '\[\[bodies\]'; allowed is TOML"),
    ("", "Scene.bodies is empty"),
    (BALL + "color = 1\nmas = 3\n", r"line 5: bodies\[0\]: color is not known; allowed are "),
    (BALL + "denstiy = 1\n", r"line 5: bodies\[0\]: denstiy is not known; allowed are density, "),
    (BALL + "[[effects]]\nkind = 'Gravty'\n", r"line 6: effects\[0\]: kind is 'Gravty'; allowed are Gravity, "),
    (BALL + "[[effects]]\nkind = 3\n", r"line 6: effects\[0\]: kind is 3; allowed are Gravity, "),
    (BALL + "[[effects]]\nradius = 3\n", r"line 5: effects\[0\]: kind is missing; allowed are Gravity, "),
    (BALL + "[[walls]]\nnormal = [0, 1, 0]\nofset = 1\n", r"line 7: walls\[0\]: ofset .*; allowed are offset, normal"),
    (BALL + "[[walls]]\nnormal = 'up'\n", r"line 6: walls\[0\]: HalfSpace.normal is 'up'; allowed are numbers"),
    (BALL + "quat = [1, 1, 0, 0]\n", r"line 5: bodies\[0\]: Sphere.quat is .* of norm 1.41421; allowed are unit quat"),
    (BALL + "pos = [0, true, 1]\n", r"line 5: bodies\[0\]: Sphere.pos is \[0, True, 1\]; allowed are numbers"),
    ("format = true\n" + BALL, "line 1: format is True; allowed is 1"),
    ("[bodies]\nkind = 'Sphere'\n", r"line 1: bodies is \{'kind': 'Sphere'\}; allowed are tables \[\[bodies\]\]"),
    (
        '[[bodies]]\nkind = "Sphere"\nradius = 1\n',
        r"line 1: bodies\[0\]: Sphere.mass is None and density is None; allowed is",
    ),
    (BALL + "density = 2\n", r"line 4: bodies\[0\]: Sphere.mass is 2 and density is 2; allowed is exactly one"),
    (BALL + "[[effects]]\nkind = 'Gravity'\n" * 2, "line 7: Scene.effects holds 2 Gravity; allowed is one"),
    (BALL + "[[effects]]\nkind = 'Friction'\n", "line 5: Scene.effects holds Friction without Contact; add"),
    (
        BALL + "[[effects]]\nkind = 'Gravity'\n[[effects]]\nkind = 'Push'\nbody = 4\n",
        "line 7: Push.body is 4; allow",
    ),
    (
        BALL + "name = 'ball'\n[[effects]]\nkind = 'Push'\nbody = 'bal'\n",
        "line 6: Push.body is 'bal'; allowed are ball",
    ),
    (BALL + "name = ' '\n", r"line 5: bodies\[0\]: Sphere.name is ' '; allowed are printable characters"),
    (
        BALL + "name = 'a'\n" + BALL + "name = 'a'\n",
        r"line 6: Scene.bodies\[1\] has the name 'a', as Scene.bodies\[0\]; allowed are different names",
    ),
    (BALL + "[enviroment]\n", "line 5: enviroment is not known; allowed are environment, format, bodies"),
    (BALL + "[[environment]]\n", r"line 5: environment is \[\{\}\]; allowed is a table \[environment\]"),
    ("bodies = [{kind = 'Sphere', radius = 1, mass = 0}]", r"line 1: bodies\[0\]: Sphere.mass is 0.0; allowed are"),
]


@pytest.mark.parametrize(("text", "message"), MISTAKES)
def test_a_mistake_is_told_with_its_line(text, message):
    with pytest.raises(ValueError, match=f"(?s)^here.*{message}"):
        from_toml(text, "here")


def test_a_density_may_stand_in_the_file(tmp_path):
    scene = from_toml(BALL.replace("mass = 2", "density = 3"))
    assert scene.bodies[0].mass == 3 * scene.bodies[0].volume
    assert "density" not in to_toml(scene)
    assert from_toml(to_toml(scene)) == scene


def test_a_table_of_another_program_is_handed_back_with_its_lines():
    text = BALL + "[environment]\ndriven = [0]\ngoal = {body = 0}\n[environment . start]\n\npos = 1 # [m]\n"
    file = file_from_toml(text, "here")
    assert file.scene == from_toml(BALL)
    assert file.others == {"environment": {"driven": [0], "goal": {"body": 0}, "start": {"pos": 1}}}
    lines = {
        ("environment", "driven"): 6, ("environment", "dt"): 5, ("environment", None): 5,
        ("environment.goal", "body"): 7, ("environment.start", "pos"): 10, ("environment.start", None): 8,
    }  # fmt: skip
    for (table, key), line in lines.items():
        assert str(file.places.error_in_table(table, key, "no")) == f"here, line {line}: {table}: no"


def test_a_key_that_is_missing_is_not_looked_for_in_the_table_behind():
    text = BALL.replace("mass = 2\n", "points = [\n[1, 2],\n]\n") + "[environment]\nmass = 1\n"
    with pytest.raises(ValueError, match=r"here, line 4: .*points is not known"):
        from_toml(text, "here")
    with pytest.raises(ValueError, match=r"here, line 1: .*mass is None"):
        from_toml(text.replace("points = [\n[1, 2],\n]\n", ""), "here")


def test_a_file_that_cannot_be_read_is_named(tmp_path):
    path = tmp_path / "scene.toml"
    with pytest.raises(FileNotFoundError, match=r"scene\.toml.*does not exist; allowed is"):
        physics.load_scene(path)
    path.write_bytes(b"# caf\xe9\n")
    with pytest.raises(ValueError, match=r"scene.toml: byte 5 is no UTF-8; allowed is a text file"):
        physics.load_scene(path)
    with pytest.raises(ValueError, match=r"kinds holds <class 'int'>; allowed are subclasses of physics.Field"):
        from_toml(BALL, kinds=[int])


@physics.field_function
def pull(state, p, t):
    """Towards x = 0."""
    return (-p[0] * state.x[0], 0.0, 0.0), (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Trough(physics.Field):
    """A field of one's own."""

    stiffness: float = 1.0
    function: ClassVar = pull


def test_a_field_of_ones_own_is_read_where_its_class_is_given(tmp_path):
    scene = physics.Scene([physics.Sphere(1, 2)], effects=[Trough(3.0)])
    path = tmp_path / "scene.toml"
    physics.save_scene(scene, path)
    assert physics.load_scene(path, kinds=[Trough]) == scene
    with pytest.raises(ValueError, match="kind is 'Trough'; allowed are Gravity"):
        physics.load_scene(path)


def test_the_file_of_the_docs_is_read_and_its_mistake_told_as_stated(tmp_path):
    page = (Path(__file__).parents[2] / "docs" / "scene-files.md").read_text(encoding="utf-8")
    text = page.split("```toml\n")[1].split("```")[0]
    scene = from_toml(text)
    assert [type(effect).__name__ for effect in scene.effects] == ["Gravity", "Contact", "Drag"]
    told = page.split("    ball.toml, ")[1].split("\n")[0]
    with pytest.raises(ValueError, match=f"^{re.escape('ball.toml, ' + told)}$"):
        from_toml(text.replace("mass = ", "mass = -"), "ball.toml")
