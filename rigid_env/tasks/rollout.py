"""Rollouts of a task: each world takes a sequence of actions, and the rewards are kept."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from physics import validation
from physics.html_table import parts_table
from physics.keywords import known_keywords
from physics.parallel.bound_call import bound_alike
from physics.parallel.exclusive import exclusive
from physics.summary import parts_repr
from physics.undo import undo_on_error
from physics.world.batch_arrays import machine_memory
from physics.world.report import Status, gravest
from rigid_env.tasks import layout as col
from rigid_env.tasks.restoring import reinstate, remember
from rigid_env.tasks.rollout_steps import Kept, end_control
from rigid_env.tasks.state import TaskState
from rigid_env.tasks.task import Task
from rigid_env.tasks.wrenches import begin_control

MEBIBYTE = 2**20


@dataclass(frozen=True, eq=False)
class TaskRollout:
    """Results of a task's rollout: rewards, flags and observations of every control step, for each world.

    Attributes
    ----------
    rewards : (worlds, length) float64
        Reward of each control step.
    success, failure : (worlds, length) bool
        Flags of the task after each control step.
    observations : (worlds, samples, entries) float32 or None
        Observations after every so many control steps, as requested; None: none were requested.
    status : (worlds,) int64
        Gravest `physics.Status` of any step.
    ends_on_success : bool
        Whether success ends an episode of the task.
    """

    rewards: NDArray[np.float64]
    success: NDArray[np.bool_]
    failure: NDArray[np.bool_]
    observations: NDArray[np.float32] | None
    status: NDArray[np.int64]
    ends_on_success: bool

    @property
    def lengths(self) -> NDArray[np.int64]:
        """Length (worlds,) int64 of each episode: control steps up to its end, inclusive; all if it does not end."""
        ends = self.failure | self.success if self.ends_on_success else self.failure
        return np.where(ends.any(axis=1), ends.argmax(axis=1) + 1, ends.shape[1])

    @property
    def returns(self) -> NDArray[np.float64]:
        """Sums (worlds,) float64 of the rewards up to the end of each episode."""
        counts = np.arange(self.rewards.shape[1]) < self.lengths[:, None]
        return np.where(counts, self.rewards, 0.0).sum(axis=1)

    @property
    def _worst(self) -> Status:
        return Status(max(self.status.tolist(), key=Status.severity))

    @property
    def nbytes(self) -> int:
        """Memory that the arrays take [bytes]."""
        arrays = (self.rewards, self.success, self.failure, self.observations, self.status)
        return sum(array.nbytes for array in arrays if array is not None)

    __repr__ = parts_repr
    _repr_html_ = parts_table

    def _parts(self) -> tuple[str, ...]:
        worlds, length = self.rewards.shape
        observed = "no observations" if self.observations is None else f"{self.observations.shape[1]} observations"
        return (
            f"{worlds} worlds", f"{length} control steps", observed,
            f"returns {self.returns.min():.4g} to {self.returns.max():.4g}", f"status {self._worst.name}",
            f"{self.nbytes / MEBIBYTE:.3g} MiB",
        )  # fmt: skip


@known_keywords
def rollout(
    task: Task,
    actions: ArrayLike,
    initial: TaskState | None = None,
    observations: bool = False,
    every: int = 1,
    out: TaskRollout | None = None,
) -> TaskRollout:
    """Step every world of a task with its own sequence of actions, and keep the rewards.

    A rollout has the same bits as `Task.step` with one action after another. No episode restarts. The arrays also
    contain the steps after the end of an episode, which `TaskRollout.returns` leaves out. Afterwards the task is in the
    state after the last step.

    Parameters
    ----------
    task : Task
        A batch of worlds: ``MyTask(128)``, or an environment's ``unwrapped.task``.
    actions : (worlds, length, action_size) array_like
        Clipped to ±1.
    initial : TaskState, optional
        State that the worlds begin from (``env.unwrapped.get_state()``): of one world, which all worlds then begin
        from, or of as many worlds. None: the present state of the task. The state's random generators decide the
        disturbances, so these are the ones that the environment will meet.
    observations : bool
        Keep observations, too.
    every : int
        Control steps from one kept observation to the next; a divisor of the number of control steps.
    out : TaskRollout, optional
        Results of the same sizes, whose arrays are overwritten and returned.

    Returns
    -------
    TaskRollout
        Its arrays take 10 bytes a control step, and 4 bytes a number of a kept observation.

    Raises
    ------
    ValueError
        An argument of the wrong shape or out of range, more observations than this machine's memory holds, or a wrong
        result of a function of the task. Nothing has changed then.
    RuntimeError
        Another thread is stepping or changing this world.

    Notes
    -----
    The loop of a compiled task runs in machine code, in each thread. Python steps a task with NumPy functions, with one
    call a control step for the whole batch. It also steps a task with impulses, disturbances, an actuator or
    `dump_faults`.
    """
    validation.instance(task, Task, "task", "a Task, such as env.unwrapped.task")
    actions = _actions(task, actions)
    length = actions.shape[1]
    every = validation.count(every, "every")
    if length % every:
        raise ValueError(f"every is {every}; allowed are divisors of {length}, the number of actions of a world")
    validation.instance(observations, bool, "observations", "True or False")
    kept = _room(task, length, length // every if observations else 0, out)
    may_raise = task.compiled is None or task.world.plan.may_raise
    with undo_on_error(remember(task) if may_raise else None):
        if initial is not None:
            reinstate(task, {}, initial)
        if _needs_python(task):
            status = _one_by_one(task, actions, every, kept)
        else:
            status = _all_at_once(task.world, task, actions, every, kept)
    return TaskRollout(*kept[:3], kept.observations if observations else None, status, task.ends_on_success)


def _actions(task: Task, actions: ArrayLike) -> np.ndarray:
    """Check `actions`, and return them as contiguous float64 (worlds, length, action_size), all finite."""
    allowed = f"({task.worlds}, length, {task.action_size})"
    array = validation.floats(actions, "actions", f"are numbers in shape {allowed}")
    if array.ndim != 3 or array.shape[1] == 0 or array.shape[::2] != (task.worlds, task.action_size):
        raise ValueError(f"actions has shape {array.shape}; allowed is {allowed}, with a length of at least 1")
    return np.ascontiguousarray(validation.finite(array, array.shape, "actions"))


def _room(task: Task, length: int, samples: int, out: TaskRollout | None) -> Kept:
    """Return arrays for the results: those of `out`, or new ones; refuse more than this machine's memory.

    `samples` is the number of observations that are kept for each world.
    """
    worlds, entries = task.obs.shape
    if out is not None:
        return _checked(out, worlds, length, (worlds, samples, entries))
    needed, memory = worlds * (10 * length + 4 * samples * entries), machine_memory()
    if needed > memory:
        raise ValueError(
            f"{length} control steps of {worlds} worlds need {needed / 2**30:.3g} GiB, and this machine has "
            f"{memory / 2**30:.3g} GiB of memory; allowed are fewer: raise `every`, or leave out `observations`"
        )
    success, failure = (np.empty((worlds, length), dtype=np.bool_) for _ in range(2))
    observed = np.empty((worlds, samples, entries), dtype=np.float32)
    return Kept(np.empty((worlds, length)), success, failure, observed)


def _checked(out: TaskRollout, worlds: int, length: int, shape: tuple[int, int, int]) -> Kept:
    validation.instance(out, TaskRollout, "out", "None or a TaskRollout")
    observed = np.empty((worlds, 0, shape[2]), dtype=np.float32) if out.observations is None else out.observations
    if out.rewards.shape != (worlds, length) or observed.shape != shape:
        raise ValueError(
            f"out is {out!r}; allowed is one of {worlds} worlds, {length} control steps and {shape[1]} observations"
        )
    return Kept(out.rewards, out.success, out.failure, observed)


def _needs_python(task: Task) -> bool:
    """True if Python must run between two control steps of the task, so that the loop cannot be compiled."""
    world = task.world
    if task.compiled is None or task.disturbed is not None or task.has_impulses or task.is_driving:
        return True
    return world.actuation is not None or world.recorder is not None


def _one_by_one(task: Task, actions: np.ndarray, every: int, kept: Kept) -> np.ndarray:
    """Take all control steps from Python, and write `kept`; return the gravest status (worlds,) of each world."""
    gravity = np.array([Status.severity(status) for status in Status])
    status = np.full(task.worlds, Status.OK, dtype=np.int64)
    for k in range(actions.shape[1]):
        task.step(actions[:, k])
        outcome = task.outcome
        kept.rewards[:, k] = outcome[:, col.REWARD]
        kept.success[:, k], kept.failure[:, k] = outcome[:, col.SUCCESS] > 0.0, outcome[:, col.FAILURE] > 0.0
        np.copyto(status, task.status, where=gravity[task.status] > gravity[status])
        if kept.observations.shape[1] and (k + 1) % every == 0:
            kept.observations[:, (k + 1) // every - 1] = task.obs
    return status


@exclusive
def _all_at_once(world, task: Task, actions: np.ndarray, every: int, kept: Kept) -> np.ndarray:
    """Take all control steps in machine code, and write `kept`; return the gravest status (worlds,) of each world."""
    total, length, loop = np.zeros_like(world.report_table), actions.shape[1], task.rollout_loop
    arrays = (task.outcome, task.obs, world.report_table, total, kept)
    before = [bound_alike(None, begin_control, moment, actions, *task.wrench_arguments) for moment in loop.moments]
    after = [
        observe.then(bound_alike(None, end_control, moment, every, *arrays))
        for observe, moment in zip(task.rollout_observers, loop.moments, strict=True)
    ]
    loop.run(length, before, after)
    task.clock += length
    gravest(world.report_table, task.status)
    status = np.empty_like(task.status)
    gravest(total, status)
    return status
