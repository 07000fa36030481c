"""Options of reset and parameters of an episode: told, fixed, held, and refused without a trace."""

from __future__ import annotations

import copy
import gc
import sys

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AsyncVectorEnv, SyncVectorEnv

import physics
from physics.kernels.state import layout as at
from rigid_env import BlockReachEnv, BlockReachVectorEnv, BlockReorientEnv, BlockReorientVectorEnv
from tests.envs.conftest import random_actions
from tests.wrong_input.environments import state_of

RANGES = {
    "mass": (4.0, 8.0),
    "size": ((2.0, 2.0, 1.0), (5.0, 3.0, 2.0)),
    "friction": (0.3, 0.7),
    "restitution": (0.0, 0.4),
    "gravity": (5.0, 10.0),
}
FIXED = {"mass": 7.0, "size": (3.0, 2.0, 1.5), "friction": 0.25, "restitution": 0.9, "gravity": 3.7}


def same(a, b) -> bool:
    return a.keys() == b.keys() and all(np.array_equal(a[key], b[key]) for key in a)


def in_world(env, row=0) -> dict:
    """The parameters as the engine has them."""
    world = env.task.world
    return {
        "mass": 1.0 / world.params[row, at.INV_MASS],
        "size": 2.0 * world.params[row, at.DIMENSIONS : at.DIMENSIONS + 3],
        "friction": world.params[row, at.FRICTION],
        "restitution": world.params[row, at.RESTITUTION],
        "gravity": -world.gravity[row, 1],
    }


@pytest.mark.parametrize("arguments", [{}, RANGES], ids=["fixed", "drawn"])
def test_reset_tells_the_parameters_of_the_world(env_class, arguments):
    env = env_class(**arguments)
    for seed in (0, None):
        _, info = env.reset(seed=seed)
        for field, value in in_world(env).items():
            np.testing.assert_allclose(info[field], value, rtol=1e-15, err_msg=field)
            assert np.array_equal(getattr(env, field), info[field])
        assert not info.keys() & {"_mass"}
        later = env.step(np.zeros(6))[4]
        assert later["mass"] == info["mass"]
        assert later["size"].tolist() == info["size"].tolist()


def test_a_batch_tells_those_of_the_running_episodes(vector_class, rng):
    """In all modes they change in the call in which the new episode's first observation stands."""
    for mode in ("NextStep", "SameStep", "Disabled"):
        envs = vector_class(3, autoreset_mode=mode, max_episode_steps=4, **RANGES)
        _, infos = envs.reset(seed=0, options={"reset_mask": np.array([True, True, True])})
        assert infos["_mass"].tolist() == [True] * 3
        begun, last = [], infos
        for k, actions in enumerate(random_actions(rng, 4 if mode == "Disabled" else 9, 3), 1):
            infos = envs.step(actions)[4]
            assert infos["_size"].all()
            np.testing.assert_array_equal(infos["mass"], envs.get_attr("mass"))
            np.testing.assert_array_equal(infos["size"], envs.get_attr("size"))
            if (infos["mass"] != last["mass"]).any():
                begun.append(k)
            if "final_info" in infos:
                np.testing.assert_array_equal(infos["final_info"]["mass"], last["mass"])
            last = infos
        assert begun == {"NextStep": [5], "SameStep": [4, 8], "Disabled": []}[mode]
        mask = np.array([False, True, False])
        infos = envs.reset(options={"reset_mask": mask})[1]
        assert infos["_gravity"].tolist() == mask.tolist()
        assert (infos["mass"] > 0).tolist() == mask.tolist()


@pytest.mark.parametrize("arguments", [{}, RANGES], ids=["fixed", "drawn"])
def test_an_option_fixes_a_parameter_for_one_episode_and_nothing_else(env_class, arguments):
    """The draws of the seed stay: goal, face and yaw of this episode, and everything of the next, to the bit."""
    env, twin = env_class(**arguments), env_class(**arguments)
    other, plain = env.reset(seed=3, options=FIXED), twin.reset(seed=3)
    for field, value in FIXED.items():
        np.testing.assert_array_equal(other[1][field], value)
        np.testing.assert_allclose(in_world(env)[field], value, rtol=1e-15)
    np.testing.assert_array_equal(env.task.world.quat, twin.task.world.quat)
    if not arguments and env_class is BlockReachEnv:  # the room that is left for places depends on the size
        env.reset(seed=3, options={"mass": 7.0})
        np.testing.assert_array_equal(env.task.world.pos, twin.task.world.pos)
        np.testing.assert_array_equal(env.task.record[:, 7:9], twin.task.record[:, 7:9])
    assert plain[1]["gravity"] != 3.7
    after, expected = env.reset(), twin.reset()
    np.testing.assert_array_equal(after[0], expected[0])
    assert same(after[1], expected[1])
    np.testing.assert_array_equal(env.task.world.params, twin.task.world.params)
    np.testing.assert_array_equal(env.task.world.gravity, twin.task.world.gravity)
    for action in random_actions(np.random.default_rng(0), 30, 1)[:, 0]:
        np.testing.assert_array_equal(env.step(action)[0], twin.step(action)[0])


def test_an_environment_with_an_option_is_the_one_made_with_that_value():
    env, made = BlockReachEnv(), BlockReachEnv(**FIXED)
    np.testing.assert_array_equal(env.reset(seed=5, options=FIXED)[0], made.reset(seed=5)[0])
    for action in random_actions(np.random.default_rng(0), 40, 1)[:, 0]:
        np.testing.assert_array_equal(env.step(action)[0], made.step(action)[0])


def test_options_of_a_batch_are_for_all_or_for_each():
    envs = BlockReachVectorEnv(2)
    _, infos = envs.reset(seed=0, options={"mass": [5.0, 9.0], "size": (2.0, 2.0, 3.0), "gravity": 1.6})
    assert infos["mass"].tolist() == [5.0, 9.0]
    assert infos["size"].tolist() == [[2.0, 2.0, 3.0]] * 2
    assert envs.get_attr("gravity") == (1.6, 1.6)
    single = BlockReachEnv()
    obs, _ = single.reset(seed=1, options={"mass": 9.0, "size": (2.0, 2.0, 3.0), "gravity": 1.6})
    np.testing.assert_array_equal(envs.task.obs[1], obs)


def test_sync_and_async_batches_take_the_same_options_and_attributes(env_id):
    native = gym.make_vec(env_id, num_envs=2, mass=(4.0, 8.0))
    makers = [lambda: gym.make(f"rigid_env:{env_id}", mass=(4.0, 8.0))] * 2
    for kind in (SyncVectorEnv, AsyncVectorEnv):
        envs = kind(makers)
        try:
            ours, theirs = (
                native.reset(seed=4, options={"friction": 0.3}),
                envs.reset(seed=4, options={"friction": 0.3}),
            )
            np.testing.assert_array_equal(ours[0], theirs[0])
            assert same(ours[1], theirs[1])
            for name in ("mass", "friction", "render_mode", "observation_space", "action_space"):
                assert tuple(native.get_attr(name)) == tuple(envs.get_attr(name)), name
            native.set_attr("mass", [5.0, 6.0])
            envs.set_attr("mass", [5.0, 6.0])
            assert native.get_attr("mass") == envs.get_attr("mass") == (5.0, 6.0)
            assert same(native.reset()[1], envs.reset()[1])
            assert native.get_attr("mass") == (5.0, 6.0)
            native.set_attr("mass", None)
            envs.set_attr("mass", None)
            assert same(native.reset()[1], envs.reset()[1])
            assert native.get_attr("mass") != (5.0, 6.0)
        finally:
            envs.close()


def test_a_held_parameter_acts_at_once(vector_class):
    envs = vector_class(2)
    envs.reset(seed=0, options={"face": 2})
    envs.set_attr("gravity", 3.0)
    assert envs.task.world.gravity[:, 1].tolist() == [-3.0, -3.0]
    envs.step(np.array([[0.0, 1.0, 0, 0, 0, 0]] * 2))
    np.testing.assert_allclose(envs.task.wrench[:, 0, 1], 0.9 * 6.0 * 3.0)
    envs.set_attr("size", np.array([5.0, 3.0, 1.0]))
    assert [size.tolist() for size in envs.get_attr("size")] == [[5.0, 3.0, 1.0]] * 2
    twin = vector_class(2, gravity=3.0, size=(5.0, 3.0, 1.0))
    np.testing.assert_array_equal(envs.reset(seed=8)[0], twin.reset(seed=8)[0])


def test_attributes_of_one_world():
    envs = BlockReachVectorEnv(3, dt=0.01, walls="corner", max_episode_steps=9)
    envs.reset(seed=5)
    envs.step(np.zeros((3, 6)))
    assert envs.get_attr("np_random_seed") == (5, 6, 7)
    assert envs.get_attr("elapsed_steps") == (1, 1, 1)
    assert envs.get_attr("dt") == (0.01,) * 3
    assert envs.call("walls") == ("corner",) * 3
    assert envs.get_attr("accuracy")[0] == physics.PRESETS["balanced"]
    assert envs.get_attr("observation_space") == (envs.single_observation_space,) * 3
    assert [
        picture.shape for picture in BlockReachVectorEnv(2, render_mode="rgb_array", width=8, height=6).call("render")
    ] == [(6, 8, 3)] * 2
    envs.set_attr("max_episode_steps", [20, 20, 20])
    assert envs.get_attr("max_episode_steps") == (20,) * 3
    with pytest.raises(AttributeError, match="call got name 'reset'; the worlds of a native batch"):
        envs.call("reset", seed=1)


def test_a_copy_keeps_held_parameters():
    env = BlockReachEnv()
    env.mass = 9.0
    twin = copy.deepcopy(env)
    assert twin.reset(seed=0)[1]["mass"] == 9.0
    twin.mass = 3.0
    assert env.reset(seed=0)[1]["mass"] == 9.0


def test_a_parameter_that_an_effect_replaces_is_neither_told_nor_taken():
    env = BlockReachEnv(effects=[physics.Gravity((0, -4, 0))])
    _, info = env.reset(seed=0)
    assert "gravity" not in info
    assert "mass" in info
    with pytest.raises(ValueError, match=r"options gravity was given, but effects holds Gravity"):
        env.reset(options={"gravity": 3.0})
    with pytest.raises(ValueError, match=r"^gravity was given, but effects holds Gravity"):
        env.gravity = 3.0


def test_a_range_of_sizes_with_a_cube_in_the_middle():
    """Its kernel has the gyroscopic torque that the other blocks of the range need."""
    env = BlockReorientEnv(size=((1.0, 1.0, 1.0), (3.0, 3.0, 3.0)))
    _, info = env.reset(seed=0)
    assert np.ptp(info["size"]) > 0.1
    twin = BlockReorientEnv(size=tuple(info["size"]))
    np.testing.assert_array_equal(env.reset(seed=0)[0], twin.reset(seed=0)[0])


@pytest.mark.parametrize(
    "options",
    [{"place": (9.9, 0.0)}, {"goal": (0.0, 10.5)}, {"mass": 0.0}, {"size": (18.0, 8.0, 1.0)}, {"shape": 1}],
    ids=lambda options: next(iter(options)),
)
def test_refused_options_leave_the_generators_where_they_were(options):
    """With a seed and without, before the first reset and after: the next draws are those of an untouched twin."""
    for seed in (None, 11):
        env, twin = BlockReachEnv(), BlockReachEnv()
        envs, twins = BlockReachVectorEnv(3), BlockReachVectorEnv(3)
        for thing in (env, twin, envs, twins):
            thing.reset(seed=2)
        for thing in (env, envs):
            before = state_of(thing)
            with pytest.raises(ValueError, match="options"):
                thing.reset(seed=seed, options=options)
            after = state_of(thing)
            assert repr(before) == repr(after)
        np.testing.assert_array_equal(env.reset()[0], twin.reset()[0])
        np.testing.assert_array_equal(envs.reset()[0], twins.reset()[0])
        assert env.np_random_seed == 2
    fresh = BlockReorientVectorEnv(2)
    with pytest.raises(ValueError, match="options face is 9"):
        fresh.reset(seed=1, options={"face": 9})
    assert fresh.np_random_seed == (-1, -1)
    assert fresh.np_random == (None, None)


def test_a_batch_whose_construction_failed_is_closed_without_a_word(monkeypatch):
    told = []
    monkeypatch.setattr(sys, "unraisablehook", told.append)
    with pytest.raises(ValueError, match="render_mode is 'film'"):
        BlockReachVectorEnv(2, render_mode="film")
    gc.collect()
    assert told == []
