"""Loop over time of a rollout in each thread: all steps of one block of worlds, then the next block.

Worlds are independent, so that no thread waits for another one between two steps, and a block of worlds stays in the
cache of its processor. With the compiler `fused` the whole loop is machine code, which makes prepared calls by their
address. With the other compilers Python makes these calls, once for each step and block.
"""

from __future__ import annotations

from typing import NoReturn

import numpy as np

from physics.kernels.parallel import work_stealing
from physics.kernels.parallel.work_stealing import RANGE_CHUNK, RANGE_END, TAKEN_CHUNK_END, begin_taking, take_chunk
from physics.kernels.state.groups import WorkQueue
from physics.parallel.bound_call import BoundCall, bound_alike, loop_kernel, perform_all
from physics.scene.field_errors import raised
from physics.world.batch import Batch
from physics.world.stepper import kernel_calls

# Worlds of a block, which a thread steps through all of time before the next block: few enough for the cache of a
# processor, and so many that the calls are a small part of the time.
BLOCK_STEPS = 8

# Entries of `moment`, the present place of a thread in its loop: first world of the block, end of the block, and index
# of the step.
FIRST, END, STEP, MOMENT_SIZE = range(4)


@loop_kernel
def roll_out(outer, inner, block, starts, clock, moment, calls, count):
    """Make all steps of the worlds that no other thread has taken, block by block; body of a thread's loop.

    It ends early if a call raises an exception.

    Parameters
    ----------
    outer : WorkQueue
        Queue from which this thread takes worlds, which it shares with the other threads.
    inner : WorkQueue
        Queue of the step kernel, which this loop fills with one block at a time.
    block : int
        Worlds of a block.
    starts : (length,) float64
        Time at which each step begins [s].
    clock : (records,) float64, out
        Time that the fields of this thread read [s]; (0,) without fields.
    moment : (MOMENT_SIZE,) int64, out
        Present block and step, for the calls before and after the step kernel.
    calls, count
        Calls of one step and their number, from `BoundCall.handed`.
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
    """Loop over time of a batch of worlds, prepared once and run often.

    Parameters
    ----------
    world : Batch
        Batch without a recorder, whose actuator, if any, needs no call from Python between two steps.
    wrench : (worlds, bodies, 6) float64
        Array of the wrenches of the next step [N, N m], which a call before each step writes. With an actuator the
        kernel reads the actuator's output instead.
    steps : int
        Steps that one call of the step kernel makes.
    dt : float
        Length of each step [s].

    Attributes
    ----------
    moments : list of (MOMENT_SIZE,) int64
        Present block and step of each thread.
    taken : list of array
        Worlds that the last kernel call of each thread stepped, as a list of `work_stealing`.
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
        """Call the step kernel `length` times for every world, with further calls before and after.

        Parameters
        ----------
        length : int
            Number of kernel calls for each world.
        before, after : list of BoundCall
            For each thread the call that it makes before the kernel, and the one after it.

        Returns
        -------
        (length,) float64
            Time after each kernel call [s].

        Raises
        ------
        Exception
            Exception of a user's field. Some worlds have then made more steps than others.
        """
        world = self._world
        times = np.full(1 + length, self._duration)
        times[0] = world.time
        np.add.accumulate(times, out=times)  # as times add up step by step
        chains = [first.then(step).then(last) for first, step, last in zip(before, self._stepping, after, strict=True)]
        loops = [
            _bound((outer, inner, BLOCK_STEPS, times[:-1], world.clock_of(k), self.moments[k], *chains[k].handed))
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


def _bound(arguments: tuple) -> BoundCall:
    return bound_alike(arguments[4].flags.c_contiguous, roll_out, *arguments)
