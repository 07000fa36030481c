"""Tasks with goals: both goals in the observation, rewards of any pair, hindsight experience replay."""

from __future__ import annotations

import pickle

import gymnasium as gym
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigid_env import BlockReachEnv, TaskEnv, TaskVectorEnv, check_task
from rigid_env.envs.goals import METHODS
from rigid_env.tasks import Entry
from rigid_env.tasks.block_goals import BlockReachGoal, BlockReorientGoal
from rigid_env.tasks.goal import GoalTask
from tests.tasks.conftest import Slide

pytestmark = pytest.mark.interpreted

TASKS = (BlockReachGoal, BlockReorientGoal)
IDS = ("rigid_env/BlockReachGoal-v0", "rigid_env/BlockReorientGoal-v0")


@pytest.mark.compiled
@pytest.mark.parametrize("task", TASKS)
@pytest.mark.parametrize("reward", ["sparse", "dense"])
def test_tasks_pass_their_checks(task, reward):
    check_task(task, contexts=("fork",), reward=reward)


@pytest.mark.compiled
@pytest.mark.parametrize("env_id", IDS)
def test_sb3_check_env_without_a_warning(env_id):
    pytest.importorskip("stable_baselines3")
    import warnings

    from stable_baselines3.common.env_checker import check_env

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(gym.make(env_id).unwrapped, warn=True, skip_render_check=True)


@pytest.mark.compiled
@pytest.mark.parametrize("env_id", IDS)
@pytest.mark.parametrize("reward", ["sparse", "dense"])
def test_the_reward_is_that_of_the_observed_goals(env_id, reward, is_exhaustive):
    worlds, steps = (4, 20) if is_exhaustive else (2, 6)
    envs = gym.make_vec(env_id, num_envs=worlds, reward=reward)
    envs.reset(seed=0)
    rng = np.random.default_rng(1)
    for _ in range(steps):
        obs, rewards, *_ = envs.step(rng.uniform(-1, 1, (worlds, 6)))
        np.testing.assert_array_equal(
            rewards, envs.unwrapped.compute_reward(obs["achieved_goal"], obs["desired_goal"], {})
        )
    other = np.roll(obs["desired_goal"], 1, axis=0)  # of any pair, and of a stack of pairs
    each = [envs.unwrapped.compute_reward(a, b) for a, b in zip(obs["achieved_goal"], other)]
    np.testing.assert_array_equal(envs.unwrapped.compute_reward(obs["achieved_goal"], other), each)
    stack = np.stack([obs["achieved_goal"]] * 2), np.stack([other] * 2)
    np.testing.assert_array_equal(envs.unwrapped.compute_reward(*stack), [each, each])
    for ends in (envs.unwrapped.compute_terminated, envs.unwrapped.compute_truncated):  # as no episode ends by a goal
        np.testing.assert_array_equal(ends(obs["achieved_goal"], obs["achieved_goal"], {}), np.zeros(worlds, bool))
        assert ends(*stack).shape == (2, worlds)


@pytest.mark.parametrize("task", TASKS)
def test_a_goal_that_is_achieved_is_reached_and_success_does_not_end_the_episode(task):
    env = TaskEnv(task)
    option = {"place": (1.0, 2.0), "face": 2}
    option |= {"goal": (1.0, 2.0)} if task is BlockReachGoal else {"target_face": 2}
    obs, info = env.reset(seed=0, options=option)
    assert info["is_success"] is False  # nothing has been done yet
    for _ in range(5):
        obs, reward, is_ended, _, info = env.step(np.zeros(6))
        assert (reward, is_ended, info["is_success"]) == (0.0, False, True)
    np.testing.assert_allclose(obs["achieved_goal"], obs["desired_goal"], atol=1e-3)


@pytest.mark.parametrize(
    ("change", "is_reached"),
    [
        ({}, True),
        ({"pos": (0.29, 3.0, 0.0)}, True),
        ({"pos": (0.31, 3.0, 0.0)}, False),
        ({"pos": (0.0, 5.0, 0.0)}, True),  # the height does not count
        ({"linvel": (0.0, 0.09, 0.0)}, True),
        ({"linvel": (0.0, 0.11, 0.0)}, False),
        ({"angvel": (0.0, 0.0, 0.09)}, True),
        ({"angvel": (0.0, 0.0, 0.11)}, False),
    ],
)
def test_place_speed_and_spin_decide(change, is_reached):
    task = BlockReachGoal(1)
    task.seed(0, 0)
    task.start(np.zeros(1, dtype=np.int64), {"goal": (0.0, 0.0)})
    state = {"pos": (0.0, 3.0, 0.0), "linvel": (0.0, 0.0, 0.0), "angvel": (0.0, 0.0, 0.0), **change}
    task.world.set_state(**state)
    worlds = task._functions._all
    worlds.renew()
    worlds.measured = task.measure(worlds)
    assert task.success(worlds)[0] == is_reached


@given(st.floats(-np.pi, np.pi), st.integers(0, 5))
def test_the_angle_decides_which_face_is_down(turn, face):
    """A turn about z takes the way down from -y by so much: the shortfall is the angle over 0.1 rad."""
    task = BlockReorientGoal(1)
    task.seed(0, 0)
    task.start(np.zeros(1, dtype=np.int64), {"face": 2, "target_face": face})
    quat = (np.cos(turn / 2), 0.0, 0.0, np.sin(turn / 2))
    task.world.set_state(pos=(0, 6, 0), quat=quat, linvel=(0, 0, 0), angvel=(0, 0, 0))
    worlds = task._functions._all
    worlds.renew()
    down = np.array([-np.sin(turn), -np.cos(turn), 0.0])  # Rᵀ (0, -1, 0)
    axis = np.zeros(3)
    axis[face // 2] = 1.0 if face % 2 else -1.0
    expected = np.arctan2(np.linalg.norm(np.cross(down, axis)), down @ axis) / 0.1
    # Goals are float32: an angle from their chord is off by some 1e-7, near 180° by its root; ten of that over 0.1.
    assert task.measure(worlds)["shortfall"][0] == pytest.approx(expected, abs=1e-5 if expected < 31 else 2e-2)


def test_autoreset_gives_dicts_and_the_last_one_of_each_episode():
    envs = TaskVectorEnv(2, task=BlockReachGoal, autoreset_mode="SameStep", max_episode_steps=2)
    first, _ = envs.reset(seed=0)
    assert set(first) == {"observation", "achieved_goal", "desired_goal"}
    envs.step(np.zeros((2, 6)))
    obs, _, _, cuts, infos = envs.step(np.zeros((2, 6)))
    assert cuts.all()
    for i in range(2):
        np.testing.assert_array_equal(infos["final_obs"][i]["desired_goal"], first["desired_goal"][i])
        assert (obs["desired_goal"][i] != first["desired_goal"][i]).any()


def test_goals_go_along_with_states_and_pickles_and_pictures():
    env = TaskEnv(BlockReachGoal, obs="pixels", obs_size=(12, 16))
    env.reset(seed=1)
    state, twin = env.get_state(), pickle.loads(pickle.dumps(env))
    other = TaskEnv(BlockReachGoal, obs="pixels", obs_size=(12, 16))
    other.set_state(state)
    action = np.full(6, 0.3)
    ours = env.step(action)[0]
    assert ours["observation"].shape == (12, 16, 3)
    for copy in (twin, other):
        theirs = copy.step(action)[0]
        for key, part in ours.items():
            np.testing.assert_array_equal(theirs[key], part)


@pytest.mark.compiled
def test_hindsight_replay_of_stable_baselines3_takes_the_native_batch():
    pytest.importorskip("stable_baselines3")
    from stable_baselines3 import SAC, HerReplayBuffer

    from rigid_env import RigidVecEnv

    envs = RigidVecEnv(TaskVectorEnv(2, task=BlockReachGoal, autoreset_mode="SameStep", max_episode_steps=10))
    model = SAC(
        "MultiInputPolicy", envs, replay_buffer_class=HerReplayBuffer, learning_starts=40, batch_size=16, seed=0,
        device="cpu", policy_kwargs={"net_arch": [16]},
    )  # fmt: skip
    model.learn(100)
    samples = model.replay_buffer.sample(200)
    relabelled = samples.rewards.numpy().ravel()
    again = envs.env_method("compute_reward", samples.next_observations["achieved_goal"].numpy(),
                            samples.observations["desired_goal"].numpy(), [{}] * 200, indices=[0])  # fmt: skip
    assert len(again) == 1
    np.testing.assert_array_equal(relabelled, again[0])
    assert (relabelled == 0.0).any()  # some transitions reach the goal that hindsight puts in place


@pytest.mark.compiled
class Along(GoalTask, Slide):
    """Slide to a place along x, told in units of 2 m from -1 to 1."""

    goal_entries = (Entry("place", "m", -1.0, 1.0, lambda worlds: worlds.pos[:, 0, 0], 2.0),)
    draws = {"goal": (-9.0, 9.0)}  # noqa: RUF012
    rewards = GoalTask.rewards

    def desired(self, worlds):
        return worlds.drawn["goal"][:, None]

    def shortfall(self, achieved, desired):
        return np.abs(achieved - desired)[..., 0] / 0.1


def test_goals_are_clipped_to_their_space():
    """The one that is wanted as the one that is achieved: a goal at a bound counts as reached beyond it."""
    env = TaskEnv(Along)
    for goal, told in ((5.0, 1.0), (-5.0, -1.0), (1.0, 0.5)):
        obs, _ = env.reset(seed=0, options={"goal": goal})
        assert obs["desired_goal"].tolist() == [told]
        assert env.observation_space.contains(obs)
    env.reset(options={"goal": 5.0})
    env.task.world.set_state(pos=(7.0, 0.5, 0.0))
    obs, reward, *_, info = env.step([0.0])
    assert obs["achieved_goal"].tolist() == [1.0]
    assert reward == 0.0
    assert info["is_success"]


@pytest.mark.parametrize(
    ("gave", "told"),
    [
        (lambda n: np.zeros((n, 2)), r"desired of Off gave float64 of shape \(2, 2\); allowed are .* shape \(2, 1\)"),
        (lambda n: np.zeros(n), r"desired of Off gave float64 of shape \(2,\); allowed are .* shape \(2, 1\)"),
        (lambda n: [[0.0]] * n, r"desired of Off gave \[\[0.0\], \[0.0\]\]; allowed are .* shape \(2, 1\)"),
        (lambda n: np.full((n, 1), np.inf), "desired goal 'place' of Off is inf in world 0; allowed are finite"),
    ],
)
def test_goals_that_are_no_rows_of_numbers_are_refused_when_the_task_is_made(gave, told):
    """Not by an error of NumPy's from the division by the scales."""

    class Off(Along):
        def desired(self, worlds):
            return gave(len(worlds))

    with pytest.raises(ValueError, match=told):
        Off()


def test_an_achieved_goal_that_is_not_finite_is_refused_though_clipping_would_hide_it():
    class Lost(Along):
        goal_entries = (Entry("place", "m", -1.0, 1.0, lambda worlds: worlds.pos[:, 0, 0] + np.inf),)

    with pytest.raises(ValueError, match="achieved goal 'place' of Lost is inf in world 0; allowed are finite"):
        Lost()


def test_what_a_batch_cannot_do_for_some_of_its_worlds_is_refused_still():
    pytest.importorskip("stable_baselines3")
    from rigid_env import RigidVecEnv

    envs = RigidVecEnv(TaskVectorEnv(2, task=BlockReachGoal, autoreset_mode="SameStep"))
    with pytest.raises(ValueError, match="indices"):
        envs.env_method("render", indices=[0])


def test_a_goal_ends_an_episode_where_the_task_says_so():
    class Ending(BlockReachGoal):
        ends_on_success = True

    env = TaskEnv(Ending)
    goal = np.zeros(4)
    np.testing.assert_array_equal(env.compute_terminated([goal, goal + 9.0], [goal, goal]), [True, False])
    assert not env.compute_truncated(goal, goal)


def test_refusals():
    with pytest.raises(ValueError, match=r"reward is 'shaped'.*sparse, dense"):
        TaskEnv(BlockReachGoal, reward="shaped")
    env = TaskEnv(BlockReachGoal)
    with pytest.raises(ValueError, match=r"desired_goal has shape \(3,\); allowed are 4 numbers"):
        env.compute_reward(np.zeros(4), np.zeros(3))
    assert not any(hasattr(BlockReachEnv(), name) for name in METHODS)
    with pytest.raises(TypeError, match=r"'acuracy'.*allowed are accuracy"):
        TaskEnv(BlockReachGoal, acuracy="fast")


@pytest.mark.compiled
@pytest.mark.parametrize("env_id", IDS)
def test_parameters_are_attributes_as_in_a_batch(env_id):
    env, envs = gym.make(env_id, friction=(0.2, 0.6)).unwrapped, gym.make_vec(env_id, num_envs=1, friction=(0.2, 0.6))
    for each in (env, envs):
        each.reset(seed=2)
    for name in ("mass", "size", "friction", "restitution", "gravity"):
        np.testing.assert_array_equal(getattr(env, name), envs.get_attr(name)[0])
    env.friction = 0.3
    assert env.step(np.zeros(6))[4]["friction"] == env.friction == 0.3
    assert env.reset()[1]["friction"] == 0.3
    env.friction = None
    env.reset()
    assert env.friction != 0.3
    with pytest.raises(ValueError, match=r"friction is \[-1"):
        env.friction = -1.0


def test_a_parameter_that_the_task_does_not_draw_is_no_attribute():
    env = TaskEnv(Slide)
    assert not hasattr(env, "friction")
    with pytest.raises(AttributeError, match="Slide does not draw 'mass'; allowed are no attributes"):
        env.mass = 3.0
    env = TaskEnv(type("Heavy", (Slide,), {"draws": {"mass": 2.0}}))
    with pytest.raises(AttributeError, match="Heavy does not draw 'size'; allowed are mass"):
        print(env.size)
