"""Keys of infos: those of a reset are those of a step, and a batch has the values of single environments."""

from __future__ import annotations

import copy
import pickle

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

import physics
from rigid_env import TaskEnv, TaskVectorEnv, Uniform
from rigid_env.envs.infos import ROWS
from tests.tasks.conftest import Slide

pytestmark = pytest.mark.interpreted


class Drawn(Slide):
    """A task with draws of all forms."""

    draws = {"mass": (1.0, 3.0), "goal": Uniform((-1, -1), (1, 1)), "turn": 2.0}  # noqa: RUF012


class Gone(Drawn):
    """It fails sooner or later."""

    def failure(self, worlds):
        return worlds.pos[:, 0, 0] > 0.004 * worlds.drawn["mass"]


def kinds(info: dict) -> dict:
    """Type, shape and dtype of each entry."""
    return {key: (type(value), np.shape(value), np.asarray(value).dtype) for key, value in info.items()}


@pytest.mark.parametrize("extra", [{}, {"contacts": 2, "impacts": 1}])
def test_infos_of_reset_and_step_have_the_same_keys_types_and_shapes(extra):
    env = TaskEnv(Drawn, **extra)
    _, first = env.reset(seed=0)
    for action in ([1.0], [-1.0]):
        assert kinds(env.step(action)[4]) == kinds(first)
    assert kinds(env.reset()[1]) == kinds(first)
    assert {"is_success", "reward_speed", "physics_status", "mass", "goal", "turn"} <= first.keys()
    assert type(first["mass"]) is float


def test_what_effects_replace_is_told_nowhere():
    env = TaskEnv(type("Rough", (Slide,), {"draws": {"gravity": 9.0}}), effects=[physics.Gravity()])
    assert "gravity" not in env.reset(seed=0)[1]
    assert "gravity" not in env.step([0.0])[4]


def test_an_info_stays_as_it_was_and_shares_nothing():
    """More steps than copies are made at once."""
    env = TaskEnv(Drawn)
    _, first = env.reset(seed=0)
    kept, goals = copy.deepcopy(first), [first["goal"]]
    for _ in range(ROWS + 2):
        *_, info = env.step([1.0])
        np.testing.assert_array_equal(info["goal"], kept["goal"])
        goals.append(info["goal"])
    for goal in goals[1:]:
        goal[:] = 3.0
    env.reset()
    np.testing.assert_equal(first, kept)
    assert not np.array_equal(env.step([1.0])[4]["goal"], kept["goal"])


def test_a_value_that_is_set_is_told_from_the_next_step_on():
    env, envs = TaskEnv(Drawn), TaskVectorEnv(2, task=Drawn)
    env.reset(seed=0)
    envs.reset(seed=0)
    env.task.hold("mass", 2.5)
    envs.set_attr("mass", [2.0, 2.5])
    assert env.step([0.0])[4]["mass"] == 2.5
    assert envs.step(np.zeros((2, 1)))[4]["mass"].tolist() == [2.0, 2.5]


def test_a_state_brings_its_values_along():
    env = TaskEnv(Drawn)
    _, first = env.reset(seed=0)
    state = env.get_state()
    env.reset(seed=1)
    env.set_state(state)
    assert env.step([0.0])[4]["mass"] == first["mass"]


def test_a_refused_start_leaves_the_values():
    env = TaskEnv(Drawn)
    _, first = env.reset(seed=0)
    with pytest.raises(ValueError, match="mass"):
        env.reset(options={"mass": -1.0})
    np.testing.assert_equal(env.step([0.0])[4]["goal"], first["goal"])


def test_copies_tell_their_own_values():
    env = TaskEnv(Drawn)
    env.reset(seed=0)
    for twin in (pickle.loads(pickle.dumps(env)), copy.deepcopy(env)):
        _, other = twin.reset(seed=1)
        assert twin.step([0.0])[4]["mass"] == other["mass"] != env.step([0.0])[4]["mass"]


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_a_batch_tells_what_gymnasium_gathers_from_single_environments(mode):
    """Keys, masks and values, in the final infos too; with episodes that end at different times."""
    native = TaskVectorEnv(3, task=Gone, autoreset_mode=mode, max_episode_steps=None)
    gathered = gym.vector.SyncVectorEnv([lambda: TaskEnv(Gone)] * 3, autoreset_mode=mode)
    ours, theirs = native.reset(seed=4)[1], gathered.reset(seed=4)[1]
    ended = 0
    for _ in range(30):
        check_same(ours, theirs)
        _, _, ends, _, ours = native.step(np.ones((3, 1), dtype=np.float32))
        theirs = gathered.step(np.ones((3, 1), dtype=np.float32))[4]
        ended += ends.sum()
        if mode is AutoresetMode.DISABLED and ends.any():
            check_same(ours, theirs)
            ours, theirs = (envs.reset(options={"reset_mask": ends})[1] for envs in (native, gathered))
    assert ended > 2


def check_same(ours: dict, theirs: dict) -> None:
    """Compare infos of batches, nested ones included."""
    assert ours.keys() == theirs.keys()
    for key, value in ours.items():
        if isinstance(value, dict):
            check_same(value, theirs[key])
        elif value.dtype == object:
            for one, other in zip(value, theirs[key]):
                np.testing.assert_equal(one, other, err_msg=key)
        else:
            np.testing.assert_array_equal(value, theirs[key], err_msg=key)
