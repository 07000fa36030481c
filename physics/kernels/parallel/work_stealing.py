"""Work stealing over a batch: each thread takes the next few worlds of its own range, then of the others' ranges.

They do so in machine code, without the interpreter in between: its lock changes hands only when a thread begins and
ends. A thread finds the worlds of its own range in the cache of its processor, where it left them after the last step.
With one queue for all, half of the worlds of a thread had been stepped by the other one, and came from its cache.
"""

from __future__ import annotations

import numpy as np

from physics.compiler.decorators import inlined, kernel, lend
from physics.kernels.parallel.atomics import atomic_add

# Words between what different threads change: two lines of a cache, since processors fetch them in pairs.
PADDING_WORDS = 16

# `turns`, of all threads. Row 0: how many worlds are taken at once, and the first world. Then a row for each range: the
# first of its worlds that nobody has taken, and the end of the range.
RANGE_CHUNK = 0
RANGE_NEXT, RANGE_END = range(2)

# `taken`, of one thread: how many worlds it has taken, the end of those it took last, the range that it takes from, its
# own range, and from TAKEN_FIRST_WORLD on the worlds.
TAKEN_COUNT, TAKEN_CHUNK_END, TAKEN_RANGE, TAKEN_OWN_RANGE, TAKEN_FIRST_WORLD = range(5)


def make_ranges(threads: int, worlds: int, chunk: int) -> np.ndarray:
    """Ranges (1 + threads, PADDING_WORDS) int64 of worlds, one for each thread."""
    turns = np.zeros((1 + threads, PADDING_WORDS), dtype=np.int64)
    turns[0, RANGE_CHUNK] = chunk
    turns[1:, RANGE_END] = worlds * np.arange(1, threads + 1) // threads
    return turns


def make_taken_lists(threads: int, worlds: int) -> np.ndarray:
    """Lists (threads, TAKEN_FIRST_WORLD + worlds + PADDING_WORDS) int64 of taken worlds, one row per thread, empty."""
    lists = np.zeros((threads, TAKEN_FIRST_WORLD + worlds + PADDING_WORDS), dtype=np.int64)
    lists[:, TAKEN_OWN_RANGE] = 1 + np.arange(threads)
    return lists


@inlined
def begin_taking(turns, taken):
    """Clear the taken worlds; return the index before the first world. A single thread also resets its range."""
    if turns.shape[0] == 2:
        turns[1, RANGE_NEXT] = turns[0, RANGE_END]
    taken[TAKEN_COUNT] = taken[TAKEN_CHUNK_END] = 0
    taken[TAKEN_RANGE] = taken[TAKEN_OWN_RANGE]
    return -1


@kernel
def take_chunk(turns, taken):
    """First of the thread's next worlds, which end at `taken[TAKEN_CHUNK_END]`, or -1."""
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
    """World that the thread steps after `world`, or -1.

    Parameters
    ----------
    world : int
    turns : (1 + threads, PADDING_WORDS) int64, in and out
        Of all threads: `make_ranges`.
    taken : (TAKEN_FIRST_WORLD + worlds + PADDING_WORDS,) int64, in and out
        Of this thread.
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
    """Reset all ranges, with no world taken."""
    for k in range(1, turns.shape[0]):
        turns[k, RANGE_NEXT] = turns[k - 1, RANGE_END] if k > 1 else 0


def for_each_world(advance):
    """Make the kernel (queue, about) with the one loop over worlds, which calls ``advance(world, *about)`` for each.

    A thread takes worlds that no other thread has taken (`WorkQueue` of `physics.kernels.state.groups`).

    Parameters
    ----------
    advance : kernel
        Advances one world; `about` is the tuple of its other arguments.
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
