"""One trial of a sweep, as a worker runs it."""

from __future__ import annotations

import sys
import time
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from rich.console import Console

from agents.checkpoint import list_checkpoints
from agents.config import RunConfig, RunFolder, RunInUse
from agents.environments import warm_kernels
from agents.run import run_or_resume
from agents.supervisor import OnCheckpoint
from agents.training import Interrupted
from agents.trials import Trial
from rigid_env.launchers.job import Job

PATIENCE = 60.0  # for a folder that a lost worker still holds [s]


def make_job(trial: Trial, out: Path, on_checkpoint: OnCheckpoint | None = None) -> Job:
    """Make the job that runs a trial in its folder in `out`, or goes on with it; see `run_trial`."""
    call = partial(run_trial, trial.name, trial.config, str(out), on_checkpoint=on_checkpoint)
    return Job(trial.name, call, trial.command(out), partial(warm_kernels, trial.config))


def tell_models(trials: Sequence[Trial], out: Path) -> None:
    """Print a warning on standard error if models that are there already are about to be read, whose code runs."""
    if any(list_checkpoints(RunFolder(out / trial.name).checkpoints) for trial in trials):
        told = "models of Stable-Baselines3: code in them runs while they are read; take them from those you trust only"
        print(f"rigid-env: {out} holds {told}", file=sys.stderr, flush=True)


def run_trial(
    name: str, config: RunConfig, out: str, patience: float = PATIENCE, on_checkpoint: OnCheckpoint | None = None
) -> dict[str, Any]:
    """Run a trial, or go on with it, and return its result; `on_checkpoint` ends it by an error of its own.

    Code in a checkpoint runs while it is read: the program that starts trials says so once, by `tell_models`.

    Raises
    ------
    RunInUse
        If another process still holds the folder after `patience` seconds.
    KeyboardInterrupt
        Ended by Ctrl-C.
    Exception
        Whatever the training raises.
    """
    limit, is_told = time.monotonic() + patience, False
    while True:
        try:
            quiet = Console(quiet=True)
            folder = Path(out) / name
            return run_or_resume(config, folder, is_trusted=True, on_checkpoint=on_checkpoint, console=quiet)
        except RunInUse:
            if time.monotonic() >= limit:
                raise
            if not is_told:
                print(f"{name} is in use by another process: waiting for it ...", file=sys.stderr, flush=True)
                is_told = True
            time.sleep(0.2)
        except Interrupted as error:
            raise KeyboardInterrupt(str(error)) from error
