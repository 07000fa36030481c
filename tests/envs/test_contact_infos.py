"""Contacts in `info`: alone, in batches, in each way of starting anew, and for Stable-Baselines3."""

from __future__ import annotations

import pickle

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from rigid_env import BlockReachEnv, BlockReachVectorEnv, SceneEnv, SceneVectorEnv, TaskEnv, TaskVectorEnv
from rigid_env.envs.checks import check_task
from rigid_env.envs.contact_infos import CONTACT_KEYS as KEYS
from rigid_env.envs.infos import InfoMaker
from rigid_env.tasks import BlockReach
from tests.envs.conftest import random_actions
from tests.tasks.conftest import Slide

ROWS = 5
SHAPES = {"contact_count": (), "contact_ends": (ROWS, 2)}
OTHERS = ("contact_point", "contact_force", "contact_impulse")
SHAPES.update(dict.fromkeys(OTHERS, (ROWS, 3)))


def check_equal(ours: dict, theirs: dict, *places) -> None:
    """The contacts of two infos, of which the second is that of a batch at a place, have the same bits."""
    for key in KEYS:
        other = theirs[key][places] if places else theirs[key]
        np.testing.assert_array_equal(ours[key], other, err_msg=key)
        assert np.shape(ours[key]) == SHAPES[key]


def test_infos_hold_the_contacts_of_the_world(rng):
    env = BlockReachEnv(contacts=ROWS)
    _, info = env.reset(seed=0)
    assert info["contact_count"] == 0
    assert type(info["contact_count"]) is int
    infos, most = [info], 0
    for action in random_actions(rng, 30, 1):
        *_, info = env.step(action[0])
        points, forces = env.task.world.contacts()
        assert info["contact_count"] == len(points)
        if len(points) <= ROWS:
            np.testing.assert_array_equal(info["contact_point"][: len(points)], points)
            np.testing.assert_allclose(info["contact_force"][: len(points)], forces, rtol=1e-12, atol=1e-12)
            np.testing.assert_array_equal(info["contact_ends"][: len(points)], env.task.world.contact_ends())
        infos.append(info)
        most = max(most, len(points))
    assert most > 1
    assert not infos[0]["contact_force"].any()  # the first info is not written over


def test_without_the_argument_infos_are_as_before():
    env, envs = BlockReachEnv(), BlockReachVectorEnv(2)
    assert isinstance(env._info, InfoMaker)  # not the one that adds contacts and impacts
    assert not set(KEYS) & set(env.reset(seed=0)[1])
    assert not {*KEYS, "_contact_count"} & set(envs.reset(seed=0)[1])
    assert not set(KEYS) & set(envs.step(np.zeros((2, 6)))[4])


def test_episodes_have_the_same_bits_with_and_without(rng):
    told, plain = BlockReachEnv(contacts=ROWS), BlockReachEnv()
    np.testing.assert_array_equal(told.reset(seed=4)[0], plain.reset(seed=4)[0])
    for action in random_actions(rng, 40, 1):
        ours, theirs = told.step(action[0]), plain.step(action[0])
        np.testing.assert_array_equal(ours[0], theirs[0])
        assert ours[1:4] == theirs[1:4]
        np.testing.assert_equal({key: value for key, value in ours[4].items() if key not in KEYS}, theirs[4])


@pytest.mark.parametrize("mode", ["NextStep", "SameStep", "Disabled"])
def test_a_batch_tells_what_single_environments_tell(mode, rng):
    envs = BlockReachVectorEnv(3, autoreset_mode=mode, max_episode_steps=6, contacts=ROWS)
    singles = [BlockReachEnv(contacts=ROWS) for _ in range(3)]
    _, infos = envs.reset(seed=2)
    for i, env in enumerate(singles):
        check_equal(env.reset(seed=2 + i)[1], infos, i)
        assert all(infos[f"_{key}"].all() for key in KEYS)
    for k, actions in enumerate(random_actions(rng, 6, 3)):
        *_, infos = envs.step(actions)
        last = k == 5 and mode == "SameStep"  # what is told then is of the next episode, which has no contacts yet
        for i, env in enumerate(singles):
            single = env.step(actions[i])[4]
            check_equal(single, infos["final_info"] if last else infos, i)
            assert single["contact_count"] > 0
        assert infos["contact_count"].any() != last
    if mode == "SameStep":
        assert all(infos["final_info"][f"_{key}"].all() for key in KEYS)
    if mode == "NextStep":
        assert not envs.step(actions)[4]["contact_force"].any()  # episodes begin in this step
    if mode == "Disabled":
        mask = np.array([True, False, False])
        _, infos = envs.reset(options={"reset_mask": mask})
        for key in KEYS:
            np.testing.assert_array_equal(infos[f"_{key}"], mask)
            assert not infos[key].any()


def test_gymnasium_and_the_task_check_are_content():
    check_env(BlockReachEnv(contacts=ROWS), skip_render_check=True)
    check_task(BlockReach, 30, contexts=(), contacts=ROWS)
    check_task(Slide, 30, contexts=(), contacts=ROWS)


def test_gymnasium_makes_them_with_the_argument():
    env = gym.make("rigid_env/BlockReach-v0", contacts=2)
    assert env.reset(seed=0)[1]["contact_point"].shape == (2, 3)
    envs = gym.make_vec("rigid_env/BlockReorient-v0", num_envs=3, contacts=2)
    assert envs.reset(seed=0)[1]["contact_point"].shape == (3, 2, 3)
    others = gym.make_vec("rigid_env/BlockReach-v0", num_envs=2, vectorization_mode="sync", contacts=2)
    _, infos = others.reset(seed=0)
    assert infos["contact_point"].shape == (2, 2, 3)
    assert infos["_contact_point"].all()


def test_environments_of_scenes_tell_contacts_between_bodies():
    env, envs = SceneEnv("tower", driven=[0], contacts=8), SceneVectorEnv(2, "tower", driven=[0], contacts=8)
    env.reset(seed=0)
    envs.reset(seed=0)
    for _ in range(3):
        *_, info = env.step(np.zeros(6))
        *_, infos = envs.step(np.zeros((2, 6)))
    assert info["contact_count"] > 8
    assert (info["contact_ends"][:, 1] >= 0).any()
    for key in KEYS:
        np.testing.assert_array_equal(info[key], infos[key][0])


def test_a_copy_tells_its_own_contacts():
    env = BlockReachEnv(contacts=ROWS)
    env.reset(seed=0)
    env.step(np.full(6, 0.3))
    twin = pickle.loads(pickle.dumps(env))
    before = env.step(np.full(6, 0.3))[4]
    twin.step(np.full(6, -0.9))
    check_equal(twin.step(np.full(6, 0.3))[4], env_info := twin._info._contacts.one())
    assert not np.array_equal(before["contact_force"], env_info["contact_force"])
    check_equal(before, env._info._contacts.one())


@pytest.mark.parametrize(
    "make", [lambda task: TaskEnv(task, contacts=1), lambda task: TaskVectorEnv(2, task=task, contacts=1)]
)
def test_a_task_that_measures_the_same_key_is_refused(make):
    class Measuring(Slide):
        def measure(self, worlds):
            return {"contact_count": np.zeros(len(worlds))}

    with pytest.raises(
        ValueError, match=r"contacts is 1, but Measuring has 'contact_count' in its info; allowed are 0"
    ):
        make(Measuring)
    assert TaskEnv(Measuring).reset(seed=0)[1]["contact_count"] == 0.0


def test_stable_baselines_gets_them_at_the_end_of_episodes(rng):
    pytest.importorskip("stable_baselines3")
    from rigid_env import RigidVecEnv

    venv = RigidVecEnv(BlockReachVectorEnv(2, autoreset_mode="SameStep", max_episode_steps=3, contacts=ROWS))
    single = BlockReachEnv(contacts=ROWS)
    venv.seed(3)
    venv.reset()
    single.reset(seed=3)
    assert np.shape(venv.reset_infos[0]["contact_point"]) == (ROWS, 3)
    for actions in random_actions(rng, 3, 2):
        *_, infos = venv.step(actions)
        *_, info = single.step(actions[0])
    check_equal(info, infos[0])
    assert type(infos[0]["contact_count"]) is int
    assert infos[0]["is_success"] is False
