"""Launcher together with its settings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from rigid_env.launchers import load
from rigid_env.launchers.job import Ended, Job, Launch


@dataclass(frozen=True)
class Place:
    """Launcher and its settings: where the jobs of a command run.

    Parameters
    ----------
    launcher : str
        A name of `LAUNCHERS`.
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

    launcher: str
    folder: Path
    at_once: int = 2
    address: str | None = None

    def __post_init__(self) -> None:
        load(self.launcher)

    @property
    def is_printed(self) -> bool:
        """True if jobs are only printed; then no job ever ends."""
        return self.launcher == "print"

    def run(self, jobs: Sequence[Job]) -> Iterator[Ended]:
        """Run jobs, and yield the end of each as soon as it ends, in any order."""
        return self.launch(jobs, self.folder, self.at_once, self.address)

    @property
    def launch(self) -> Launch:
        """Launch function of the launcher."""
        return load(self.launcher)
