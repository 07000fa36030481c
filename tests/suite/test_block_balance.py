"""BlockBalance: the inverted pendulum that it is, in closed form."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
import pytest

import rigid_env  # noqa: F401 (registers)
from rigid_env.suite.block_balance import FALLEN, STANCES, TORQUE, BlockBalance, G, controller, product, upright

ENV = "rigid_env/BlockBalance-v0"


class Calm(BlockBalance):
    """Without pushes and gusts."""

    disturbances = ()


def inertia(stance: str) -> float:
    """Moment of inertia over the mass, about the edge or a horizontal axis through the vertex [m²]."""
    x, y, _ = STANCES[stance].size
    central = (x * x + y * y) / 12  # of the cube the same about every axis
    return central + STANCES[stance].height ** 2


@pytest.mark.parametrize("stance", STANCES)
def test_it_falls_as_an_inverted_pendulum(stance):
    """Energy: ½ I ω² = g h (cos θ0 - cos θ), as long as the contact holds.

    Time stepping takes the velocity half a step ahead of the lean, which grows as exp(λ t): λ dt / 2 = 1.8 % of it,
    with λ = √(g h / I) of at most 3.6 1/s and dt = 10 ms.
    """
    task = Calm(stance=stance)
    task.seed(0, 0)
    task.start(np.arange(1), {"start_lean": 0.05, "yaw": 0.7})
    lean = [0.05]
    while lean[-1] < 0.3:
        task.step(np.zeros((1, 3)))
        lean.append(float(task.outcome[0, 3]))
    spin = float(np.linalg.norm(task.world.angvel[0, 0]))
    drop = STANCES[stance].height * (np.cos(0.05) - np.cos(lean[-1]))
    assert spin == pytest.approx(np.sqrt(2 * G * drop / inertia(stance)), rel=0.02)


@pytest.mark.parametrize("stance", STANCES)
def test_the_torque_holds_a_lean_up_to_that_of_the_documentation(stance):
    """Torque 0.3 m g times half the longest edge against m g h sin θ: 0.26 rad on the edge, 0.17 rad on the vertex."""
    largest = np.arcsin(TORQUE * 0.5 * max(STANCES[stance].size) / STANCES[stance].height)
    assert largest == pytest.approx({"edge": 0.26, "vertex": 0.17}[stance], abs=0.005)
    envs = Calm(2, stance=stance)
    for world in range(2):
        envs.seed(world, world)
    envs.start(np.arange(2), {"start_lean": largest + np.array([-0.01, 0.01]), "yaw": 0.0})
    for _ in range(10):
        envs.step(np.array([[0.0, 0.0, -1.0]] * 2))
    lean = envs.outcome[:, 3]
    assert lean[0] < largest - 0.01
    assert lean[1] > largest + 0.01


@pytest.mark.parametrize("stance", STANCES)
def test_it_starts_with_the_drawn_lean_on_the_floor(stance):
    envs = gym.make_vec(ENV, num_envs=8, stance=stance)
    observations, infos = envs.reset(seed=0)
    task = envs.unwrapped.task
    np.testing.assert_allclose(infos["lean"], np.abs(infos["start_lean"]), atol=1e-9)
    np.testing.assert_allclose(observations[:, 1], np.cos(infos["lean"]), atol=1e-6)
    signs = np.array([[x, y, z] for x in (1, -1) for y in (1, -1) for z in (1, -1)])
    corners = 0.5 * signs * STANCES[stance].size
    heights = task.world.pos[:, 0, 1, None] + np.einsum("nj,cj->nc", rotation(task.world.quat[:, 0])[:, 1], corners)
    np.testing.assert_allclose(heights.min(axis=1), 0.0, atol=1e-12)
    lowest = (heights < 1e-9).sum(axis=1)
    assert (lowest == {"edge": 2, "vertex": 1}[stance]).all()


def rotation(quat):
    """Matrices (n, 3, 3) of quaternions (n, 4)."""
    from scipy.spatial.transform import Rotation

    return Rotation.from_quat(quat[:, [1, 2, 3, 0]]).as_matrix()


def test_the_products_of_quaternions_are_scipys():
    rng = np.random.default_rng(0)
    p, q = (each / np.linalg.norm(each, axis=1, keepdims=True) for each in rng.normal(size=(2, 5, 4)))
    np.testing.assert_allclose(rotation(product(p, q)), rotation(p) @ rotation(q), atol=1e-14)
    axis = np.array([0.6, 0.0, 0.8])
    np.testing.assert_allclose(rotation(upright(axis)[None])[0] @ axis, [0.0, 1.0, 0.0], atol=1e-15)


def test_success_is_a_whole_episode_and_ends_by_truncation():
    envs = gym.make_vec(ENV, num_envs=4, autoreset_mode="SameStep")
    observations, _ = envs.reset(seed=0)
    for step in range(1, 241):
        observations, _, terminated, truncated, infos = envs.step(controller(observations))
        assert not terminated.any()
        assert truncated.tolist() == [step == 240] * 4
        if step < 240:
            assert not infos["is_success"].any()
    assert infos["final_info"]["is_success"].all()
    np.testing.assert_allclose(infos["final_info"]["upright"], 12.0)


@pytest.mark.parametrize("stance", STANCES)
def test_a_block_that_is_left_alone_falls_and_the_episode_fails(stance):
    env = gym.make(ENV, stance=stance)
    env.reset(seed=0)
    for _ in range(240):
        _, reward, terminated, _, info = env.step(np.zeros(3))
        if terminated:
            break
    assert terminated
    assert not info["is_success"]
    assert info["lean"] > FALLEN
    assert reward == 0.0


def test_another_stance_is_refused():
    with pytest.raises(ValueError, match="stance is 'face'; allowed are edge, vertex"):
        gym.make(ENV, stance="face")
