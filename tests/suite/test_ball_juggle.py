"""BallJuggle: impacts in closed form, and no way to success or to reward but by juggling."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import rigid_env  # noqa: F401 (registers)
from rigid_env.suite.ball_juggle import (
    APEX_BONUS,
    APEXES,
    BALL,
    BALL_MASS,
    BLOCK,
    BLOCK_MASS,
    MOST_MIRROR,
    RATE,
    STRENGTH,
    TOLERANCE,
    TOUCHING,
    WANTED,
    G,
    controller,
    mirror_ratio,
)  # fmt: skip

ENV = "rigid_env/BallJuggle-v0"
CENTRED = {"aside": (0.0, 0.0), "drift": (0.0, 0.0)}


def speed_after(fall: float, rise: float, restitution: float) -> float:
    """Speed of the ball after its impact on a free block, from momentum and Newton's restitution [m/s]."""
    momentum = BALL_MASS * -fall + BLOCK_MASS * rise
    return float(np.linalg.solve([[BALL_MASS, BLOCK_MASS], [1, -1]], [momentum, restitution * (rise + fall)])[0])


@given(st.floats(0.4, 2.0), st.floats(0.4, 2.0), st.floats(0.3, 1.0))
def test_the_mirror_law_sends_the_ball_to_the_wanted_apex(apex, wanted, restitution):
    ratio = float(mirror_ratio(np.array([apex]), np.array([wanted]), np.array([restitution]))[0])
    assume(abs(ratio) < MOST_MIRROR)
    fall = np.sqrt(2 * G * (apex - TOUCHING))
    ball = speed_after(fall, ratio * fall, restitution)
    assert TOUCHING + ball**2 / (2 * G) == pytest.approx(wanted, rel=1e-9)


@pytest.mark.parametrize("restitution", [0.6, 0.9])
def test_a_ball_rises_from_the_block_at_rest_as_momentum_and_restitution_say(restitution):
    """The first flight, the impact and the second flight are exact: what is left is roundoff."""
    env = gym.make(ENV)
    env.reset(seed=0, options={"restitution": restitution, "release": 1.0, **CENTRED})
    apex = 1.0
    while abs(apex - 1.0) < 1e-3:
        apex = env.step(np.zeros(5))[4]["apex"]
    fall = np.sqrt(2 * G * (1.0 - TOUCHING))
    rise = speed_after(fall, 0.0, restitution) ** 2 / (2 * G)
    assert apex - TOUCHING == pytest.approx(rise, rel=1e-9)
    assert rise < 2 / 3 * (1.0 - TOUCHING)


def test_a_block_that_is_left_alone_does_not_juggle():
    envs = gym.make_vec(ENV, num_envs=64)
    envs.reset(seed=0)
    rows = []
    for _ in range(150):
        envs.step(np.zeros((64, 5)))
        rows.append(envs.unwrapped.task.memory_arrays["row"].max())
    assert max(rows) < APEXES - 1


def test_a_ball_that_the_block_carries_up_and_down_does_not_count():
    """It turns at the wanted height again and again, on the block: no apex."""
    env = gym.make(ENV).unwrapped
    wanted, middle = WANTED[0], WANTED[0] - TOUCHING
    env.reset(seed=0, options={"release": TOUCHING, "wanted": wanted, **CENTRED})
    task, speeds, heights = env.task, [], []
    for step in range(280):
        time = step * task.control_dt
        place, speed = middle + 0.03 * np.sin(6.0 * time), 0.18 * np.cos(6.0 * time)
        height, rate = task.world.pos[0, BLOCK, 1], task.world.linvel[0, BLOCK, 1]
        lift = G * BALL_MASS / BLOCK_MASS + RATE**2 * height
        lift += np.clip(40.0 * (place - height) + 12.0 * (speed - rate), -5.0, 5.0)
        _, _, terminated, _, _ = env.step(np.array([0.0, lift / (STRENGTH * G), 0.0, 0.0, 0.0]))
        assert not terminated
        assert task.memory_arrays["row"][0] == 0
        speeds.append(task.world.linvel[0, BALL, 1])
        heights.append(task.world.pos[0, BALL, 1])
    turns = (np.array(speeds[:-1]) > 0.0) & (np.array(speeds[1:]) <= 0.0)
    assert np.sum(turns & (np.abs(np.array(heights[1:]) - wanted) < TOLERANCE)) >= APEXES


@pytest.mark.parametrize("play", ["controller", "random"])
def test_progress_depends_on_start_and_end_alone(play):
    """Whatever happens in between: the sum is the difference of two potentials, here from positions and speeds."""
    env = gym.make(ENV).unwrapped
    observation, _ = env.reset(seed=3)
    task, total, rng = env.task, 0.0, np.random.default_rng(0)
    start = potential(task)
    for _ in range(300):
        action = controller(observation[None])[0] if play == "controller" else rng.uniform(-1, 1, 5)
        observation, reward, terminated, _, info = env.step(action)
        total += info["reward_progress"]
        if terminated:
            break
    assert terminated
    assert total == pytest.approx(potential(task) - start, abs=1e-12)
    assert reward == pytest.approx(info["reward_progress"] + (2.0 if play == "controller" else -1.0))


def potential(task) -> float:
    """Potential of the docstring."""
    pos, linvel, memory = task.world.pos[0], task.world.linvel[0], task.memory_arrays
    aside = np.hypot(*(pos[BALL] - pos[BLOCK])[::2])
    drift = np.hypot(*linvel[BALL, ::2])
    _, x, _, z = task.world.quat[0, BLOCK]
    miss = abs(memory["apex"][0] - task.drawn["wanted"][0])
    return APEX_BONUS * memory["row"][0] - miss - 0.5 * aside - 0.25 * drift - 0.5 * 2.0 * (x * x + z * z)
