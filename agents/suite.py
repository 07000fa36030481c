"""Train and judge agents on every environment: ``python -m agents.suite [ENV...] --seeds 0-4 --out DIR``.

Trials are those of `agents.sweep`: they run on any launcher, and the same command goes on with what was ended. Each
complete trial is a file of results, and each environment another one with what chance and a hand reach. With
``--results benchmarks/results/suite`` they are published: `benchmarks.environment_pages` makes pages of them.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

from agents.accuracy_transfer import parse_accuracies
from agents.baselines import CONTROLLERS, baseline_policy
from agents.config import HYPERPARAMETERS, RunFolder, environments_of, short_name
from agents.curve import read_curve
from agents.evaluate import evaluate
from agents.interval import bootstrap, interquartile_mean
from agents.options import folder_option, make_folders
from agents.run import EVALUATION_EPISODES
from agents.sweep import complete, sweep, told_ends
from agents.trials import Trial, make_trials, parse_seeds
from agents.worker import tell_models
from physics.accuracy import PRESETS
from rigid_env.cli.common import at_least
from rigid_env.lab.measure.machine import write_json
from rigid_env.launchers import LAUNCHERS
from rigid_env.launchers.job import Ended, Job
from rigid_env.launchers.place import Place
from rigid_env.terminal import Table, make_console, number_columns, run_program

RESULTS = Path("benchmarks/results/suite")  # published ones, in a checkout
JUDGED_EPISODES = 200  # at each preset
CURVE_POINTS = 60  # kept of a learning curve
RUNNING = [name for name in LAUNCHERS if name != "print"]  # launchers whose jobs end here, so that they are judged


# --- what is measured ------------------------------------------------------------------------------------------------


def judge_trial(trial: Trial, out: str, accuracy: str) -> dict[str, Any]:
    """Judge a complete trial's policy at a preset of the engine; returns `agents.evaluate.evaluate`'s numbers."""
    from agents.checkpoint import load_policy

    config, policy = load_policy(RunFolder(Path(out) / trial.name), is_trusted=True)
    arguments = {**config.evaluation_arguments, "accuracy": accuracy}
    return evaluate(config.env, policy, JUDGED_EPISODES, config.seed, **arguments)


def measure_floors(env_id: str) -> dict[str, Any]:
    """Evaluate random actions and, where there is one, the controller written by hand; returns both by name."""
    names = ["random", *(["controller"] if env_id in CONTROLLERS else [])]
    return {
        name: evaluate(env_id, baseline_policy(name, env_id), EVALUATION_EPISODES, 0, accuracy="balanced")
        for name in names
    }


# --- files of results ------------------------------------------------------------------------------------------------


def trial_file(results: Path, trial: Trial) -> Path:
    """File of a trial's results."""
    return results / f"{trial.name}.json"


def floors_file(results: Path, env_id: str) -> Path:
    """File of an environment's floors."""
    return results / f"{short_name(env_id)}-floors.json"


def write_trial(results: Path, trial: Trial, out: Path, result: dict[str, Any], judged: dict[str, Any]) -> None:
    """Write what a trial reached, with the machine, the versions and the commit."""
    curve = read_curve(RunFolder(out / trial.name).curve)
    every = max(1, len(curve) // CURVE_POINTS)
    content = {**result, "accuracy": trial.config.accuracy, "is_default": "accuracy" not in trial.settings}
    del content["run"]
    write_json(trial_file(results, trial), {**content, "judged": judged, "curve": [*curve[::every], curve[-1]]})


def is_written(path: Path, result: dict[str, Any] | None = None) -> bool:
    """Return whether a file of results is there; with `result`, of this very result of a trial, and judged."""
    if not path.is_file():
        return False
    kept = json.loads(path.read_text(encoding="utf-8"))
    return result is None or (kept["evaluation"] == result["evaluation"] and bool(kept["judged"]))


def tell_replaced(path: Path, result: dict[str, Any], console: Console) -> None:
    """Say so if a file of results is about to be replaced that has another result of the trial."""
    if not path.is_file():
        return
    kept = json.loads(path.read_text(encoding="utf-8"))
    if kept["evaluation"] == result["evaluation"]:
        return
    made = kept.get("machine") or {}
    commit = (made.get("git") or {}).get("commit", "no commit")[:10]
    was, now = (each["evaluation"]["success_rate"] for each in (kept, result))
    told = f"success {was:.1%}, made at {commit} on {made.get('date', 'an unknown day')[:10]}; it is {now:.1%} now"
    console.print(f"{path} is replaced: it had {told}", soft_wrap=True)


class Judgements:
    """Success of a complete trial's policy at each preset, kept in the folder of its run as soon as it is known.

    Parameters
    ----------
    out : Path
        Folder of the runs.
    trial : Trial
    result : dict
        Result of the trial. Judgements of a policy with another one are left out.
    """

    def __init__(self, out: Path, trial: Trial, result: dict[str, Any]) -> None:
        self.trial, self.result = trial, result
        self._path = out / trial.name / "judged.json"
        kept = json.loads(self._path.read_text(encoding="utf-8")) if self._path.is_file() else {}
        is_of_this = kept.get("evaluation") == result["evaluation"]
        self.found: dict[str, dict[str, Any]] = kept["judged"] if is_of_this else {}

    @property
    def missing(self) -> list[str]:
        """Presets at which the policy has not been judged."""
        return [accuracy for accuracy in PRESETS if accuracy not in self.found]

    def keep(self, accuracy: str, numbers: dict[str, Any]) -> None:
        """Keep the numbers of a preset."""
        known = {**self.found, accuracy: numbers}
        self.found = {name: known[name] for name in PRESETS if name in known}
        write_json(self._path, {"evaluation": self.result["evaluation"], "judged": self.found})


# --- the command -----------------------------------------------------------------------------------------------------


def write_results(trials: Sequence[Trial], out: Path, results: Path, place: Place, console: Console) -> list[str]:
    """Judge complete trials and measure floors that are not yet written, on the launcher; returns errors.

    Each preset of a trial is a job of its own, and an interruption loses those that run.
    """
    done = complete(trials, out)
    left = [Judgements(out, t, done[t.name]) for t in unwritten(trials, done, results) if t.name in done]
    for each in left:
        tell_replaced(trial_file(results, each.trial), each.result, console)
    judging = {f"judge {each.trial.name} at {name}": (each, name) for each in left for name in each.missing}
    floors = {f"floors of {env}": env for env in dict.fromkeys(t.config.env for t in trials)
              if not is_written(floors_file(results, env))}  # fmt: skip
    jobs = [Job(job, partial(judge_trial, each.trial, str(out), name), "") for job, (each, name) in judging.items()]
    jobs += [Job(name, partial(measure_floors, env), "") for name, env in floors.items()]
    errors = []
    for job, found, error, _ in place.watch(jobs, console) if jobs else ():
        if found is None:
            errors.append(f"{job}: {error}")
        elif job in floors:
            write_json(floors_file(results, floors[job]), {"env": floors[job], "floors": found})
        else:
            judging[job][0].keep(judging[job][1], found)
            _write_judged(left, out, results)
    _write_judged(left, out, results)
    return errors


def unwritten(trials: Sequence[Trial], done: dict[str, dict[str, Any]], results: Path) -> list[Trial]:
    """Trials that are not complete, or whose results are not written; `done` has the results of complete ones."""
    return [t for t in trials if t.name not in done or not is_written(trial_file(results, t), done[t.name])]


def _write_judged(left: list[Judgements], out: Path, results: Path) -> None:
    """Write the results of trials that have been judged at all presets, and take these trials off the list."""
    for each in [each for each in left if not each.missing]:
        write_trial(results, each.trial, out, each.result, each.found)
        left.remove(each)


def read_results(results: Path, env_id: str) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """Read the results of an environment's trials, and its floors by name."""
    files = sorted(results.glob(f"{short_name(env_id)}-*-s*.json"))
    return [json.loads(path.read_text(encoding="utf-8")) for path in files], read_floors(results, env_id)


def read_floors(results: Path, env_id: str) -> dict[str, Any]:
    """Read an environment's floors by name; none if there is no file."""
    path = floors_file(results, env_id)
    return json.loads(path.read_text(encoding="utf-8"))["floors"] if path.is_file() else {}


def aggregate(found: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Sum up the trials of one environment and algorithm: interquartile means over seeds, with bootstrap intervals."""
    rates = [each["evaluation"]["success_rate"] for each in found]
    return {
        "seeds": len(found), "success": interquartile_mean(rates), "interval": bootstrap(rates), "lowest": min(rates),
        "steps": interquartile_mean([each["steps"] for each in found]),
        "seconds": interquartile_mean([each["training_seconds"] for each in found]),
    }  # fmt: skip


def make_table(trials: Sequence[Trial], ends: Sequence[Ended], results: Path) -> Table:
    """Table of these trials' environments: what was reached, after how long, and the floors.

    A row sums up all seeds; trials at different presets have rows of their own.
    """
    columns = number_columns("seeds", "success", "lowest", "M steps", "s", "controller", "random")
    table = Table(["environment", "by", *columns], "suite")
    found = {end.name: end.result for end in ends if end.result is not None}
    rows: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for trial in (trial for trial in trials if trial.name in found):
        preset = f" at {trial.settings['accuracy']}" if "accuracy" in trial.settings else ""
        rows.setdefault((trial.config.env, trial.config.algo + preset), []).append(found[trial.name])
    for (env_id, by), members in rows.items():
        whole, floors = aggregate(members), read_floors(results, env_id)
        rates = [f"{floors[name]['success_rate']:.1%}" if name in floors else "" for name in ("controller", "random")]
        table.add_row(
            short_name(env_id), by, str(whole["seeds"]), f"{whole['success']:.1%}", f"{whole['lowest']:.1%}",
            f"{whole['steps'] / 1e6:.2f}", f"{whole['seconds']:.0f}", *rates,
        )  # fmt: skip
    return table


def main(
    env: Annotated[list[str] | None, typer.Argument(help="Gymnasium ids; none: all that have hyperparameters.")] = None,
    seeds: Annotated[str, typer.Option(help="Numbers and ranges: 0-4 or 1,3,7.")] = "0-4",
    accuracy: Annotated[
        str | None, typer.Option(help="Presets to train at, with commas.", show_default="that of the hyperparameters")
    ] = None,
    hyperparameters: Annotated[Path, typer.Option(help="YAML file.", exists=True)] = HYPERPARAMETERS,
    out: Annotated[Path, folder_option("Folder of the runs; every worker sees it.")] = Path("suite"),
    results: Annotated[Path | None, folder_option("Folder of the files of results.", "OUT/results")] = None,
    launcher: Annotated[str, typer.Option(help=f"{', '.join(RUNNING)}.")] = "local",
    jobs: Annotated[int, typer.Option(callback=at_least(1), help="Trials at once.")] = 2,
    address: Annotated[str | None, typer.Option(help="Of a Ray cluster, or a Slurm partition (local: none).")] = None,
) -> None:
    """Train and judge agents on all environments: each policy is judged at every preset of the engine.

    The same command goes on with what was ended.
    """
    console = make_console()
    try:
        env_ids = list(env or environments_of(hyperparameters))
        grid = {} if accuracy is None else {"accuracy": parse_accuracies(accuracy)}
        trials = make_trials(env_ids, parse_seeds(seeds), grid, None, hyperparameters)
        place = Place(launcher, out.resolve(), jobs, address)
        if place.is_printed:
            told = "which runs nothing; allowed is agents.sweep with it, and then this one"
            raise ValueError(f"launcher is 'print', {told}")
        results = out / "results" if results is None else results
        make_folders(out=out, results=results)
        tell_models(unwritten(trials, complete(trials, out), results), out)
        with told_ends(console):
            ends = sweep(trials, out.resolve(), place.launch, jobs, address, console)
        with told_ends(console, "with the policies that are not judged yet"):
            errors = write_results(trials, out.resolve(), results, place, console)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    console.print(make_table(trials, ends, results))
    console.print(f"results     {results}", soft_wrap=True)
    errors += [f"{each.name}: {each.error}" for each in ends if each.result is None]
    for error in errors:
        console.print(f"Error: {error}", soft_wrap=True)
    if errors:
        raise typer.Exit(1)


if __name__ == "__main__":
    run_program(main)
