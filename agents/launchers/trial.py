"""Run of one trial in a worker, and the interface of launchers."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from rich.console import Console

from agents.config import RunConfig, RunInUse
from agents.run import run_or_resume
from agents.training import Interrupted
from agents.trials import Trial

PATIENCE = 60.0  # longest wait for a folder that a lost worker has locked [s]
RETRIES = 3  # restarts of a trial whose worker is lost


class Outcome(NamedTuple):
    """Outcome of a trial: its result, or None and an error in one line."""

    name: str
    result: dict[str, Any] | None
    error: str = ""


class Launch(Protocol):
    """Function that runs trials in the folder `out`, `jobs` at a time, and yields the outcome of each as it ends.

    `address` says where they run; its meaning depends on the launcher.
    """

    def __call__(self, trials: Sequence[Trial], out: Path, jobs: int, address: str | None) -> Iterator[Outcome]: ...


def run_trial(name: str, config: RunConfig, out: str, patience: float = PATIENCE) -> Outcome:
    """Run a trial, or continue it; an error becomes its outcome, and only Ctrl-C is raised.

    It waits up to `patience` seconds if another process works on the trial.
    """
    limit, is_told = time.monotonic() + patience, False
    while True:
        try:
            return Outcome(name, run_or_resume(config, Path(out) / name, console=Console(quiet=True)))
        except RunInUse as error:
            if time.monotonic() >= limit:
                return Outcome(name, None, str(error))
            if not is_told:
                print(f"{name} is in use by another process: waiting for it ...", file=sys.stderr, flush=True)
                is_told = True
            time.sleep(0.2)
        except Interrupted:
            raise
        except Exception as error:  # of one trial: the others go on
            return Outcome(name, None, _told(error))


def _told(error: Exception) -> str:
    """Text of an error in one line."""
    words = " ".join(str(error).split())
    return words if isinstance(error, ValueError) else f"{type(error).__name__}: {words}"
