"""Steps that are prepared once and taken often: calls of a world's step kernel with all arguments bound."""

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

# Index of the `TimeGrid` among the arguments of every step kernel.
GRID = 1


@known_keywords
class Stepper:
    """Repeated step of a world, faster than `World.step`: checks and look-ups are made once, at the first call.

    It serves loops in which these take longer than the step of one world. The wrench is written into an array, the
    attribute `wrench`; calling the object makes the steps.

    Parameters
    ----------
    world : Batch
        The `World` to step.
    steps : int
        Steps that one call makes.
    dt : float, optional
        Length of a step [s]; None: that of the world.
    then : Callable, optional
        Function that makes a kernel call, which each thread runs after its steps. It takes the thread's list of worlds
        stepped, an array of `physics.kernels.parallel.work_stealing` that every call renews, and returns a bound call
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
        if not hasattr(world, "no_wrench"):  # the class `World` itself imports this module
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
        self._alone: Any = None  # the single call in `_calls`, if a step consists of it alone
        self._perform: Callable[[], bool] | None = None  # method of `_alone`
        self._duration = self.steps * self.dt

    @property
    def wrench(self) -> np.ndarray:
        """Wrench of the next call, to be written into: force [N] and torque about the centre of mass [N m].

        (worlds, bodies, 6) float64, world frame, zero at first. It acts during the whole call; with an actuator it is
        the command. Its numbers are not checked: a body whose new state would not be finite keeps the old one, and
        `World.report` says so.
        """
        return self._wrench

    def __call__(self) -> None:
        """Advance every world by `steps` steps of `dt` under `wrench`.

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
            else:  # the same as `World.advance` in this case, in half the time
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
            if takes_each_step(self.world) and self.steps > 1:  # each step is a call of its own
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
    """True if several steps must be separate kernel calls, since an actuator with a memory acts before each step."""
    return world.actuation is not None and world.actuation.actuator.remembers


def _is_all(world: Batch, calls: list[BoundCall]) -> bool:
    """True if a step consists of the single call in `calls`: one thread, no actuator, and `Batch.is_plain`.

    Then `World.advance` does nothing else, apart from the recorder. A recorder may be added later, so each call of a
    `Stepper` looks for one.
    """
    return len(calls) == 1 and world.actuation is None and world.is_plain


def kernel_calls(
    world: Batch, wrench: np.ndarray, steps: int, dt: float, queues: Sequence[WorkQueue] | None = None
) -> list[BoundCall]:
    """Bind the arguments of the step kernel: make a call of it for each thread.

    Parameters
    ----------
    world : Batch
        Batch whose arrays are bound. The calls hold no reference to the batch, which may therefore keep them.
    wrench : (worlds, bodies, 6) float64, contiguous and writable
        Array from which each call reads the wrenches. With an actuator the calls read the actuator's output instead.
    steps : int
        Steps that a call makes; a call makes one step where `takes_each_step`.
    dt : float
        Length of a step [s].
    queues : sequence of WorkQueue, optional
        Queues from which the threads take worlds; None: those of the batch's team.
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
    """Change the number of steps and their length `dt` [s] in calls that `kernel_calls` made, without new calls."""
    for call in calls:
        call.put(GRID, _time_grid(world, steps, dt))


def _time_grid(world: Batch, steps: int, dt: float) -> TimeGrid:
    """Time grid of a kernel call: steps, substeps of each, and length of a substep [s]."""
    substeps = world.accuracy.substeps
    return TimeGrid(1 if takes_each_step(world) else steps, substeps, dt / substeps)
