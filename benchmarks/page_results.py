"""Section of results of an environment's page: success of seeds, at other accuracies, and of the package's policy."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from agents.suite import JUDGED_EPISODES, aggregate
from benchmarks import machine
from benchmarks.shipped_policies import read_shipped
from physics.accuracy import PRESETS
from rigid_env.envs.pretrained import pretrained_ids

TRAINED_AT = ("fast", "precise")
"""Presets at which an agent is trained to be judged at the others, besides the default settings."""

WHY_MISSING = {
    "rigid_env/BlockPush-v0": "At `precise` two bodies in contact make a step so slow that training would take hours.",
    "rigid_env/BlockStack-v0": "At `precise` two bodies in contact make a step so slow that training would take hours.",
}
"""Reasons for agents that are missing, by environment; a page shows its reason while one is missing."""

ABOUT_ACCURACIES: dict[str, str] = {
    "rigid_env/BlockStack-v0": (
        "Seed 1 lands with sideways speed. Of its first 60 episodes it fails 12 at `precise`, all of them within 30 "
        "control steps, by moving B: A is 27 to 620 times as heavy there. At `balanced` it fails one."
    ),
}
"""Paragraphs under the table of accuracies, by environment."""

JUDGED = (
    "Success of 1,000 episodes that training has not seen, at `balanced`. Each seed has episodes of its own. One is a "
    "success if `is_success` is true at its last control step. Brackets hold Wilson's interval, 95 %."
)

AT_OTHERS = (
    f"The next table judges agents at each preset: on the first {JUDGED_EPISODES} of the 1,000 episodes of their seed, "
    "as a percentage with half the width of Wilson's interval (95 %). Agents of the table above are trained at "
    '`balanced`, but with contact problems solved to 1e-3 instead of 1e-6. Their rows are called "balanced, tolerance '
    '0.001". Other rows are agents that were trained at another preset.'
)


FROM_ELSEWHERE = " It comes from another run: on their episodes it ends otherwise than each of the agents above."


def results_of(env_id: str, found: Sequence[dict[str, Any]], floors: dict[str, Any], curve: str) -> list[str]:
    """Paragraphs and tables of the results of an environment.

    Parameters
    ----------
    env_id : str
    found : sequence of dict
        Results of its trials, as of `agents.suite.read_results`.
    floors : dict
        Evaluations of policies that are not trained, by name.
    curve : str
        Markdown of the picture of the learning curves; "" if there is none.
    """
    default = [each for each in found if each["is_default"]]
    rows = [
        (each["algo"], each["seed"], rate(each["evaluation"]), f"{each['steps'] / 1e6:.2f}",
         f"{each['training_seconds']:.0f}")
        for each in default
    ]  # fmt: skip
    rows += [(name, "", rate(floor), "", "") for name, floor in floors.items()]
    parts = [JUDGED, machine.markdown_table(["policy", "seed", "success", "M steps", "s"], rows)]
    algos = sorted({each["algo"] for each in default})
    parts += [_whole(algo, [each for each in default if each["algo"] == algo]) for algo in algos]
    parts += [_seconds(default), curve, *_accuracies(env_id, found)]
    if found:
        parts.append(f"`python -m agents.suite {env_id}` on {machine.headline(found[0]['machine'])}.")
    return [part for part in [*parts, _policy(env_id)] if part]


def rate(evaluation: dict[str, Any]) -> str:
    """Success rate of an evaluation with its interval, as a cell of a table."""
    low, high = evaluation["interval"]
    return f"{evaluation['success_rate']:.1%} ({100 * low:.1f} to {100 * high:.1f})"


def _seconds(default: Sequence[dict[str, Any]]) -> str:
    """Sentence about the machines whose seconds a table has."""
    loads = [each["machine"].get("load_average") for each in default]
    known = [load for load in loads if load is not None]
    cores = max((each["machine"]["cores"] for each in default), default=0)
    told = f", with a load average of {min(known):.1f} to {max(known):.1f} on {cores} cores" if known else ""
    return (
        "M steps: millions of control steps of training. s: seconds of training, on machines that ran other programs, "
        f"too{told}. [Performance](../performance.md) has times of BlockReach and BlockReorient on a quiet machine."
    )


def _whole(algo: str, found: Sequence[dict[str, Any]]) -> str:
    """Sentence that sums up the seeds of an algorithm."""
    if len(found) < 2:
        return f"One seed of {algo} was run: it says little about others."
    whole = aggregate(found)
    low, high = whole["interval"]
    return (
        f"Interquartile mean of {whole['seeds']} seeds of {algo}: {whole['success']:.1%} "
        f"({100 * low:.1f} to {100 * high:.1f}, bootstrap, 95 %), after {whole['seconds']:.0f} s."
    )


def _accuracies(env_id: str, found: Sequence[dict[str, Any]]) -> list[str]:
    """Table of agents judged at all presets, with sentences about it and about agents that it lacks."""
    judged = [each for each in found if each.get("judged")]
    rows = [(_trained_at(each), each["seed"], *(_short_rate(each["judged"][name]) for name in PRESETS))
            for each in judged]  # fmt: skip
    parts = [AT_OTHERS, machine.markdown_table(["trained at", "seed", *PRESETS], rows)] if rows else []
    lacking = [name for name in TRAINED_AT if name not in [each["accuracy"] for each in judged]]
    told = f"No agent was trained at {' or '.join(f'`{name}`' for name in lacking)}." if lacking else ""
    left = [str(each["seed"]) for each in found if each["is_default"] and not each.get("judged")]
    if left and not rows:
        told = "No agent has been judged at other presets."
    elif left:
        told += f" Not judged at other presets: seed {', '.join(left)}."
    why = WHY_MISSING.get(env_id, "") if told else ""
    return [*parts, f"{told} {why}".strip(), ABOUT_ACCURACIES.get(env_id, "") if rows else ""]


def _trained_at(result: dict[str, Any]) -> str:
    """Accuracy of a trial's training, as a cell of a table."""
    value = result["accuracy"]
    if isinstance(value, str):
        return value
    own = {"preset": "balanced", **value}
    return ", ".join([own.pop("preset"), *(f"{name} {number:g}" for name, number in own.items())])


def _short_rate(evaluation: dict[str, Any]) -> str:
    """Success rate with half the width of its interval, as a narrow cell."""
    low, high = evaluation["interval"]
    return f"{100 * evaluation['success_rate']:.1f} ± {50 * (high - low):.1f}"


def _policy(env_id: str) -> str:
    """Sentences about the policy that comes with the package; none if there is none."""
    if env_id not in pretrained_ids():
        return ""
    told = f"A trained policy comes with the package: `rigid-env play {env_id}`."
    row = read_shipped().get(env_id)
    if row is None:
        return told
    own = f" It is that of {row['algo']}, seed {row['seed']}." if row["seed"] is not None else FROM_ELSEWHERE
    evaluation = row["evaluation"]
    return (
        f"{told}{own} It solves {rate(evaluation)} of {evaluation['episodes']:,} further episodes, on which no agent "
        "above was judged (`python -m benchmarks.shipped_policies`)."
    )
