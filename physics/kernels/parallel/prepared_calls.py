"""Make prepared calls one after another: a job is a row of a table in memory (`fused.prepared_entry`)."""

from __future__ import annotations

from physics.compiler.decorators import kernel
from physics.compiler.fused.prepared_calls import JOB_BYTES, enter_prepared, raise_prepared


@kernel
def run_jobs(jobs, count):
    """Make `count` calls of the table at the address `jobs`; True if one raised an exception, which ends them."""
    for k in range(count):
        if enter_prepared(jobs + k * JOB_BYTES) != 0:
            return True
    return False


@kernel
def run_job(job):
    """Make one call, of the row at the address `job`; return whether it raised an exception."""
    return enter_prepared(job) != 0


@kernel
def reraise(code, raised):
    """Raise the exception of a call."""
    raise_prepared(code, raised)
