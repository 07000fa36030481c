"""The suite's environments as `MujocoEnv`s: a controller of ours solves them, and the program measures both."""

from __future__ import annotations

import json

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from rigid_env.envs.controllers import load_controller
from rigid_env.suite import ball_juggle, block_stack

pytest.importorskip("mujoco")

from benchmarks import mujoco_suite, suite_throughput


def episode(env, name: str, seed: int) -> tuple[bool, float]:
    """Success of our controller in an episode of a `MujocoEnv`, and the sum of its rewards."""
    policy, total = load_controller(f"rigid_env/{name}-v0"), 0.0
    observation, _ = env.reset(seed=seed)
    while True:
        observation, reward, terminated, truncated, info = env.step(policy(observation[None])[0])
        total += reward
        if terminated or truncated:
            return bool(info["is_success"]), total


@pytest.mark.parametrize("name", mujoco_suite.KINDS)
def test_our_controller_solves_it(name):
    """It reads our observations and gives our actions; chance solves no episode of 100 (`tests.suite.rates`)."""
    env = mujoco_suite.make_peer(name).make()
    results = [episode(env, name, seed) for seed in range(5)]
    assert sum(is_success for is_success, _ in results) >= 4
    assert all(total > 2.0 for is_success, total in results if is_success)


def test_the_stack_pays_our_reward():
    """A lift from the floor: progress is the decrease of the way that `block_stack.route` gives, plus the tilt."""
    env = mujoco_suite.make_peer("BlockStack").make().unwrapped
    env.reset(seed=0)

    def to_go():
        offset = env.data.qpos[:3] - env.data.qpos[7:10] - (0.0, block_stack.STACKED, 0.0)
        return float(block_stack.route(offset[None])[0]) + 1.0 - env.data.xmat[1, 4]

    for _ in range(10):
        before = to_go()
        _, reward, *_ = env.step(np.array([0.1, 0.9, 0.0, 0.0, 0.0, 0.2]))
        assert reward == pytest.approx(before - to_go(), abs=1e-12)


def test_the_block_on_springs_swings_as_in_closed_form():
    """Up and down: y'' = -w² y - c/m y', w = 5 1/s and c = 4 * 3 N s/m, so y = d e^(-g t) (cos v t + g/v sin v t).

    MuJoCo's step of 5 ms is of first order: some w h / 2 = 1.3 % of the swing.
    """
    env = mujoco_suite.make_peer("BallJuggle").make().unwrapped
    env.reset(seed=0)
    qpos, deep = env.init_qpos.copy(), 0.1
    qpos[1], qpos[8] = -deep, 50.0
    env.set_state(qpos, env.init_qvel)
    damping = 4 * ball_juggle.DAMPING / ball_juggle.BLOCK_MASS / 2
    swing = np.sqrt(ball_juggle.RATE**2 - damping**2)
    for step in range(1, 40):
        env.step(np.zeros(5))
        t = step * env.dt
        expected = -deep * np.exp(-damping * t) * (np.cos(swing * t) + damping / swing * np.sin(swing * t))
        assert env.data.qpos[1] == pytest.approx(expected, abs=0.02 * deep)


def test_a_ball_rebounds_with_the_restitution_that_is_drawn():
    """Newton's impact law on bodies of 4 kg and 0.2 kg: relative speeds after and before have the ratio e.

    Both fall freely or swing for the control step of 25 ms: the speed changes by some g · 25 ms = 0.25 m/s of 4 m/s.
    """
    env = mujoco_suite.make_peer("BallJuggle").make().unwrapped
    env.reset(seed=1)
    speeds = []
    for _ in range(40):
        env.step(np.zeros(5))
        speeds.append(env.data.qvel[7] - env.data.qvel[1])
        if speeds[-1] > 0.0:
            break
    assert speeds[-1] / -speeds[-2] == pytest.approx(env.restitution, abs=0.1)


@pytest.mark.exhaustive
def test_the_program_measures_both(tmp_path):
    app, file = typer.Typer(), tmp_path / "rows.json"
    app.command()(suite_throughput.main)
    found = CliRunner().invoke(app, ["--quick", "--env", "BlockStack", "--json", str(file)])
    assert found.exit_code == 0, found.output
    rows = json.loads(file.read_text())["rows"]
    assert [row["accuracy"] for row in rows] == list(suite_throughput.ACCURACIES)
    assert all(row["ratio"]["median"] > 0.0 and row["notes"]["load_before"] for row in rows)
    assert CliRunner().invoke(app, ["--env", "BlockFly"]).exit_code != 0
