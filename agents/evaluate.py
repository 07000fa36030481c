"""Success rate of a trained agent or a baseline: ``python -m agents.evaluate RUN_DIR``.

Each of a fixed set of seeds gets exactly one episode, which is run to its end. Counting the episodes that end first
would favour short ones, which are successes.
"""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from gymnasium.vector import AutoresetMode
from rich.console import Console

from agents.baselines import Policy, baseline_policy
from agents.checkpoint import load_policy
from agents.config import RunFolder
from agents.environments import make_vector_env
from agents.interval import wilson
from agents.options import AccuracyOption, BaselineOption, EnvOption, JsonOption, RunArgument, SeedOption, write_json
from rigid_env.terminal import Column, Table, make_console, run_program

BATCH = 500  # episodes at a time

FIRST_SEED = 1_000_000_000  # far from the seeds of training, which start at the seed of the run
SEED_STRIDE = 1_000_000  # difference of the first seeds of two evaluations


@dataclass(frozen=True)
class Episodes:
    """Outcomes of n episodes.

    Parameters
    ----------
    success : (n,) bool
    returns : (n,) float64
        Sum of the rewards of each episode.
    lengths : (n,) int64
        Control steps of each episode.
    """

    success: np.ndarray
    returns: np.ndarray
    lengths: np.ndarray

    def summary(self) -> dict[str, Any]:
        """Numbers about the outcomes, as a dict for a table or JSON."""
        successes, count = int(self.success.sum()), len(self.success)
        low, high = wilson(successes, count)
        return {
            "episodes": count,
            "successes": successes,
            "success_rate": successes / count,
            "interval": [low, high],
            "interval_is": "Wilson score, 95 %",
            "return_mean": float(self.returns.mean()),
            "return_std": float(self.returns.std()),
            "length_mean": float(self.lengths.mean()),
            "length_max": int(self.lengths.max()),
        }


def evaluation_seeds(seed: int, count: int) -> range:
    """Seeds of the `count` episodes of an evaluation; other values of `seed`, and training, have other seeds."""
    first = FIRST_SEED + SEED_STRIDE * seed
    return range(first, first + count)


def run_episodes(env: str, policy: Policy, seeds: range, threads: int = 2, **arguments: Any) -> Episodes:
    """Run one episode for each seed, from its reset to its end.

    Parameters
    ----------
    env : str
        Gymnasium id.
    policy : callable
        Function from observations (n, entries) to actions (n, 6).
    seeds : sequence of int
    threads : int
        Threads of the engine.
    **arguments
        Arguments of the environment.

    Returns
    -------
    Episodes
        In the order of the seeds.
    """
    parts = []
    for first in range(0, len(seeds), BATCH):
        batch = list(seeds[first : first + BATCH])
        vector_env = make_vector_env(
            env, len(batch), autoreset_mode=AutoresetMode.SAME_STEP, threads=threads, **arguments
        )
        parts.append(_first_episodes(vector_env, policy, batch))
        vector_env.close()
    return Episodes(*(np.concatenate([getattr(part, name) for part in parts]) for name in vars(parts[0])))


def _first_episodes(vector_env, policy: Policy, seeds: list[int]) -> Episodes:
    """Run a batch until the first episode of every world has ended; later episodes are not counted."""
    count = len(seeds)
    success, is_running = np.zeros(count, dtype=bool), np.ones(count, dtype=bool)
    returns, lengths = np.zeros(count), np.zeros(count, dtype=np.int64)
    observations, _ = vector_env.reset(seed=seeds)
    while is_running.any():
        observations, rewards, terminations, truncations, infos = vector_env.step(policy(observations))
        returns += np.where(is_running, rewards, 0.0)
        lengths += is_running
        ended = is_running & (terminations | truncations)
        if ended.any():
            success[ended] = infos["final_info"]["is_success"][ended]
            is_running &= ~ended
    return Episodes(success, returns, lengths)


def evaluate(env: str, policy: Policy, episodes: int, seed: int, **arguments: Any) -> dict[str, Any]:
    """Evaluate a policy on fresh episodes with fixed seeds.

    Parameters
    ----------
    env : str
        Gymnasium id.
    policy : callable
        Function from observations (n, entries) to actions (n, 6).
    episodes : int
    seed : int
        Seed of the set of episodes; every policy gets the same set.
    **arguments
        Arguments of the environment.

    Returns
    -------
    dict
        Summary of the episodes, with environment, arguments and seed.

    Raises
    ------
    ValueError
        If `episodes` is not from 1 to `SEED_STRIDE`.
    """
    if not 1 <= episodes <= SEED_STRIDE:
        raise ValueError(f"episodes is {episodes}; allowed is 1 to {SEED_STRIDE}")
    start = time.perf_counter()
    done = run_episodes(env, policy, evaluation_seeds(seed, episodes), **arguments)
    seconds = time.perf_counter() - start
    return {"env": env, **arguments, "seed": seed, **done.summary(), "seconds": round(seconds, 3)}


def make_table(result: dict[str, Any], title: str) -> Table:
    """Table of an evaluation."""
    low, high = result["interval"]
    table = Table([Column("quantity", is_whole=True), "value"], title)
    table.add_row("environment", result["env"])
    if "accuracy" in result:
        table.add_row("accuracy", str(result["accuracy"]))
    table.add_row("episodes", f"{result['episodes']} (seed {result['seed']})")
    table.add_row("success rate", f"{result['success_rate']:.1%}  ({low:.1%} to {high:.1%}, 95 %)")
    table.add_row("return", f"{result['return_mean']:.3f} ± {result['return_std']:.3f}")
    table.add_row("length", f"{result['length_mean']:.1f} steps, at most {result['length_max']}")
    table.add_row("time", f"{result['seconds']:.1f} s")
    return table


def print_evaluation(result: dict[str, Any], title: str, console: Console) -> None:
    """Print an evaluation as a table."""
    console.print(make_table(result, title))


@dataclass(frozen=True)
class Subject:
    """Policy to be evaluated or recorded, with its environment and the environment's arguments."""

    title: str
    policy: Policy
    env: str
    arguments: dict[str, Any]


def choose_subject(run: Path | None, baseline: str | None, env: str, seed: int, accuracy: str | None) -> Subject:
    """Choose the subject of a command: the policy of a run, or a baseline.

    Raises
    ------
    ValueError
        If both or none are given, or a run or baseline does not exist.
    """
    if (run is None) == (baseline is None):
        raise ValueError("allowed is either the folder of a run or --baseline")
    chosen = {} if accuracy is None else {"accuracy": accuracy}
    if run is None:
        policy = baseline_policy(baseline, env, seed)
        return Subject(f"baseline {baseline}", policy, env, {"accuracy": "balanced", **chosen})
    config, policy = load_policy(RunFolder(run))
    return Subject(str(run), policy, config.env, {**config.evaluation_arguments, **chosen})


def main(
    run: RunArgument = None,
    baseline: BaselineOption = None,
    env: EnvOption = "rigid_env/BlockReach-v0",
    episodes: Annotated[int, typer.Option(help="How many, each with its own seed.")] = 1000,
    seed: SeedOption = 0,
    accuracy: AccuracyOption = None,
    json_file: JsonOption = None,
) -> None:
    """Success rate, with its confidence interval, of a trained agent or a baseline on fresh episodes."""
    try:
        subject = choose_subject(run, baseline, env, seed, accuracy)
        result = evaluate(subject.env, subject.policy, episodes, seed, **subject.arguments)
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    print_evaluation(result, subject.title, make_console())
    if json_file is not None:
        write_json(json_file, {"policy": subject.title, **result})


if __name__ == "__main__":
    run_program(main)
