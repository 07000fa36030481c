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

from physics.compiler.decorators import inlined, kernel
from physics.compiler.fused.atomics import (
    atomic_add,
    atomic_exchange,
    atomic_load,
    call_address,
    compare_exchange,
    spin_pause,
)
from physics.kernels.parallel.prepared_calls import run_jobs
from physics.kernels.parallel.work_stealing import PADDING_WORDS, TAKEN_COUNT, reset_ranges

IDLE, SPINNING, WOKEN, RUNNING, STOPPING = range(5)

# Of a crew: how many members' calls raised an exception, the leader's processor, and whether it has done its
# part; the addresses of the functions that give way and that tell the processor (0: none); and the number of pauses
# between two calls of the first one, and before the first call of a member that waits while the leader is busy. Then, a
# row for each member: its state, its jobs and their number, and whether it was away when it was called.
(
    CREW_FAILED_COUNT,
    CREW_LEADER_PROCESSOR,
    CREW_LEADER_DONE,
    CREW_YIELD_ADDRESS,
    CREW_PROCESSOR_ADDRESS,
    CREW_YIELD_INTERVAL,
    CREW_BRIEF_PAUSES,
) = range(7)
WORKER_STATE, WORKER_JOBS, WORKER_JOB_COUNT, WORKER_WAS_IDLE = range(4)

# What became of a run: all went well, someone has not finished, a call raised an exception.
RUN_DONE, RUN_UNFINISHED, RUN_FAILED = range(3)


def make_worker_table(members: int) -> np.ndarray:
    """Table (1 + members, PADDING_WORDS) int64 with all members away."""
    return np.zeros((1 + members, PADDING_WORDS), dtype=np.int64)


@kernel
def wake_workers(crew, turns, members):
    """Call the first members to a new batch; return the number of those that are away and must be sent for."""
    reset_ranges(turns)
    crew[0, CREW_FAILED_COUNT] = crew[0, CREW_LEADER_DONE] = away = 0
    crew[0, CREW_LEADER_PROCESSOR] = call_address(crew[0, CREW_PROCESSOR_ADDRESS])
    for k in range(1, 1 + members):
        crew[k, WORKER_WAS_IDLE] = 1 if atomic_exchange(crew, k, WORKER_STATE, WOKEN) == IDLE else 0
        away += crew[k, WORKER_WAS_IDLE]
    return away


@kernel
def stop_workers(crew):
    """Dismiss all members, each at once or after its present call."""
    for k in range(1, crew.shape[0]):
        while SPINNING <= atomic_load(crew, k, WORKER_STATE) <= RUNNING:
            compare_exchange(crew, k, WORKER_STATE, WOKEN, IDLE)
            compare_exchange(crew, k, WORKER_STATE, SPINNING, IDLE)
            compare_exchange(crew, k, WORKER_STATE, RUNNING, STOPPING)


@inlined
def _rest(crew, look):
    """Pause after so many polls; the leader may need this processor itself."""
    spin_pause()
    if look % crew[0, CREW_YIELD_INTERVAL] == 0 or (
        look == crew[0, CREW_BRIEF_PAUSES] and atomic_load(crew, 0, CREW_LEADER_DONE) == 0
    ):
        call_address(crew[0, CREW_YIELD_ADDRESS])


@inlined
def _is_busy(crew, member, patience):
    """True if the member has not finished after so many polls."""
    for look in range(1, patience + 1):
        if atomic_load(crew, member, WORKER_STATE) != RUNNING:
            return False
        _rest(crew, look)
    return atomic_load(crew, member, WORKER_STATE) == RUNNING


@kernel
def run_and_join(crew, taken, members, jobs, count, patience):
    """Make calls, and wait until all members that began have finished or `patience` is over; return the outcome."""
    if run_jobs(jobs, count):
        atomic_add(crew, 0, CREW_FAILED_COUNT, 1)
    atomic_exchange(crew, 0, CREW_LEADER_DONE, 1)
    for k in range(1, 1 + members):
        if compare_exchange(crew, k, WORKER_STATE, WOKEN, SPINNING):
            taken[k, TAKEN_COUNT] = 0
    for k in range(1, 1 + members):
        if _is_busy(crew, k, patience):
            return RUN_UNFINISHED
    return RUN_FAILED if atomic_load(crew, 0, CREW_FAILED_COUNT) > 0 else RUN_DONE


@inlined
def _is_in_the_way(crew):
    """True if a member runs on the leader's processor and would only delay it; the member has then yielded."""
    processor = call_address(crew[0, CREW_PROCESSOR_ADDRESS])
    if processor < 0 or processor != crew[0, CREW_LEADER_PROCESSOR]:
        return False
    call_address(crew[0, CREW_YIELD_ADDRESS])
    return True


@inlined
def _begins(crew, member, patience):
    """True if the waiting member is called within so many polls; else it is away."""
    for look in range(1, patience + 1):
        state = atomic_load(crew, member, WORKER_STATE)
        if state == WOKEN and not _is_in_the_way(crew) and compare_exchange(crew, member, WORKER_STATE, WOKEN, RUNNING):
            return True
        if state == IDLE:
            return False
        _rest(crew, look)
    while atomic_load(crew, member, WORKER_STATE) != IDLE:
        if compare_exchange(crew, member, WORKER_STATE, WOKEN, RUNNING):
            return True
        if compare_exchange(
            crew, member, WORKER_STATE, SPINNING, IDLE
        ):  # another thread may be in its place from here on
            return False
    return False


@kernel
def worker_loop(crew, member, patience):
    """Run a member: make its calls each time it is called, and leave after a long wait."""
    while _begins(crew, member, patience):
        if run_jobs(crew[member, WORKER_JOBS], crew[member, WORKER_JOB_COUNT]):
            atomic_add(crew, 0, CREW_FAILED_COUNT, 1)
        if not compare_exchange(crew, member, WORKER_STATE, RUNNING, SPINNING):
            atomic_exchange(crew, member, WORKER_STATE, IDLE)
            return


@kernel
def repeat_pause(times):
    """Make so many pauses, to measure the length of one."""
    for _ in range(times):
        spin_pause()
