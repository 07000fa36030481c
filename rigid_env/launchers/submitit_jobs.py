"""Launcher of jobs on a Slurm cluster, or in processes of this machine, through submitit."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from pathlib import Path

from rigid_env.extras import require
from rigid_env.launchers.job import Ended, Job, run_job

POLL_EVERY = 1.0  # time between two checks of the jobs [s]
MINUTES = 24 * 60  # longest time of a job [min]


def launch(jobs: Sequence[Job], folder: Path, at_once: int, address: str | None = None) -> Iterator[Ended]:
    """Run jobs through submitit, as `job.Launch` describes.

    `address` is a partition of Slurm, or ``local`` for processes of this machine.
    """
    require("submitit", purpose="--launcher submitit")
    import submitit

    is_local = address == "local"
    executor = submitit.AutoExecutor(folder=folder / "submitit", cluster="local" if is_local else "slurm")
    executor.update_parameters(timeout_min=MINUTES, cpus_per_task=1)
    if not is_local:
        executor.update_parameters(slurm_array_parallelism=at_once)
        if address:
            executor.update_parameters(slurm_partition=address)
    waiting, running = list(jobs), {}
    while waiting or running:
        room = at_once - len(running) if is_local else len(waiting)
        batch, waiting = waiting[:room], waiting[room:]
        if batch:
            with executor.batch():
                made = [executor.submit(run_job, job) for job in batch]
            running.update(zip((job.name for job in batch), made))
        for name in [name for name, job in running.items() if job.done()]:
            job = running.pop(name)
            try:
                yield job.result()
            except Exception as error:  # the job was lost; submitit raises exceptions of its own classes
                yield Ended(name, None, str(error).strip().splitlines()[-1])
        time.sleep(POLL_EVERY if running else 0.0)
