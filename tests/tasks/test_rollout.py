"""A rollout of a task is `Task.step` with one action after another, bit for bit, and says what it refuses."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import physics
from benchmarks.numpy_reach import NumpyReach
from rigid_env import BlockReach, BlockReachEnv, BlockReachGoal, BlockReorient, TaskRollout, rollout
from rigid_env.tasks import Gust, Impulse, Push, Task, Wrench
from rigid_env.tasks import rollout as module
from rigid_env.tasks.layout import FAILURE, REWARD, SUCCESS
from rigid_env.tasks.restoring import capture, reinstate
from rigid_env.tasks.state import TaskState
from tests.physics.test_field_errors import Reaching
from tests.tasks.conftest import Slide, started
from tests.tiers.sweep import sweep


class Kicked(Slide):
    """Impulses, pushes and gusts."""

    actions = Impulse(0)
    disturbances = (Push(0, 0.5, 0.1), Gust(0, every=0.2))
    memory = {"count": 1}  # noqa: RUF012

    def update(self, worlds):
        worlds.memory["count"] += worlds.pos[:, 0, 0] > 0.0

    def success(self, worlds):
        return worlds.memory["count"] > 3.0


class PushedReach(BlockReach):
    """A compiled task with disturbances."""

    disturbances = (Push(0, 0.5, 0.1),)


TASKS = {
    "reach": BlockReach,
    "reach of many blocks": lambda n, threads: BlockReach(n, mass=(4, 8), friction=(0.3, 0.7), threads=threads),
    "reorient": lambda n, threads: BlockReorient(n, accuracy="fast", frame_skip=3, threads=threads),
    "gusts": lambda n, threads: BlockReach(n, effects=[physics.Drag(), physics.Wind(gust=1.0)], threads=threads),
    "lag": lambda n, threads: BlockReach(n, effects=[physics.Actuator(lag=0.05, delay=0.02)], threads=threads),
    "pushed": PushedReach,
    "numpy": NumpyReach,
    "kicked": Kicked,
    "goal": BlockReachGoal,
}


def state_of(task: Task) -> TaskState:
    return capture(task, {}, [None] * task.worlds)


def assert_same_state(ours: Task, theirs: Task) -> None:
    one, other = state_of(ours), state_of(theirs)
    assert one.generators == other.generators
    assert one.world.time == other.world.time
    for name, array in one.arrays.items():
        np.testing.assert_array_equal(array, other.arrays[name], err_msg=name)
    for a, b in zip(ours.world.kept(), theirs.world.kept(), strict=True):
        np.testing.assert_array_equal(a, b)


def one_by_one(task: Task, actions: np.ndarray):
    """Outcomes (worlds, length, 3), observations, and the gravest status of each world."""
    outcomes, seen, told = [], [], []
    for k in range(actions.shape[1]):
        task.step(actions[:, k])
        outcomes.append(task.outcome[:, [REWARD, SUCCESS, FAILURE]])
        seen.append(task.obs.copy())
        told.append(task.status.copy())
    gravest = [max(column, key=physics.Status.severity) for column in np.array(told).T.tolist()]
    return np.stack(outcomes, axis=1), np.stack(seen, axis=1), gravest


@pytest.mark.parametrize("name", sweep(TASKS, set(TASKS) - {"gusts"}))
@given(data=st.data())
@settings(max_examples=6)
def test_it_is_step_in_a_loop(name, data):
    worlds, threads = data.draw(st.integers(1, 19), "worlds"), data.draw(st.integers(1, 2), "threads")
    every, samples = data.draw(st.integers(1, 3), "every"), data.draw(st.integers(1, 12), "samples")
    seed = data.draw(st.integers(0, 99), "seed")
    ours, theirs = (started(TASKS[name](worlds, threads=count), seed) for count in (threads, 1))
    actions = np.random.default_rng(seed).uniform(-1.2, 1.2, (worlds, every * samples, ours.action_size))
    outcomes, seen, status = one_by_one(theirs, actions)
    found = rollout(ours, actions, observations=True, every=every)
    np.testing.assert_array_equal(found.rewards, outcomes[:, :, 0])
    np.testing.assert_array_equal(found.success, outcomes[:, :, 1] > 0.0)
    np.testing.assert_array_equal(found.failure, outcomes[:, :, 2] > 0.0)
    np.testing.assert_array_equal(found.observations, seen[:, every - 1 :: every])
    np.testing.assert_array_equal(found.status, status)
    assert_same_state(ours, theirs)
    for task in (ours, theirs):
        task.step(actions[:, 0])
    assert_same_state(ours, theirs)


@pytest.mark.parametrize("name", ["reach", "numpy"])
def test_all_worlds_may_begin_where_one_is(name):
    one, many = started(TASKS[name](1)), TASKS[name](12, threads=2)
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (12, 40, 6))
    for k in range(15):
        one.step(actions[:1, k])
    state = state_of(one)
    found = rollout(many, actions, initial=state)
    for world in (0, 7, 11):
        reinstate(one, {}, state)
        np.testing.assert_array_equal(rollout(one, actions[world : world + 1]).rewards[0], found.rewards[world])


def test_a_return_ends_with_its_episode():
    rewards = np.array([[1.0, 2.0, 4.0], [1.0, 2.0, 4.0], [1.0, 2.0, 4.0]])
    success = np.array([[False, True, True], [False, False, False], [False, False, False]])
    failure = np.array([[False, False, False], [True, False, False], [False, False, False]])
    status = np.zeros(3, dtype=np.int64)
    ending = TaskRollout(rewards, success, failure, None, status, True)
    assert ending.lengths.tolist() == [2, 1, 3]
    assert ending.returns.tolist() == [3.0, 1.0, 7.0]
    going_on = TaskRollout(rewards, success, failure, None, status, False)
    assert going_on.lengths.tolist() == [3, 1, 3]
    assert going_on.returns.tolist() == [7.0, 1.0, 7.0]


def test_an_episode_that_is_solved_counts_up_to_there():
    """A block at rest at its goal: success after HOLD_STEPS control steps."""
    task = BlockReach(2)
    task.seed(0, 0)
    task.seed(1, 1)
    task.start(np.arange(2), {"place": (3.0, 3.0), "goal": np.array([[3.0, 3.0], [6.0, 6.0]])})
    found = rollout(task, np.zeros((2, 20, 6)))
    assert found.lengths.tolist() == [10, 20]
    # Ten positive numbers in another order: at most ten roundings, of 1.1e-16 of the sum each.
    np.testing.assert_allclose(found.returns[0], found.rewards[0, :10].sum(), rtol=1.1e-15)
    assert found.returns[0] > 5.0 > 0.0 > found.returns[1]


def test_arrays_are_used_again():
    task = started(BlockReach(5))
    actions = np.random.default_rng(1).uniform(-1.0, 1.0, (5, 6, 6))
    first = rollout(task, actions, observations=True, every=3)
    kept = first.rewards.copy()
    again = rollout(task, actions, observations=True, every=3, out=first)
    assert again.rewards is first.rewards
    assert again.observations is first.observations
    assert (again.rewards != kept).any()
    assert again.nbytes == 5 * (6 * 10 + 2 * 24 * 4 + 8)


def test_it_is_shown_on_a_screen():
    text = repr(rollout(started(BlockReach(2)), np.zeros((2, 4, 6))))
    assert text.startswith("TaskRollout(2 worlds, 4 control steps, no observations, returns -")
    assert "status OK" in text


def other_out() -> TaskRollout:
    return rollout(started(BlockReach(3)), np.zeros((3, 2, 6)))


ZEROS = np.zeros((3, 4, 6))
WRONG = {
    "a task": (lambda t: rollout(7, ZEROS), "task is 7; allowed is a Task"),
    "an environment": (lambda t: rollout(BlockReachEnv(), ZEROS), "task is <.*; allowed is a Task, such as env"),
    "of other worlds": (lambda t: rollout(t, np.zeros((2, 4, 6))), r"\(2, 4, 6\); allowed is \(3, length, 6\)"),
    "of other numbers": (lambda t: rollout(t, np.zeros((3, 4, 5))), r"\(3, 4, 5\); allowed is \(3, length, 6\)"),
    "of one step": (lambda t: rollout(t, np.zeros((3, 6))), r"\(3, 6\); allowed is \(3, length, 6\)"),
    "no steps": (lambda t: rollout(t, np.zeros((3, 0, 6))), "a length of at least 1"),
    "not finite": (lambda t: rollout(t, np.full((3, 2, 6), np.nan)), r"\[0, 0, 0\] is nan; .* finite"),
    "text": (lambda t: rollout(t, "push"), "actions is 'push'; allowed are numbers in shape"),
    "every": (lambda t: rollout(t, ZEROS, every=3), "every is 3; allowed are divisors of 4"),
    "a flag": (lambda t: rollout(t, ZEROS, observations="yes"), "observations is 'yes'; allowed is True or False"),
    "initial": (lambda t: rollout(t, ZEROS, initial=t.world.snapshot()), "state is Snapshot.*allowed is what get_st"),
    "of another task": (lambda t: rollout(t, ZEROS, initial=state_of(started(BlockReorient(1)))), "states of BlockRe"),
    "out": (lambda t: rollout(t, ZEROS, out=[]), r"out is \[\]; allowed is None or a TaskRollout"),
    "other out": (lambda t: rollout(t, ZEROS, out=other_out()), "allowed is one of 3 worlds, 4 control steps and 0"),
    "with observations": (
        lambda t: rollout(t, np.zeros((3, 2, 6)), observations=True, out=other_out()), "2 control steps and 2 obs",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_errors_say_what_is_allowed_and_nothing_moves(name):
    call, message = WRONG[name]
    task, twin = started(BlockReach(3)), started(BlockReach(3))
    with pytest.raises(ValueError, match=f"(?s){message}"):
        call(task)
    assert_same_state(task, twin)
    assert not task.world.is_in_use


class Faulty(NumpyReach):
    """A reward that is not finite once a block is fast."""

    def rewards(self, worlds):
        return {"speed": np.where(worlds.linvel[:, 0, 0] > 1.0, np.inf, 0.0)}


def test_a_function_that_goes_wrong_puts_everything_back():
    task, twin = started(Faulty(2)), started(Faulty(2))
    initial = state_of(started(Faulty(2), seed=5))
    actions = np.zeros((2, 40, 6))
    actions[1, 10:, :2] = 1.0
    for begin in (None, initial):
        with pytest.raises(ValueError, match="reward term 'speed' of Faulty is inf in world 1"):
            rollout(task, actions, begin)
        assert_same_state(task, twin)


class Flying(BlockReach):
    """A block that can be lifted."""

    actions = Wrench(0, force=3.0)


@pytest.mark.interpreted
@pytest.mark.parametrize("threads", [1, 2])
def test_an_exception_of_a_field_puts_everything_back(threads):
    task, twin = (started(Flying(2, effects=[Reaching()], threads=threads)) for _ in range(2))
    actions = np.zeros((2, 200, 6))
    actions[1, 10:, 1] = 1.0  # in the end this world is too fast for the field
    with pytest.raises(IndexError, match="in a function of Reaching"):
        rollout(task, actions)
    assert_same_state(task, twin)
    rollout(task, actions[:, :5])  # and may be rolled out again


def test_what_the_memory_does_not_hold_is_refused(monkeypatch):
    task = started(BlockReach(4))
    monkeypatch.setattr(module, "machine_memory", lambda: 60 * 2**10)
    with pytest.raises(ValueError, match=r"1000 control steps of 4 worlds need .* raise `every`, or leave out"):
        rollout(task, np.zeros((4, 1000, 6)), observations=True)
    assert rollout(task, np.zeros((4, 1000, 6)), observations=True, every=500).nbytes < 60 * 2**10


def test_a_world_in_use_is_refused():
    task = started(BlockReach(3))
    assert task.world.is_free
    task.world.is_free = False
    with pytest.raises(RuntimeError, match="World is being used by another thread"):
        rollout(task, np.zeros((3, 2, 6)))
