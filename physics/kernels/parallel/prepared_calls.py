"""Make prepared calls, whose arguments lie ready in memory, from machine code.

A job is one prepared call: a row of JOB_BYTES bytes, with the addresses of a kernel and of its arguments
(`fused.prepared_calls`). Addresses are integers.
"""

from __future__ import annotations

from physics.compiler.decorators import kernel
from physics.compiler.fused.prepared_calls import JOB_BYTES, enter_prepared, raise_prepared


@kernel
def run_jobs(jobs, count):
    """Make the calls of `count` jobs, one after the other, from a table at the address `jobs`.

    Returns True if a call raised an exception; the calls after it are not made.
    """
    for k in range(count):
        if enter_prepared(jobs + k * JOB_BYTES) != 0:
            return True
    return False


@kernel
def run_job(job):
    """Make the call of the job at the address `job`; return whether it raised an exception."""
    return enter_prepared(job) != 0


@kernel
def reraise(code, raised):
    """Raise the exception of a job that has failed: `code` is its status, `raised` the address of its exception."""
    raise_prepared(code, raised)
