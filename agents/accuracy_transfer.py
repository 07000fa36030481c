"""Success of policies trained at a coarse accuracy, at an exact one: ``python -m agents.accuracy_transfer``.

One policy is trained per accuracy, with the same hyperparameters, seed and target. The end of training is decided at
the accuracy of the training, as if no other one were available. Each policy is then evaluated on the same fresh
episodes, at its own accuracy and at `reference`. The table shows success at `reference` and the time of training.

A policy that has been trained already is not trained again, so an interrupted program continues with the next one.
"""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from agents.checkpoint import load_policy
from agents.config import HYPERPARAMETERS, RunConfig, RunFolder, make_config, short_name
from agents.curve import plot_transfer
from agents.evaluate import evaluate
from agents.options import JsonOption, folder_option, write_json
from agents.train import DEFAULTS, INTERRUPTED
from agents.training import Interrupted, train
from physics.accuracy import PRESETS
from rigid_env.cli.common import at_least
from rigid_env.cli.files import PLOTS, output_option
from rigid_env.lab.measure import machine
from rigid_env.terminal import Table, make_console, number_columns, run_program

TRUTH = "reference"
TRAINED_AT = "fast,balanced,precise"
EPISODES = 500


@dataclass(frozen=True)
class Transfer:
    """Policy trained at one accuracy, and its evaluations.

    Attributes
    ----------
    accuracy : str
        Preset of the engine in training.
    training_seconds : float
        Time of training [s].
    steps : int
        Environment steps of training.
    is_target_reached : bool
        True if training ended at its target, False if at its limit.
    own, truth : dict
        Evaluations at that accuracy and at `reference` (`agents.evaluate.Episodes.summary`).
    """

    accuracy: str
    training_seconds: float
    steps: int
    is_target_reached: bool
    own: dict[str, Any]
    truth: dict[str, Any]


def parse_accuracies(names: str) -> list[str]:
    """Split a list of presets with commas, and check the names.

    Raises
    ------
    ValueError
        If a name is no preset.
    """
    found = [name.strip() for name in names.split(",")]
    unknown = [name for name in found if name not in PRESETS]
    if unknown:
        raise ValueError(f"accuracies has {unknown[0]!r}; allowed are {', '.join(PRESETS)}, with commas")
    return found


def trained(config: RunConfig, run: RunFolder, console: Console) -> dict[str, Any]:
    """Return the result of `agents.train.train` for a run; train if the folder has no result yet.

    Raises
    ------
    ValueError
        If the folder contains another run.
    """
    if run.model.is_file() and run.result.is_file():
        if run.read_config() != config:
            raise ValueError(f"out holds a run of another configuration in {str(run.path)!r}; allowed is a new folder")
        return json.loads(run.result.read_text(encoding="utf-8"))
    result = train(config, run, console=console)
    del result["policy"]
    write_json(run.result, result)
    return result


def transfer(config: RunConfig, run: RunFolder, episodes: int, console: Console) -> Transfer:
    """Train one policy, unless it is trained already, and evaluate it.

    Parameters
    ----------
    config : RunConfig
        Configuration; its `accuracy` is the name of a preset.
    run : RunFolder
        Folder of the run.
    episodes : int
        Episodes per evaluation.
    console : rich.console.Console
    """
    result = trained(config, run, console)
    _, policy = load_policy(run)
    seen = [
        evaluate(config.env, policy, episodes, config.seed, **{**config.env_kwargs, "accuracy": accuracy})
        for accuracy in (config.accuracy, TRUTH)
    ]
    return Transfer(
        config.accuracy, result["training_seconds"], result["steps"], result["is_target_reached"], seen[0], seen[1]
    )


def make_table(env: str, rows: list[Transfer]) -> Table:
    """Table of success and training time, a row for each policy."""
    names = "training, s", "million\nsteps", "success\nthere", f"success at\n{TRUTH}", "95 %"
    table = Table(["trained at", *number_columns(*names)], f"{env}: trained at an accuracy, judged at {TRUTH}")
    for row in rows:
        low, high = row.truth["interval"]
        table.add_row(
            row.accuracy + ("" if row.is_target_reached else " (limit)"),
            f"{row.training_seconds:.0f}", f"{row.steps / 1e6:.2f}",
            f"{row.own['success_rate']:.1%}", f"{row.truth['success_rate']:.1%}", f"{low:.1%} to {high:.1%}",
        )  # fmt: skip
    return table


def main(
    env: Annotated[str, typer.Option(help="Gymnasium id, or module:id.")] = DEFAULTS["env"],
    algo: Annotated[str, typer.Option(help="ppo or sac.")] = "ppo",
    seed: Annotated[int, typer.Option(callback=at_least(0), help="Of all that is random.")] = DEFAULTS["seed"],
    accuracies: Annotated[str, typer.Option(metavar="NAMES", help="Presets to train at, with commas.")] = TRAINED_AT,
    episodes: Annotated[int, typer.Option(callback=at_least(1), help="Of each evaluation.")] = EPISODES,
    target: Annotated[float | None, typer.Option(help="Success rate to stop at, 0 to 1.")] = None,
    max_steps: Annotated[int | None, typer.Option(help="Steps to stop at.")] = None,
    hyperparameters: Annotated[Path, typer.Option(help="YAML file.", exists=True)] = HYPERPARAMETERS,
    out: Annotated[Path, folder_option("Where the runs are kept; done ones are not repeated.")] = Path("transfer"),
    json_file: JsonOption = None,
    plot: Annotated[Path | None, output_option("--plot", *PLOTS, help="Draw the picture here.")] = None,
) -> None:
    """Train one policy per accuracy, evaluate each at `reference`: success against training time."""
    console, rows = make_console(), []
    try:
        for name in parse_accuracies(accuracies):
            config = make_config(
                env, algo, seed, hyperparameters,
                accuracy=name, evaluation_accuracy=name, target=target, max_steps=max_steps,
            )  # fmt: skip
            console.print(f"training at {name}", highlight=False)
            run = RunFolder(out / f"{short_name(config.env)}-{algo}-s{seed}-{name}")
            rows.append(transfer(config, run, episodes, console))
            console.print(make_table(config.env, rows[-1:]))
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    except Interrupted as interruption:
        console.print(str(interruption), soft_wrap=True, highlight=False)
        raise typer.Exit(INTERRUPTED) from interruption
    console.print(make_table(env, rows))
    if plot is not None:
        plot.parent.mkdir(parents=True, exist_ok=True)
        plot_transfer(rows, f"{env}: trained at an accuracy, judged at {TRUTH}", plot)
    if json_file is not None:
        machine.write_json(json_file, {"env": env, "algo": algo, "seed": seed, "rows": [asdict(row) for row in rows]})


if __name__ == "__main__":
    run_program(main)
