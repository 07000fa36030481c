"""Mistakes in a declaration that would pass in silence, or end far from where they are made."""

from __future__ import annotations

import numpy as np
import pytest

import physics
from rigid_env import TaskEnv, TaskVectorEnv, register_task
from rigid_env.tasks import Entry, Gust, LogUniform, Normal, Push, Uniform, observe
from tests.tasks.conftest import Free, Slide, started

pytestmark = pytest.mark.interpreted

ROUGH = physics.Scene(Slide.scene.bodies, Slide.scene.walls, [*Slide.scene.effects, physics.Friction(0.4)])


def subclass(**body):
    """A subclass of `Slide` with this body."""
    return type("Crate", (Slide,), body)


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("observations", (), ("'observations'", "'observation'")),
        ("action", (), ("'action'", "the task's own")),
        ("draw", {}, ("'draw'", "'draws'")),
        ("max_episode_step", 3, ("'max_episode_step'", "'max_episode_steps'")),
        ("disturbance", (), ("'disturbance'", "'disturbances'")),
        ("memories", {}, ("'memories'", "'memory'")),
        ("steps", 3, ("'steps'", "the task's own")),
        ("weights", 3, ("'weights'", "the task's own")),
        ("rewards", {"a": 1.0}, ("rewards", "a function")),
    ],
)
def test_an_attribute_that_would_be_ignored_or_hide_another_is_refused(name, value, words):
    with pytest.raises(TypeError, match="allowed") as error:
        subclass(**{name: value})
    assert all(word in str(error.value) for word in ("Crate", *words)), str(error.value)


def test_helpers_of_ones_own_are_allowed():
    rewards = Slide.rewards
    task = subclass(potential=lambda self: 0.0, LIMIT=3.0, reward=lambda self: 0.0, rewards=rewards)
    assert started(task()).worlds == 1


@pytest.mark.parametrize(
    ("body", "words"),
    [
        ({"draws": {"friction": 0.3}}, ("'friction'", "physics.Friction")),
        ({"draws": {"fricton": 0.3}}, ("'fricton'", "'friction'")),
        ({"draws": {"Mass": 0.3}}, ("'Mass'", "'mass'")),
        ({"draws": {"mass[1]": 3.0}}, ("'mass[1]'", "0 to 0")),
        ({"draws": {"mass": 3.0, "mass[0]": 3.0}}, ("'mass'", "'mass[0]'", "one of the two")),
        ({"draws": {"mass": (-1.0, 3.0)}}, ("draws mass", "Crate")),
        ({"draws": {"mass": Normal(1.0, 1.0)}}, ("draws mass", "Crate")),
        ({"draws": {"gravity": (-9.81, 5.0)}}, ("draws gravity", "Crate")),
        ({"draws": {"is_success": 1.0}}, ("info of Crate", "'is_success'")),
        ({"draws": ["goal"]}, ("draws", "'goal'")),
        ({"memory": ["hold"]}, ("memory", "'hold'")),
        ({"observation": (entry for entry in ())}, ("observation", "generator")),
        ({"observation": (observe.pos(1),)}, ("observation of Crate", "1 bodies")),
        ({"observation": (observe.drawn("gaol"),), "draws": {"goal": 1.0}}, ("'gaol'", "goal")),
        ({"observation": (observe.wall_gaps(),)}, ("'gap to wall 0'", "(2, 1)", "(2, 3)")),
        ({"observation": (Entry(("a", "b"), "m", -1, 1, lambda w: w.pos[:, 0, 0]),)}, ("'a'", "(2,)", "(2, 2)")),
        ({"rewards": lambda self, w: {"a": w.pos[0, 0]}}, ("'a'", "rewards of Crate", "(3,)")),
        ({"rewards": lambda self, w: {"a": w.pos.sum()}}, ("'a'", "rewards of Crate")),
        ({"measure": lambda self, w: {"a": w.pos[:, 0, 0] * 1j}}, ("'a'", "measure of Crate", "complex")),
        ({"measure": lambda self, w: {"reward_speed": w.pos[:, 0, 0]}}, ("info of Crate", "'reward_speed'")),
        ({"max_episode_steps": 0}, ("max_episode_steps of Crate", "0")),
        ({"place": lambda self, drawn: {"pos": np.zeros(5)}}, ("place of Crate", "(5,)")),
        ({"place": lambda self, drawn: {"pos": (0.0, np.nan, 0.0)}}, ("place of Crate", "finite")),
    ],
)
def test_it_is_refused_when_the_task_is_made(body, words):
    with pytest.raises((ValueError, TypeError), match=r"allowed|add") as error:
        subclass(**body)()
    assert all(word in str(error.value) for word in words), str(error.value)


@pytest.mark.parametrize("make", [lambda: Push(speed=-1.0), lambda: Gust(force=(-1, 1)), lambda: Gust(lasts=-0.1)])
def test_negative_sizes_of_disturbances_are_refused(make):
    with pytest.raises(ValueError, match="at least 0"):
        make()


def test_one_entry_and_one_disturbance_need_no_list():
    task = subclass(observation=observe.pos(), disturbances=Gust(0))
    assert started(task()).obs.shape == (1, 3)


@pytest.mark.parametrize(("name", "value"), [("mass", 5.0), ("friction", 0.0), ("gravity", 3.0), ("size", (2, 1, 1.5))])
def test_a_fixed_draw_reaches_the_world(name, value):
    env = TaskEnv(subclass(scene=ROUGH, draws={name: value}))
    _, info = env.reset(seed=0)
    np.testing.assert_array_equal(info[name], value)
    task = env.task
    seen = task._parameters_of(np.zeros(1, dtype=np.int64))
    found = np.linalg.norm(seen["gravity"][0]) if name == "gravity" else seen[name][0, 0]
    np.testing.assert_allclose(found, value, rtol=1e-14)
    gravity, mass = (value if name == each else other for each, other in (("gravity", 9.81), ("mass", 3.0)))
    assert task.weights[0, 0] == pytest.approx(gravity * mass, rel=1e-14)


def test_an_effect_in_place_of_a_fixed_draw_stands():
    task = subclass(scene=ROUGH, draws={"friction": 0.4, "gravity": 9.81})
    env = TaskEnv(task, effects=[physics.Friction(0.1), physics.Gravity((0, -2.0, 0))])
    _, info = env.reset(seed=0)
    seen = env.task._parameters_of(np.zeros(1, dtype=np.int64))
    assert seen["friction"][0, 0] == 0.1
    assert seen["gravity"].tolist() == [[0.0, -2.0, 0.0]]
    assert not {"friction", "gravity"} & set(info)


def test_an_argument_replaces_a_draw_by_one_of_its_length():
    task = subclass(draws={"goal": Uniform((0, 0), (1, 1)), "mass": (2.0, 4.0)})
    assert TaskEnv(task, draws={"mass": 5.0}).reset(seed=1)[1]["mass"] == 5.0
    assert TaskEnv(task, draws={"mass": LogUniform(0.1, 1.0)}).reset(seed=1)[1]["mass"] < 1.0
    with pytest.raises(ValueError, match="draws goal is 1"):
        TaskEnv(task, draws={"goal": 1})


def test_memory_may_be_assigned_and_nothing_else_may():
    class Assigning(Slide):
        memory = {"count": 1}  # noqa: RUF012

        def update(self, worlds):
            worlds.memory["count"] = worlds.memory["count"] + 1.0

    task = started(Assigning(2))
    for _ in range(3):
        task.step(np.zeros((2, 1)))
    task.start(np.array([0]))
    assert task.memory_arrays["count"].tolist() == [0.0, 3.0]
    for name, update in {
        "drawn": lambda self, worlds: worlds.drawn.__setitem__("goal", 1.0),
        "action": lambda self, worlds: worlds.action.fill(0.0),
        "pos": lambda self, worlds: worlds.pos.fill(0.0),
    }.items():
        with pytest.raises((TypeError, ValueError)):
            subclass(update=update, draws={"goal": 1.0})()
        assert name
    for read in ("drawn", "memory", "measured"):
        with pytest.raises(KeyError, match=f"{read} has no 'gaol'; allowed are"):
            subclass(update=lambda self, worlds, read=read: getattr(worlds, read)["gaol"])()


def test_after_a_failing_start_nothing_has_changed():
    class Picky(Slide):
        draws = {"goal": (0.0, 10.0)}  # noqa: RUF012
        observation = (Entry("x", "m", -9, 9, lambda w: np.where(w.drawn["goal"] > 9.0, np.nan, w.pos[:, 0, 0])),)

        def place(self, drawn):
            return {"pos": np.stack([drawn["goal"], np.full_like(drawn["goal"], 0.5), 0 * drawn["goal"]], axis=1)}

    env = TaskEnv(Picky)
    env.reset(seed=3, options={"goal": 2.0})
    env.step(np.ones(1))
    before = env.get_state()
    with pytest.raises(ValueError, match=r"observation 'x' of Picky is nan in world 0"):
        env.reset(options={"goal": 9.5})
    after = env.get_state()
    for ours, theirs in zip(before.world.arrays, after.world.arrays):
        np.testing.assert_array_equal(ours, theirs)
    assert before.generators == after.generators
    for name, array in before.arrays.items():
        np.testing.assert_array_equal(after.arrays[name], array, err_msg=name)


@pytest.mark.parametrize("effects", [(), (physics.Actuator(lag=0.05, delay=0.02),)])
def test_a_refused_step_leaves_actuators_and_disturbances_as_they_were(effects):
    class Stormy(Slide):
        disturbances = (Push(0, 0.5, 0.05), Gust(0, every=0.05))
        is_refusing = False

        def rewards(self, worlds):
            return {"a": np.full(len(worlds), np.nan if self.is_refusing else 1.0)}

    task, twin = (started(Stormy(2, effects=effects)) for _ in range(2))
    for _ in range(10):
        task.step(np.ones((2, 1)))
        twin.step(np.ones((2, 1)))
        task.is_refusing = True
        with pytest.raises(ValueError, match="reward term 'a'"):
            task.step(-np.ones((2, 1)))
        task.is_refusing = False
    task.step(np.ones((2, 1)))
    twin.step(np.ones((2, 1)))
    np.testing.assert_array_equal(task.world.state, twin.world.state)


def test_registering_with_an_unknown_setting_is_refused_at_once():
    with pytest.raises(TypeError, match=r"'acuracy'.*allowed are accuracy"):
        register_task("tests/Never-v0", Free, acuracy="fast")
    register_task("tests/Slide-v0", Slide, accuracy="fast", obs="state")
    import gymnasium as gym

    envs = gym.make_vec("tests/Slide-v0", num_envs=2)
    assert envs.task.world.accuracy == physics.World(Free.scene, accuracy="fast").accuracy
    assert TaskVectorEnv(2, task=Slide).max_episode_steps is None
