"""Jobs as lines for a shell: for job arrays, xargs and schedulers of one's own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from rigid_env.launchers.job import Ended, Job


def launch(jobs: Sequence[Job], folder: Path, at_once: int, address: str | None = None) -> Iterator[Ended]:
    """Print the command of each job; none of them runs here, so none ends."""
    for job in jobs:
        print(job.command)
    return iter(())
