"""Train an agent: ``python -m agents.train``.

A run makes its environments and its model from a configuration, trains until the target or the limit is
reached, and leaves in its folder:

- ``config.yaml``, ``model.zip``, and the last ``checkpoints``,
- ``monitor.csv`` (every episode of training), ``curve.csv`` and ``curve.png`` (the learning curve),
- ``evaluation.json`` (1,000 fresh seeded episodes without exploration) and ``result.json``,
- ``episodes.mp4``, a video.

Ctrl-C ends it at its last checkpoint, from which ``--resume FOLDER`` goes on with the same bits.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import torch
import typer
from rich.console import Console
from stable_baselines3.common.logger import Logger, configure

from agents.algorithms import make_model, make_training_env
from agents.checkpoint import greedy, list_checkpoints, load_checkpoint
from agents.config import HYPERPARAMETERS, RunConfig, RunFolder, change, default_algorithm, make_config
from agents.curve import History, plot_curve, write_curve
from agents.evaluate import JsonOption, evaluate, evaluation_seeds, print_evaluation, write_json
from agents.progress import ProgressDisplay
from agents.record import record
from agents.supervisor import Supervisor
from rigid_env.cli.names import checked_preset
from rigid_env.terminal import make_console, run_program

DEFAULTS = {"env": "rigid_env/BlockReach-v0", "seed": 0}
EVALUATION_EPISODES = 1000
VIDEO_EPISODES = 3
RESUME_HELP = "Go on with a run; code in its checkpoint runs while it is read: take it from those you trust only."
INTERRUPTED = 130  # exit status of a program ended by Ctrl-C


class Interrupted(Exception):
    """Training was ended by Ctrl-C; the message says how to go on."""


def train(
    config: RunConfig,
    run: RunFolder,
    *,
    is_resumed: bool = False,
    with_tensorboard: bool = False,
    console: Console | None = None,
) -> dict[str, Any]:
    """Train until the target or the limit is reached; writes configuration, model, checkpoints and curve.

    Parameters
    ----------
    config : RunConfig
    run : RunFolder
    is_resumed : bool
        Go on from the newest checkpoint in `run`.
    with_tensorboard : bool
        Write Stable-Baselines3's diagnostics for TensorBoard, too.
    console : rich.console.Console, optional

    Returns
    -------
    dict
        Steps, seconds, whether the target was reached, and where the last episodes of training stood.

    Raises
    ------
    Interrupted
        On Ctrl-C.
    ValueError
        If a resumed run has no checkpoint, or has done `config.max_steps` already.
    """
    console = console or make_console()
    torch.set_num_threads(config.torch_threads)
    if is_resumed:
        model, history = load_checkpoint(run, config)
        if model.num_timesteps >= config.max_steps:
            raise ValueError(f"max_steps is {config.max_steps}; allowed is more than the {model.num_timesteps} done")
    else:
        model, history = make_model(config, make_training_env(config)), History()
    run.path.mkdir(parents=True, exist_ok=True)
    config.write(run.config)
    model.set_logger(_logger(run, with_tensorboard))

    first_step, first_second = model.num_timesteps, history.seconds
    with ProgressDisplay(console, config.max_steps) as display:
        supervisor = Supervisor(config, run, history, display)
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
    model.save(run.model)
    last = history.points[-1]
    return {
        "steps": last.steps,
        "training_seconds": round(history.seconds, 3),
        "steps_per_second": round((last.steps - first_step) / (history.seconds - first_second)),
        "is_target_reached": supervisor.is_target_reached,
        "training_success_rate": last.success_rate,
        "training_return_mean": last.mean_return,
        "policy": greedy(model),
    }


def _logger(run: RunFolder, with_tensorboard: bool) -> Logger:
    """Logger of Stable-Baselines3; its own default leaves an empty folder in that of temporary files."""
    return configure(str(run.path / "tensorboard"), ["tensorboard"]) if with_tensorboard else Logger(None, [])


def interruption_message(run: RunFolder, step: int) -> str:
    """Say what an interrupted run has left, and how to go on."""
    kept = list_checkpoints(run.checkpoints)
    if not kept:
        return f"Interrupted before the first checkpoint; {run.path} holds nothing to go on from."
    return (
        f"Interrupted at step {step:,}. The checkpoint of step {int(kept[-1].name):,} is kept; go on with\n"
        f"python -m agents.train --resume {run.path}"
    )


def choose_config(resume: Path | None, hyperparameters: Path, fixed: dict[str, Any]) -> RunConfig:
    """The configuration of a new run, or of the one to go on with.

    Parameters
    ----------
    resume : Path or None
        Folder of the run to go on with.
    hyperparameters : Path
    fixed : dict
        ``env``, ``algo``, ``seed``, ``num_envs``, ``accuracy``: None where nothing else than the default is
        wanted.

    Raises
    ------
    ValueError
        On values out of range, and where a run is to go on as another one.
    """
    given = {name: value for name, value in fixed.items() if value is not None}
    if resume is None:
        wanted = {**DEFAULTS, **given}
        wanted.setdefault("algo", default_algorithm(wanted["env"], hyperparameters))
        return make_config(path=hyperparameters, **wanted)
    if given:
        raise ValueError(f"{next(iter(given))} cannot change with --resume; allowed are target, max_steps, threads")
    return RunFolder(resume).read_config()


def finish(config: RunConfig, run: RunFolder, policy, with_video: bool, console: Console) -> dict[str, Any]:
    """Evaluate a trained policy and record a video; writes both into the folder of the run.

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


def new_folder(out: Path, config: RunConfig) -> RunFolder:
    """A folder in `out` that does not exist yet, named by what is trained and when."""
    name = f"{config.env.rpartition('/')[2]}-{config.algo}-s{config.seed}-{time.strftime('%Y%m%d-%H%M%S')}"
    path, count = out / name, 1
    while path.exists():
        count += 1
        path = out / f"{name}-{count}"
    return RunFolder(path)


def main(
    env: Annotated[str | None, typer.Option(help="Gymnasium id, or module:id.", show_default=DEFAULTS["env"])] = None,
    algo: Annotated[str | None, typer.Option(help="ppo or sac.", show_default="the first of the environment")] = None,
    seed: Annotated[int | None, typer.Option(help="Of all that is random.", show_default="0")] = None,
    num_envs: Annotated[int | None, typer.Option(help="Worlds trained on at once.")] = None,
    accuracy: Annotated[
        str | None, typer.Option(help="Preset of the engine in training.", callback=checked_preset)
    ] = None,
    target: Annotated[float | None, typer.Option(help="Success rate to stop at, 0 to 1.")] = None,
    max_steps: Annotated[int | None, typer.Option(help="Steps to stop at.")] = None,
    threads: Annotated[int | None, typer.Option(help="Of the engine.")] = None,
    hyperparameters: Annotated[Path, typer.Option(help="YAML file.", exists=True)] = HYPERPARAMETERS,
    resume: Annotated[Path | None, typer.Option(metavar="RUN_DIR", help=RESUME_HELP)] = None,
    out: Annotated[Path, typer.Option(help="Where the folders of runs are made.")] = Path("runs"),
    video: Annotated[bool, typer.Option(help="Record some episodes at the end.")] = True,
    tensorboard: Annotated[bool, typer.Option(help="Write diagnostics for TensorBoard.")] = False,
    json_file: JsonOption = None,
) -> None:
    """Train an agent until it reaches the target, evaluate it, and record a video.

    What is not given comes from the hyperparameters of the environment and the algorithm. With --resume,
    only target, limit and threads can be changed.
    """
    start, console = time.perf_counter(), make_console()
    try:
        fixed = {"env": env, "algo": algo, "seed": seed, "num_envs": num_envs, "accuracy": accuracy}
        config = choose_config(resume, hyperparameters, fixed)
        config = change(config, target=target, max_steps=max_steps, threads=threads)
        run = new_folder(out, config) if resume is None else RunFolder(resume)
        console.print(f"run         {run.path}", soft_wrap=True)
        is_resumed = resume is not None
        result = train(config, run, is_resumed=is_resumed, with_tensorboard=tensorboard, console=console)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    except Interrupted as interruption:
        console.print(str(interruption), soft_wrap=True)
        raise typer.Exit(INTERRUPTED) from interruption
    goal = "target reached" if result["is_target_reached"] else "target not reached within the limit"
    console.print(f"{goal}: {result['steps']:,} steps in {result['training_seconds']:.1f} s")
    evaluation = finish(config, run, result.pop("policy"), video, console)
    seconds = round(time.perf_counter() - start, 3)
    head = {"run": str(run.path), "env": config.env, "algo": config.algo, "seed": config.seed}
    result = {**head, "target": config.target, **result, "total_seconds": seconds, "evaluation": evaluation}
    write_json(run.result, result)
    if json_file is not None:
        write_json(json_file, result)
    for name, path in (("curve", run.curve.with_suffix(".png")), ("evaluation", run.evaluation), ("policy", run.model)):
        console.print(f"{name:<11} {path}", soft_wrap=True)
    console.print(f"all         {seconds:.1f} s")


if __name__ == "__main__":
    run_program(main)
