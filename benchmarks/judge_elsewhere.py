"""Policies judged in another engine: ``python -m benchmarks.judge_elsewhere [--env ID]... [--policy ID=FILE]...``.

A policy acts in the episodes of an environment and of its MuJoCo twin (`benchmarks.twins`): the same starts, goals,
observations and success, another engine. The table shows the success that is lost. The first row of an environment is
its handwritten controller, which needs no training; then come policies, files of `rigid_env.load_policy`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

import rigid_env
from agents.baselines import baseline_policy
from agents.evaluate import evaluation_seeds, run_episodes
from benchmarks import machine
from benchmarks.twins import ORIGINALS, SETTINGS, twin_id
from rigid_env.lab.measure.machine import write_json
from rigid_env.terminal import Column, Table, make_console, number_columns, run_program

CONTROLLER = "controller"
EPISODES = 500
OURS = "ours"


def read_policy(name: str, env: str) -> Callable[[np.ndarray], np.ndarray]:
    """Read a policy: the controller of an environment, or a file or an id as of `rigid_env.load_policy`."""
    return baseline_policy(name, env) if name == CONTROLLER else rigid_env.load_policy(name)


def judge(env: str, name: str, episodes: int, seed: int) -> dict[str, Any]:
    """Success of one policy in our engine and in MuJoCo at each setting, over the same episodes.

    Parameters
    ----------
    env : str
        Id of an environment with a twin.
    name : str
        Policy, see `read_policy`.
    episodes, seed : int
        Number of episodes, and the seed of the set of episodes, as of `agents.evaluate`.

    Returns
    -------
    dict
        ``env``, ``policy`` (the file's name), ``judged``: by engine the numbers of `agents.evaluate.Episodes.summary`;
        and ``lost``: by setting of MuJoCo the success rate in ours less that in MuJoCo.
    """
    policy, seeds = read_policy(name, env), evaluation_seeds(seed, episodes)
    judged = {OURS: run_episodes(env, policy, seeds, threads=1, accuracy="balanced").summary()}
    for setting in SETTINGS:
        judged[setting] = run_episodes(twin_id(env), policy, seeds, threads=1, setting=setting).summary()
    ours = judged[OURS]["success_rate"]
    lost = {setting: ours - judged[setting]["success_rate"] for setting in SETTINGS}
    return {"env": env, "policy": Path(name).name, "judged": judged, "lost": lost}


def make_judged_table(rows: list[dict[str, Any]]) -> Table:
    """Table of the success rates, and of the lost percentage points."""
    heads = [text for setting in SETTINGS for text in (f"MuJoCo,\n{setting}", "lost,\npoints")]
    table = Table(
        [Column("environment", is_whole=True), Column("policy", under="environment"), *number_columns(OURS, *heads)],
        f"Success in another engine\n{machine.headline()}",
    )
    for row in rows:
        cells = [f"{row['judged'][OURS]['success_rate']:.1%}"]
        for setting in SETTINGS:
            cells += [f"{row['judged'][setting]['success_rate']:.1%}", f"{100.0 * row['lost'][setting]:+.1f}"]
        table.add_row(row["env"].rpartition("/")[2], row["policy"], *cells)
    return table


def chosen(envs: Sequence[str], policies: Sequence[str]) -> list[tuple[str, str]]:
    """Pairs of environment and policy: the controller of each environment, then its policies, given as ``ID=FILE``.

    Raises
    ------
    ValueError
        An environment without a twin, or a policy in another form or of an environment that is not in `envs`.
    """
    for env in envs:
        twin_id(env)
    given = [text.partition("=") for text in policies]
    for text, (env, _, file) in zip(policies, given):
        if env not in envs or not file:
            raise ValueError(f"policy is {text!r}; allowed is ID=FILE with one of {', '.join(envs)}")
    return [(env, name) for env in envs for name in (CONTROLLER, *(file for of, _, file in given if of == env))]


def main(
    env: Annotated[list[str] | None, typer.Option(help="Id of an environment with a twin.", show_default="all")] = None,
    policy: Annotated[
        list[str] | None, typer.Option(metavar="ID=FILE", help="Policy of an environment besides its controller.")
    ] = None,
    episodes: Annotated[int, typer.Option(min=1, help="Episodes of each evaluation.")] = EPISODES,
    seed: Annotated[int, typer.Option(min=0, help="Of the set of episodes.")] = 0,
    json_file: Annotated[Path | None, typer.Option("--json", help="Where to write the result.")] = None,
) -> None:
    """Judge policies in MuJoCo: success in our engine, in its twins, and the success that is lost."""
    console = make_console()
    try:
        rows = [judge(each, name, episodes, seed) for each, name in chosen(env or ORIGINALS, policy or ())]
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    console.print(make_judged_table(rows))
    path = json_file or machine.RESULTS / "twins.json"
    write_json(path, {"name": "twins", "episodes": episodes, "seed": seed, "settings": SETTINGS, "rows": rows})
    console.print(f"written to {path}", soft_wrap=True)


if __name__ == "__main__":
    run_program(main)
