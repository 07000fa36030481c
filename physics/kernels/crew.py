"""Threads that wait for each other in machine code.

A member of a crew makes the calls that it was given (`jobs`), says that it has finished, and waits for a while to be
called again. To be woken takes a thread half as long as a batch of a hundred worlds, and to get hold of the
interpreter, without which it can neither begin nor end, as long as another one keeps it.

A member is AWAY, or CALLED until it has finished and is WAITING, or CALLED_LAST until it has finished and is AWAY. It
may be called while it is about to go, and dismissed before it has noticed that it was called: whoever changes what it
is does so from what it has to be, in one piece.
"""

from __future__ import annotations

import numpy as np

from physics.kernels.atomic import add, exchange, exchange_if, pause, seen
from physics.kernels.compiler import inlined, kernel
from physics.kernels.jobs import perform
from physics.kernels.turns import APART, deal

AWAY, CALLED, CALLED_LAST, WAITING = range(4)

# Of a crew: how many members have finished, of how many a call raised an exception. Then, a row for each: what it does,
# its jobs and their number, and whether it was away when it was called.
FINISHED, FAILED = range(2)
STATE, JOBS, COUNT, WAS_AWAY = range(4)

# What became of a run: all went well, someone has not finished, a call raised an exception.
DONE, UNFINISHED, RAISED = range(3)


def make_crew(members: int) -> np.ndarray:
    """(1 + members, APART) int64, all of them away."""
    return np.zeros((1 + members, APART), dtype=np.int64)


@kernel
def summon(crew, turns):
    """Call all members to a batch of which nothing is taken; how many were away, so that they have to be sent for."""
    deal(turns)
    crew[0, FINISHED] = crew[0, FAILED] = away = 0
    for k in range(1, crew.shape[0]):
        crew[k, WAS_AWAY] = 1 if exchange(crew, k, STATE, CALLED) == AWAY else 0
        away += crew[k, WAS_AWAY]
    return away


@kernel
def dismiss(crew):
    """Let all members go, once they have done what they are called for."""
    for k in range(1, crew.shape[0]):
        while seen(crew, k, STATE) == CALLED or seen(crew, k, STATE) == WAITING:
            exchange_if(crew, k, STATE, CALLED, CALLED_LAST)
            exchange_if(crew, k, STATE, WAITING, AWAY)


@kernel
def lead(crew, jobs, count, patience):
    """Make calls, and wait until all members have finished or `patience` is over: what became of it."""
    if perform(jobs, count):
        add(crew, 0, FAILED, 1)
    for _ in range(patience):
        if seen(crew, 0, FINISHED) == crew.shape[0] - 1:
            return RAISED if seen(crew, 0, FAILED) > 0 else DONE
        pause()
    return UNFINISHED


@inlined
def _is_called_again(crew, member, patience):
    for _ in range(patience):
        if seen(crew, member, STATE) != WAITING:
            break
        pause()
    is_gone = exchange_if(crew, member, STATE, WAITING, AWAY)  # another thread may be in its place from here on
    return not is_gone and seen(crew, member, STATE) != AWAY


@kernel
def serve(crew, member, patience):
    """Be a member: make its calls each time that it is called, until it is not for so long."""
    is_called = True
    while is_called:
        if perform(crew[member, JOBS], crew[member, COUNT]):
            add(crew, 0, FAILED, 1)
        stays = exchange_if(crew, member, STATE, CALLED, WAITING)
        if not stays:
            exchange(crew, member, STATE, AWAY)
        add(crew, 0, FINISHED, 1)
        is_called = stays and _is_called_again(crew, member, patience)


@kernel
def pause_often(times):
    """How long so many pauses take is how long a patience lasts."""
    for _ in range(times):
        pause()
