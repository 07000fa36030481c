"""Train an agent: ``python -m agents.train``.

A run makes its environments and its model from a configuration, trains until the target or the limit is
reached, and leaves in its folder:

- ``config.yaml``, ``model.zip``, and the last ``checkpoints``,
- ``monitor.csv`` (every episode of training), ``curve.csv`` and ``curve.png`` (the learning curve),
- ``evaluation.json`` (1,000 fresh seeded episodes without exploration) and ``result.json``,
- ``episodes.mp4``, a video.

Ctrl-C ends it at its last checkpoint, from which ``--resume FOLDER`` continues with the same bits. `run_or_resume` does
all of this for programs: it starts a run, continues it from its last checkpoint, or returns its result.
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from agents.compile_ahead import compile_ahead
from agents.config import HYPERPARAMETERS, RunConfig, RunFolder, change, default_algorithm, make_config, make_folder
from agents.options import JsonOption, folder_option, make_folders, write_json
from agents.settings import apply_settings, parse_settings
from rigid_env.cli.common import at_least
from rigid_env.cli.names import checked_preset
from rigid_env.terminal import make_console, run_program

DEFAULTS = {"env": "rigid_env/BlockReach-v0", "seed": 0}
RESUME_HELP = "Go on with a run; code in its checkpoint runs while it is read: take it from those you trust only."
INTERRUPTED = 130  # exit status of a program ended by Ctrl-C


def __getattr__(name: str) -> Any:
    """Import `run_or_resume`, and PyTorch with it, at the first use."""
    if name == "run_or_resume":
        from agents.run import run_or_resume

        return run_or_resume
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def choose_config(resume: Path | None, hyperparameters: Path, fixed: dict[str, Any]) -> RunConfig:
    """Choose the configuration of a new run, or of the run to be continued.

    Parameters
    ----------
    resume : Path or None
        Folder of the run to be continued; None: a new run.
    hyperparameters : Path
    fixed : dict
        ``env``, ``algo``, ``seed``, ``num_envs``, ``accuracy`` as given; None stands for the default.

    Raises
    ------
    ValueError
        On values out of range, and if a value is given for a run to be continued.
    """
    given = {name: value for name, value in fixed.items() if value is not None}
    if resume is None:
        wanted = {**DEFAULTS, **given}
        wanted.setdefault("algo", default_algorithm(wanted["env"], hyperparameters))
        return make_config(path=hyperparameters, **wanted)
    if given:
        raise ValueError(f"{next(iter(given))} cannot change with --resume; allowed are target, max_steps, threads")
    return RunFolder(resume).read_config()


def _run(
    config: RunConfig, given: Path | None, out: Path, with_video: bool, with_tensorboard: bool, console: Console
) -> tuple[RunFolder, dict[str, Any]]:
    """Run, or go on with, a run in the folder `given`, or in a new one in `out`; return its folder and its result.

    PyTorch is imported before the folder is made: Ctrl-C meanwhile leaves none.
    """
    from agents.run import check_same, read_result, run_or_resume
    from agents.training import Interrupted

    if given is None:
        make_folders(out=out)
        run = make_folder(out, config)
    else:
        make_folders(folder=given)
        run = RunFolder(given)
    console.print(f"run         {run.path}", soft_wrap=True)
    try:
        if run.config.is_file():
            check_same(run, config)
        if read_result(run, config) is not None:
            console.print("This run is complete: a larger --max-steps or --target trains on.")
        result = run_or_resume(
            config, run.path, with_video=with_video, with_tensorboard=with_tensorboard, console=console
        )
        return run, result
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    except Interrupted as interruption:
        console.print(str(interruption), soft_wrap=True)
        raise typer.Exit(INTERRUPTED) from interruption


def main(
    env: Annotated[str | None, typer.Option(help="Gymnasium id, or module:id.", show_default=DEFAULTS["env"])] = None,
    algo: Annotated[str | None, typer.Option(help="ppo or sac.", show_default="the first of the environment")] = None,
    seed: Annotated[
        int | None, typer.Option(callback=at_least(0), help="Of all that is random.", show_default="0")
    ] = None,
    num_envs: Annotated[int | None, typer.Option(help="Worlds trained on at once.")] = None,
    accuracy: Annotated[
        str | None, typer.Option(help="Preset of the engine in training.", callback=checked_preset)
    ] = None,
    target: Annotated[float | None, typer.Option(help="Success rate to stop at, 0 to 1.")] = None,
    max_steps: Annotated[int | None, typer.Option(help="Steps to stop at.")] = None,
    threads: Annotated[int | None, typer.Option(help="Of the engine.")] = None,
    settings: Annotated[
        list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="Anything that config.yaml holds.")
    ] = None,
    hyperparameters: Annotated[Path, typer.Option(help="YAML file.", exists=True)] = HYPERPARAMETERS,
    resume: Annotated[Path | None, typer.Option(metavar="RUN_DIR", help=RESUME_HELP)] = None,
    out: Annotated[Path, folder_option("Where the folders of runs are made.")] = Path("runs"),
    folder: Annotated[
        Path | None, folder_option("Folder of the run, begun or gone on with; instead of --out.", show_default=False)
    ] = None,
    video: Annotated[bool, typer.Option(help="Record some episodes at the end.")] = True,
    tensorboard: Annotated[bool, typer.Option(help="Write diagnostics for TensorBoard.")] = False,
    json_file: JsonOption = None,
) -> None:
    """Train an agent until it reaches the target, evaluate it, and record a video.

    What is not given comes from the hyperparameters of the environment and the algorithm. With --resume,
    only --target, --max-steps and --threads can be changed.
    """
    start, console = time.perf_counter(), make_console()
    try:
        chosen = parse_settings(settings or [])
        limits = {"target": target, "max_steps": max_steps, "threads": threads}
        told = {"num_envs": num_envs, "accuracy": accuracy, **limits}
        for name in (name for name, value in told.items() if value is not None and name in chosen):
            raise ValueError(f"--set names {name}, which has an option here; allowed is one of them")
        fixed = {"env": env, "algo": algo, "seed": seed, "num_envs": num_envs, "accuracy": accuracy}
        config = choose_config(resume, hyperparameters, fixed)
        config = change(config, **limits)
        config = apply_settings(config, chosen)
        if resume is not None and folder is not None:
            raise ValueError(f"--folder is {str(folder)!r}, with --resume; allowed is one of them")
        compile_ahead(config)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error

    run, result = _run(config, resume or folder, out, video, tensorboard, console)
    if json_file is not None:
        write_json(json_file, result)
    for name, path in (("curve", run.curve.with_suffix(".png")), ("evaluation", run.evaluation), ("policy", run.model)):
        console.print(f"{name:<11} {path}", soft_wrap=True)
    console.print(f"all         {time.perf_counter() - start:.1f} s")


if __name__ == "__main__":
    run_program(main)
