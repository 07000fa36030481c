"""How threads share a batch: each takes the next few worlds, until there is none left.

They do so in machine code, without the interpreter in between: its lock changes hands only when a thread begins and
ends.
"""

from __future__ import annotations

from numba.core import types
from numba.extending import intrinsic

from physics.kernels.codegen.elements import DATA
from physics.kernels.compiler import inlined, kernel

# Of all threads: the first world that nobody has taken, how many worlds are taken at once, how many there are,
# how many threads have finished.
NEXT, CHUNK, WORLDS, FINISHED, TURNS_SIZE = range(5)

# Of one thread: how many worlds it has taken, the end of those it took last, and from FIRST on which.
TAKEN, END, FIRST = range(3)


@intrinsic
def _add(typing_context, turns, k, number):
    """turns[k] += number, at once for all threads; returns what was there before."""

    def lower(context, builder, sig, args):
        index = context.cast(builder, args[1], sig.args[1], types.int64)
        number = context.cast(builder, args[2], sig.args[2], types.int64)
        place = builder.gep(builder.extract_value(args[0], DATA), [index], inbounds=True)
        return builder.atomic_rmw("add", place, number, "acq_rel")

    return types.int64(turns, k, number), lower


@inlined
def begin(taken):
    """Nothing taken yet; returns what comes before the first world."""
    taken[TAKEN] = 0
    taken[END] = 0
    return -1


@inlined
def next_world(world, turns, taken):
    """The world that the thread steps after `world`, or -1.

    Parameters
    ----------
    world : int
    turns : (TURNS_SIZE,) int64, in and out
        Of all threads.
    taken : (FIRST + worlds,) int64, in and out
        Of this thread.
    """
    world += 1
    if world == taken[END]:
        world = _add(turns, NEXT, turns[CHUNK])
        if world >= turns[WORLDS]:
            return -1
        taken[END] = min(world + turns[CHUNK], turns[WORLDS])
    taken[FIRST + taken[TAKEN]] = world
    taken[TAKEN] += 1
    return world


@kernel
def finish(turns):
    """A thread has finished."""
    _add(turns, FINISHED, 1)


@kernel
def have_finished(turns, threads, patience):
    """Whether so many threads have finished; asked again and again, `patience` times."""
    for _ in range(patience):
        if _add(turns, FINISHED, 0) >= threads:
            return True
    return False
