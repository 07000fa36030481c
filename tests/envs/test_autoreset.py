"""End of an episode in each of Gymnasium's autoreset modes; reset masks and options."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.vector import AutoresetMode

from rigid_env import BlockReachVectorEnv, TaskEnv, TaskVectorEnv, Uniform
from rigid_env.tasks import BlockReach, Distribution, Push
from tests.tasks.conftest import Slide

STILL = np.zeros((2, 6), dtype=np.float32)


def staggered(vector_class, mode):
    """Two worlds with a limit of 4 steps, of which world 1 is two steps younger."""
    envs = vector_class(2, autoreset_mode=mode, max_episode_steps=4)
    envs.reset(seed=0)
    envs.step(STILL)
    envs.step(STILL)
    envs.reset(options={"reset_mask": np.array([False, True])})
    return envs


def test_next_step_resets_one_step_later_without_reward(vector_class):
    envs = staggered(vector_class, "NextStep")
    assert envs.metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    envs.step(STILL)
    last, rewards, terminated, truncated, infos = envs.step(STILL)
    assert truncated.tolist() == [True, False]
    assert "final_obs" not in infos
    first, rewards, terminated, truncated, infos = envs.step(STILL)
    assert not np.array_equal(first[0], last[0])
    assert rewards[0] == 0.0
    assert rewards[1] != 0.0
    assert not truncated.any()
    assert not terminated.any()
    assert envs.step(STILL)[3].tolist() == [False, True]


def test_same_step_returns_the_new_observation_and_keeps_the_final_one(vector_class):
    envs, twin = staggered(vector_class, "SameStep"), staggered(vector_class, "NextStep")
    envs.step(STILL)
    twin.step(STILL)
    first, rewards, _, truncated, infos = envs.step(STILL)
    last, twin_rewards, _, _, twin_infos = twin.step(STILL)
    new = twin.step(STILL)[0]
    assert truncated.tolist() == [True, False]
    np.testing.assert_array_equal(rewards, twin_rewards)
    np.testing.assert_array_equal(infos["final_obs"][0], last[0])
    assert infos["final_obs"][1] is None
    assert infos["_final_obs"].tolist() == [True, False]
    error = envs.task.error_name
    assert infos["final_info"][error][0] == twin_infos[error][0]
    assert infos["final_info"][f"_{error}"].tolist() == [True, False]
    np.testing.assert_array_equal(first[0], new[0])
    assert "final_obs" not in envs.step(STILL)[4]


def test_disabled_waits_for_a_reset_of_exactly_the_ended_worlds(vector_class):
    envs = staggered(vector_class, AutoresetMode.DISABLED)
    envs.step(STILL)
    obs, _, terminated, truncated, _ = envs.step(STILL)
    with pytest.raises(gym.error.ResetNeeded, match=r"\[0\]"):
        envs.step(STILL)
    new, infos = envs.reset(options={"reset_mask": terminated | truncated})
    assert not np.array_equal(new[0], obs[0])
    np.testing.assert_array_equal(new[1], obs[1])
    assert infos["_speed"].tolist() == [True, False]
    assert envs.step(STILL)[3].tolist() == [False, False]


def test_reset_mask_leaves_the_callers_options_alone(vector_class):
    envs = vector_class(2)
    envs.reset(seed=0)
    options = {"reset_mask": np.array([True, False])}
    envs.reset(options=options)
    assert options.keys() == {"reset_mask"}


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
def test_vector_episode_statistics_count_each_step_once(vector_class, mode):
    if mode == "SameStep" and tuple(map(int, gym.__version__.split(".")[:2])) < (1, 4):
        pytest.skip("needs Gymnasium 1.4: before, its wrapper leaves out the first step of all episodes but the first")
    envs = gym.wrappers.vector.RecordEpisodeStatistics(vector_class(2, autoreset_mode=mode, max_episode_steps=3))
    envs.reset(seed=0)
    lengths = []
    for _ in range(9):
        infos = envs.step(STILL)[4]
        lengths += infos["episode"]["l"][infos["_episode"]].tolist() if "episode" in infos else []
    assert set(lengths) == {3}


def test_step_before_reset(env_class, vector_class):
    with pytest.raises(gym.error.ResetNeeded):
        env_class().step(STILL[0])
    with pytest.raises(gym.error.ResetNeeded):
        vector_class(2).step(STILL)


@pytest.mark.parametrize(
    ("mask", "text"),
    [
        (np.array([False, False]), "at least one True"),
        ([True, False], "bool array"),
        (np.ones(3, bool), "bool array"),
    ],
)
def test_reset_mask_errors(vector_class, mask, text):
    envs = vector_class(2)
    envs.reset(seed=0)
    with pytest.raises(ValueError, match=f"reset_mask.*{text}"):
        envs.reset(options={"reset_mask": mask})


class Pushed(Slide):
    """A push is due in nearly every control step."""

    draws = {"mass": (2.0, 4.0)}  # noqa: RUF012
    disturbances = (Push(0, 0.5, 0.002),)


def episodes_of(mode, count=4, limit=3) -> list[np.ndarray]:
    """First observations, draws and observations of each step of the episodes of world 1 of a batch."""
    envs = TaskVectorEnv(2, task=Pushed, autoreset_mode=mode, max_episode_steps=limit)
    obs, infos = envs.reset(seed=3)
    found = [obs[1], infos["mass"][1]]
    for _ in range(count):
        for k in range(limit):
            obs, _, _, _, infos = envs.step(np.zeros((2, 1)))
            found.append(infos["final_obs"][1] if k == limit - 1 and mode == "SameStep" else obs[1])
        if mode == "NextStep":
            obs, _, _, _, infos = envs.step(np.zeros((2, 1)))
        if mode == "Disabled":
            obs, infos = envs.reset(options={"reset_mask": np.ones(2, dtype=bool)})
        found += [obs[1], infos["mass"][1]]
    return found


def test_later_episodes_are_those_of_a_single_environment_in_all_modes():
    """Also where disturbances draw numbers: a world that starts anew in the next step must not draw in it."""
    env = TaskEnv(Pushed)
    obs, info = env.reset(seed=4)
    alone = [obs, info["mass"]]
    for _ in range(4):
        alone += [env.step([0.0])[0] for _ in range(3)]
        obs, info = env.reset()
        alone += [obs, info["mass"]]
    for mode in AutoresetMode:
        for ours, theirs in zip(episodes_of(mode.value), alone, strict=True):
            np.testing.assert_array_equal(ours, theirs)


# --- starts that end with an error ------------------------------------------------------------------------------------


class Fragile(Slide):
    """A task whose start, or whose goal in pictures, may end with an error."""

    draws = {"x": Uniform(-1.0, 1.0), "mass": (2.0, 4.0)}  # noqa: RUF012
    memory = {"count": 1}  # noqa: RUF012
    disturbances = (Push(0, 0.5, 0.05),)
    max_episode_steps = 4
    breaks_at = None

    def place(self, drawn):
        if self.breaks_at == "place":
            raise ZeroDivisionError("no place")
        return {"pos": np.stack([drawn["x"], np.full_like(drawn["x"], 0.5), 0 * drawn["x"]], axis=1)}

    def begin(self, worlds):
        if self.breaks_at == "begin":
            raise ZeroDivisionError("no beginning")

    def update(self, worlds):
        worlds.memory["count"] += 1.0

    def goal_mark(self, world):
        if self.breaks_at == "goal_mark":
            raise ZeroDivisionError("no goal")
        return {"pos": (0.0, 0.0, 0.0)}


class OwnDraw(Distribution):
    """A distribution that ends with an error while `breaks` is True."""

    length = uniforms = 1
    breaks = False

    def at(self, shares, drawn):
        if self.breaks:
            raise ZeroDivisionError("no draw")
        return 4.0 + shares[:, 0]

    def describe(self):
        return "from 4 to 5"


class FragileReach(BlockReach):
    """A compiled task whose start may end with an error."""

    breaks_at = None

    def place(self, drawn):
        if self.breaks_at == "place":
            raise ZeroDivisionError("no place")
        return super().place(drawn)


def everything(envs) -> str:
    state = envs.get_state()
    parts = state.world.arrays, state.world.time, state.arrays, state.held, state.generators, state.seeds
    with np.printoptions(threshold=1_000_000, floatmode="unique"):
        return str((parts, envs.task.clock, [generator is None for generator in envs.task.generators]))


def broken(envs, place):
    """Break the task at a place."""
    envs.task.breaks_at = place
    for each in envs.task.distributions.values():
        for part in (each, getattr(each, "edges", None)):
            if isinstance(part, OwnDraw):
                part.breaks = place == "draw"


FRAGILE = {
    "place": (Fragile, {}, "place"),
    "begin": (Fragile, {}, "begin"),
    "pictures": (Fragile, {"obs": "pixels", "obs_size": (8, 12), "obs_stack": 2}, "goal_mark"),
    "start of pictures": (Fragile, {"obs": "pixels", "obs_size": (8, 12), "obs_stack": 2}, "begin"),
    "compiled": (FragileReach, {}, "place"),
    "drawn": (BlockReach, {"mass": OwnDraw()}, "draw"),
}


@pytest.mark.parametrize("mode", ["NextStep", "SameStep"])
@pytest.mark.parametrize("name", FRAGILE)
def test_a_step_whose_start_fails_changes_nothing_and_can_be_taken_again(name, mode):
    task, more, place = FRAGILE[name]
    envs, twin = (TaskVectorEnv(3, task=task, autoreset_mode=mode, max_episode_steps=4, **more) for _ in range(2))
    rng = np.random.default_rng(1)
    for each in (envs, twin):
        broken(each, None)
        each.reset(seed=0)
        each.step(np.zeros(each.action_space.shape))
        each.reset(options={"reset_mask": np.array([True, False, True])})
    failed = 0
    for _ in range(14):
        action = rng.uniform(-1, 1, envs.action_space.shape)
        before = everything(envs)
        broken(envs, place)
        try:
            obs, *rest = envs.step(action)
        except ZeroDivisionError:
            failed += 1
            assert everything(envs) == before
            broken(envs, None)
            obs, *rest = envs.step(action)
        broken(envs, None)
        theirs = twin.step(action)
        np.testing.assert_array_equal(obs, theirs[0])
        for ours, other in zip(rest[:3], theirs[1:4], strict=True):
            np.testing.assert_array_equal(ours, other)
    assert failed >= 3
    assert everything(envs) == everything(twin)


@pytest.mark.parametrize("name", FRAGILE)
def test_a_reset_that_fails_changes_nothing(name):
    task, more, place = FRAGILE[name]
    envs = TaskVectorEnv(2, task=task, **more)
    broken(envs, None)
    envs.reset(seed=0)
    envs.step(np.zeros(envs.action_space.shape))
    before, seeds = everything(envs), envs.np_random_seed
    broken(envs, place)
    for keywords in ({}, {"seed": 5}, {"options": {"reset_mask": np.array([False, True])}}):
        with pytest.raises(ZeroDivisionError):
            envs.reset(**keywords)
        assert everything(envs) == before
        assert envs.np_random_seed == seeds
    broken(envs, None)


def test_built_in_tasks_need_no_copies_for_starts():
    assert not BlockReachVectorEnv(1).task.may_fail
    assert TaskVectorEnv(1, task=FragileReach).task.may_fail
