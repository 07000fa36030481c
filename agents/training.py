"""Training of a model until its target or its limit of steps, with checkpoints."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.logger import Logger, configure

from agents.algorithms import make_model, make_training_env, set_up_torch
from agents.checkpoint import greedy, list_checkpoints, load_checkpoint
from agents.config import RunConfig, RunFolder
from agents.curve import History, plot_curve, write_curve
from agents.progress import ProgressDisplay
from agents.supervisor import OnCheckpoint, Supervisor
from rigid_env.terminal import make_console


class Interrupted(Exception):
    """Training was ended by Ctrl-C; the message says how to continue."""


def train(
    config: RunConfig,
    run: RunFolder,
    *,
    is_resumed: bool = False,
    is_trusted: bool = False,
    with_tensorboard: bool = False,
    on_checkpoint: OnCheckpoint | None = None,
    console: Console | None = None,
) -> dict[str, Any]:
    """Train until the target or the limit of steps is reached; writes configuration, model, checkpoints and curve.

    A resumed run that has reached one of them already is not trained further.

    Parameters
    ----------
    config : RunConfig
    run : RunFolder
    is_resumed : bool
        Continue from the newest checkpoint in `run`.
    is_trusted : bool
        Leave out the line which says that code in the checkpoint runs.
    with_tensorboard : bool
        Write Stable-Baselines3's diagnostics for TensorBoard, too.
    on_checkpoint : callable, optional
        See `Supervisor`.
    console : rich.console.Console, optional

    Returns
    -------
    dict
        Steps, seconds, whether the target was reached, success rate and mean return of the last episodes of training,
        and the policy.

    Raises
    ------
    Interrupted
        On Ctrl-C.
    ValueError
        If a resumed run has no checkpoint, or the algorithm or the environment refuses an argument.
    """
    console = console or make_console()
    set_up_torch(config)
    if is_resumed:
        model, history = load_checkpoint(run, config, is_trusted=is_trusted)
    else:
        model, history = make_model(config, make_training_env(config)), History()
    run.path.mkdir(parents=True, exist_ok=True)
    config.write(run.config)
    if model.num_timesteps < config.max_steps and history.reached < config.target:
        model.set_logger(_logger(run, with_tensorboard))
        _learn(config, run, model, history, is_resumed, on_checkpoint, console)
    model.save(run.model)
    last = history.points[-1]
    return {
        "steps": last.steps,
        "training_seconds": round(history.seconds, 3),
        "steps_per_second": round(last.steps / history.seconds),
        "is_target_reached": history.reached >= config.target,
        "training_success_rate": last.success_rate,
        "training_return_mean": last.mean_return,
        "policy": greedy(model),
    }


def _learn(
    config: RunConfig, run: RunFolder, model: BaseAlgorithm, history: History, is_resumed: bool,
    on_checkpoint: OnCheckpoint | None, console: Console,
) -> None:  # fmt: skip
    """Let a model learn; the curve is drawn even if an exception ends it."""
    with ProgressDisplay(console, config.max_steps) as display:
        supervisor = Supervisor(config, run, history, display, on_checkpoint)
        try:
            model.learn(
                config.max_steps - model.num_timesteps,
                callback=supervisor,
                reset_num_timesteps=not is_resumed,
            )
        except KeyboardInterrupt as interrupt:
            raise Interrupted(interruption_message(run, model.num_timesteps)) from interrupt
        finally:
            supervisor.close()
            write_curve(history.points, run.curve)
            title = f"{config.env}, {config.algo}, seed {config.seed}"
            plot_curve(history.points, config.target, title, run.curve.with_suffix(".png"))


def _logger(run: RunFolder, with_tensorboard: bool) -> Logger:
    """Make a logger of Stable-Baselines3; its default logger would leave an empty folder among the temporary files."""
    return configure(str(run.path / "tensorboard"), ["tensorboard"]) if with_tensorboard else Logger(None, [])


def interruption_message(run: RunFolder, step: int) -> str:
    """Text that says at which step a run was interrupted, and how to continue it."""
    kept = list_checkpoints(run.checkpoints)
    if not kept:
        return f"Interrupted before the first checkpoint; {run.path} holds nothing to go on from."
    return (
        f"Interrupted at step {step:,}. The checkpoint of step {int(kept[-1].name):,} is kept; go on with\n"
        f"python -m agents.train --resume {run.path}"
    )
