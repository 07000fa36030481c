"""A planner on copies of the environment: it solves episodes without training."""

from __future__ import annotations

import json
from itertools import product

import gymnasium as gym
import numpy as np
import pytest
import typer
from typer.testing import CliRunner

import agents.planner
from agents.planner import INTERRUPTED, Planner, PlannerSettings, main, solve
from rigid_env import BlockReachEnv, Gust, Push, TaskEnv, TaskVectorEnv
from tests.tasks.conftest import Slide
from tests.tiers.sweep import sweep


@pytest.mark.parametrize(
    ("name", "method"),
    sweep(
        product(("BlockReach", "BlockReorient"), ("mppi", "cem")),
        [("BlockReach", "mppi"), ("BlockReorient", "cem")], id="-".join,
    ),
)  # fmt: skip
def test_it_solves_episodes_without_training(name, method):
    env = gym.make(f"rigid_env:rigid_env/{name}-v0")
    planner = Planner(type(env.unwrapped.task), PlannerSettings(method=method), accuracy="fast")
    # 99 to 100 of 100 succeed; five of six allow for one, at a chance of failing of 2 in 1,000 for a rate of 0.99.
    assert sum(solve(env, planner, 6, seed=50).is_success) >= 5


def test_a_return_is_the_sum_of_the_rewards_of_the_environment():
    env = BlockReachEnv(accuracy="fast")
    env.reset(seed=3)
    planner = Planner(
        type(env.task), PlannerSettings(samples=3, horizon=6, knots=2, elites=1, replan=1), accuracy="fast"
    )
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (3, 6, 6))
    state = env.get_state()
    ours = planner.returns(state, actions)
    for k in range(3):
        env.set_state(state)
        total = 0.0
        for action in actions[k]:
            total += env.step(action)[1]
        assert ours[k] == total  # the same bits in the same order


def test_a_plan_is_the_same_for_a_seed_and_stays_within_bounds():
    env = BlockReachEnv()
    env.reset(seed=1)
    state = env.get_state()
    first, second = (Planner(type(env.task), seed=4, accuracy="fast").plan(state) for _ in range(2))
    np.testing.assert_array_equal(first, second)
    assert first.shape == (4, 6)
    assert np.abs(first).max() <= 1.0


class Pushed(Slide):
    """Pushes in nearly every control step."""

    disturbances = (Push(0, (0.5, 1.5), 0.03), Gust(0, every=0.1))


SMALL = PlannerSettings(samples=4, horizon=8, knots=2, replan=8)


@pytest.mark.interpreted
def test_a_plan_does_not_foresee_pushes():
    """Neither when the next one comes nor what the generator of the environment will draw."""
    env = TaskEnv(Pushed)
    env.reset(seed=0)
    state = env.get_state()
    plan = Planner(Pushed, SMALL).plan(state)
    assert env.get_state().generators == state.generators
    env.task.generators[0] = np.random.default_rng(99)
    env.task.disturbed.next[:] = 7.0
    np.testing.assert_array_equal(Planner(Pushed, SMALL).plan(env.get_state()), plan)


@pytest.mark.interpreted
def test_all_sequences_of_an_iteration_meet_the_same_pushes_those_of_another_one_others():
    env = TaskEnv(Pushed)
    env.reset(seed=0)
    planner, actions = Planner(Pushed, SMALL), np.zeros((4, 8, 1))
    first, second = (planner.returns(env.get_state(), actions) for _ in range(2))
    assert len(set(first)) == len(set(second)) == 1
    assert first[0] != second[0]


@pytest.mark.interpreted
def test_a_state_that_is_none_of_one_world_is_refused():
    planner, envs = Planner(Slide, SMALL), TaskVectorEnv(2, task=Slide)
    envs.reset(seed=0)
    for state in (None, np.zeros(3), envs.get_state()):
        with pytest.raises(ValueError, match=r"state is .*; allowed "):
            planner.plan(state)
    assert planner.plan(envs.get_state([1])).shape == (8, 1)


@pytest.mark.interpreted
def test_a_method_reads_its_own_settings_only():
    """MPPI has no elites: two sequences are enough for it."""
    env = TaskEnv(Slide)
    env.reset(seed=0)
    assert Planner(Slide, PlannerSettings(samples=2)).plan(env.get_state()).shape == (4, 1)
    with pytest.raises(ValueError, match="elites is 4; allowed are at most the samples, 2"):
        PlannerSettings(method="cem", samples=2)


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("method", "luck", ("method", "'luck'", "mppi, cem")),
        ("samples", 1, ("samples", "1", "at least 2")),
        ("noise", -1.0, ("noise", "-1")),
        ("knots", 1, ("knots", "1", "2 to")),
        ("replan", 99, ("replan", "99", "24")),
    ],
)
def test_settings_out_of_range_are_refused(field, value, words):
    with pytest.raises(ValueError, match="allowed") as error:
        PlannerSettings(**{field: value})
    assert all(word in str(error.value) for word in words), str(error.value)


def run(*arguments):
    app = typer.Typer(rich_markup_mode=None)
    app.command()(main)
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--method", "luck"), "method is 'luck'; allowed are mppi, cem"),
        (("--samples", 1), "'--samples'"),
        (("--env", "CartPole-v1"), "env is 'CartPole-v1', a CartPoleEnv; allowed are environments of rigid_env"),
        (("--env", "rigid_env/Nope-v0"), "env is 'rigid_env/Nope-v0', which is not there"),
        (("--env", "BlockRech"), "which is not there; allowed are names such as 'rigid_env/BlockReach-v0'"),
        (("--accuracy", "balaced"), "'--accuracy': 'balaced'; allowed are balanced, fast, precise, reference"),
        (("--env", "rigid_env/Scene-v0"), "scene is None"),
    ],
)
def test_the_command_tells_a_mistake_in_a_line(arguments, words):
    result = run(*arguments)
    assert result.exit_code == 2
    assert words in " ".join(result.output.split())


def test_what_was_planned_before_ctrl_c_is_kept(monkeypatch, tmp_path):
    done = []

    def interrupted(*arguments):
        if len(done) == 2:
            raise KeyboardInterrupt
        done.append(arguments)
        return agents.planner.Solved([True], [10], [0.1])

    monkeypatch.setattr(agents.planner, "solve", interrupted)
    path = tmp_path / "found.json"
    result = run("--episodes", 5, "--json", path)
    assert result.exit_code == INTERRUPTED
    assert "interrupted after 2 of 5 episodes" in result.output
    assert json.loads(path.read_text())["episodes"] == 2


def test_a_task_of_ones_own_in_the_working_folder_is_planned(monkeypatch, tmp_path):
    (tmp_path / "mine_to_plan.py").write_text(OWN)
    monkeypatch.chdir(tmp_path)
    for method, samples in (("mppi", 8), ("cem", 2)):
        result = run("--env", "mine_to_plan:Up", "--episodes", 1, "--samples", samples, "--method", method)
        assert result.exit_code == 0, result.output


OWN = """
import physics
from rigid_env import Task, Wrench, observe


class Up(Task):
    max_episode_steps = 5
    scene = physics.Scene([physics.Block((1, 1, 1), 1.0)], effects=[physics.Gravity()])
    actions = Wrench(0)
    observation = [observe.pos(0)]

    def rewards(self, worlds):
        return {"height": worlds.pos[:, 0, 1]}
"""
