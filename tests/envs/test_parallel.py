"""Tasks of several agents: parts of the action, views, rewards and ends, without PettingZoo."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

from rigid_env import TaskEnv, Wrench, observe
from rigid_env.envs.parallel import Parallel, single_env
from rigid_env.tasks import Task
from tests.tasks.conftest import Slide

pytestmark = pytest.mark.interpreted

PLACE = observe.pos()


class Two(Slide):
    """Two agents push one block along x, each with half of the force of `Slide`."""

    actions = tuple(Wrench(0, force=0.25, torque=0.0, force_axes="x", agent=agent) for agent in ("left", "right"))

    def rewards(self, worlds):
        return {"speed": worlds.linvel[:, 0, 0]}


class Apart(Two):
    """The same with a view and a cost for each of them."""

    observation = {"left": [PLACE, observe.linvel()], "right": [observe.height(), PLACE]}  # noqa: RUF012
    max_episode_steps = 3

    def rewards(self, worlds):
        effort = -(worlds.action**2)
        return {"speed": worlds.linvel[:, 0, 0], "effort[left]": effort[:, 0], "effort[right]": effort[:, 1]}


def parallel(task: type[Task] | str, limit="registered", **settings) -> Parallel:
    """The agents of a task."""
    return Parallel(*single_env(task, limit, settings))


def test_two_agents_of_half_the_strength_push_as_one():
    one, two = TaskEnv(Slide), parallel(Two)
    obs = one.reset(seed=0)[0]
    found, infos = two.reset(seed=0)
    assert list(found) == list(infos) == two.agents == two.possible_agents == ["left", "right"]
    np.testing.assert_array_equal(found["left"], obs)
    for _ in range(3):
        obs = one.step([0.6])[0]
        found, rewards, ends, cuts, infos = two.step({"right": [0.6], "left": np.array([0.6])})
        for agent in two.possible_agents:
            np.testing.assert_allclose(found[agent], obs, rtol=1e-6)
            assert rewards[agent] == infos[agent]["reward_speed"] > 0.0
        assert ends == cuts == {"left": False, "right": False}
    assert two.action_spaces == dict.fromkeys(two.agents, gym.spaces.Box(-1.0, 1.0, (1,), dtype=np.float32))
    assert two.observation_space("left") is two.observation_space("left") is not two.observation_space("right")


def test_each_agent_sees_its_entries_and_pays_its_costs():
    env = parallel(Apart)
    env.reset(seed=0)
    found, rewards, *_, infos = env.step({"left": [1.0], "right": [0.5]})
    state = env.state()  # place, velocity, height
    np.testing.assert_array_equal(found["left"], state[:6])
    np.testing.assert_array_equal(found["right"], state[[6, 0, 1, 2]])
    speed = infos["left"]["reward_speed"]
    assert rewards == {"left": speed - 1.0, "right": speed - 0.25}
    for agent in env.agents:
        assert env.observation_space(agent).contains(found[agent])
    assert env.state_space.contains(state)
    found["left"][:] = 9.0
    infos["left"].clear()
    np.testing.assert_array_equal(env.state(), state)
    assert infos["right"]


@pytest.mark.parametrize(("limit", "steps"), [("registered", 3), (2, 2), (None, None), (-1, None)])
def test_an_episode_is_cut_for_all_agents_at_once(limit, steps):
    env = parallel(Apart, limit)
    env.reset(seed=0)
    for k in range(1, 6):
        *_, cuts, infos = env.step({agent: [0.0] for agent in env.possible_agents})
        assert list(infos) == ["left", "right"]
        assert cuts == dict.fromkeys(infos, k == steps)
        assert env.agents == ([] if k == steps else ["left", "right"])
        if k == steps:
            break
    if steps is not None:
        with pytest.raises(gym.error.ResetNeeded, match="call reset"):
            env.step({agent: [0.0] for agent in env.possible_agents})
        env.reset()
        assert env.agents == ["left", "right"]


def test_it_terminates_for_all_agents_at_once():
    env = parallel(type("Ends", (Two,), {"failure": lambda self, worlds: worlds.pos[:, 0, 0] > -9.0}))
    env.reset(seed=0)
    _, _, ends, cuts, _ = env.step({"left": [0.0], "right": [0.0]})
    assert ends == {"left": True, "right": True}
    assert cuts == {"left": False, "right": False}
    assert env.agents == []


def test_an_id_has_one_agent_and_its_own_limit():
    env = parallel("rigid_env/BlockReach-v0", accuracy="fast", mass=(4.0, 8.0))
    found, infos = env.reset(seed=3, options={"options": 1, "friction": 0.3})
    twin = gym.make("rigid_env/BlockReach-v0", accuracy="fast", mass=(4.0, 8.0))
    obs, info = twin.reset(seed=3, options={"friction": 0.3})
    np.testing.assert_array_equal(found["agent"], obs)
    np.testing.assert_equal(infos["agent"], info)
    assert env._limit == 300
    assert env.action_space("agent").shape == (6,)


def test_goals_are_seen_by_all_agents():
    env = parallel("rigid_env/BlockReachGoal-v0")
    found, _ = env.reset(seed=0)
    assert found["agent"].keys() == {"observation", "achieved_goal", "desired_goal"}
    assert env.observation_space("agent").contains(found["agent"])
    assert env.state_space.contains(env.state())


@pytest.mark.parametrize(
    ("actions", "words"),
    [
        ({"left": [0.0]}, "actions is of 'left'; allowed is a dict of 'left', 'right'"),
        ({"left": [0.0], "right": [0.0], "third": [0.0]}, "'third'; allowed is a dict"),
        ([0.0, 0.0], "actions is of [0.0, 0.0]; allowed is a dict"),
        ({"left": [0.0, 0.0], "right": [0.0]}, "action of 'left' has shape (2,); allowed is shape (1,)"),
        ({"left": [np.nan], "right": [0.0]}, "allowed are finite numbers"),
        ({"left": ["much"], "right": [0.0]}, "action of 'left' is ['much']; allowed are numbers"),
    ],
)
def test_actions_that_are_not_of_all_agents_are_refused(actions, words):
    env = parallel(Two)
    env.reset(seed=0)
    with pytest.raises(ValueError, match="allowed") as error:
        env.step(actions)
    assert words in str(error.value)
    assert env._env.task.steps[0] == 0


@pytest.mark.parametrize(
    ("task", "body", "words"),
    [
        (
            Two,
            {"rewards": lambda self, w: {"near[lest]": 0.0}},
            "term 'near[lest]' of T is of agent 'lest'; allowed are left",
        ),
        (
            Two,
            {"observation": {"left": [PLACE]}},
            "observation of T is of 'left'; allowed are the agents of its actions",
        ),
        (Two, {"observation": {"left": [PLACE], "right": PLACE.read}}, "allowed is a list of Entry, or a dict of such"),
        (Two, {"observation": {"left": [PLACE], "right": [observe.pos()]}}, "two entries of the name"),
        (Two, {"observation": {"left": [PLACE, PLACE], "right": []}}, "two entries of the name"),
    ],
)
def test_a_declaration_that_misses_an_agent_is_refused(task, body, words):
    with pytest.raises(ValueError, match=r"allowed") as error:
        parallel(type("T", (task,), body))
    assert words in str(error.value)


def test_views_of_pictures_are_refused():
    pytest.importorskip("pygame")
    with pytest.raises(ValueError, match="observation of Apart has views of agents; allowed are obs='state'"):
        parallel(Apart, obs="pixels")


def test_views_are_part_of_the_whole_observation():
    """Gymnasium sees every entry once; an entry that two agents see is one object."""
    env = TaskEnv(Apart)
    assert env.observation_space.shape == (7,)
    assert env.task.observed.views["right"].tolist() == [6, 0, 1, 2]
    assert "| 0 | position x | -10 | 10 | 5 m | left, right |" in env.describe()
    assert "| 6 | height y | -10 | 10 | 5 m | right |" in env.describe()
    assert TaskEnv(Slide).task.observed.views == {}


def test_environments_of_others_and_unknown_options_are_refused():
    with pytest.raises(ValueError, match="task is 'CartPole-v1', a CartPoleEnv; allowed are environments of rigid_env"):
        parallel("CartPole-v1")
    with pytest.raises(ValueError, match="options has the key 'mas'"):
        parallel(Two).reset(options={"mas": 1})
    with pytest.raises(gym.error.ResetNeeded, match="state"):
        parallel(Two).state()
