"""Wrenches and impulses from actions, against `physics.wrench_at` and the laws of momentum."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import physics
import rigid_env
from physics.kernels.state import layout as at
from rigid_env.tasks import Force, Impulse, Task, Wrench, observe
from rigid_env.tasks.block_goals import BlockReachGoal
from rigid_env.tasks.describe import describe
from rigid_env.tasks.scene_task import SceneTask
from tests.tasks.conftest import Free, started

pytestmark = pytest.mark.interpreted

TILT = (0.5, 0.5, -0.5, 0.5)


def floating(*ways, bodies: int = 1, worlds: int = 1, frame_skip: int = 1) -> Task:
    """A task of blocks that float, tilted, acted upon in some ways."""

    class Floating(Free):
        scene = physics.Scene(
            [physics.Block((5, 3, 2), 6.0, pos=(9.0 * b, 0, 0), quat=TILT) for b in range(bodies)], effects=[]
        )
        actions = ways
        observation = (observe.pos(),)

    return started(Floating(worlds, frame_skip=frame_skip))


@settings(max_examples=40, deadline=None)
@given(st.lists(st.floats(-2.0, 2.0), min_size=6, max_size=6))
def test_a_wrench_is_clipped_and_shortened_to_its_limits(action):
    task = floating(Wrench(0, force=0.5, torque=0.25))
    task.step(np.array([action]))
    force, torque = (np.clip(part, -1.0, 1.0) for part in (action[:3], action[3:]))
    weight = 6.0 * 9.81  # without gravity the unit is 9.81 m/s²
    for vector, limit, ours in ((force, 0.5 * weight, slice(0, 3)), (torque, 0.25 * weight * 2.5, slice(3, 6))):
        expected = limit * vector / max(1.0, np.linalg.norm(vector))
        # A norm, a quotient and a product: a few roundings of the limit.
        np.testing.assert_allclose(task.wrench[0, 0, ours], expected, rtol=1e-14, atol=1e-14 * limit)


def test_the_reach_of_a_hull_is_the_farthest_along_an_axis_from_its_centre_of_mass():
    """A cone over a square of 2 m, 4 m high: its centre of mass is 1 m above the square, 3 m below the tip."""
    cone = physics.Hull([(1, 0, 1), (1, 0, -1), (-1, 0, 1), (-1, 0, -1), (0, 4, 0)], 6.0)

    class Turning(Free):
        scene = physics.Scene([cone], effects=[])
        actions = Wrench(0, force=0.0, torque=0.5)

    task = started(Turning())
    task.step(np.array([[0.0, 0.0, 1.0]]))
    assert task.wrench[0, 0, 5] == pytest.approx(0.5 * 6.0 * 9.81 * 3.0, rel=1e-12)
    told = "(longest half extent, of a hull the farthest along a body axis from the centre of mass)"
    assert f"a is the reach of the body {told}" in " ".join(describe(task).split())


@pytest.mark.parametrize("frame", ["world", "body"])
@pytest.mark.parametrize("point", [(0.0, 0.0, 0.0), (2.5, -1.5, 0.5)])
def test_a_force_at_a_point_is_wrench_at(frame, point):
    task = floating(Force(0, 0.7, point, frame=frame))
    task.step(np.array([[0.3, -0.4, 0.5]]))
    task.start(np.arange(1))  # the same pose again, in which `wrench_at` is asked
    expected = physics.wrench_at(task.world, 0.7 * 6.0 * 9.81 * np.array([0.3, -0.4, 0.5]), point, frame)
    task.step(np.array([[0.3, -0.4, 0.5]]))
    np.testing.assert_allclose(task.wrench, expected, rtol=1e-13, atol=1e-12)


def test_ways_take_the_numbers_in_turn_and_agents_know_theirs():
    task = floating(
        Wrench(0, 0.5, 0.5, force_axes="xz", torque_axes="y", agent="left"), Force(1, 0.4, axes="y", agent="right"),
        bodies=2,
    )  # fmt: skip
    assert task.action_size == 4
    assert {agent: places.tolist() for agent, places in task.agents.items()} == {"left": [0, 1, 2], "right": [3]}
    task.step(np.array([[1.0, 0.0, 0.0, -1.0]]))
    weight = 6.0 * 9.81
    np.testing.assert_allclose(task.wrench[0, 0], [0.5 * weight, 0, 0, 0, 0, 0], rtol=1e-14)
    np.testing.assert_allclose(task.wrench[0, 1], [0, -0.4 * weight, 0, 0, 0, 0], rtol=1e-14)


@pytest.mark.parametrize("frame_skip", [1, 4])
def test_an_impulse_changes_the_momentum_by_itself_however_long_the_step(frame_skip):
    task = floating(Impulse(0, 0.2, point=(2.5, 0.0, 0.0)), frame_skip=frame_skip)
    task.step(np.array([[0.0, 1.0, 0.0]]))
    impulse = 0.2 * 6.0 * 9.81
    # Without other forces the velocity of the centre is impulse / m exactly, up to the rounding of a few products.
    np.testing.assert_allclose(task.world.linvel[0, 0], [0.0, impulse / 6.0, 0.0], rtol=1e-12, atol=1e-12)
    arm = Rotation.from_quat(TILT, scalar_first=True).apply([2.5, 0.0, 0.0])
    momentum = task.world.state[0, at.ANGMOM : at.ANGMOM + 3]
    np.testing.assert_allclose(momentum, np.cross(arm, [0.0, impulse, 0.0]), rtol=1e-12, atol=1e-12)
    before = task.world.linvel.copy()
    task.step(np.zeros((1, 3)))
    np.testing.assert_allclose(task.world.linvel, before, rtol=1e-12, atol=1e-12)


def test_an_action_that_is_not_finite_moves_nothing():
    task = floating(Wrench(0), worlds=2)
    state, before = task.world.state.copy(), task.action.copy()
    with pytest.raises(ValueError, match=r"action of world 1 is .*nan.*allowed are finite"):
        task.step(np.array([[0.0] * 6, [0.0] * 5 + [np.nan]]))
    np.testing.assert_array_equal(task.world.state, state)
    np.testing.assert_array_equal(task.action, before)


def test_a_refused_action_leaves_the_state_of_a_compiled_task():
    env = rigid_env.BlockReachEnv()
    env.reset(seed=0)
    env.step(np.full(6, 0.5))
    before = env.get_state()
    with pytest.raises(ValueError, match="allowed are finite"):
        env.step(np.array([0.0] * 5 + [np.inf]))
    after = env.get_state()
    for name, array in before.arrays.items():
        np.testing.assert_array_equal(array, after.arrays[name], err_msg=name)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("kind", ["NumPy", "goal", "scene", "compiled"])
def test_numbers_that_are_not_finite_are_refused_in_all_tasks(kind, bad):
    """Compiled ones or not; alone, in a batch and in a rollout: none is clipped to a limit."""
    task, settings = {
        "NumPy": (Free, {}), "goal": (BlockReachGoal, {}), "scene": (SceneTask, {"scene": "drop"}),
        "compiled": (rigid_env.BlockReach, {}),
    }[kind]  # fmt: skip
    env, envs = rigid_env.TaskEnv(task, **settings), rigid_env.TaskVectorEnv(2, task=task, **settings)
    env.reset(seed=0)
    envs.reset(seed=0)
    before = env.get_state(), envs.get_state()
    action = np.zeros((2, *env.action_space.shape))
    action[1, -1] = bad
    with pytest.raises(ValueError, match=f"action of world 0 is .*{bad}.*; allowed are finite numbers"):
        env.step(action[1])
    with pytest.raises(ValueError, match=f"action of world 1 is .*{bad}.*; allowed are finite numbers"):
        envs.step(action)
    with pytest.raises(ValueError, match=f"is {bad}; allowed are finite"):
        rigid_env.rollout(envs.task, action[:, None])
    for ours, kept in zip((env.get_state(), envs.get_state()), before):
        for name, array in kept.arrays.items():
            np.testing.assert_array_equal(ours.arrays[name], array, err_msg=name)


REFUSED = {
    "none": (lambda: floating(), ("actions", "at least one")),
    "word": (lambda: floating("push"), ("actions", "'push'")),
    "body": (lambda: floating(Wrench(1)), ("body", "1", "0 to 0")),
    "negative": (lambda: Wrench(-1), ("body", "-1", "from 0 on")),
    "axes": (lambda: Force(axes="zx"), ("axes", "'zx'", "'xyz'")),
    "zero": (lambda: Wrench(force=0.0, torque=0.0), ("force and torque", "above 0")),
    "strength": (lambda: Force(strength=0.0), ("strength", "0")),
    "frame": (lambda: Force(frame="wall"), ("frame", "'wall'", "body")),
    "point": (lambda: Impulse(point=(0, 0)), ("point", "(2,)", "(3,)")),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refusals_name_field_value_and_what_is_allowed(name):
    make, words = REFUSED[name]
    with pytest.raises(ValueError, match="allowed") as error:
        make()
    assert all(word in str(error.value) for word in words), str(error.value)
