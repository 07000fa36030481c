"""States of environments: bit-identical continuation, copies into other worlds, files, refusals."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import physics
from benchmarks.numpy_reach import NumpyReach
from rigid_env import (
    BlockReachEnv,
    BlockReachGoal,
    BlockReachVectorEnv,
    BlockReorientEnv,
    SceneEnv,
    TaskEnv,
    TaskState,
    TaskVectorEnv,
)
from rigid_env.tasks import Gust, Push, Wrench
from tests.tasks.conftest import Slide

pytestmark = pytest.mark.interpreted

VARIED = {"mass": (4.0, 8.0), "size": ((4.0, 2.5, 1.5), (6.0, 3.5, 2.5)), "friction": (0.3, 0.7)}


class Stormy(Slide):
    """A task with all that a state holds: draws, memory, disturbances."""

    draws = {"mass": (2.0, 4.0), "goal": (1.0, 2.0)}  # noqa: RUF012
    memory = {"count": 1, "last": 3}  # noqa: RUF012
    disturbances = (Push(0, 0.5, 0.1), Gust(0, every=0.2))
    max_episode_steps = 12

    def update(self, worlds):
        worlds.memory["count"] += 1.0
        worlds.memory["last"][:] = worlds.pos[:, 0]

    def rewards(self, worlds):
        return {"count": worlds.memory["count"] * worlds.drawn["goal"]}


MAKERS = {
    "reach": lambda n, most=12: BlockReachVectorEnv(n, max_episode_steps=most, **VARIED),
    "same step": lambda n, most=12: BlockReachVectorEnv(n, "SameStep", max_episode_steps=most),
    "actuated": lambda n, most=12: BlockReachVectorEnv(n, effects=[physics.Actuator(lag=0.05, delay=0.02)]),
    "numpy": lambda n, most=12: TaskVectorEnv(n, task=NumpyReach, max_episode_steps=most),
    "stormy": lambda n, most=12: TaskVectorEnv(n, task=Stormy, max_episode_steps=most),
    "pixels": lambda n, most=12: BlockReachVectorEnv(n, obs="pixels", obs_size=(12, 16), obs_stack=2),
}
"""Batches of a number of worlds, with episodes of at most so many steps where they end."""


def run(envs, steps: int, seed: int) -> list:
    """All that steps give, with random actions."""
    rng, found = np.random.default_rng(seed), []
    for _ in range(steps):
        obs, rewards, ends, cuts, infos = envs.step(rng.uniform(-1.0, 1.0, envs.action_space.shape))
        found.append((obs, rewards, ends, cuts, infos["physics_status"]))
    return found


def assert_same(ours: list, theirs: list) -> None:
    for step, (one, other) in enumerate(zip(ours, theirs, strict=True)):
        for a, b in zip(one, other, strict=True):
            np.testing.assert_array_equal(a, b, err_msg=f"step {step}")


def compiled_but_stormy(names) -> list:
    """Names whose kernels other tests compile, too, and one whose kernel is its own."""
    return [name if name == "stormy" else pytest.param(name, marks=pytest.mark.compiled) for name in names]


@pytest.mark.parametrize("name", compiled_but_stormy(MAKERS))
def test_a_batch_goes_on_with_the_same_bits_also_over_ends_of_episodes(name, is_exhaustive):
    worlds, most, before, after = (3, 12, 9, 25) if is_exhaustive else (2, 5, 3, 10)
    envs = MAKERS[name](worlds, most)
    envs.reset(seed=1)
    run(envs, before, 2)
    state = envs.get_state()
    first = run(envs, after, 3)
    envs.set_state(state)
    assert_same(run(envs, after, 3), first)
    twin = MAKERS[name](worlds, most)
    twin.set_state(state)  # never reset itself
    assert_same(run(twin, after, 3), first)
    assert twin.np_random_seed == envs.np_random_seed


@pytest.mark.parametrize(
    "make", [BlockReachEnv, BlockReorientEnv, lambda: TaskEnv(Stormy), lambda: TaskEnv(NumpyReach)]
)
def test_one_environment_goes_on_with_the_same_bits(make, is_exhaustive):
    env, twin = make(), make()
    env.reset(seed=4)
    before, after = (10, 20) if is_exhaustive else (4, 8)
    actions = np.random.default_rng(5).uniform(-1.0, 1.0, (before + after, *env.action_space.shape))
    for action in actions[:before]:
        env.step(action)
    state = env.get_state()
    twin.set_state(state)
    for action in actions[before:]:
        ours, theirs = env.step(action), twin.step(action)
        np.testing.assert_array_equal(ours[0], theirs[0])
        assert ours[1:4] == theirs[1:4]
        np.testing.assert_equal(ours[4], theirs[4])
    (obs, info), (other, told) = env.reset(), twin.reset()  # the generator, too
    np.testing.assert_array_equal(obs, other)
    assert str(info) == str(told)
    assert env.np_random_seed == twin.np_random_seed == 4


@pytest.mark.parametrize("name", compiled_but_stormy(["reach", "numpy", "stormy"]))
def test_one_world_goes_on_in_many_and_some_in_others(name):
    envs = MAKERS[name](4)
    envs.reset(seed=1)
    run(envs, 5, 2)
    state = envs.get_state()
    twin = MAKERS[name](4)
    twin.reset(seed=9)
    run(twin, 5, 7)
    before = twin.get_state()
    twin.set_state(state, worlds=[0, 3], source=[2, 1])
    push = np.random.default_rng(3).uniform(-1.0, 1.0, (3, *envs.action_space.shape))
    theirs = [twin.step(np.stack([action[2], action[1], action[2], action[1]])) for action in push]
    ours = [envs.step(action) for action in push]
    for (obs, rewards, *_), (seen, earned, *_) in zip(ours, theirs):
        np.testing.assert_array_equal(seen[[0, 3]], obs[[2, 1]])
        np.testing.assert_array_equal(earned[[0, 3]], rewards[[2, 1]])
    twin.set_state(before)
    others = [twin.step(np.stack([action[2], action[1], action[2], action[1]])) for action in push]
    for (obs, *_), (seen, *_) in zip(theirs, others):
        np.testing.assert_array_equal(seen[1:3], obs[1:3])  # worlds that were left alone
    twin.set_state(envs.get_state([2]))  # one into all
    rows = twin.step(np.tile(push[0][2], (4, 1)))[0]
    np.testing.assert_array_equal(rows, np.tile(rows[0], (4, 1)))


def test_a_single_environment_and_a_batch_take_each_others_states():
    env, envs = BlockReachEnv(), BlockReachVectorEnv(3)
    env.reset(seed=6)
    envs.set_state(env.get_state())
    action = np.full(6, 0.5)
    obs = env.step(action)[0]
    np.testing.assert_array_equal(envs.step(np.tile(action, (3, 1)))[0], np.tile(obs, (3, 1)))
    other = BlockReachEnv()
    other.set_state(envs.get_state(), source=2)
    np.testing.assert_array_equal(other.step(action)[0], env.step(action)[0])


def test_held_values_go_along():
    envs = BlockReachVectorEnv(2)
    envs.reset(seed=1)
    envs.set_attr("mass", [3.0, 5.0])
    state = envs.get_state()
    twin = BlockReachVectorEnv(2)
    twin.set_state(state)
    assert twin.reset(seed=2)[1]["mass"].tolist() == [3.0, 5.0]
    fresh = BlockReachVectorEnv(2)
    fresh.reset(seed=1)
    with pytest.raises(ValueError, match="state holds mass, the task nothing"):
        fresh.set_state(state, worlds=[1], source=1)
    twin.set_state(fresh.get_state())
    assert twin.reset(seed=2)[1]["mass"].tolist() == [6.0, 6.0]


def test_files_hold_the_same_bits(tmp_path):
    envs = MAKERS["stormy"](3)
    envs.reset(seed=1)
    run(envs, 7, 2)
    envs.set_attr("goal", 1.25)
    path = envs.get_state().save(tmp_path / "state.npz")
    twin = MAKERS["stormy"](3)
    twin.set_state(TaskState.load(path))
    assert_same(run(twin, 20, 3), run(envs, 20, 3))
    assert twin.np_random_seed == envs.np_random_seed


def test_a_state_before_the_first_reset_is_one(tmp_path):
    envs, twin = BlockReachVectorEnv(2), BlockReachVectorEnv(2)
    path = envs.get_state().save(tmp_path / "state.npz")
    twin.reset(seed=1)
    twin.set_state(TaskState.load(path))
    import gymnasium as gym

    with pytest.raises(gym.error.ResetNeeded):
        twin.step(np.zeros((2, 6)))


def everything(envs) -> tuple:
    state = envs.get_state()
    return state.world.arrays, state.arrays, state.held, state.generators, state.seeds


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda envs, s: envs.set_state(None), ("state", "None", "get_state")),
        (lambda envs, s: envs.set_state(s["reorient"]), ("BlockReorient", "states of BlockReach")),
        (lambda envs, s: envs.set_state(s["pixels"]), ("pictures", "same settings")),
        (
            lambda envs, s: envs.set_state(s["actuated"]),
            ("effects", "lag=0.1", "Contact with restitution, Friction, Gravity"),
        ),
        (lambda envs, s: envs.set_state(s["three"]), ("3", "2 worlds")),
        (lambda envs, s: envs.set_state(s["own"], worlds=[2]), ("worlds", "2", "0 to 1")),
        (lambda envs, s: envs.set_state(s["own"], source=[0, 5]), ("source", "5", "0 to 1")),
        (lambda envs, s: envs.get_state([0, 0]), ("worlds", "once")),
    ],
)
def test_a_wrong_state_changes_nothing(change, words):
    envs = BlockReachVectorEnv(2)
    envs.reset(seed=1)
    others = {
        "own": envs.get_state(),
        "reorient": BlockReorientEnv().get_state(),
        "pixels": BlockReachEnv(obs="pixels", obs_size=(8, 8)).get_state(),
        "actuated": BlockReachVectorEnv(2, effects=[physics.Push((1, 0, 0)), physics.Actuator(lag=0.1)]).get_state(),
        "three": BlockReachVectorEnv(3).get_state(),
    }
    before = str(everything(envs))
    with pytest.raises(ValueError, match="allowed") as error:
        change(envs, others)
    assert all(word in str(error.value) for word in words), str(error.value)
    assert str(everything(envs)) == before


class Stronger(Stormy):
    """The same as `Stormy`, by its name, with other actions."""

    actions = Wrench(0, force=0.75, torque=0.0, force_axes="x")


Stronger.__name__ = "Stormy"


class Tuned(Slide):
    """A task with a setting of its own."""

    def __init__(self, worlds=1, *, worth=1.0, **settings):
        self.worth = worth
        super().__init__(worlds, **settings)

    def own_settings(self):
        return {"worth": self.worth}

    def rewards(self, worlds):
        return {"speed": self.worth * worlds.linvel[:, 0, 0]}


GOAL = {"pos": (3.0, 1.5, 0.0), "tolerance": 0.5}
OTHER_SETTINGS = {
    "frame_skip": (BlockReachEnv, lambda: BlockReachEnv(frame_skip=4), ("5", "4")),
    "dt": (BlockReachEnv, lambda: BlockReachEnv(dt=0.004), ("0.005", "0.004")),
    "walls": (BlockReachEnv, lambda: BlockReachEnv(half_width=12.0), ("offset=-10.0", "offset=-12.0")),
    "effects": (BlockReachEnv, lambda: BlockReachEnv(effects=[physics.Drag(0.1, 1.0)]), ("Gravity;", "Drag")),
    "actions": (lambda: TaskEnv(Stormy), lambda: TaskEnv(Stronger), ("force 0.5", "force 0.75")),
    "worth": (lambda: TaskEnv(Tuned), lambda: TaskEnv(Tuned, worth=2.0), ("1.0", "2.0")),
    "reward": (lambda: TaskEnv(BlockReachGoal), lambda: TaskEnv(BlockReachGoal, reward="dense"), ("sparse", "dense")),
    "goal": (
        lambda: SceneEnv("drop", goal=GOAL), lambda: SceneEnv("drop", goal={**GOAL, "tolerance": 0.25}), ("0.5", "0.25")
    ),
    "length": (lambda: SceneEnv("drop", length=2.0), lambda: SceneEnv("drop", length=3.0), ("2.0", "3.0")),
}  # fmt: skip


@pytest.mark.parametrize("name", OTHER_SETTINGS)
def test_other_settings_are_refused_by_name_and_nothing_changes(name, tmp_path):
    make, make_other, words = OTHER_SETTINGS[name]
    env, other = make(), make_other()
    env.reset(seed=1)
    other.reset(seed=2)
    state, before = env.get_state(), str(everything(other))
    for each in (state, TaskState.load(state.save(tmp_path / "state.npz"))):
        with pytest.raises(ValueError, match=f"^{name} of state is .*; allowed is that of this ") as error:
            other.set_state(each)
        assert all(word in str(error.value) for word in words), str(error.value)
        assert str(everything(other)) == before
        make().set_state(each)


@given(skip=st.integers(1, 6), other_skip=st.integers(1, 6), dt=st.sampled_from((0.004, 0.005, 0.0025)))
@settings(max_examples=20)
def test_a_state_goes_on_exactly_where_the_steps_are_alike(skip, other_skip, dt):
    env, other = BlockReachEnv(frame_skip=skip), BlockReachEnv(frame_skip=other_skip, dt=dt)
    env.reset(seed=1)
    try:
        other.set_state(env.get_state())
    except ValueError:
        assert (skip, 0.005) != (other_skip, dt)
        return
    assert (skip, 0.005) == (other_skip, dt)
    action = np.full(6, 0.4)
    np.testing.assert_array_equal(other.step(action)[0], env.step(action)[0])


def test_accuracy_limits_and_ranges_of_draws_may_be_others():
    """A planner rolls out states of a fine environment in a coarse model; the worlds are the same."""
    env = BlockReachEnv(accuracy="balanced")
    env.reset(seed=3, options={"mass": 7.0})
    others = BlockReachEnv(accuracy="fast"), BlockReachEnv(accuracy="precise"), BlockReachEnv(mass=(2.0, 3.0))
    for other in (*others, BlockReachVectorEnv(1, max_episode_steps=7)):
        other.set_state(env.get_state())
        np.testing.assert_array_equal(other.task.world.state, env.task.world.state)
        assert other.task.drawn["mass"][0] == 7.0


def test_a_file_without_settings_is_refused(tmp_path):
    path = BlockReachEnv().get_state().save(tmp_path / "state.npz")
    with np.load(path) as file:
        parts = dict(file)
    head = json.loads(str(parts["head"]))
    lacking = "has format 1, which does not hold all settings of the task; allowed is format 3"
    for number, words in ((1, lacking), (4, "has format 4; allowed is format 3")):
        np.savez(path, **{**parts, "head": json.dumps({**head, "format": number})})
        with pytest.raises(ValueError, match=words):
            TaskState.load(path)


def test_held_values_of_another_form_are_refused():
    envs = BlockReachVectorEnv(2)
    envs.reset(seed=1)
    state, before = envs.get_state(), str(everything(envs))
    for held in ({"mass": np.ones((2, 3))}, {"hue": np.ones(2)}):
        with pytest.raises(ValueError, match=r"held mass of state has shape|state holds hue"):
            envs.set_state(dataclasses.replace(state, held=held))
        assert str(everything(envs)) == before


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 no archive", b"not a state"])
def test_a_file_that_is_none_is_refused(content, tmp_path):
    path = tmp_path / "state.npz"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"state.npz is no state of a task.*TaskState.save"):
        TaskState.load(path)
