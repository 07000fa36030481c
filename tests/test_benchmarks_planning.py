"""Plans per second beside MuJoCo: peers plan the same task, and a quick run writes its rows. No time is asserted."""

import importlib.util
import json
import sys

import numpy as np
import pytest
import typer
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from typer.testing import CliRunner

from agents.planner import Planner, PlannerSettings
from benchmarks import planning
from benchmarks.planning_peers import ENGINES, PeerPlanner, Worker, make_setup, start_of
from benchmarks.planning_worker import MOTION, POSE, Rollouts, make_wrenches, sum_rewards
from physics.rotations import rotation_matrices
from rigid_env import BlockReachEnv
from rigid_env.lab.measure import mujoco_scene
from rigid_env.lab.measure.timing import Spread
from rigid_env.tasks.block_reach import BlockReach
from rigid_env.tasks.layout import REWARD, SUCCESS

needs_mujoco = pytest.mark.skipif(not mujoco_scene.is_installed(), reason="mujoco is not installed")
HAS_MJBATCH = importlib.util.find_spec("mjbatch") is not None
IS_THERE = {"rollout": mujoco_scene.is_installed(), "batch": mujoco_scene.has_batch(), "mjbatch": HAS_MJBATCH}
SMALL = PlannerSettings(samples=3, horizon=6, knots=2, elites=1)


@pytest.fixture(scope="module")
def task():
    return BlockReach()


def run(*arguments):
    app = typer.Typer()
    app.command()(planning.main)
    return CliRunner().invoke(app, ["--quick", *arguments])


def mujoco_state(task):
    """Pose and motion of the task's block, as MuJoCo has them."""
    world = task.world
    spin = rotation_matrices(world.quat[0, 0]).T @ world.angvel[0, 0]
    return np.concatenate((world.pos[0, 0], world.quat[0, 0], world.linvel[0, 0], spin))


def stepped(task, actions):
    """States, rewards and successes of a task, each of one world, after each of its `actions`."""
    states, outcomes = [], []
    for row in actions:
        task.step(row[None])
        states.append(mujoco_state(task))
        outcomes.append(task.outcome[0].copy())
    return np.array(states)[None], np.array(outcomes)


def check_rewards(env, actions):
    """Compare the sum of a worker with the environment's rewards up to the end of the episode; returns successes."""
    start = start_of(env.get_state())
    states, outcomes = stepped(env.task, actions)
    end = np.argmax(outcomes[:, SUCCESS]) + 1 if outcomes[:, SUCCESS].any() else len(actions)
    found = sum_rewards(start, states, actions[None], make_setup("rollout", SMALL, 1).reward)
    assert found == pytest.approx([outcomes[:end, REWARD].sum()], abs=1e-12)
    return outcomes[:, SUCCESS]


@settings(max_examples=50, deadline=None)
@given(arrays(np.float64, 6, elements=st.floats(-3.0, 3.0)))
def test_an_action_is_the_wrench_of_the_environment(task, action):
    task.step(action[None])
    wrench = make_wrenches(action, np.array(make_setup("rollout", SMALL, 1).limits))
    np.testing.assert_allclose(wrench, task.wrench[0, 0], rtol=1e-14, atol=1e-300)


def test_a_return_is_the_sum_of_the_rewards_of_the_environment():
    env = BlockReachEnv()
    env.reset(seed=2)
    rng = np.random.default_rng(0)
    stepped(env.task, rng.uniform(-1.5, 1.5, (5, 6)))
    assert not check_rewards(env, rng.uniform(-1.5, 1.5, (20, 6))).any()


@pytest.mark.parametrize("already", [0, 4])
def test_a_return_counts_the_hold_and_ends_with_success(already):
    env = BlockReachEnv()
    env.reset(seed=2, options={"place": (1.0, 2.0), "goal": (1.1, 2.0), "face": 2})
    stepped(env.task, np.zeros((already, 6)))
    is_success = check_rewards(env, np.zeros((14, 6)))
    assert np.argmax(is_success) == 9 - already
    assert is_success[-1]  # the environment goes on counting: what follows the first success was left out


def test_a_return_forgets_a_hold_that_was_broken():
    env = BlockReachEnv()
    env.reset(seed=2, options={"place": (1.0, 2.0), "goal": (1.1, 2.0), "face": 2})
    actions = np.zeros((30, 6))
    actions[3:8, 0] = actions[9:14, 0] = 1.0
    assert not check_rewards(env, actions)[:13].any()


@pytest.mark.parametrize("engine", list(ENGINES))
def test_a_peer_turns_and_moves_the_block_as_we_do_in_the_air(engine):
    if not IS_THERE[engine]:
        pytest.skip(f"{ENGINES[engine]} is not installed")
    env = BlockReachEnv()
    env.reset(seed=0)
    world, turned = env.task.world, np.array([0.8, 0.2, -0.4, 0.4])
    world.set_state(pos=(0.0, 50.0, 0.0), quat=turned, linvel=(1.0, 2.0, -1.0), angvel=(0.5, -1.0, 2.0))
    start, actions = start_of(env.get_state()), np.random.default_rng(1).uniform(-1.0, 1.0, (6, 6))
    np.testing.assert_allclose(start[: POSE + MOTION], mujoco_state(env.task), rtol=1e-15)
    setup = make_setup(engine, SMALL, 2)
    with mujoco_scene.elsewhere():
        rollouts = Rollouts(setup)
        wrenches = make_wrenches(np.repeat(actions[None], SMALL.samples, axis=0), rollouts.limits)
        found = [rollouts.states(start[: POSE + MOTION], wrenches).copy() for _ in range(2)]
    np.testing.assert_array_equal(*found)  # nothing is left of the rollout before
    ours = stepped(env.task, actions)[0]
    # Euler's error in place is a dt t / 2 at most, with |a| <= 20 m/s², t = 0.15 s: 8 mm; of turns it is alike
    np.testing.assert_allclose(found[0], np.repeat(ours, SMALL.samples, axis=0), rtol=0, atol=0.01)


@needs_mujoco
def test_returns_of_a_peer_rank_sequences_as_ours_do():
    env = BlockReachEnv()
    env.reset(seed=5)
    rng = np.random.default_rng(0)
    stepped(env.task, rng.uniform(-1.0, 1.0, (12, 6)))
    wanted = PlannerSettings(samples=64)
    state, actions = env.get_state(), np.repeat(rng.uniform(-1.0, 1.0, (64, 4, 6)), 6, axis=1)
    with Worker(sys.executable, make_setup("rollout", wanted, 2)) as worker:
        peers = PeerPlanner(worker, wanted).returns(state, actions)
    ours = Planner(BlockReach, wanted, accuracy="balanced").returns(state, actions)
    # contacts differ (MuJoCo's are soft): a wrong frame, goal or limit gives far less
    assert np.corrcoef(ours, peers)[0, 1] > 0.9


def test_time_on_the_way_to_a_worker_does_not_count():
    class Late:
        on_the_way = 0.0

        def reset(self):
            pass

        def plan(self, state):
            self.on_the_way -= 10.0  # as if the worker had told 10 s more than have passed
            return np.zeros((4, 6))

    side = planning.Side(BlockReachEnv(), Late(), planning.QUICK)
    assert 0.09 < side() <= 0.1
    assert side.moving == [False, False]  # the block lies still


def test_a_row_passes_only_if_both_sides_solve_the_task():
    def rows(success):
        spreads = {name: Spread((rate,)) for name, rate in (("balanced", 40.0), ("fast", 60.0), ("rollout", 10.0))}
        notes = {"balanced": {"success": 1.0}, "fast": {"success": 1.0}, "rollout": {"success": success}}
        return {row.accuracy: row for row in planning.make_rows(planning.QUICK, spreads, notes)}

    assert {accuracy: row.is_passed for accuracy, row in rows(1.0).items()} == {"balanced": True, "fast": True}
    assert not rows(0.5)["balanced"].is_passed
    assert (rows(1.0)["balanced"].target, rows(1.0)["fast"].target) == (3.5, 5.0)


@pytest.mark.exhaustive
def test_a_quick_run_writes_what_it_found(tmp_path):
    given = ["--mjbatch-python", sys.executable] if HAS_MJBATCH else []
    found = run("--json", str(tmp_path / "p.json"), *given)
    assert found.exit_code == 0, found.output
    written = json.loads((tmp_path / "p.json").read_text())
    keys = {f"plans_{engine}" for engine, is_there in IS_THERE.items() if is_there} or {"plans_alone"}
    assert {(row["key"], row["accuracy"]) for row in written["rows"]} == {
        (key, accuracy) for key in keys for accuracy in planning.TARGETS
    }
    missing = {ENGINES[engine] for engine, is_there in IS_THERE.items() if not is_there}
    assert set(written["settings"]["missing"]) == missing
    assert all(name in found.output for name in missing)
    for row in written["rows"]:
        assert row["ours"]["min"] > 0.0
        assert 0.0 <= row["notes"]["ours"]["success"] <= 1.0
        assert row["peer"] is None or row["notes"]["peer"]["versions"]["mujoco"]


@needs_mujoco
@pytest.mark.parametrize("python", ["nowhere", "."])
def test_a_python_that_cannot_run_is_named(python, tmp_path):
    found = run("--json", str(tmp_path / "p.json"), "--mjbatch-python", python)
    assert found.exit_code == 2
    assert "--mjbatch-python" in found.output
    assert "allowed" in found.output
    assert not (tmp_path / "p.json").exists()


@pytest.mark.skipif(HAS_MJBATCH, reason="mjbatch is installed")
def test_a_python_without_the_engine_is_refused():
    with pytest.raises(ValueError, match=r"mjbatch is .*No module named 'm.*allowed is one that has mjbatch"):
        Worker(sys.executable, make_setup("mjbatch", SMALL, 1))


@needs_mujoco
def test_a_worker_refuses_actions_of_another_shape():
    with Worker(sys.executable, make_setup("rollout", SMALL, 1)) as worker:
        with pytest.raises(ValueError, match=r"actions has shape \(6, 3, 6\); allowed is \(3, 6, 6\)"):
            worker(np.zeros(17), np.zeros((6, 3, 6)))
        seconds, returns = worker(np.r_[0.0, 1.5, 0.0, 1.0, np.zeros(13)], np.zeros((3, 6, 6)))
    assert seconds > 0.0
    assert returns.shape == (3,)
