"""A step prepared once and taken often: from a world to bound calls of its compiled kernel."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from physics import validation
from physics.kernels.state.groups import BodyArrays, TimeGrid, WorkQueue
from physics.keywords import known_keywords
from physics.parallel.bound_call import BoundCall, bound_alike
from physics.parallel.exclusive import in_use
from physics.summary import shown
from physics.world.batch import Batch

# Which argument of all step kernels the `TimeGrid` is.
GRID = 1


@known_keywords
class Stepper:
    """The same step of a world again and again, with all that can be checked or looked up done before.

    For loops in which that takes longer than the step of one world itself: the wrench is an array to write into,
    and a call is the step alone.

    Parameters
    ----------
    world : Batch
    steps : int
        Steps that one call takes.
    dt : float, optional
        Time of one of them, instead of the world's [s].
    then : Callable, optional
        What each thread does with the worlds that it has stepped: from their list, as of
        `physics.kernels.parallel.work_stealing`, which every call renews, to a kernel that has it
        (`physics.parallel.bound_call.bound`).

    Raises
    ------
    ValueError
        `steps` is not a positive integer, or `dt` not a positive number.
    """

    def __init__(
        self,
        world: Batch,
        steps: int = 1,
        dt: float | None = None,
        then: Callable[[np.ndarray], BoundCall] | None = None,
    ):
        if not hasattr(world, "no_wrench"):  # the class itself knows this module
            raise ValueError(f"world is {shown(world)}; allowed is a physics.World")
        if then is not None and not callable(then):
            raise ValueError(f"then is {shown(then)}; allowed are None and a function of the list of worlds taken")
        self.world = world
        self.steps = validation.count(steps, "steps")
        self.dt = world.dt if dt is None else float(validation.positive(dt, (), "dt"))
        self._wrench = world.no_wrench()
        self._then = then
        self._calls: list[BoundCall] | None = None
        self._afterwards: list[BoundCall] = []
        self._alone: Any = None  # the `BoundCall` of `_calls` the only one, where nothing else has a part in a step
        self._perform: Callable[[], bool] | None = None  # of that
        self._duration = self.steps * self.dt

    @property
    def wrench(self) -> np.ndarray:
        """(worlds, bodies, 6) float64 to write into: force [N] and torque about the centre of mass [N m].

        World frame, held during a call (with an actuator: the command that it is given); zeros at first. What is in
        it is not checked: a body whose new state is not finite keeps the old one, and `World.report` says so.
        """
        return self._wrench

    def __call__(self) -> None:
        """Advance every world by `steps` times `dt`.

        Raises
        ------
        RuntimeError
            Another thread is stepping or changing the world.
        """
        world, perform = self.world, self._perform
        if world.is_free:
            world.is_free = False
        else:
            raise in_use(world)
        try:
            if perform is None or world.recorder is not None:
                self._advance()
            else:  # what `World.advance` comes to, in half the time
                if perform():
                    self._alone.raise_again()
                world.time += self._duration
        finally:
            world.is_free = True

    def _advance(self) -> None:
        world: Any = self.world
        if self._calls is None:
            self._prepare()
        world.advance(self._calls, self._wrench, self.steps, self.dt)
        for call in self._afterwards:
            call()

    def _prepare(self) -> None:
        calls = kernel_calls(self.world, self._wrench, self.steps, self.dt)
        self.world.is_bound = True
        if self._then is not None:
            following = [self._then(taken) for taken in self.world.team.taken]
            if takes_each_step(self.world) and self.steps > 1:  # with calls of their own
                self._afterwards = following
            else:
                calls = [first.then(second) for first, second in zip(calls, following, strict=True)]
        self._calls = calls
        self._alone = calls[0] if _is_all(self.world, calls) else None
        self._perform = None if self._alone is None else self._alone.perform

    def __getstate__(self):
        machine_code = {"_calls": None, "_afterwards": [], "_alone": None, "_perform": None}  # belongs to the process
        return {**vars(self), **machine_code}


def takes_each_step(world: Batch) -> bool:
    """A call of several steps is made step by step, since the actuator is asked at each."""
    return world.actuation is not None and world.actuation.actuator.remembers


def _is_all(world: Batch, calls: list[BoundCall]) -> bool:
    """True if a step is this call: there is one thread, no actuator, and `Batch.make` has nothing to add.

    What `World.advance` does besides; a recorder, which comes and goes, is looked up in each call.
    """
    return len(calls) == 1 and world.actuation is None and world.is_plain


def kernel_calls(
    world: Batch, wrench: np.ndarray, steps: int, dt: float, queues: Sequence[WorkQueue] | None = None
) -> list[BoundCall]:
    """One call of the step kernel for each thread, all arguments bound.

    Parameters
    ----------
    world : Batch
        Its arrays are bound, not the world itself: it may keep the calls, and is freed with its last user.
    wrench : (worlds, bodies, 6) float64, contiguous and writable
        What it holds when a call is made counts; of a scene with an actuator what that makes of it.
    steps : int
        Where an actuator remembers, a call takes one of them.
    dt : float
        [s].
    queues : sequence of WorkQueue, optional
        Worlds that each thread may take, instead of those of its team.
    """
    plan = world.plan
    queues = world.team.queues if queues is None else queues
    if world.actuation is not None:
        wrench = world.actuation.applied
    grid = _time_grid(world, steps, dt)
    scheme = plan.scheme
    gravity = world.gravity if plan.gravity else None
    bodies = BodyArrays(world.state, world.params, world.shapes, gravity, wrench.reshape(-1, 6))
    argument_lists = [(queue, grid, bodies, *scheme.arguments(world, k)) for k, queue in enumerate(queues)]
    key = (plan.key, len(world.walls))
    return [bound_alike(key, scheme.kernel, *arguments) for arguments in argument_lists]


def retime(world: Batch, calls: list[BoundCall], steps: int, dt: float) -> None:
    """Let `kernel_calls` of a world take so many steps of another `dt` [s]: faster than to prepare others."""
    for call in calls:
        call.put(GRID, _time_grid(world, steps, dt))


def _time_grid(world: Batch, steps: int, dt: float) -> TimeGrid:
    """Time that a kernel is called for."""
    substeps = world.accuracy.substeps
    return TimeGrid(1 if takes_each_step(world) else steps, substeps, dt / substeps)
