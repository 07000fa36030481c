"""Worker threads that wait for their leader in machine code, by a spin wait.

The leader is the thread that steps a batch; the workers help it. The leader gives each worker prepared calls
(`prepared_calls`) and wakes it. The worker makes the calls, and then spins for a while, ready for the next batch. A
thread that sleeps instead would need half the time of a batch of a hundred worlds to wake up. It would also have to
wait for Python's interpreter lock, without which it can neither begin nor end.

A worker's state is in the table `crew`, which all threads share:

- IDLE: the worker's thread does not run its loop. SPINNING: it waits for calls.
- WOKEN: the leader wants it to make its calls. RUNNING: it makes them; SPINNING follows.
- STOPPING: it was told to stop while it was running; IDLE follows.

When nothing is left to do, the leader sets workers that are still WOKEN back to SPINNING: their processors may be busy
with another program. Both sides change a state by an atomic compare-and-exchange, since the other side may have changed
it in the meantime.

A waiting thread yields its processor from time to time, so that other programs run, or the thread that it waits for. A
worker that finds itself on the leader's processor does not begin, and yields at once.
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

# Columns of row 0 of `crew`: number of threads whose calls raised an exception; the leader's processor; 1 once the
# leader has made its own calls; the addresses of the functions that yield and that tell the processor (0: none); the
# pauses between two yields; and the pauses before the first yield of a thread that waits while the leader is busy.
# Columns of row k, of worker k: its state, the address and the number of its jobs, and 1 if it was IDLE when woken.
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

# Outcomes of `run_and_join`: all calls were made, some worker has not finished, a call raised an exception.
RUN_DONE, RUN_UNFINISHED, RUN_FAILED = range(3)


def make_worker_table(members: int) -> np.ndarray:
    """Make the table `crew` (1 + members, PADDING_WORDS) int64 of so many workers, all of them IDLE."""
    return np.zeros((1 + members, PADDING_WORDS), dtype=np.int64)


@kernel
def wake_workers(crew, turns, members):
    """Wake the first `members` workers for a new batch, and reset the ranges of worlds in `turns`.

    `crew` is the table of `make_worker_table`. Returns the number of workers that were IDLE, not in their loop; the
    caller must start their threads.
    """
    reset_ranges(turns)
    crew[0, CREW_FAILED_COUNT] = crew[0, CREW_LEADER_DONE] = away = 0
    crew[0, CREW_LEADER_PROCESSOR] = call_address(crew[0, CREW_PROCESSOR_ADDRESS])
    for k in range(1, 1 + members):
        crew[k, WORKER_WAS_IDLE] = 1 if atomic_exchange(crew, k, WORKER_STATE, WOKEN) == IDLE else 0
        away += crew[k, WORKER_WAS_IDLE]
    return away


@kernel
def stop_workers(crew):
    """Stop all workers: those that wait become IDLE at once, those that run become IDLE after their present calls."""
    for k in range(1, crew.shape[0]):
        while SPINNING <= atomic_load(crew, k, WORKER_STATE) <= RUNNING:
            compare_exchange(crew, k, WORKER_STATE, WOKEN, IDLE)
            compare_exchange(crew, k, WORKER_STATE, SPINNING, IDLE)
            compare_exchange(crew, k, WORKER_STATE, RUNNING, STOPPING)


@inlined
def _rest(crew, look):
    """Pause a waiting thread after its poll number `look`; after some polls it also yields its processor to others."""
    spin_pause()
    if look % crew[0, CREW_YIELD_INTERVAL] == 0 or (
        look == crew[0, CREW_BRIEF_PAUSES] and atomic_load(crew, 0, CREW_LEADER_DONE) == 0
    ):
        call_address(crew[0, CREW_YIELD_ADDRESS])


@inlined
def _is_busy(crew, member, patience):
    """True if a worker is still RUNNING after `patience` polls of its state."""
    for look in range(1, patience + 1):
        if atomic_load(crew, member, WORKER_STATE) != RUNNING:
            return False
        _rest(crew, look)
    return atomic_load(crew, member, WORKER_STATE) == RUNNING


@kernel
def run_and_join(crew, taken, members, jobs, count, patience):
    """Make the leader's `count` calls, then wait for the workers that have begun; return RUN_DONE or another RUN code.

    Each of the first `members` workers is polled at most `patience` times. A worker that has not begun is not waited
    for, and its list of worlds in `taken` is emptied.
    """
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
    """True if the calling worker runs on the leader's processor, where it would delay the leader; it then yields."""
    processor = call_address(crew[0, CREW_PROCESSOR_ADDRESS])
    if processor < 0 or processor != crew[0, CREW_LEADER_PROCESSOR]:
        return False
    call_address(crew[0, CREW_YIELD_ADDRESS])
    return True


@inlined
def _begins(crew, member, patience):
    """Wait until a worker is woken, for `patience` polls at most: True if it is RUNNING now, False if it is IDLE."""
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
    """Run the loop of worker number `member`: make its calls each time it is woken.

    The loop ends after `patience` polls without a call, or when the worker is stopped.
    """
    while _begins(crew, member, patience):
        if run_jobs(crew[member, WORKER_JOBS], crew[member, WORKER_JOB_COUNT]):
            atomic_add(crew, 0, CREW_FAILED_COUNT, 1)
        if not compare_exchange(crew, member, WORKER_STATE, RUNNING, SPINNING):
            atomic_exchange(crew, member, WORKER_STATE, IDLE)
            return


@kernel
def repeat_pause(times):
    """Make `times` spin pauses, so that the caller can measure the length of one."""
    for _ in range(times):
        spin_pause()
