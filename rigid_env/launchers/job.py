"""A job: a call that may run in any process of any machine, and how it ends."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, Protocol

RETRIES = 3  # of a job whose process or machine is lost


@dataclass(frozen=True)
class Job:
    """A call that may run in any process.

    Parameters
    ----------
    name : str
    call : callable
        Takes nothing, can be pickled, and returns something that can be pickled and is not None.
    command : str
        A line for a shell that does the same.
    warm : callable, optional
        Compiles or loads the kernels that `call` needs; a cluster runs it once on each node before its first job.
    """

    name: str
    call: Callable[[], Any]
    command: str
    warm: Callable[[], None] | None = None


class Stopped(Exception):
    """A scheduler has ended a job; the message says which, and where."""


class Ended(NamedTuple):
    """End of a job: what its call returned; or None, with an error in one line or the message of a scheduler."""

    name: str
    result: Any
    error: str = ""
    stopped: str = ""


class Launch(Protocol):
    """Run jobs, some at once.

    Parameters
    ----------
    jobs : sequence of Job
    folder : Path
        Where a launcher may keep files of its own, such as logs.
    at_once : int
    address : str, optional
        Of a cluster; each launcher says what it means.

    Yields
    ------
    Ended
        One for each job, as it ends.
    """

    def __call__(self, jobs: Sequence[Job], folder: Path, at_once: int, address: str | None) -> Iterator[Ended]: ...


def run_job(job: Job) -> Ended:
    """Call a job; its error is its end, so that the others go on. Only Ctrl-C ends more than the job."""
    try:
        return Ended(job.name, job.call())
    except Stopped as stop:
        return Ended(job.name, None, stopped=str(stop))
    except Exception as error:
        return Ended(job.name, None, _told(error))


def _told(error: Exception) -> str:
    """Return an error as one line."""
    words = " ".join(str(error).split())
    return words if isinstance(error, ValueError) else f"{type(error).__name__}: {words}"
