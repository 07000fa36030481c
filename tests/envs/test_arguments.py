"""Groups of arguments: constructors take their fields by name and place, and say so."""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from typing import get_type_hints

import pytest

import physics
from rigid_env.envs.arguments import CommonArguments, VectorArguments
from rigid_env.envs.block import BlockEnv, BlockVectorEnv
from rigid_env.envs.env import RigidEnv
from rigid_env.envs.scene import SceneEnv, SceneVectorEnv
from rigid_env.envs.task import TaskEnv, TaskVectorEnv
from rigid_env.envs.vector_env import RigidVectorEnv
from rigid_env.tasks.arguments import part, takes

ONE = ("render_mode", "width", "height", "obs", "obs_size", "obs_stack", "contacts", "impacts")
MANY = ("autoreset_mode", "max_episode_steps", *ONE)


@dataclass(frozen=True)
class Place:
    """Place of a lamp."""

    room: str
    floor: int = 0


@dataclass(frozen=True, kw_only=True)
class Light:
    """Light of a lamp."""

    power: float = 60.0


@dataclass(frozen=True)
class LampArguments(Light, Place):
    """Both."""


class Lamp:
    """Something with a constructor of groups."""

    @takes(LampArguments)
    def __init__(self, given: LampArguments) -> None:
        self.given = given


def test_a_constructor_takes_fields_by_name_and_place():
    assert Lamp("hall", 2, power=3.0).given == LampArguments("hall", 2, power=3.0)
    assert Lamp(room="hall").given == LampArguments("hall")
    assert part(Lamp("hall").given, Place) == {"room": "hall", "floor": 0}
    assert part(Lamp("hall").given, Light, Place) == {"power": 60.0, "room": "hall", "floor": 0}


def test_tools_see_the_fields_as_parameters():
    written = "(room: 'str', floor: 'int' = 0, *, power: 'float' = 60.0)"
    assert str(inspect.signature(Lamp)) == written
    assert list(inspect.signature(Lamp.__init__).parameters) == ["self", "room", "floor", "power"]
    assert get_type_hints(Lamp.__init__) == {"room": str, "floor": int, "power": float}
    assert get_type_hints(BlockEnv.__init__)["accuracy"] == get_type_hints(SceneEnv.__init__)["accuracy"]


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: Lamp(), r"Lamp\.__init__\(\) missing 1 required positional argument: 'room'"),
        (lambda: Lamp("hall", colour=1), r"Lamp\.__init__\(\) got an unexpected keyword argument 'colour'"),
        (lambda: Lamp("hall", 1, 2), r"Lamp\.__init__\(\) takes from 2 to 3 positional arguments but 4"),
    ],
)
def test_errors_name_the_constructor(call, message):
    with pytest.raises(TypeError, match=message):
        call()


@pytest.mark.parametrize(
    ("kind", "first"),
    [
        (RigidEnv, ("task", *ONE)),
        (RigidVectorEnv, ("task", *MANY)),
        (BlockEnv, ONE),
        (BlockVectorEnv, ("num_envs", *MANY)),
        (SceneEnv, ("scene", *ONE)),
        (SceneVectorEnv, ("num_envs", "scene", *MANY)),
    ],
)
def test_places_of_arguments(kind, first):
    found = inspect.signature(kind).parameters.values()
    assert tuple(each.name for each in found if each.kind is each.POSITIONAL_OR_KEYWORD) == first


@pytest.mark.parametrize(("kind", "group"), [(TaskEnv, CommonArguments), (TaskVectorEnv, VectorArguments)])
def test_environments_of_any_task_write_the_same_arguments_out(kind, group):
    """They take settings of any name, which no group can hold; what they share with the others must not differ."""
    own, shared = inspect.signature(kind).parameters, inspect.signature(group).parameters
    assert {name: own[name].default for name in shared} == {name: each.default for name, each in shared.items()}
    assert {name: own[name].annotation for name in shared} == {name: each.annotation for name, each in shared.items()}


def test_settings_of_a_scene_reach_its_task():
    env = SceneEnv("drop", force=0.25, frame_skip=3, episode_steps=7, effects=[physics.Drag(0.1)])
    assert (env.task.settings.force, env.task.frame_skip, env.task.max_episode_steps) == (0.25, 3, 7)
    assert [type(each) for each in env.task.effects] == [physics.Drag]
