"""A step prepared once and taken often: from a world to bound calls of its compiled kernel."""

from __future__ import annotations

import gc
import sys
import threading
from collections.abc import Callable
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING

import numba
import numpy as np

from physics import checks
from physics.kernels.events.hybrid import step_events
from physics.kernels.linked import step_linked
from physics.kernels.many.step import step_many
from physics.kernels.sleep import sleep_through
from physics.kernels.step import step_worlds

if TYPE_CHECKING:
    from physics.plan import Plan
    from physics.world import World

# Seconds after which the first step of a plan says that it is compiling.
COMPILE_NOTICE = 1.0


class Stepper:
    """The same step of a world again and again, with all that can be checked or looked up done before.

    For loops in which that takes longer than the step of one world itself: the wrench is an array to write into,
    and a call is the step alone.

    Parameters
    ----------
    world : World
    steps : int
        Steps that one call takes.
    dt : float, optional
        Time of one of them, instead of the world's [s].

    Raises
    ------
    ValueError
        `steps` is not a positive integer, or `dt` not a positive number.
    """

    def __init__(self, world: World, steps: int = 1, dt: float | None = None):
        self.world = world
        self.steps = checks.count(steps, "steps")
        self.dt = world.dt if dt is None else float(checks.positive(dt, (), "dt"))
        self._wrench = world.no_wrench()
        self._calls: list[Callable[[], None]] | None = None

    @property
    def wrench(self) -> np.ndarray:
        """(worlds, bodies, 6) float64 to write into: force [N] and torque about the centre of mass [N m].

        World frame, held during a call (with an actuator: the command that it is given); zeros at first. What is in
        it is not checked: a body whose new state is not finite keeps the old one, and `World.report` says so.
        """
        return self._wrench

    def __call__(self) -> None:
        """Advance every world by `steps` times `dt`."""
        if self._calls is None:
            self._calls = kernel_calls(self.world, self._wrench, self.steps, self.dt)
        self.world.advance(self._calls, self._wrench, self.steps, self.dt)

    def __getstate__(self):
        return {**vars(self), "_calls": None}  # machine code belongs to the process


def kernel_calls(world: World, wrench: np.ndarray, steps: int, dt: float) -> list[Callable[[], None]]:
    """One call of the step kernel for each slice of the batch, all arguments bound.

    Parameters
    ----------
    world : World
        Its arrays are bound, not the world itself: it may keep the calls, and is freed with its last user.
    wrench : (worlds, bodies, 6) float64, contiguous and writable
        What it holds when a call is made counts; of a scene with an actuator what that makes of it.
    steps : int
        Where an actuator remembers, a call takes one of them.
    dt : float
        [s].
    """
    plan, substeps = world.plan, world.accuracy.substeps
    if world.actuation is not None:
        wrench = world.actuation.applied
        steps = 1 if world.actuation.actuator.remembers else steps
    kernel, own_arguments = _step_of(plan)
    argument_lists = [
        (
            first, last, steps, substeps, dt / substeps, world.state, world.params, world.shapes,
            world.gravity if plan.gravity else None, wrench.reshape(-1, 6), *own_arguments(world, k),
        )
        for k, (first, last) in enumerate(world.pool.slices)
    ]  # fmt: skip
    machine_code = _machine_code(kernel, (plan.key, len(world.walls)), argument_lists[0])
    calls = [partial(machine_code, *arguments) for arguments in argument_lists]
    if plan.many and plan.sleeping:
        return [_unless_asleep(world, wrench, worlds, call) for worlds, call in zip(world.pool.slices, calls)]
    return calls


def _unless_asleep(world: World, wrench: np.ndarray, worlds: tuple[int, int], call: Callable) -> Callable[[], None]:
    """A call that is not made where every body of its worlds sleeps: handing over its arguments alone takes 2 µs."""
    sleep = world.sleep_of_kernel()
    first, last = worlds[0] * world.body_count, worlds[1] * world.body_count
    arguments = (first, last, wrench.reshape(-1, 6), sleep, world.report_table[worlds[0] : worlds[1]])
    asleep = _machine_code(sleep_through, ("sleep_through",), arguments)

    def step():
        if not asleep(*arguments):
            call()

    return step


def _step_of(plan: Plan) -> tuple[Callable, Callable[[World, int], tuple]]:
    """The step kernel of a plan, and what gives the arguments that it alone has for one slice of the batch."""
    if plan.many:
        return step_many, _many_arguments
    if plan.linked:
        return step_linked, _linked_arguments
    if plan.events:
        return step_events, _event_arguments
    return step_worlds, _world_arguments


def _many_arguments(world: World, k: int) -> tuple:
    plan = world.plan
    switches = (plan.friction, plan.restitution, plan.gyroscopic, plan.tilted, plan.ellipsoids, plan.hulls, plan.scheme)
    switches = (*switches, plan.refined)
    return *switches, world.sleep_of_kernel(), world.memory, world.report_table, world.scratch[k]


def _linked_arguments(world: World, k: int) -> tuple:
    plan = world.plan
    held = None if plan.events else True
    return plan.gyroscopic, plan.tilted, plan.scheme, held, plan.events, world.report_table, world.scratch[k]


def _wall_switches(plan: Plan) -> tuple:
    return plan.contact, plan.friction, plan.smooth, plan.restitution, plan.gyroscopic, plan.tilted, plan.pivots


def _event_arguments(world: World, k: int) -> tuple:
    log = (world.event_log, world.event_counts)
    return *_wall_switches(world.plan), world.memory, world.report_table, world.scratch[k], world.motions[k], *log


def _world_arguments(world: World, k: int) -> tuple:
    switches = (*_wall_switches(world.plan), world.plan.scheme)
    return *switches, world.sleep_of_kernel(), world.memory, world.report_table, world.scratch[k]


def _machine_code(kernel, key: tuple, arguments: tuple) -> Callable[..., None]:
    """The step kernel compiled for arguments of these types, which `key` determines.

    Calling it directly leaves out Numba's dispatcher, which would find out the types of all arguments each time.
    """
    if key not in _COMPILED:
        with _compiling():
            _COMPILED[key] = kernel.compile(tuple(map(numba.typeof, arguments)))
    return _COMPILED[key]


_COMPILED: dict[tuple, Callable[..., None]] = {}


@contextmanager
def _compiling():
    """Say on standard error that a kernel is being compiled, if it takes long enough to notice.

    The garbage collector waits: it would walk through Numba's growing tables again and again, a tenth of the time.
    """
    text = "rigid-env: compiling the kernel of this scene, once (it is kept for later runs) ..."
    timer = threading.Timer(COMPILE_NOTICE, lambda: print(text, file=sys.stderr, flush=True))
    timer.daemon = True
    was_collecting = gc.isenabled()
    timer.start()
    gc.disable()
    try:
        yield
    finally:
        timer.cancel()
        if was_collecting:
            gc.enable()
