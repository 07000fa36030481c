"""Launcher that prints jobs as shell lines, for job arrays, xargs and a user's own scheduler."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from rigid_env.launchers.job import Ended, Job


def launch(jobs: Sequence[Job], folder: Path, at_once: int, address: str | None = None) -> Iterator[Ended]:
    """Print the command of each job. No job runs here, so no end is yielded."""
    for job in jobs:
        print(job.command)
    return iter(())
