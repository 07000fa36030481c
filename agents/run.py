"""Whole run: training, evaluation and video, started or continued from its last checkpoint."""

from __future__ import annotations

import json
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

from rich.console import Console

from agents.checkpoint import list_checkpoints
from agents.config import CHANGEABLE, RunConfig, RunFolder
from agents.evaluate import evaluate, evaluation_seeds, print_evaluation
from agents.options import write_json
from agents.record import record
from agents.supervisor import OnCheckpoint
from agents.training import Interrupted, interruption_message, train
from rigid_env.terminal import make_console

EVALUATION_EPISODES = 1000
VIDEO_EPISODES = 3


def finish(config: RunConfig, run: RunFolder, policy, with_video: bool, console: Console) -> dict[str, Any]:
    """Evaluate a trained policy and record a video; both are written into the folder of the run.

    Returns
    -------
    dict
        The evaluation.
    """
    arguments = config.evaluation_arguments
    evaluation = evaluate(config.env, policy, EVALUATION_EPISODES, config.seed, **arguments)
    write_json(run.evaluation, evaluation)
    print_evaluation(evaluation, "trained agent, fresh episodes", console)
    if with_video:
        seeds = evaluation_seeds(config.seed, VIDEO_EPISODES)
        path = record(config.env, policy, seeds, run.video, **arguments)
        console.print(f"video       {path}", soft_wrap=True)
    return evaluation


def run_or_resume(
    config: RunConfig,
    folder: Path | str,
    *,
    with_video: bool = False,
    with_tensorboard: bool = False,
    is_trusted: bool = False,
    on_checkpoint: OnCheckpoint | None = None,
    console: Console | None = None,
) -> dict[str, Any]:
    """Train and evaluate: start a run, continue one from its last checkpoint, or read the result of a complete one.

    Parameters
    ----------
    config : RunConfig
    folder : path
        Folder of the run; made if it does not exist.
    with_video, with_tensorboard : bool
        Record some episodes at the end; write diagnostics.
    is_trusted : bool
        Leave out the line which says that code in the checkpoint runs.
    on_checkpoint : callable, optional
        See `Supervisor`.
    console : rich.console.Console, optional

    Returns
    -------
    dict
        Contents of `result.json`.

    Raises
    ------
    Interrupted
        On Ctrl-C; the next call continues the run.
    RunInUse
        If another process works on the run.
    ValueError
        If the folder has a run with other settings, or the algorithm or the environment refuses an argument.
    """
    start, run, console = time.perf_counter(), RunFolder(Path(folder)), console or make_console()
    with run.locked():
        if run.config.is_file():
            check_same(run, config)
        kept = read_result(run, config)
        if kept is not None:
            return kept
        try:
            is_resumed = bool(list_checkpoints(run.checkpoints))
            result = train(
                config, run, is_resumed=is_resumed, is_trusted=is_trusted, with_tensorboard=with_tensorboard,
                on_checkpoint=on_checkpoint, console=console,
            )  # fmt: skip
        except ValueError:
            run.discard()
            raise
        except KeyboardInterrupt as interrupt:  # before the first step
            kept = list_checkpoints(run.checkpoints)
            run.discard()
            raise Interrupted(interruption_message(run, int(kept[-1].name) if kept else 0)) from interrupt
        goal = "target reached" if result["is_target_reached"] else "target not reached within the limit"
        console.print(f"{goal}: {result['steps']:,} steps in {result['training_seconds']:.1f} s")
        evaluation = finish(config, run, result.pop("policy"), with_video, console)
        seconds = round(time.perf_counter() - start, 3)
        head = {"run": str(run.path), "env": config.env, "algo": config.algo, "seed": config.seed}
        result = {**head, "target": config.target, **result, "total_seconds": seconds, "evaluation": evaluation}
        write_json(run.result, result)
    return result


def read_result(run: RunFolder, config: RunConfig) -> dict[str, Any] | None:
    """Read the result of a run that is complete; None if steps, or a higher target, are left."""
    if not run.result.is_file():
        return None
    result = json.loads(run.result.read_text(encoding="utf-8"))
    is_reached = result["is_target_reached"] and result["target"] >= config.target
    return result if is_reached or result["steps"] >= config.max_steps else None


def check_same(run: RunFolder, config: RunConfig) -> None:
    """Refuse to continue a run with a different configuration.

    Raises
    ------
    ValueError
        Naming the first setting that differs.
    """
    ours, theirs = asdict(config), asdict(run.read_config())
    for name in ours:
        if name not in CHANGEABLE and ours[name] != theirs[name]:
            where, mine, kept = _difference(name, ours[name], theirs[name])
            raise ValueError(
                f"{where} is {mine!r}, and {kept!r} in {str(run.path)!r}; allowed to change while a run goes on are "
                f"{', '.join(CHANGEABLE)}"
            )


def _difference(name: str, ours: Any, theirs: Any) -> tuple[str, Any, Any]:
    """Dotted name of the first entry that differs between two values of a field, and both values of this entry."""
    if isinstance(ours, dict) and isinstance(theirs, dict):
        for key in (*ours, *theirs):
            if ours.get(key) != theirs.get(key):
                return _difference(f"{name}.{key}", ours.get(key), theirs.get(key))
    return name, ours, theirs
