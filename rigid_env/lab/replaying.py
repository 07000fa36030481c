"""Command ``rigid-env replay``: repeats the steps of a recording, and prints whether they are the same."""

from __future__ import annotations

import numpy as np
from rich.console import Console

from physics import Replay, Status
from physics.io.recording import origin
from rigid_env.terminal import Table, number_columns, say

# Most rows of the table. For a longer recording it shows the last steps, which led to the fault that was recorded.
LAST_ROWS = 20


def summary(replay: Replay) -> dict:
    """Numbers of a replay as a dict for JSON."""
    recording, first = replay.recording, replay.first_difference
    return {
        "reason": recording.reason,
        "bodies": len(recording.scene.bodies),
        "steps": len(recording),
        "is_identical": replay.is_identical,
        "first_difference": first,
        "tolerance": replay.tolerance,
        "largest_distance": float(replay.distances.max(initial=0.0)),
        "recorded_with": recording.origin,
        "replayed_with": origin(),
        "rows": [_row(replay, k) for k in range(len(recording))],
    }


def _row(replay: Replay, k: int) -> dict:
    report, recording = replay.reports[k], replay.recording
    return {
        "t": float(replay.times[k]),
        "steps": int(recording.steps[k]),
        "status": Status(int(report.status[0])).name,
        "penetration": float(report.penetration[0]),
        "residual": float(report.residual[0]),
        "impacts": int(report.impacts[0]),
        "energy": float(replay.energies[k]),
        "is_identical": bool(np.array_equal(replay.states[k], recording.states[k], equal_nan=True)),
    }


def show(content: dict, console: Console) -> None:
    """Print a replay from its `summary`."""
    say(console, "kept", content["reason"])
    say(console, "scene", f"{content['bodies']} bodies, {content['steps']} steps")
    rows, shown = content["rows"], _shown(content["rows"])
    if len(shown) < len(rows):
        say(console, "table", f"the last {LAST_ROWS} steps, and those that went wrong; all with --json")
    console.print(make_table(rows, shown))
    say(console, "replayed", _verdict(content))


def make_table(rows: list[dict], shown: list[int]) -> Table:
    """Table of those rows of a `summary` whose indices are in `shown`."""
    names = "step", "t [s]", "status", "depth [m]", "residual", "impacts", "energy [J]", "same bits"
    table = Table(number_columns(*names))
    for k in shown:
        row = rows[k]
        table.add_row(
            str(k), f"{row['t']:.6g}", row["status"], f"{row['penetration']:.3g}", f"{row['residual']:.3g}",
            str(row["impacts"]), f"{row['energy']:.9g}", "yes" if row["is_identical"] else "no",
        )  # fmt: skip
    return table


def _shown(rows: list[dict]) -> list[int]:
    """Indices of the rows that the table shows: the last ones, and those with a problem."""
    last = len(rows) - LAST_ROWS
    return [k for k, row in enumerate(rows) if k >= last or row["status"] not in ("OK", "UNCONVERGED")]


def _verdict(content: dict) -> str:
    """Text of the outcome of a replay."""
    if content["is_identical"]:
        return "bit for bit as recorded"
    ours, theirs = content["replayed_with"], content["recorded_with"]
    compilers = f"recorded by compiler {theirs['compiler']}, replayed by {ours['compiler']}"
    if content["first_difference"] is None:
        return f"as recorded, within {content['tolerance']:g} ({compilers}, which rounds differently)"
    other = ", ".join(f"{key} {theirs.get(key)} then, {ours[key]} now" for key in ours if ours[key] != theirs.get(key))
    cause = other or "all versions are the same: please report this"
    return f"differs from step {content['first_difference']} on, by up to {content['largest_distance']:.3g} m ({cause})"
