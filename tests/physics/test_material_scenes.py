"""Materials in scenes: what is refused, files, texts, and changes of coefficients in single worlds."""

from dataclasses import replace

import numpy as np
import pytest

import physics
from physics import Block, Contact, Friction, Gravity, HalfSpace, Scene, Sphere, World
from physics.io.toml import from_toml, to_toml

pytestmark = pytest.mark.interpreted

DIE = Block((0.2, 0.2, 0.2), 0.1, pos=(0, 0.1, 0), name="die", friction=0.4, restitution=0.2)
BALL = Sphere(0.1, 0.1, pos=(1, 0.1, 0), name="ball")
FLOOR = HalfSpace((0, 1, 0), name="floor", friction=0.1)
SIDE = HalfSpace((1, 0, 0), -3.0, name="side", restitution=0.5)
EFFECTS = [Gravity(), Contact(restitution=0.1), Friction(0.5)]
RICH = Scene(
    [DIE, BALL],
    [FLOOR, SIDE],
    [
        Gravity(),
        Contact(0.1, restitution_rule="average", restitution_pairs={("die", "ball"): 0.9, ("ball", "side"): 0.3}),
        Friction(0.5, rule="minimum", pairs=[("floor", "die", 0.25), (1, 0, 0.05)]),
    ],
)


def scene(**friction):
    return Scene([DIE, BALL], [FLOOR, SIDE], [Gravity(), Contact(), Friction(0.5, **friction)])


REFUSED = {
    "negative friction": (lambda: Block((1, 1, 1), 1, friction=-0.1), r"friction is -0.1; allowed are numbers of at"),
    "friction of nan": (lambda: Sphere(1, 1, friction=float("nan")), "friction is nan; allowed are finite"),
    "friction of text": (lambda: Sphere(1, 1, friction="ice"), "friction is 'ice'; allowed is one number"),
    "restitution above 1": (
        lambda: Sphere(1, 1, restitution=1.5),
        "restitution is 1.5; allowed are numbers from 0",
    ),
    "wall": (lambda: HalfSpace((0, 1, 0), friction=-2), "HalfSpace.friction is -2.0; allowed"),
    "wall's restitution": (lambda: HalfSpace((0, 1, 0), restitution=-2), "HalfSpace.restitution is -2.0; allowed"),
    "wall's name": (lambda: HalfSpace((0, 1, 0), name=" x"), "HalfSpace.name is ' x'; allowed"),
    "unknown rule": (lambda: Friction(rule="maximal"), "Friction.rule is 'maximal'; allowed are 'maximum', 'minimum'"),
    "no rule": (lambda: Contact(restitution_rule=None), "Contact.restitution_rule is None; allowed are 'minimum'"),
    "pairs of text": (lambda: Friction(pairs="die"), "Friction.pairs is 'die'; allowed is a dict of two names"),
    "pairs of two": (lambda: Friction(pairs=[("a", "b")]), r"Friction.pairs holds \('a', 'b'\); allowed is a dict"),
    "one name": (lambda: Friction(pairs={"a": 1.0}), r"Friction.pairs holds \('a', 1.0\); allowed is a dict"),
    "an end of nothing": (lambda: Friction(pairs={("a", None): 1.0}), "holds the end None; allowed are names and"),
    "negative pair": (lambda: Friction(pairs={("a", "b"): -1}), r"Friction.pairs\[\('a', 'b'\)\] is -1.0; allowed"),
    "nan of a pair": (lambda: Friction(pairs={("a", "b"): np.nan}), r"Friction.pairs\[\('a', 'b'\)\] is nan; allowed"),
    "a pair twice": (
        lambda: Friction(pairs=[("a", "b", 1), ("b", "a", 1)]),
        r"Friction.pairs holds the pair \('b', 'a'\) twice; allowed is one number",
    ),
    "a pair under two names": (
        lambda: scene(pairs={("die", "floor"): 1, (0, "floor"): 1}),
        r"Friction.pairs holds the pair \(0, 'floor'\) twice",
    ),
    "unknown name": (
        lambda: scene(pairs={("die", "flor"): 1}),
        r"Friction.pairs holds the end 'flor'; allowed are floor, .*indices from -2 to 1 \(b: body b, -1 - k: wall k\)",
    ),
    "unknown index": (lambda: scene(pairs={(0, -3): 1}), "Friction.pairs holds the end -3; allowed are"),
    "two walls": (
        lambda: scene(pairs={("side", "floor"): 1}),
        r"holds the pair \('side', 'floor'\), two walls, which never touch; allowed are two bodies, or a body and a",
    ),
    "one body": (lambda: scene(pairs={("die", 0): 1}), r"holds the pair \('die', 0\), one body twice; allowed"),
    "friction without friction": (
        lambda: Scene([DIE], [], [Contact()]),
        r"Scene.bodies\[0\].friction is 0.4, but the scene has no friction; add physics.Friction\(\)",
    ),
    "friction of a wall without friction": (
        lambda: Scene([BALL], [FLOOR], [Contact()]),
        r"Scene.walls\[0\].friction is 0.1, but the scene has no friction",
    ),
    "restitution without contact": (
        lambda: Scene([Sphere(1, 1, restitution=0.2)]),
        r"Scene.bodies\[0\].restitution is 0.2, but nothing touches; add physics.Contact\(\)",
    ),
    "restitution with springs": (
        lambda: Scene([BALL], [SIDE], [Contact(stiffness=1e3)]),
        r"Scene.walls\[1?0?\].restitution is 0.5 with Contact.stiffness; allowed is None",
    ),
    "pairs with springs": (
        lambda: Contact(stiffness=1e3, restitution_pairs={("a", "b"): 0.1}),
        r"Contact.restitution_pairs is .* with a stiffness; allowed is \(\)",
    ),
    "a wall named as a body": (
        lambda: Scene([DIE], [replace(FLOOR, name="die")], EFFECTS),
        r"Scene.walls\[0\] has the name 'die', as Scene.bodies\[0\]; allowed are different names",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_wrong_input_is_refused_by_field_and_value(name):
    make, words = REFUSED[name]
    with pytest.raises(ValueError, match=words):
        make()


def test_a_scene_file_holds_materials_and_names_the_line_of_a_wrong_one():
    text = to_toml(RICH)
    assert from_toml(text) == RICH
    for old, new, words in (
        ("friction = 0.4", "friction = -1", r"scene, line \d+: bodies\[0\]: Block.friction of 'die' is -1"),
        ('rule = "minimum"', 'rule = "min"', r"scene, line \d+: effects\[2\]: Friction.rule is 'min'"),
        ('"floor", "die"', '"flor", "die"', r"scene, line \d+: Friction.pairs holds the end 'flor'"),
        ('name = "floor"', 'name = "die"', r"scene, line \d+: Scene.walls\[0\] has the name 'die'"),
    ):
        assert old in text
        with pytest.raises(ValueError, match=words):
            from_toml(text.replace(old, new))


def test_a_repr_makes_the_scene_again_and_shows_only_what_was_given():
    for item in (DIE, FLOOR, *RICH.effects, Scene([DIE], [FLOOR], EFFECTS)):
        assert eval(repr(item), vars(physics).copy()) == item
    assert "friction" not in repr(BALL)
    assert "pairs" not in repr(Friction(0.5))
    assert repr(FLOOR) == "HalfSpace(normal=(0.0, 1.0, 0.0), offset=0.0, name='floor', friction=0.1)"


def test_the_plan_tells_which_coefficients_are_own():
    text = World(RICH).plan.explain()
    assert "declared: μ = 0.5; own of 1 body, 1 wall, 2 pairs; rule minimum" in text
    assert "declared: e = 0.1; own of 1 body, 1 wall, 2 pairs; rule average" in text
    assert "a number per wall" in text
    plain = World(Scene([BALL], [HalfSpace((0, 1, 0))], EFFECTS)).plan.explain()
    assert "own of" not in plain
    assert "rule" not in plain


# --- changes of single worlds -----------------------------------------------------------------------------------------


def ways(world):
    """Ways [m] that blocks slide in the worlds of a batch, times 2 g/v²: the inverse of their frictions."""
    world.step(steps=2000)
    return world.pos[:, 0, 0] * 2 * 9.81 / 2.0**2


def test_each_world_may_have_its_own_coefficients():
    block = Block((1.0, 0.2, 1.0), 2.0, pos=(0, 0.1, 0), linvel=(2.0, 0, 0))
    sliding = Scene(
        [block], [HalfSpace((0, 1, 0), friction=0.4)], [Gravity(), Contact(), Friction(0.4, rule="average")]
    )
    world = World(sliding, worlds=4, dt=0.005, accuracy="precise")
    world.set_parameters(friction=[0.2, 0.4, 0.2, 0.6], wall_friction=[0.6, np.nan, 0.4, 0.2])
    world.set_parameters(wall_friction=0.8, worlds=[3])
    assert 1 / ways(world) == pytest.approx([0.4, 0.4, 0.3, 0.7], rel=1e-9)
    snapshot = world.snapshot()
    other = World(sliding, worlds=4, dt=0.005, accuracy="precise")
    other.restore(snapshot)
    assert np.array_equal(other.params, world.params, equal_nan=True)


def test_a_wrong_coefficient_of_a_wall_changes_nothing():
    plain, alike = (
        World(Scene([BALL], [replace(FLOOR, friction=mu), HalfSpace((1, 0, 0), -9, friction=mu)], EFFECTS), worlds=2)
        for mu in (None, 0.3)
    )
    differ = World(Scene([DIE, BALL], [FLOOR, SIDE], EFFECTS), worlds=2)
    for world, given, words in (
        (
            plain,
            {"wall_friction": 0.1},
            "wall_friction was given, but no wall of the scene has a friction",
        ),
        (alike, {"wall_restitution": 2}, r"wall_restitution is \[\[2.*; allowed are numbers from 0 to 1"),
        (alike, {"wall_friction": [[0.1, 0.2]] * 2}, r"wall_friction is \[\[0.1.* allowed is one number for all walls"),
        (differ, {"wall_friction": -0.1}, r"wall_friction is \[\[-0.1.*; allowed are numbers of at least 0"),
        (differ, {"wall_friction": np.inf}, r"wall_friction is \[\[inf.*; allowed are"),
        (differ, {"wall_friction": [1, 2, 3]}, r"wall_friction has shape \(3,\); allowed is shape \(2, 2\)"),
    ):
        before = world.params.copy()
        with pytest.raises(ValueError, match=words):
            world.set_parameters(mass=0.5, **given)
        assert np.array_equal(world.params, before, equal_nan=True)
    alike.set_parameters(wall_friction=[0.1, 0.2])
    differ.set_parameters(wall_friction=[[0.1, np.nan], [np.nan, 0.2]], wall_restitution=0.3)


def test_a_friction_of_the_scene_leaves_bodies_their_own():
    world = World(Scene([DIE, BALL], [FLOOR], EFFECTS), worlds=2)
    world.set_parameters(effects=[Friction(0.8)], worlds=[1])
    column = physics.kernels.state.layout.FRICTION
    assert world.params[:, column].tolist() == [0.4, 0.5, 0.4, 0.8]
    with pytest.raises(ValueError, match=r"Friction.rule is 'minimum'; allowed is the scene's, 'geometric_mean'"):
        world.set_parameters(effects=[Friction(0.8, rule="minimum")])


def test_a_snapshot_is_refused_by_a_scene_with_other_rules_pairs_or_walls():
    world = World(RICH)
    snapshot = world.snapshot()
    numbers = replace(RICH, bodies=(replace(DIE, friction=0.1), BALL), walls=(replace(FLOOR, friction=0.9), SIDE))
    World(numbers).restore(snapshot)  # each world has its own numbers
    friction, contact = RICH.effect(Friction), RICH.effect(Contact)
    for other in (
        replace(RICH, effects=(Gravity(), contact, replace(friction, rule="maximum"))),
        replace(RICH, effects=(Gravity(), contact, replace(friction, pairs=()))),
        replace(RICH, effects=(Gravity(), replace(contact, restitution_rule="product"), friction)),
        replace(RICH, walls=(FLOOR, replace(SIDE, restitution=None))),
    ):
        with pytest.raises(ValueError, match="snapshot is of another scene"):
            World(other).restore(snapshot)


def test_a_recording_plays_a_scene_with_materials_again(tmp_path):
    world = World(RICH, dt=0.01)
    recorder = physics.Recorder(world)
    world.set_state(linvel=[[2, 0, 0], [-1, 0, 0]])
    world.step(steps=50)
    recorder.save(tmp_path / "run.npz")
    assert physics.Recording.load(tmp_path / "run.npz").replay().is_identical
