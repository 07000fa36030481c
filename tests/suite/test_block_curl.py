"""BlockCurl: the best push in closed form, and the regret that follows from it."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import minimize

import rigid_env  # noqa: F401 (registers)
from rigid_env.suite import block_curl
from rigid_env.suite.block_curl import G, best_push, controller

ENV = "rigid_env/BlockCurl-v0"


@given(st.floats(0.5, 5.0), st.floats(0.0, 2.0), st.floats(0.1, 0.5), st.floats(0.1, 1.0))
def test_the_best_push_stops_the_stone_at_the_mark(distance, speed, friction, left):
    """Independently: integrate x'' = g (f(t) - μ), then slide. The root is found to 2^-50 of 10 s."""
    assume(distance > speed * left)  # nearer ones are passed before the push is over
    force, effort = (float(part[0]) for part in best_push(*(np.array([v]) for v in (distance, speed, friction, left))))
    # f falls in a line to its value at the end, which the effort gives: ∫ f² = (f0² + f0 f1 + f1²) T / 3
    root = np.sqrt(max(force**2 - 4 * (force**2 - 3 * effort / left), 0.0))
    last = min(
        ((-force + sign * root) / 2 for sign in (1, -1)),
        key=lambda f: abs(stop(force, f, speed, friction, left) - distance),
    )
    assert stop(force, last, speed, friction, left) == pytest.approx(distance, rel=1e-6, abs=1e-6)


def stop(first: float, last: float, speed: float, friction: float, left: float) -> float:
    """Place where a stone rests that a force between two values, in a line, has pushed [m]."""

    def motion(t, y):
        return [y[1], G * (first + (last - first) * t / left - friction)]

    x, v = solve_ivp(motion, (0.0, left), [0.0, speed], method="DOP853", rtol=1e-12, atol=1e-12).y[:, -1]
    return x + v**2 / (2 * friction * G)


def test_no_other_push_takes_less_effort():
    """Against an optimiser that chooses 25 forces freely; each is held for 20 ms."""
    distance, friction, left, count = 2.5, 0.25, 0.5, 25
    dt = left / count

    def rest(forces):
        x = v = 0.0
        for f in forces:
            a = G * (f - friction)
            x, v = x + v * dt + a * dt * dt / 2, v + a * dt
        return x + v * v / (2 * friction * G)

    found = minimize(
        lambda f: (f**2).sum() * dt, np.full(count, 0.8), method="SLSQP", tol=1e-12,
        constraints={"type": "eq", "fun": lambda f: rest(f) - distance},
    )  # fmt: skip
    _, effort = best_push(*(np.array([v]) for v in (distance, 0.0, friction, left)))
    # a force held over dt has at most (f1 - f0)² dt²/(12 T²) more squares than the line that it follows: 1e-4 of them
    assert effort[0] == pytest.approx(found.fun, rel=1e-3)
    assert effort[0] <= found.fun * (1 + 1e-9)


def test_regret_is_never_negative_and_small_for_the_best_push():
    """The force is held over a control step: it costs (f1 - f0)²/12 per step more effort than the line, ≤ 5e-3."""
    envs = gym.make_vec(ENV, num_envs=64, autoreset_mode="SameStep")
    observations, _ = envs.reset(seed=0)
    regrets, returns, best = np.full(64, np.nan), np.zeros(64), None
    for _ in range(200):
        observations, rewards, terminated, _, infos = envs.step(controller(observations))
        is_over = ~np.isnan(regrets)
        returns[~is_over] += rewards[~is_over]
        ended = terminated & ~is_over
        if ended.any():
            regrets[ended] = infos["final_info"]["regret"][ended]
            best = returns + regrets if best is None else np.where(ended, returns + regrets, best)
    assert not np.isnan(regrets).any()
    assert (regrets >= 0.0).all()
    assert regrets.max() < 5e-3
    assert ((best > 1.0) & (best < 5.0)).all()  # return and regret add up to the largest return


def test_the_agent_cannot_act_once_the_push_is_over():
    env = gym.make(ENV).unwrapped
    env.reset(seed=0)
    for step in range(block_curl.PUSHED + 1):
        assert np.any(env.task.limits) == (step < block_curl.PUSHED)
        env.step(np.array([1.0, 0.0]))
    assert np.all(env.task.wrench == 0.0)


def test_a_stone_that_is_left_alone_fails():
    env = gym.make(ENV)
    env.reset(seed=0)
    ends = [env.step(np.zeros(2))[2] for _ in range(block_curl.PUSHED)]
    assert ends == [False] * (block_curl.PUSHED - 1) + [True]
