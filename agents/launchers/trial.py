"""One trial, as a worker runs it."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from rich.console import Console

from agents.config import RunConfig, RunInUse
from agents.run import run_or_resume
from agents.supervisor import OnCheckpoint
from agents.training import Interrupted
from agents.trials import Trial

PATIENCE = 60.0  # for a folder that a lost worker still holds [s]
RETRIES = 3  # of a trial whose worker is lost


class Stopped(Exception):
    """A scheduler has ended a trial at a checkpoint; the message says which, and where."""


class Outcome(NamedTuple):
    """End of a trial: its result, an error, or the message of a scheduler that stopped it."""

    name: str
    result: dict[str, Any] | None
    error: str = ""
    stopped: str = ""


class Launch(Protocol):
    """Run trials in the folder `out`, `jobs` at once; `address` says where."""

    def __call__(self, trials: Sequence[Trial], out: Path, jobs: int, address: str | None) -> Iterator[Outcome]: ...


def run_trial(
    name: str, config: RunConfig, out: str, patience: float = PATIENCE, on_checkpoint: OnCheckpoint | None = None
) -> Outcome:
    """Run a trial, or go on with it; an error is its outcome, too, and only Ctrl-C ends more than the trial.

    `on_checkpoint` ends it by `Stopped`.
    """
    limit, is_told = time.monotonic() + patience, False
    while True:
        try:
            console = Console(quiet=True)
            return Outcome(name, run_or_resume(config, Path(out) / name, on_checkpoint=on_checkpoint, console=console))
        except Stopped as stop:
            return Outcome(name, None, stopped=str(stop))
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
    """An error in one line."""
    words = " ".join(str(error).split())
    return words if isinstance(error, ValueError) else f"{type(error).__name__}: {words}"
