"""Settings as plain data: environments read them, and the specs that Gymnasium keeps survive JSON."""

from __future__ import annotations

import json
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.envs.registration import EnvSpec

import physics
from physics.io.plain import plain_scene
from physics.io.toml import tomllib
from rigid_env import TaskEnv, register_task
from rigid_env.envs.plain import import_path
from rigid_env.tasks import Uniform
from tests.tasks.conftest import Slide

pytestmark = pytest.mark.interpreted

REACH, SCENE = "rigid_env/BlockReach-v0", "rigid_env/Scene-v0"
CART = Path(__file__).parents[2] / "examples" / "cart.toml"
BALL = physics.Scene(
    [physics.Sphere(0.5, 1.0, pos=(0, 0.7, 0), name="ball")],
    [physics.HalfSpace((0, 1, 0), 0.0)],
    [physics.Gravity(), physics.Contact(0.3), physics.Friction(0.2), physics.Drag(0.1)],
)


class Attraction(physics.Field):
    """A field of a user's own."""


class Sliding(Slide):
    """A task that can be imported."""


@pytest.fixture
def ids():
    """Ids that a test registers, taken away after it."""
    before = set(gym.registry)
    yield
    for each in set(gym.registry) - before:
        del gym.registry[each]


def through_json(env: gym.Env) -> gym.Env:
    """The environment that another process makes from the spec."""
    return gym.make(EnvSpec.from_json(env.spec.to_json()))


def check_same(first: gym.Env, second: gym.Env, steps: int = 50) -> None:
    """Compare the bits of an episode."""
    rng = np.random.default_rng(3)
    np.testing.assert_array_equal(first.reset(seed=5)[0], second.reset(seed=5)[0])
    for _ in range(steps):
        action = rng.uniform(-1.0, 1.0, first.action_space.shape).astype(np.float32)
        ours, theirs = first.step(action), second.step(action)
        np.testing.assert_array_equal(ours[0], theirs[0])
        assert ours[1:3] == theirs[1:3]
        if ours[2]:
            break


@pytest.mark.parametrize(
    ("env_id", "settings"),
    [
        (REACH, {"accuracy": physics.Accuracy(tolerance=1e-3, iterations=7)}),
        (
            REACH,
            {
                "effects": [physics.Drag(0.2), physics.Gravity((0, -5, 1)), physics.Wind((1.0, 0.0, 2.0))],
                "mass": (4, 8),
            },
        ),
        (SCENE, {"scene": BALL, "effects": (physics.Friction(0.4),), "goal": {"pos": (1, 0.5, 1), "tolerance": 0.1}}),
        (SCENE, {"scene": CART}),
    ],
)
def test_a_spec_survives_json_with_the_same_bits(env_id, settings):
    env = gym.make(env_id, **settings)
    again = through_json(env)
    assert again.unwrapped.task.world.accuracy == env.unwrapped.task.world.accuracy
    assert again.unwrapped.task.world.scene == env.unwrapped.task.world.scene
    check_same(env, again, 50 if "accuracy" in settings else 10)


def test_a_batch_keeps_plain_data_too():
    envs = gym.make_vec(REACH, num_envs=2, accuracy=physics.Accuracy(iterations=9), autoreset_mode="SameStep")
    again = gym.make_vec(EnvSpec.from_json(envs.unwrapped.spec.to_json()))
    assert again.unwrapped.task.world.accuracy.iterations == 9
    assert again.num_envs == 2


def test_the_spec_that_was_given_stays_as_it_is():
    spec = gym.spec(REACH)
    spec.kwargs["accuracy"] = physics.Accuracy(iterations=9)
    try:
        assert gym.make(spec).spec.kwargs["accuracy"]["iterations"] == 9
        assert isinstance(spec.kwargs["accuracy"], physics.Accuracy)
    finally:
        del spec.kwargs["accuracy"]


def test_accuracy_is_read_from_its_settings():
    world = physics.World(BALL, accuracy={"tolerance": 1e-3})
    assert world.accuracy == physics.Accuracy(tolerance=1e-3)
    fast = TaskEnv(Slide, accuracy={"preset": "fast", "impacts": 3}).task.world.accuracy
    assert (fast.solver, fast.tolerance, fast.impacts) == ("sweeps", 1e-3, 3)


@pytest.mark.parametrize(
    ("accuracy", "words"),
    [
        ({"tolerence": 1e-3}, "accuracy has 'tolerence'; allowed are tolerance, "),
        ({"preset": "quick"}, "accuracy preset is 'quick'; allowed are "),
        ({"tolerance": -1.0}, "Accuracy.tolerance is -1.0; allowed are "),
        ({"solver": None}, "Accuracy.solver is None; allowed are "),
        (("fast",), "a dict of settings, or a physics.Accuracy"),
        ({3: 1}, "accuracy has 3; allowed are "),
    ],
)
def test_an_accuracy_that_cannot_be_read_is_refused(accuracy, words):
    with pytest.raises(ValueError, match="allowed") as error:
        TaskEnv(Slide, accuracy=accuracy)
    assert words in str(error.value)


def test_effects_are_read_as_from_a_scene_file():
    env = TaskEnv(Slide, effects=[{"kind": "Drag", "coefficient": 0.2}, physics.Gravity((0, -4, 0))])
    assert env.task.effects == (physics.Drag(0.2), physics.Gravity((0, -4, 0)))


@pytest.mark.parametrize(
    ("effects", "words"),
    [
        ([{"coefficient": 0.2}], "effects[0]: kind is missing; allowed are Gravity, "),
        ([{"kind": "Drug"}], "effects[0]: kind is 'Drug'; allowed are Drag, "),
        ([{"kind": "Drag", "coeff": 0.2}], "effects[0]: coeff is not known; allowed are coefficient, "),
        ([physics.Drag(), {"kind": "Gravity", "acceleration": 5}], "effects[1]: "),
        ([{"kind": "Block"}], "effects[0]: kind is 'Block'; allowed are "),
        ({"kind": "Drag"}, "effects"),
    ],
)
def test_effects_that_cannot_be_read_are_refused(effects, words):
    with pytest.raises(ValueError, match="allowed") as error:
        TaskEnv(Slide, effects=effects)
    assert words in str(error.value)


def test_a_scene_is_read_from_the_content_of_its_file():
    content = tomllib.loads(CART.read_text(encoding="utf-8"))
    env, twin = gym.make(SCENE, scene=content), gym.make(SCENE, scene=str(CART))
    assert env.unwrapped.task.settings.force == twin.unwrapped.task.settings.force
    check_same(env, twin, 5)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            {"bodies": [{"kind": "Sphere", "radius": -1.0, "mass": 1.0}]},
            "scene: bodies[0]: Sphere.radius is -1.0; allowed ",
        ),
        ({"bodies": {}}, "scene: bodies is {}; allowed are tables"),
        ({"walks": []}, "scene: walks is not known; allowed are walls, "),
        ({"format": 2}, "scene: format is 2; allowed is 1"),
        ({"environment": {"fource": 1}}, "scene: environment: fource is not known; allowed are force, "),
        ({"environment": {"goal": {"pos": (1, 0, 0)}}}, "scene: environment.goal: tolerance is missing; allowed "),
    ],
)
def test_content_that_is_no_scene_is_refused(change, words):
    with pytest.raises(ValueError, match="allowed") as error:
        gym.make(SCENE, scene={**plain_scene(BALL), **change})
    assert words in str(error.value)


def test_a_field_of_a_user_stays_an_object():
    kept = gym.make(REACH, effects=[physics.Drag()])
    field = Attraction()
    kept.unwrapped.spec = EnvSpec(REACH, kwargs={"effects": [physics.Drag(), field]})
    assert kept.unwrapped.spec.kwargs["effects"] == [{"kind": "Drag"}, field]


def test_a_registered_class_keeps_its_import_path(ids):
    register_task("mine/Sliding-v0", Sliding, accuracy=physics.Accuracy(iterations=9))
    assert gym.spec("mine/Sliding-v0").kwargs["task"] == f"{__name__}:Sliding"
    json.loads(gym.spec("mine/Sliding-v0").to_json())
    env = gym.make("mine/Sliding-v0", effects=[physics.Drag()])
    again = through_json(env)
    assert type(again.unwrapped.task) is Sliding
    assert again.unwrapped.task.world.accuracy.iterations == 9
    check_same(env, again, 5)


def test_a_local_class_stays_a_class(ids):
    class Here(Slide):
        """It cannot be imported."""

    assert import_path(Here) is None
    register_task("mine/Here-v0", Here)
    assert type(gym.make("mine/Here-v0").unwrapped.task) is Here
    with pytest.raises(TypeError, match="JSON"):
        gym.spec("mine/Here-v0").to_json()


def test_other_objects_are_refused_by_json(ids):
    register_task("mine/Drawn-v0", Sliding, draws={"mass": Uniform(1.0, 2.0)})
    with pytest.raises(TypeError, match="Uniform is not JSON serializable"):
        gym.spec("mine/Drawn-v0").to_json()
