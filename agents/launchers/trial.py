"""One trial, as a worker runs it."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from rich.console import Console

from agents.config import RunConfig, RunInUse
from agents.run import run_or_resume
from agents.trials import Trial

PATIENCE = 60.0  # for a folder that a lost worker still holds [s]
RETRIES = 3  # of a trial whose worker is lost


class Outcome(NamedTuple):
    """End of a trial: its result, or an error."""

    name: str
    result: dict[str, Any] | None
    error: str = ""


class Launch(Protocol):
    """Run trials in the folder `out`, `jobs` at once; `address` says where."""

    def __call__(self, trials: Sequence[Trial], out: Path, jobs: int, address: str | None) -> Iterator[Outcome]: ...


def run_trial(name: str, config: RunConfig, out: str, patience: float = PATIENCE) -> Outcome:
    """Run a trial, or go on with it; a `ValueError` is its outcome."""
    limit = time.monotonic() + patience
    while True:
        try:
            return Outcome(name, run_or_resume(config, Path(out) / name, console=Console(quiet=True)))
        except RunInUse as error:
            if time.monotonic() >= limit:
                return Outcome(name, None, str(error))
            time.sleep(0.2)
        except ValueError as error:
            return Outcome(name, None, str(error))
