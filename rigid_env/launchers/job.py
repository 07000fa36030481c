"""Job: a call that may run in any process of any machine, and the record of its end."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, Protocol

RETRIES = 3  # restarts of a job whose process or machine is lost


@dataclass(frozen=True)
class Job:
    """A call that may run in any process.

    Parameters
    ----------
    name : str
    call : callable
        Function without arguments that can be pickled. Its result can be pickled, too, and is not None.
    command : str
        Shell command that does the same.
    warm : callable, optional
        Function that compiles or loads the kernels of `call`. A cluster runs it once on each node, before the node's
        first job.
    """

    name: str
    call: Callable[[], Any]
    command: str
    warm: Callable[[], None] | None = None


def shell_line(*words: object, **options: object) -> str:
    """Make a line for a shell: the words, then ``--name value`` for each option.

    An option that is True has no value; one that is None or False is left out.
    """
    line = list(words)
    for name, value in options.items():
        if value is not None and value is not False:
            line += [f"--{name}"] if value is True else [f"--{name}", value]
    return shlex.join(map(str, line))


class Stopped(Exception):
    """Error by which a job reports that a scheduler has ended it; the message names the scheduler and the place."""


class Ended(NamedTuple):
    """End of a job: the result of its call, or None with an error in one line or the message of a scheduler."""

    name: str
    result: Any
    error: str = ""
    stopped: str = ""


class Launch(Protocol):
    """Function that runs jobs, at most `at_once` at the same time.

    Parameters
    ----------
    jobs : sequence of Job
    folder : Path
        Folder for a launcher's own files, such as logs.
    at_once : int
        Jobs that run at the same time.
    address : str, optional
        Address of a cluster; each launcher documents its form.

    Yields
    ------
    Ended
        End of each job, as soon as it ends.
    """

    def __call__(self, jobs: Sequence[Job], folder: Path, at_once: int, address: str | None) -> Iterator[Ended]: ...


def run_job(job: Job) -> Ended:
    """Call a job, and return an exception as its end, so that other jobs continue. Only Ctrl-C ends them all."""
    try:
        return Ended(job.name, job.call())
    except Stopped as stop:
        return Ended(job.name, None, stopped=str(stop))
    except Exception as error:
        return Ended(job.name, None, _told(error))


def _told(error: Exception) -> str:
    """Text of an error in one line."""
    words = " ".join(str(error).split())
    return words if isinstance(error, ValueError) else f"{type(error).__name__}: {words}"
