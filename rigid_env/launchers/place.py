"""Place at which jobs run: a launcher together with its settings, or this process."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from rigid_env.launchers import load
from rigid_env.launchers.job import Ended, Job, Launch, run_job
from rigid_env.terminal import progress_bar


@dataclass(frozen=True)
class Place:
    """Launcher and its settings: where the jobs of a command run.

    Parameters
    ----------
    launcher : str, optional
        A name of `LAUNCHERS`. None: jobs run one after the other, in this process.
    folder : Path
        Folder for files that the jobs write.
    at_once : int
        Jobs that run at the same time.
    address : str, optional
        Address of a cluster, see `job.Launch`.

    Raises
    ------
    ValueError
        If there is no such launcher.
    """

    launcher: str | None = None
    folder: Path = Path("rigid-env-jobs")
    at_once: int = 2
    address: str | None = None

    def __post_init__(self) -> None:
        if self.launcher is not None:
            load(self.launcher)

    @property
    def is_here(self) -> bool:
        """True if jobs run in this process."""
        return self.launcher is None

    @property
    def is_printed(self) -> bool:
        """True if jobs are only printed; then no job ever ends."""
        return self.launcher == "print"

    def run(self, jobs: Sequence[Job]) -> Iterator[Ended]:
        """Run jobs, and yield the end of each as soon as it ends, in any order."""
        return self.launch(jobs, self.folder, self.at_once, self.address)

    def watch(self, jobs: Sequence[Job], console: Console) -> Iterator[Ended]:
        """Run jobs as `run` does, with a progress bar, which shows the name of the first job that has not ended."""
        left = {job.name: None for job in jobs}
        with progress_bar(Console(quiet=True) if self.is_printed else console) as progress:
            task = progress.add_task(next(iter(left), ""), total=len(jobs))
            for end in self.run(jobs):
                del left[end.name]
                progress.update(task, advance=1, description=next(iter(left), ""))
                yield end

    @property
    def launch(self) -> Launch:
        """Launch function of the launcher."""
        return _launch_here if self.launcher is None else load(self.launcher)


def _launch_here(jobs: Sequence[Job], folder: Path, at_once: int, address: str | None = None) -> Iterator[Ended]:
    return map(run_job, jobs)


HERE = Place()
