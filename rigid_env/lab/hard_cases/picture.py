"""Picture of the outcomes of hard cases."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rigid_env.lab.hard_cases.run import Outcome, Status
from rigid_env.lab.hard_cases.show import grid
from rigid_env.lab.measure.plotting import make_figure

RED, GREY, NOTHING = (0.75, 0.22, 0.17, 1.0), (0.85, 0.85, 0.85, 1.0), (1.0, 1.0, 1.0, 0.0)


def write_picture(path: Path, outcomes: Sequence[Outcome]) -> None:
    """Draw a square for each case and setting: green by its margin if the case holds, red if it fails.

    Raises
    ------
    gymnasium.error.DependencyNotInstalled
        matplotlib is missing.
    """
    settings, rows = grid(outcomes)
    figure = make_figure(3.2 + 0.42 * len(settings), 1.6 + 0.22 * len(rows))
    axes = figure.subplots()
    axes.pcolormesh([[_colour(one) for one in row] for _, row in rows], edgecolors="white", linewidth=4)
    axes.invert_yaxis()
    middles = [k + 0.5 for k in range(max(len(rows), len(settings)))]
    axes.set_yticks(middles[: len(rows)], [f"{case.number} {case.name}" for case, _ in rows], fontsize=7)
    names = [f"{accuracy} {1e3 * dt:g} ms" for accuracy, dt in settings]
    axes.set_xticks(middles[: len(settings)], names, fontsize=7, rotation=90)
    axes.set_title("green: holds (pale: little margin)   red: fails   grey: not supported", fontsize=8)
    axes.tick_params(length=0)
    for side in axes.spines.values():
        side.set_visible(False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=130)


def _colour(outcome: Outcome | None) -> tuple[float, ...]:
    """Colour of an outcome (red, green, blue, opacity)."""
    if outcome is None:
        return NOTHING
    if outcome.status is Status.HOLDS:
        return (0.0, 0.5, 0.3, 0.25 + 0.75 * outcome.tightest.margin)
    return RED if outcome.status is Status.FAILS else GREY
