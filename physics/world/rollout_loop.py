"""Loop over time of a rollout in each thread: all steps of one block of worlds, then the next block.

Worlds are independent, so that no thread waits for another one between two steps, and a block of worlds stays in the
cache of its processor. `fused` has the whole loop in machine code, which makes prepared calls by their address. The
other compilers make them from Python, once for each step and block.
"""

from __future__ import annotations

from typing import NoReturn

import numpy as np

from physics.kernels.parallel import work_stealing
from physics.kernels.parallel.work_stealing import RANGE_CHUNK, RANGE_END, TAKEN_CHUNK_END, begin_taking, take_chunk
from physics.kernels.state.groups import WorkQueue
from physics.kernels.time_stepping.workspace import body_records
from physics.parallel.bound_call import BoundCall, bound_alike, loop_kernel, perform_all
from physics.scene.field_errors import raised
from physics.world.batch import Batch
from physics.world.stepper import kernel_calls

# Worlds that a thread steps through all of time before the next ones: few enough for the cache of a processor, and
# enough that the calls are a small part of the step.
BLOCK_STEPS = 8

# `moment`, of one thread: the first of the worlds that are stepped, their end, and which step it is.
FIRST, END, STEP, MOMENT_SIZE = range(4)


@loop_kernel
def roll_out(outer, inner, block, starts, clock, moment, calls, count):
    """Take all steps of the worlds that no other thread has taken, a block at a time.

    A call that raises an exception ends it.

    Parameters
    ----------
    outer, inner : WorkQueue
        Of this thread among the others, and of the step kernel, which is given one block.
    block : int
        Worlds of a block.
    starts : (length,) float64
        Time at which each step begins [s].
    clock : (records,) float64, out
        Time that the fields of this thread read [s]; (0,) without fields.
    moment : (MOMENT_SIZE,) int64, out
        Where it is: what the calls besides that of the step kernel read.
    calls, count
        Calls of one step: what `BoundCall.handed` gives.
    """
    begin_taking(outer.turns, outer.taken)
    while True:
        start = take_chunk(outer.turns, outer.taken)
        if start < 0:
            break
        stop = outer.taken[TAKEN_CHUNK_END]
        for first in range(start, stop, block):
            end = min(first + block, stop)
            inner.turns[0, RANGE_CHUNK] = end - first
            inner.turns[0, RANGE_END] = first
            inner.turns[1, RANGE_END] = end
            moment[FIRST], moment[END] = first, end
            for k in range(starts.shape[0]):
                moment[STEP] = k
                for record in range(clock.shape[0]):
                    clock[record] = starts[k]
                if perform_all(calls, count):
                    return


class RolloutLoop:
    """Loop over time of a world, prepared once and run often.

    Parameters
    ----------
    world : Batch
        Its actuator must need no call between two steps; while the loop runs it has no recorder.
    wrench : (worlds, bodies, 6) float64
        Wrenches of the coming step; with an actuator, its output. A call before each step writes them.
    steps : int
        Steps that are taken at once.
    dt : float
        Of each [s].

    Attributes
    ----------
    moments : list of (MOMENT_SIZE,) int64
        Of each thread: where it is.
    taken : list of array
        Of each thread: the worlds that its last step took.
    """

    def __init__(self, world: Batch, wrench: np.ndarray, steps: int, dt: float):
        self._world, self._duration = world, steps * dt
        self._inner = [WorkQueue(work_stealing.make_ranges(1, world.worlds, BLOCK_STEPS),
                                 work_stealing.make_taken_lists(1, world.worlds)[0])
                       for _ in world.team.queues]  # fmt: skip
        self._stepping = kernel_calls(world, wrench, steps, dt, self._inner)
        self.moments = [np.zeros(MOMENT_SIZE, dtype=np.int64) for _ in self._inner]
        self.taken = [queue.taken for queue in self._inner]

    def run(self, length: int, before: list[BoundCall], after: list[BoundCall]) -> np.ndarray:
        """Step every world `length` times.

        Parameters
        ----------
        length : int
        before, after : list of BoundCall
            What each thread does before a step, and after it.

        Returns
        -------
        (length,) float64
            Time after each step [s].

        Raises
        ------
        Exception
            What a field of the user's raises; worlds are then somewhere on their way.
        """
        world = self._world
        times = np.full(1 + length, self._duration)
        times[0] = world.time
        np.add.accumulate(times, out=times)  # as times add up step by step
        chains = [first.then(step).then(last) for first, step, last in zip(before, self._stepping, after, strict=True)]
        loops = [
            _bound((outer, inner, BLOCK_STEPS, times[:-1], _clock(world, k), self.moments[k], *chains[k].handed))
            for k, (outer, inner) in enumerate(zip(world.team.queues, self._inner, strict=True))
        ]
        try:
            world.team.run(loops)
            for chain in chains:
                chain.raise_again()
        except Exception as error:
            _raise_again(error, world)
        world.time = float(times[-1])
        if world.impacts is not None:
            world.impacts.is_known = False  # the log holds the last step of each world, if any
        return times[1:]


def _raise_again(error: Exception, world: Batch) -> NoReturn:
    raise raised(error, world.plan.fields)


def _clock(world: Batch, k: int) -> np.ndarray:
    """Time that the fields of a thread read, (records,) [s]."""
    return np.atleast_1d(body_records(world.scratch[k])["call_start"]) if world.plan.fields else np.zeros(0)


def _bound(arguments: tuple) -> BoundCall:
    return bound_alike(arguments[4].flags.c_contiguous, roll_out, *arguments)
