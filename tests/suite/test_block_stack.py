"""BlockStack: rest, creep and the ratio of the masses, in closed form."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

import rigid_env  # noqa: F401 (registers)
from rigid_env.suite.block_stack import BASE, EDGE, HOLD_TIME, MASS, STACKED, STRENGTH, G, route

ENV = "rigid_env/BlockStack-v0"
RATIOS = (1.0, 30.0, 1000.0)
CENTRE = 0.5 * BASE[1] + STACKED  # height of A's centre on B [m]


def stacked(ratios=RATIOS, aside: float = 0.0):
    """A batch of piles with these ratios of the masses, A a little beside the middle of B [m]."""
    envs = gym.make_vec(ENV, num_envs=len(ratios))
    envs.reset(seed=0, options={"mass[1]": MASS / np.array(ratios)})
    task = envs.unwrapped.task
    pos = task.world.pos.copy()
    pos[:, 0] = aside, CENTRE, 0.0
    task.world.set_state(pos=pos, quat=np.tile([1.0, 0.0, 0.0, 0.0], (len(ratios), 2, 1)))
    task.memory_arrays["place"][:] = pos[:, 0]  # as if it had been there before
    return envs, task


def test_a_pile_that_is_let_go_is_a_success_after_two_seconds_and_does_not_creep():
    """The solver leaves a residual of at most 1e-6 m g dt in an impulse: 1e-6 g dt = 1e-7 m/s, over 2 s 2e-7 m."""
    envs, task = stacked(aside=0.1)
    count = round(HOLD_TIME / task.control_dt)
    for step in range(1, count + 1):
        _, rewards, terminated, _, infos = envs.step(np.zeros((len(RATIOS), 6)))
        np.testing.assert_allclose(infos["held"], step * task.control_dt)
        assert terminated.tolist() == [step == count] * len(RATIOS)
    assert infos["moved"].max() < 2e-7
    np.testing.assert_allclose(task.world.pos[:, 0], [[0.1, CENTRE, 0.0]] * len(RATIOS), rtol=0, atol=2e-7)
    assert (rewards > 5.0).all()


def test_a_cube_that_the_agent_holds_does_not_rest():
    """Force 0.6 m g upwards leaves 0.4 m g to B, which is less than half."""
    envs, _ = stacked()
    actions = np.zeros((len(RATIOS), 6))
    actions[:, 1] = 0.6 / STRENGTH
    for _ in range(50):
        *_, infos = envs.step(actions)
        assert (infos["held"] == 0.0).all()
    actions[:, 1] = 0.4 / STRENGTH  # leaves 0.6 m g
    *_, infos = envs.step(actions)
    assert (infos["held"] > 0.0).all()


@pytest.mark.parametrize(("ratio", "force", "tips"), [(1.0, 0.48, False), (1000.0, 0.45, False), (1000.0, 0.48, True)])
def test_a_light_base_tips_under_a_push_that_a_heavy_one_stands(ratio, force, tips):
    """Torques about the lower edge of B: f m g (0.8 + 0.5) m against (m + M) g 0.6 m, so f* = 0.4615 (1 + M/m).

    Friction slides at 0.5, above f* = 0.4620 of the ratio 1,000, below f* = 0.923 of the ratio 1.
    """
    threshold = (1.0 + 1.0 / ratio) * 0.5 * BASE[0] / CENTRE
    assert tips == (force > threshold)
    envs, _ = stacked((ratio,))
    action = np.zeros((1, 6))
    action[0, 0] = force / STRENGTH
    assert any(envs.step(action)[2][0] for _ in range(30)) == tips  # a base that tips is a failure


def test_a_push_against_the_base_is_a_failure():
    env = gym.make(ENV)
    env.reset(seed=0, options={"bearing": 0.0, "yaw": 0.0, "apart": 1.8, "mass[1]": MASS / 100})
    for _ in range(60):
        _, _, terminated, _, info = env.step(np.array([-1.0, 0, 0, 0, 0, 0]))
        if terminated:
            break
    assert terminated
    assert not info["is_success"]
    assert info["moved"] > 0.05
    assert info["held"] == 0.0


def test_progress_adds_up_to_the_way_and_no_cycle_pays():
    """The sum telescopes; up and down again gives nothing. Rounding: 1e-16 of some metres in 60 steps."""
    env = gym.make(ENV)
    env.reset(seed=0)
    task, total = env.unwrapped.task, 0.0
    start = float(task.memory_arrays["to_go"][0])
    for step in range(60):
        info = env.step(np.array([0.2, 0.8 if step % 30 < 15 else 0.4, 0.1, 0.1, 0.0, 0.0]))[4]
        total += info["reward_progress"]
        assert info["reward_held"] == info["reward_success"] == 0.0
    assert total == pytest.approx(start - float(task.memory_arrays["to_go"][0]), abs=1e-12)


def test_the_way_leads_over_the_edge():
    """From the side the way goes through a point 0.3 m above the top; straight through B it is longer."""
    beside, above, there = np.array([[1.5, -0.5, 0.0]]), np.array([[1.5, 0.3, 0.0]]), np.zeros((1, 3))
    assert route(there) == 0.0
    assert route(above) == pytest.approx(1.5)
    assert route(beside) == pytest.approx(1.5 + 0.8)


def test_draws_are_what_the_documentation_says():
    envs = gym.make_vec(ENV, num_envs=64)
    observations, infos = envs.reset(seed=0)
    ratio = MASS / infos["mass[1]"]
    assert 1.0 <= ratio.min() < 3.0
    assert 300.0 < ratio.max() <= 1000.0
    np.testing.assert_allclose(observations[:, 14], np.log10(ratio) / 3.0, rtol=1e-6)
    pos = envs.unwrapped.task.world.pos
    np.testing.assert_allclose(np.hypot(pos[:, 0, 0], pos[:, 0, 2]), infos["apart"])
    assert (infos["apart"] >= 1.8).all()
    assert (infos["apart"] <= 3.0).all()
    assert np.allclose(pos[:, 0, 1], 0.5 * EDGE)
    np.testing.assert_allclose(envs.unwrapped.task.weights[:, 0], G * MASS)
