"""Threads that wait for each other in machine code.

A member of a crew makes the calls that it was given (`prepared_calls`), says that it has finished, and waits for a
while to be called again. To be woken takes a thread half as long as a batch of a hundred worlds, and to get hold of the
interpreter, without which it can neither begin nor end, as long as another one keeps it.

A member is AWAY or WAITING until the leader has CALLED it, BUSY from when it begins, and WAITING again when it has
finished. A member that is dismissed while it is busy is LEAVING, and then AWAY. The leader takes the call back from
a member that has not begun when there is nothing left to do: its processor may be busy with another program.
Whoever changes a state does so from the state it has to be in, in one atomic operation, since the other one may have
changed it in the meantime.

A thread that waits gives way from time to time: a program that has to share its processor runs instead, and so does
the thread that it waits for. A member that finds itself on the leader's processor does not begin, and gives way at
once.
"""

from __future__ import annotations

import numpy as np

from physics.kernels.compile.decorators import inlined, kernel
from physics.kernels.parallel.atomics import add, ask, exchange, exchange_if, pause, seen
from physics.kernels.parallel.prepared_calls import perform
from physics.kernels.parallel.work_stealing import APART, TAKEN, deal

AWAY, WAITING, CALLED, BUSY, LEAVING = range(5)

# Of a crew: how many members' calls raised an exception, the leader's processor, and whether it has done its
# part; the addresses of the functions that give way and that tell the processor (0: none); and the number of pauses
# between two calls of the first one, and before the first call of a member that waits while the leader is busy. Then, a
# row for each member: its state, its jobs and their number, and whether it was away when it was called.
FAILED, LED_ON, IS_OVER, GIVE_WAY, PROCESSOR, BETWEEN, BRIEF = range(7)
STATE, JOBS, COUNT, WAS_AWAY = range(4)

# What became of a run: all went well, someone has not finished, a call raised an exception.
DONE, UNFINISHED, RAISED = range(3)


def make_crew(members: int) -> np.ndarray:
    """(1 + members, APART) int64, all of them away."""
    return np.zeros((1 + members, APART), dtype=np.int64)


@kernel
def summon(crew, turns, members):
    """Call the first members to a batch of which nothing is taken; how many were away and have to be sent for."""
    deal(turns)
    crew[0, FAILED] = crew[0, IS_OVER] = away = 0
    crew[0, LED_ON] = ask(crew[0, PROCESSOR])
    for k in range(1, 1 + members):
        crew[k, WAS_AWAY] = 1 if exchange(crew, k, STATE, CALLED) == AWAY else 0
        away += crew[k, WAS_AWAY]
    return away


@kernel
def dismiss(crew):
    """Let all members go: at once, or after the call that they are busy with."""
    for k in range(1, crew.shape[0]):
        while WAITING <= seen(crew, k, STATE) <= BUSY:
            exchange_if(crew, k, STATE, CALLED, AWAY)
            exchange_if(crew, k, STATE, WAITING, AWAY)
            exchange_if(crew, k, STATE, BUSY, LEAVING)


@inlined
def _rest(crew, look):
    """Wait for a moment after so many looks; the leader may need this processor for its part of the run."""
    pause()
    if look % crew[0, BETWEEN] == 0 or (look == crew[0, BRIEF] and seen(crew, 0, IS_OVER) == 0):
        ask(crew[0, GIVE_WAY])


@inlined
def _is_busy(crew, member, patience):
    """True if the member has not finished after so many looks."""
    for look in range(1, patience + 1):
        if seen(crew, member, STATE) != BUSY:
            return False
        _rest(crew, look)
    return seen(crew, member, STATE) == BUSY


@kernel
def lead(crew, taken, members, jobs, count, patience):
    """Make calls, and wait until all members who have begun have finished or `patience` is over; what became of it."""
    if perform(jobs, count):
        add(crew, 0, FAILED, 1)
    exchange(crew, 0, IS_OVER, 1)
    for k in range(1, 1 + members):
        if exchange_if(crew, k, STATE, CALLED, WAITING):
            taken[k, TAKEN] = 0
    for k in range(1, 1 + members):
        if _is_busy(crew, k, patience):
            return UNFINISHED
    return RAISED if seen(crew, 0, FAILED) > 0 else DONE


@inlined
def _is_in_the_way(crew):
    """True if a member has the leader's processor and would only delay it; the member has given way then."""
    processor = ask(crew[0, PROCESSOR])
    if processor < 0 or processor != crew[0, LED_ON]:
        return False
    ask(crew[0, GIVE_WAY])
    return True


@inlined
def _begins(crew, member, patience):
    """True if the member, waiting, is called within so many looks; else it is away."""
    for look in range(1, patience + 1):
        state = seen(crew, member, STATE)
        if state == CALLED and not _is_in_the_way(crew) and exchange_if(crew, member, STATE, CALLED, BUSY):
            return True
        if state == AWAY:
            return False
        _rest(crew, look)
    while seen(crew, member, STATE) != AWAY:
        if exchange_if(crew, member, STATE, CALLED, BUSY):
            return True
        if exchange_if(crew, member, STATE, WAITING, AWAY):  # another thread may be in its place from here on
            return False
    return False


@kernel
def serve(crew, member, patience):
    """Be a member: make its calls each time that it is called, until it is not for so long."""
    while _begins(crew, member, patience):
        if perform(crew[member, JOBS], crew[member, COUNT]):
            add(crew, 0, FAILED, 1)
        if not exchange_if(crew, member, STATE, BUSY, WAITING):
            exchange(crew, member, STATE, AWAY)
            return


@kernel
def pause_often(times):
    """Pause so many times: how long that takes is how long a patience lasts."""
    for _ in range(times):
        pause()
