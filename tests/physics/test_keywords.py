"""Misspelt keywords: the message lists the known ones with the nearest first, and signatures stay."""

from __future__ import annotations

import dataclasses
import inspect
import pickle

import pytest

import physics
from physics.keywords import known_keywords, nearest_first


@known_keywords
@dataclasses.dataclass(frozen=True)
class Ball:
    """A frozen dataclass."""

    radius: float
    mass: float = 1.0
    pos: tuple = dataclasses.field(default=(0.0, 0.0, 0.0), kw_only=True)


@known_keywords
class Room:
    """A class with its own constructor."""

    def __init__(self, width: float, *, accuracy: str = "fast"):
        self.width, self.accuracy = width, accuracy


@known_keywords
def throw(ball: Ball, speed: float = 1.0) -> float:
    """A function."""
    return ball.mass * speed


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: Room(2.0, acuracy="fast"),
            "Room got an unexpected keyword argument 'acuracy' (given: 'fast'); allowed are accuracy, width",
        ),
        (
            lambda: Ball(1.0, mas=2),
            "Ball got an unexpected keyword argument 'mas' (given: 2); allowed are mass, radius, pos",
        ),
        (
            lambda: throw(Ball(1.0), sped=3),
            "throw got an unexpected keyword argument 'sped' (given: 3); allowed are speed, ball",
        ),
        (
            lambda: dataclasses.replace(Ball(1.0), Pos=1),
            "Ball got an unexpected keyword argument 'Pos' (given: 1); allowed are pos",
        ),
    ],
)
def test_a_misspelt_keyword_is_told_with_the_nearest_first(call, message):
    with pytest.raises(TypeError) as told:
        call()
    assert str(told.value).startswith(message)


@pytest.mark.parametrize(
    ("name", "first"),
    [("position", "pos"), ("velocity", "linvel"), ("angular_velocity", "angvel"), ("Static", "fixed")],
)
def test_a_name_of_other_engines_is_told_with_ours_first(name, first):
    with pytest.raises(TypeError, match=rf"Block got an unexpected .* '{name}' .*; allowed are {first}, "):
        physics.Block((1, 1, 1), 1.0, **{name: (0, 1, 0)})


def test_an_argument_given_twice_is_told_with_both_values_and_the_order():
    with pytest.raises(TypeError) as told:
        physics.Spring("crate", anchor=(0, 3, 0))
    assert str(told.value) == (
        "Spring got multiple values for argument 'anchor': 'crate' without a name, and anchor=(0, 3, 0); allowed is "
        "one: without names they are, in order, anchor, point, stiffness, damping, length, body, other"
    )
    with pytest.raises(TypeError, match="throw got multiple values for argument 'ball': 1 without a name, and ball=2"):
        throw(1, ball=2)


def test_a_long_value_is_told_in_short():
    with pytest.raises(TypeError) as told:
        Ball(1.0, poss=list(range(100_000)))
    assert len(str(told.value)) < 160


def test_nothing_else_changes():
    assert list(inspect.signature(Ball).parameters) == ["radius", "mass", "pos"]
    assert str(inspect.signature(Room)).replace("'", "") == "(width: float, *, accuracy: str = fast)"
    assert str(inspect.signature(throw)).endswith("-> 'float'")
    assert (Room.__name__, throw.__name__, throw.__doc__) == ("Room", "throw", "A function.")
    ball = Ball(2.0, pos=(1, 2, 3))
    assert pickle.loads(pickle.dumps(ball)) == ball == dataclasses.replace(ball)
    assert throw(ball, speed=3.0) == 3.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        ball.mass = 2.0
    with pytest.raises(TypeError, match="missing 1 required positional argument: 'radius'"):
        Ball()


def test_what_takes_every_keyword_is_refused():
    with pytest.raises(TypeError, match=r"gather takes \*\*kwargs"):

        @known_keywords
        def gather(**kwargs):
            """Anything."""


@pytest.mark.parametrize(
    ("module", "name", "first"),
    [
        (physics, "Box", "Block"),
        (physics, "Ball", "Sphere"),
        (physics, "Wrold", "World"),
        (physics.scenes, "dorp", "drop"),
        (physics.scenes, "by_nam", "by_name"),
    ],
)
def test_a_misspelt_name_of_a_module_is_told_with_the_nearest_first(module, name, first):
    with pytest.raises(
        AttributeError, match=rf"module 'physics[.\w]*' has no attribute '{name}'; allowed are {first}, "
    ):
        getattr(module, name)
    assert not hasattr(module, name)


def test_names_that_are_not_alike_keep_their_order():
    assert nearest_first("best", ["fast", "balanced", "precise"]) == ["fast", "balanced", "precise"]
    assert nearest_first("zzz", ["b", "a", "c"]) == ["b", "a", "c"]
    assert nearest_first("Gravty", ["Contact", "Friction", "Gravity"])[0] == "Gravity"
