"""Launcher that prints trials as shell commands, for job arrays, xargs and other schedulers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

from agents.launchers.trial import Outcome
from agents.trials import Trial


def launch(trials: Sequence[Trial], out: Path, jobs: int, address: str | None = None) -> Iterator[Outcome]:
    """Print the command of each trial; none of them runs here."""
    for trial in trials:
        print(trial.command(out))
    return iter(())
