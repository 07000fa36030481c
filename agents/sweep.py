"""Train one agent for each of many settings: ``python -m agents.sweep ENV... --seeds 0-4 --set NAME=A,B --out DIR``.

Folders are named by the settings. The same command goes on with what was ended, anywhere that sees `DIR`: each trial
is `agents.train.run_or_resume`. What is complete stands in ``DIR/results.json``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
from gymnasium.error import DependencyNotInstalled
from rich.console import Console

from agents import asha
from agents.algorithms import algorithm_arguments
from agents.config import HYPERPARAMETERS, RunFolder
from agents.environments import make_vector_env
from agents.options import folder_option, make_folders, write_json
from agents.run import read_result
from agents.trials import Trial, make_trials, parse_grid, parse_seeds
from agents.worker import make_job, tell_models
from rigid_env.cli.common import at_least
from rigid_env.cli.names import listed_presets
from rigid_env.launchers import LAUNCHERS, load
from rigid_env.launchers.job import Ended, Launch
from rigid_env.terminal import Table, counted, make_console, number_columns, progress_bar, run_program

SCHEDULERS = ("asha",)  # of the launcher ray
INTERRUPTED = 130


def check_arguments(trials: Sequence[Trial]) -> None:
    """Refuse arguments of algorithms and environments that would fail at the first step of a trial.

    Raises
    ------
    ValueError
        Naming the argument.
    """
    seen = []
    for trial in trials:
        config = trial.config
        algorithm_arguments(config)
        arguments = (config.env, config.env_kwargs)
        if arguments not in seen:
            seen.append(arguments)
            make_vector_env(config.env, 1, accuracy=config.accuracy, **config.env_kwargs).close()


def check_scheduler(scheduler: str | None, launcher: str) -> None:
    """Refuse a scheduler that is none, or that would have no effect; None is no scheduler.

    Raises
    ------
    ValueError
    """
    if scheduler not in (None, *SCHEDULERS):
        raise ValueError(f"scheduler is {scheduler!r}; allowed are {', '.join(SCHEDULERS)}")
    if scheduler is not None and launcher != "ray":
        raise ValueError(
            f"scheduler is {scheduler!r} with the launcher {launcher!r}; allowed is --launcher ray with it"
        )


def complete(trials: Sequence[Trial], out: Path) -> dict[str, dict[str, Any]]:
    """Results of the trials that are complete, by name."""
    found = {trial.name: read_result(RunFolder(out / trial.name), trial.config) for trial in trials}
    return {name: result for name, result in found.items() if result is not None}


def sweep(
    trials: Sequence[Trial], out: Path, launch: Launch, jobs: int, address: str | None, console: Console
) -> list[Ended]:
    """Run the trials that are not complete, and print a line for each that ends.

    Returns
    -------
    list of Ended
        Ends of the trials that are complete, were stopped or have failed, in the order of the trials.
    """
    ended = {name: Ended(name, result) for name, result in complete(trials, out).items()}
    left = [trial for trial in trials if trial.name not in ended]
    if ended:
        console.print(f"{len(ended)} of {counted(len(trials), 'trial')} complete already", highlight=False)
    if left:
        console.print(f"{counted(len(left), 'trial')} to run, {jobs} at once", highlight=False)
    with progress_bar(console) as bar:
        task = bar.add_task("trials", total=len(trials), completed=len(ended))
        for end in launch([make_job(trial, out) for trial in left], out, jobs, address) if left else ():
            ended[end.name] = end
            bar.update(task, completed=len(ended))
            console.print(f"{len(ended)} of {len(trials)}  {_told(end)}", highlight=False, soft_wrap=True)
    return [ended[trial.name] for trial in trials if trial.name in ended]


def _told(end: Ended) -> str:
    if end.result is None:
        return f"{end.name}: {end.stopped or end.error}"
    rate, steps = end.result["evaluation"]["success_rate"], end.result["steps"]
    return f"{end.name}: success {rate:.1%} after {steps / 1e6:.2f} M steps"


def make_table(ends: Sequence[Ended]) -> Table:
    """Table of the success of each trial on fresh episodes."""
    table = Table(["trial", *number_columns("success", "95 %", "return", "M steps", "s")], "sweep")
    for name, result, _, stopped in ends:
        if result is None:
            table.add_row(name, stopped or "failed", "", "", "", "")
            continue
        judged = result["evaluation"]
        low, high = judged["interval"]
        table.add_row(
            name, f"{judged['success_rate']:.1%}", f"{low:.1%} to {high:.1%}", f"{judged['return_mean']:.2f}",
            f"{result['steps'] / 1e6:.2f}", f"{result['training_seconds']:.0f}",
        )  # fmt: skip
    return table


@contextmanager
def told_ends(console: Console, goes_on: str = "from the last checkpoint of each trial") -> Iterator[None]:
    """Turn a missing library and Ctrl-C into a message and an exit status; `goes_on` says where."""
    try:
        yield
    except DependencyNotInstalled as error:
        console.print(f"Error: {error}", soft_wrap=True)
        raise typer.Exit(1) from None
    except KeyboardInterrupt:
        console.print(f"Interrupted: the same command goes on, {goes_on}.")
        raise typer.Exit(INTERRUPTED) from None


def main(
    env: Annotated[list[str], typer.Argument(help="Gymnasium ids, or module:id.", show_default=False)],
    seeds: Annotated[str, typer.Option(help="Numbers and ranges: 0-4 or 1,3,7.")] = "0",
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=A,B", help="Values of anything in config.yaml, each of them tried."),
    ] = None,
    accuracy: Annotated[str | None, typer.Option(help="Presets of the engine in training, with commas.")] = None,
    algo: Annotated[str | None, typer.Option(help="ppo or sac.", show_default="the first of the environment")] = None,
    hyperparameters: Annotated[Path, typer.Option(help="YAML file.", exists=True)] = HYPERPARAMETERS,
    out: Annotated[Path, folder_option("Folder of the sweep; every worker sees it.")] = Path("sweep"),
    launcher: Annotated[str, typer.Option(help=f"{', '.join(LAUNCHERS)}.")] = "local",
    jobs: Annotated[int, typer.Option(callback=at_least(1), help="Trials at once.")] = 2,
    address: Annotated[str | None, typer.Option(help="Of a Ray cluster, or a Slurm partition (local: none).")] = None,
    scheduler: Annotated[
        str | None, typer.Option(help="asha: stop trials that fall behind; with --launcher ray.", show_default="none")
    ] = None,
) -> None:
    """Train one agent for each environment, seed and combination of settings, and compare them.

    The same command goes on with a sweep that was ended.
    """
    console = make_console(is_error=launcher == "print")  # its lines alone are on standard output
    try:
        grid = parse_grid(settings or [])
        if accuracy is not None:
            grid["accuracy"] = listed_presets(accuracy)
        trials = make_trials(env, parse_seeds(seeds), grid, algo, hyperparameters)
        launch = load(launcher)
        check_scheduler(scheduler, launcher)
        check_arguments(trials)
        make_folders(out=out)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    if scheduler is not None:
        launch = partial(asha.launch, trials)
    tell_models([trial for trial in trials if trial.name not in complete(trials, out)], out)
    with told_ends(console):
        ends = sweep(trials, out.resolve(), launch, jobs, address, console)
    if ends:
        write_json(out / "results.json", {"trials": [each._asdict() for each in ends]})
        console.print(make_table(ends))
    if any(each.error for each in ends):
        raise typer.Exit(1)


if __name__ == "__main__":
    run_program(main)
