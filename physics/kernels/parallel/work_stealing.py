"""Work stealing over a batch: each thread takes the next few worlds of its own range, then of other threads' ranges.

Threads do so in machine code, and need Python's interpreter lock only to begin and to end. A thread finds the worlds of
its own range in its processor's cache, where the last step left them. A single queue for all threads would be slower,
since a thread would often take worlds from another processor's cache.
"""

from __future__ import annotations

import numpy as np

from physics.compiler.decorators import inlined, kernel, lend
from physics.kernels.parallel.atomics import atomic_add

# Words (8 bytes) between numbers that different threads change: two cache lines, since processors fetch pairs of lines.
PADDING_WORDS = 16

# Columns of `turns`, which all threads share. Row 0: how many worlds are taken at once, and the first world. Row k, of
# the range of thread k - 1: the first of its worlds that no thread has taken, and the end of the range.
RANGE_CHUNK = 0
RANGE_NEXT, RANGE_END = range(2)

# Columns of `taken`, of one thread: how many worlds it has taken, the end of the chunk that it took last, the row of
# the range that it takes from, the row of its own range, and from TAKEN_FIRST_WORLD on the worlds.
TAKEN_COUNT, TAKEN_CHUNK_END, TAKEN_RANGE, TAKEN_OWN_RANGE, TAKEN_FIRST_WORLD = range(5)


def make_ranges(threads: int, worlds: int, chunk: int) -> np.ndarray:
    """Make the table `turns` (1 + threads, PADDING_WORDS) int64: equal ranges of so many worlds, one for each thread.

    A thread takes `chunk` worlds at once. Call `reset_ranges` before worlds are taken; a single range needs no call.
    """
    turns = np.zeros((1 + threads, PADDING_WORDS), dtype=np.int64)
    turns[0, RANGE_CHUNK] = chunk
    turns[1:, RANGE_END] = worlds * np.arange(1, threads + 1) // threads
    return turns


def make_taken_lists(threads: int, worlds: int) -> np.ndarray:
    """Make empty lists of the worlds that each thread takes, one row `taken` per thread.

    The shape is (threads, TAKEN_FIRST_WORLD + worlds + PADDING_WORDS), int64.
    """
    lists = np.zeros((threads, TAKEN_FIRST_WORLD + worlds + PADDING_WORDS), dtype=np.int64)
    lists[:, TAKEN_OWN_RANGE] = 1 + np.arange(threads)
    return lists


@inlined
def begin_taking(turns, taken):
    """Clear a thread's list of taken worlds, and return -1, with which its first call of `next_world` begins.

    If `turns` has a single range, its worlds become available again; several ranges need `reset_ranges`.
    """
    if turns.shape[0] == 2:
        turns[1, RANGE_NEXT] = turns[0, RANGE_END]
    taken[TAKEN_COUNT] = taken[TAKEN_CHUNK_END] = 0
    taken[TAKEN_RANGE] = taken[TAKEN_OWN_RANGE]
    return -1


@kernel
def take_chunk(turns, taken):
    """Take the next chunk of worlds for a thread: return its first world, or -1 if no range has any left.

    The end of the chunk is written to `taken[TAKEN_CHUNK_END]`.
    """
    chunk = turns[0, RANGE_CHUNK]
    for _ in range(1, turns.shape[0]):
        place = taken[TAKEN_RANGE]
        world = atomic_add(turns, place, RANGE_NEXT, chunk)
        if world < turns[place, RANGE_END]:
            taken[TAKEN_CHUNK_END] = min(world + chunk, turns[place, RANGE_END])
            return world
        taken[TAKEN_RANGE] = place + 1 if place + 1 < turns.shape[0] else 1
    return -1


@inlined
def next_world(world, turns, taken):
    """Next world that the thread steps, after `world`; -1 if no world is left.

    Parameters
    ----------
    world : int
        World that the thread has just stepped, or -1 from `begin_taking`.
    turns : (1 + threads, PADDING_WORDS) int64, in and out
        Ranges of all threads: `make_ranges`.
    taken : (TAKEN_FIRST_WORLD + worlds + PADDING_WORDS,) int64, in and out
        Worlds that this thread has taken; the next world is added.
    """
    world += 1
    if world == taken[TAKEN_CHUNK_END]:
        world = take_chunk(turns, taken)
        if world < 0:
            return -1
    taken[TAKEN_FIRST_WORLD + taken[TAKEN_COUNT]] = world
    taken[TAKEN_COUNT] += 1
    return world


@inlined
def reset_ranges(turns):
    """Reset the ranges of all threads, so that all of their worlds can be taken."""
    for k in range(1, turns.shape[0]):
        turns[k, RANGE_NEXT] = turns[k - 1, RANGE_END] if k > 1 else 0


def for_each_world(advance):
    """Make a kernel (queue, about) that calls ``advance(world, *about)`` for each world that its thread takes.

    The thread takes worlds that no other thread has taken, from `queue`, a `WorkQueue` of
    `physics.kernels.state.groups`.

    Parameters
    ----------
    advance : kernel
        Advances one world; `about` is the tuple of its arguments after the world.
    """

    @inlined
    def loop(queue, about):
        world, lent = begin_taking(queue.turns, queue.taken), lend(about)
        while True:
            world = next_world(world, queue.turns, queue.taken)
            if world < 0:
                break
            advance(world, *lent)

    return loop
