"""Judge the trained policies that come with the package: ``python -m benchmarks.shipped_policies [ENV ...]``.

Each is the policy of one seed of `agents.suite`. It is found by its episodes: on those on which that seed was judged,
the policy ends in the same successes, length and return. Then it is judged on episodes that no seed was judged on,
since the best of several seeds flatters itself on its own. The pages of the environments tell both.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from math import isclose
from pathlib import Path
from typing import Annotated, Any

import typer

from agents.evaluate import evaluate
from agents.suite import RESULTS, read_results, short_name
from benchmarks import machine
from rigid_env.envs.policy_files import load_policy
from rigid_env.envs.pretrained import pretrained_ids
from rigid_env.lab.measure.machine import write_json
from rigid_env.terminal import Table, make_console, number_columns, run_program

FILE = machine.RESULTS / "shipped_policies.json"
FRESH = 7  # seed of a set of episodes of its own, beyond the seeds of the suite
EPISODES = 1000
OF_ENVIRONMENTS = ("accuracy", "reward")  # arguments of an evaluation


def is_same(ours: dict[str, Any], told: dict[str, Any]) -> bool:
    """Tell whether two evaluations of the same episodes end in the same successes, length and return.

    Torch and NumPy sum a layer in different orders, which changes returns by rounding alone.
    """
    is_near = isclose(ours["return_mean"], told["return_mean"], rel_tol=1e-3)
    return is_near and all(ours[key] == told[key] for key in ("successes", "length_mean"))


def is_near(ours: dict[str, Any], told: dict[str, Any]) -> bool:
    """Tell whether two evaluations of the same episodes may be of one policy on two processors.

    Where a rounding decides between two motions, a few episodes differ: the success by at most 0.5 % of all, and mean
    length and return by 0.5 % of themselves.
    """
    has_same_means = all(isclose(ours[key], told[key], rel_tol=5e-3) for key in ("length_mean", "return_mean"))
    return has_same_means and abs(ours["successes"] - told["successes"]) <= 5e-3 * told["episodes"]


def find_seed(env_id: str, found: Sequence[dict[str, Any]]) -> dict[str, Any] | None:
    """Result, among an environment's default ones, of the agent that comes with the package; None: not certain.

    That is the one whose episodes the policy repeats, or else the only one whose evaluation is near.

    Parameters
    ----------
    env_id : str
    found : sequence of dict
        Results as of `agents.suite.read_results`; those of the best agents are tried first.
    """
    policy, near = load_policy(env_id), []
    for each in sorted(found, key=lambda each: -each["evaluation"]["success_rate"]):
        told = (each.get("judged") or {}).get("balanced") or each["evaluation"]  # the first of the same episodes
        arguments = {name: told[name] for name in OF_ENVIRONMENTS if name in told}
        if not each["is_default"]:
            continue
        ours = evaluate(env_id, policy, told["episodes"], told["seed"], **arguments)
        if is_same(ours, told):
            return each
        near += [each] if is_near(ours, told) else []
    return near[0] if len(near) == 1 else None


def judge(env_id: str, results: Path) -> dict[str, Any]:
    """Judge the policy of an environment: its algorithm and seed (None: unknown), and its success on fresh episodes."""
    found, _ = read_results(results, env_id)
    own = find_seed(env_id, found) or {"algo": None, "seed": None}
    evaluation = evaluate(env_id, load_policy(env_id), EPISODES, FRESH, accuracy="balanced")
    return {"env": env_id, "algo": own["algo"], "seed": own["seed"], "evaluation": evaluation}


def read_shipped(file: Path = FILE) -> dict[str, dict[str, Any]]:
    """Read what `judge` has found, by id of the environment; empty without the file."""
    rows = json.loads(file.read_text(encoding="utf-8"))["rows"] if file.is_file() else []
    return {row["env"]: row for row in rows}


def main(
    env: Annotated[list[str] | None, typer.Argument(help="Gymnasium ids; none: all with a policy.")] = None,
    results: Annotated[Path, typer.Option(help="Folder of the files of `agents.suite`.")] = RESULTS,
    file: Annotated[Path, typer.Option(help="File of results.")] = FILE,
) -> None:
    """Judge the trained policies that come with the package; rows of other environments are kept."""
    console, rows = make_console(), read_shipped(file)
    table = Table(["environment", "by", *number_columns("seed", "success")], "policies of the package")
    for env_id in env or pretrained_ids():
        row = rows[env_id] = judge(env_id, results)
        kept = [rows[name] for name in sorted(rows)]
        write_json(file, {"name": "shipped policies", "episodes": EPISODES, "rows": kept})
        rate = f"{row['evaluation']['success_rate']:.1%}"
        table.add_row(short_name(env_id), str(row["algo"]), str(row["seed"]), rate)
    console.print(table)


if __name__ == "__main__":
    run_program(main)
