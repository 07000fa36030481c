"""One task, two interfaces: single environment, native batch and Gymnasium's batches agree bit for bit."""

from __future__ import annotations

import copy
import pickle
from functools import partial
from itertools import product

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import data_equivalence
from gymnasium.vector import AsyncVectorEnv, AutoresetMode, SyncVectorEnv

import rigid_env
from tests.envs.conftest import IDS, random_actions
from tests.tiers.sweep import sweep

RANDOMISED = {
    "friction": (0.3, 0.7),
    "mass": (4.0, 8.0),
    "size": ((3.0, 2.0, 1.0), (5.0, 4.0, 3.0)),
    "restitution": (0.0, 0.5),
    "gravity": (5.0, 10.0),
}


def make_single(env_class, limit, **parameters):
    return gym.wrappers.TimeLimit(env_class(**parameters), limit)


@pytest.fixture(params=[{}, {"walls": "corner", **RANDOMISED}], ids=["fixed", "randomised"])
def parameters(request):
    return request.param


@pytest.fixture
def pair(env_class):
    """(single class, vector class) of one task."""
    return env_class, getattr(rigid_env, env_class.__name__.replace("Env", "VectorEnv"))


@pytest.mark.parametrize("mode", [AutoresetMode.NEXT_STEP, AutoresetMode.SAME_STEP])
def test_native_batch_equals_gymnasiums_sync_batch(pair, mode, parameters, rng):
    """Observations, rewards, ends and infos through several automatic resets (episodes of 7 steps)."""
    env_class, vector_class = pair
    native = vector_class(3, autoreset_mode=mode, max_episode_steps=7, **parameters)
    sync = SyncVectorEnv([partial(make_single, env_class, 7, **parameters)] * 3, autoreset_mode=mode)
    assert native.single_observation_space == sync.single_observation_space
    assert native.observation_space == sync.observation_space
    assert native.action_space == sync.action_space
    assert data_equivalence(native.reset(seed=5), sync.reset(seed=5), exact=True)
    for actions in random_actions(rng, 24, 3):
        ours, theirs = native.step(actions), sync.step(actions)
        assert data_equivalence(ours[:4], theirs[:4], exact=True)
        assert sorted(ours[4]) == sorted(theirs[4])
        assert info_equal(ours[4], theirs[4])
    assert data_equivalence(native.reset(), sync.reset(), exact=True)


def info_equal(a, b):
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(info_equal(a[key], b[key]) for key in a)
    return a.dtype == b.dtype and all(np.array_equal(x, y) for x, y in zip(a, b))


def test_a_world_does_not_depend_on_the_batch_or_threads(vector_class, parameters, rng):
    actions = random_actions(rng, 20, 6)
    large = vector_class(6, max_episode_steps=8, threads=2, **parameters)
    small = vector_class(2, max_episode_steps=8, **parameters)
    obs_large = [large.reset(seed=10)[0][3:5]]
    obs_small = [small.reset(seed=[13, 14])[0]]
    for a in actions:
        obs_large.append(large.step(a)[0][3:5])
        obs_small.append(small.step(a[3:5])[0])
    np.testing.assert_array_equal(obs_large, obs_small)


def test_seeds_decide_everything(vector_class, rng):
    envs = vector_class(3)
    first, _ = envs.reset(seed=1)
    assert not np.array_equal(first[0], first[1])
    assert envs.np_random_seed == (1, 2, 3)
    assert len(envs.np_random) == 3
    second, _ = envs.reset()
    again, _ = envs.reset(seed=1)
    np.testing.assert_array_equal(first, again)
    np.testing.assert_array_equal(second, envs.reset()[0])
    assert not np.array_equal(first, second)
    np.testing.assert_array_equal(first[[0, 2]], envs.reset(seed=[1, None, 3])[0][[0, 2]])


@pytest.mark.parametrize("copier", [copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))], ids=["deepcopy", "pickle"])
def test_a_copy_goes_on_as_the_original(env_class, vector_class, copier, rng):
    for env, worlds in ((env_class(friction=(0.3, 0.7)), None), (vector_class(2, max_episode_steps=9), 2)):
        env.reset(seed=3)
        actions = random_actions(rng, 16, 2)
        actions = actions[:, 0] if worlds is None else actions
        for a in actions[:6]:
            env.step(a)
        twin = copier(env)
        for a in actions[6:]:
            assert data_equivalence(env.step(a)[:4], twin.step(a)[:4], exact=True)
        assert data_equivalence(env.reset(), twin.reset(), exact=True)


def test_an_environment_with_a_picture_can_be_pickled(env_class):
    env = env_class(render_mode="rgb_array", width=32, height=24)
    env.reset(seed=0)
    picture = env.render()
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(env)).render(), picture)


@pytest.mark.parametrize(
    ("env_id", "context"),
    sweep(product(IDS, ("fork", "spawn")), lambda pair: pair != (IDS[1], "spawn"), id="-".join),
)
def test_async_vector_env(env_id, context, rng):
    """Children by fork (kernels and threads already in use here) and by spawn equal the native batch."""
    native = gym.make_vec(env_id, num_envs=2, threads=2)
    expected = [native.reset(seed=2)[0]]
    actions = random_actions(rng, 3, 2)
    expected += [native.step(a)[0] for a in actions]
    envs = AsyncVectorEnv([partial(gym.make, f"rigid_env:{env_id}")] * 2, context=context)
    try:
        got = [envs.reset(seed=2)[0]] + [envs.step(a)[0] for a in actions]
    finally:
        envs.close()
    np.testing.assert_array_equal(expected, got)


def test_returned_arrays_are_not_reused(vector_class, rng):
    envs = vector_class(2)
    obs, infos = envs.reset(seed=0)
    kept = copy.deepcopy((obs, infos))
    step = envs.step(random_actions(rng, 1, 2)[0])
    kept_step = copy.deepcopy(step)
    envs.step(random_actions(rng, 1, 2)[0])
    assert data_equivalence((obs, infos), kept, exact=True)
    assert data_equivalence(step, kept_step, exact=True)
