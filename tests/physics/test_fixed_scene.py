"""Fixed bodies in descriptions: what is refused, and files, texts and tables of scenes that hold them."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

import physics
from physics.analysis.trajectory_arrays import scene_arrays, scene_of
from physics.io.mjcf import plain_reader
from physics.io.mjcf.text import parse
from physics.io.mjcf.writer import to_mjcf
from physics.io.plain import plain_scene
from physics.io.toml import from_toml, to_toml
from physics.plan.plan import make_plan
from physics.work_precision.errors import mechanical_energy

WEDGE = [(x, y, z) for z in (0, 1) for x, y in ((0, 0), (1, 0), (0, 0.5))]
BALL = physics.Sphere(0.3, 1.0, pos=(0, 1, 0))
FIXED = {
    "block": physics.Block((4, 1, 4), fixed=True, pos=(0, -0.5, 0), name="table"),
    "sphere": physics.Sphere(0.5, fixed=True, pos=(2, 0, 0)),
    "ellipsoid": physics.Ellipsoid((0.1, 0.2, 0.3), fixed=True, pos=(-2, 0, 0)),
    "hull": physics.Hull(WEDGE, fixed=True, pos=(3, 0, 0), quat=(0.8, 0.6, 0, 0), name="wedge"),
}
EFFECTS = [physics.Gravity(), physics.Contact(), physics.Friction(0.5)]
SCENE = physics.Scene([FIXED["block"], BALL, *list(FIXED.values())[1:]], [physics.HalfSpace((0, 1, 0), -1)], EFFECTS)


@pytest.mark.parametrize("body", FIXED.values(), ids=FIXED)
def test_a_fixed_body_has_infinite_mass_and_its_repr_makes_it_again(body):
    assert body.mass == math.inf
    np.testing.assert_array_equal(body.inertia, np.diag([np.inf] * 3))
    assert "fixed=True" in repr(body)
    assert "mass" not in repr(body)
    assert eval(repr(body), vars(physics)) == body
    assert replace(body, pos=(1, 2, 3)).fixed
    assert "mass" not in body._repr_html_()


def test_bodies_that_move_show_no_word_of_it():
    assert "fixed" not in repr(BALL)
    assert "fixed" not in BALL._repr_html_()


BAD = [
    (lambda: physics.Sphere(1.0, 2.0, fixed=True), "mass is 2.0 of a fixed body; allowed is none"),
    (lambda: physics.Sphere(1.0, density=2.0, fixed=True), "density is 2.0 of a fixed body"),
    (lambda: physics.Sphere(1.0, inertia_body=(1, 1, 1), fixed=True), "inertia_body is .* of a fixed body"),
    (lambda: physics.Sphere(1.0, linvel=(0, 1, 0), fixed=True), "linvel is .* of a fixed body; allowed is .0, 0, 0."),
    (lambda: physics.Sphere(1.0, angvel=(0, 1, 0), fixed=True), "angvel is .* of a fixed body"),
    (lambda: physics.Block((1, 1, 1), center=(0, 0.1, 0), fixed=True), "center is .* of a fixed body"),
    (lambda: physics.Sphere(1.0, fixed="yes"), "fixed is 'yes'; allowed are True and False"),
    (lambda: physics.Sphere(1.0), "mass is None and density is None"),
    (lambda: physics.Scene([FIXED["block"]], effects=EFFECTS), "holds only fixed bodies; allowed is at least one"),
    (lambda: with_effect(physics.Push((1, 0, 0), body=0)), "Push.body is 0, a fixed body"),
    (lambda: with_effect(physics.Spring(body=0)), "Spring.body is 0, a fixed body"),
    (lambda: with_effect(physics.Spring(body=0, other=1)), "exchange the ends of the spring, with body=1"),
    (
        lambda: with_effect(physics.Spring(body=1, other=0, anchor=(1, 0.5, 0))),
        r"Spring.other is 0, a fixed body; .* anchor in the world: anchor=\(1.0, 0.0, 0.0\)",
    ),
]


def with_effect(effect) -> physics.Scene:
    return physics.Scene([FIXED["block"], BALL], [physics.HalfSpace((0, 1, 0), -1)], [*EFFECTS, effect])


@pytest.mark.parametrize(("make", "message"), BAD)
def test_errors_name_the_field_and_the_body(make, message):
    with pytest.raises(ValueError, match=message):
        make()


def test_without_contact_it_warns():
    with pytest.warns(physics.SceneWarning, match="Scene.bodies holds fixed bodies"):
        scene = physics.Scene([FIXED["block"], physics.Sphere(0.3, 1.0, pos=(0, 1, 0))], effects=[physics.Gravity()])
    assert scene.bodies[0].fixed


def test_scene_files_hold_them():
    text = to_toml(SCENE)
    assert "fixed = true" in text
    assert "inf" not in text
    assert from_toml(text) == SCENE
    assert "mass" not in plain_scene(SCENE)["bodies"][0]


def test_mjcf_holds_them_as_bodies_without_joints():
    """Both readers; a mesh turns to its principal axes in single precision, and back."""
    pytest.importorskip("mujoco")
    text = to_mjcf(SCENE)
    for read in (from_mjcf, lambda text: plain_reader.read_scene(parse(text))):
        back = read(text)
        assert [body.fixed for body in back.bodies] == [body.fixed for body in SCENE.bodies]
        assert [body.name for body in back.bodies] == [body.name for body in SCENE.bodies]
        assert back.effects == SCENE.effects
        for body, again in zip(SCENE.bodies, back.bodies, strict=True):
            np.testing.assert_allclose(again.pos, body.pos, atol=1e-6)
            np.testing.assert_allclose(again.dimensions, body.dimensions, rtol=1e-6)


def from_mjcf(text: str) -> physics.Scene:
    from physics.io.mjcf.files import from_mjcf

    return from_mjcf(text)


def test_geoms_of_mujocos_world_become_fixed_bodies():
    pytest.importorskip("mujoco")
    text = """<mujoco><option gravity="0 0 -9.81"/><worldbody>
      <geom name="crate" type="box" size="1 2 0.5" pos="0 0 -0.5" euler="0 0 90"/>
      <body pos="0 0 1"><freejoint/><geom type="sphere" size="0.2" mass="1"/></body>
      <body name="arm" pos="3 0 0"><geom type="ellipsoid" size="1 0.5 0.2" pos="0 0 1"/></body>
    </worldbody></mujoco>"""
    scene = from_mjcf(text)
    assert [(type(body), body.fixed, body.name) for body in scene.bodies] == [
        (physics.Block, True, "crate"), (physics.Sphere, False, None), (physics.Ellipsoid, True, "arm"),
    ]  # fmt: skip
    np.testing.assert_allclose(scene.bodies[0].quat, (math.sqrt(0.5), 0, 0, math.sqrt(0.5)), atol=1e-12)
    np.testing.assert_allclose(scene.bodies[2].pos, (3, 0, 1), atol=1e-12)


def test_trajectory_files_hold_them():
    back = scene_of(scene_arrays(SCENE))
    assert [body.fixed for body in back.bodies] == [body.fixed for body in SCENE.bodies]
    assert [body.kind for body in back.bodies] == [body.kind for body in SCENE.bodies]


def test_energy_of_samples_leaves_them_out():
    count = len(SCENE.bodies)
    pos, quat = np.array([[body.pos for body in SCENE.bodies]]), np.array([[body.quat for body in SCENE.bodies]])
    energy = mechanical_energy(SCENE, pos, quat, np.zeros((1, count, 3)), np.zeros((1, count, 3)))
    np.testing.assert_allclose(energy, [[0.0, 9.81, 0.0, 0.0, 0.0]])


def test_the_plan_names_them():
    assert "fixed bodies" in make_plan(SCENE, "balanced").explain()
    assert "bodies 0, 2, 3, 4" in make_plan(SCENE, "balanced").explain()
    assert "fixed bodies" not in make_plan(physics.scenes.drop(), "balanced").explain()
