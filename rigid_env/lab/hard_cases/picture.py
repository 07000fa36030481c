"""Picture of the outcomes of hard cases."""

from __future__ import annotations

from pathlib import Path

from rigid_env.lab.hard_cases.report import Report
from rigid_env.lab.hard_cases.run import Outcome, Status
from rigid_env.lab.measure.plotting import make_figure


def write_picture(path: Path, report: Report) -> None:
    """Draw a square for each case and setting: green by its margin if the case holds, red if it fails.

    Raises
    ------
    gymnasium.error.DependencyNotInstalled
        matplotlib is missing.
    """
    columns = list(dict.fromkeys((one.accuracy, one.dt) for one in report.ours))
    cases = list(dict.fromkeys((one.case.number, one.case.name) for one in report.ours))
    figure = make_figure(3.2 + 0.42 * len(columns), 1.6 + 0.22 * len(cases))
    axes = figure.subplots()
    for one in report.ours:
        x, y = columns.index((one.accuracy, one.dt)), cases.index((one.case.number, one.case.name))
        axes.add_patch(_square(x, y, one))
    axes.set_xlim(-0.5, len(columns) - 0.5)
    axes.set_ylim(len(cases) - 0.5, -0.5)
    axes.set_yticks(range(len(cases)), [f"{number} {name}" for number, name in cases], fontsize=7)
    axes.set_xticks(range(len(columns)), [f"{a} {1e3 * dt:g} ms" for a, dt in columns], fontsize=7, rotation=90)
    axes.set_title("green: holds (pale: little margin)   red: fails   grey: not supported", fontsize=8)
    axes.tick_params(length=0)
    for side in axes.spines.values():
        side.set_visible(False)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=130)


def _square(x: int, y: int, outcome: Outcome):
    from matplotlib.patches import Rectangle

    if outcome.status is Status.HOLDS:
        colour = (0.0, 0.5, 0.3, 0.25 + 0.75 * min(1.0, max(0.0, outcome.tightest.margin)))
    else:
        colour = "#c0392b" if outcome.status is Status.FAILS else "#d9d9d9"
    return Rectangle((x - 0.45, y - 0.42), 0.9, 0.84, facecolor=colour, edgecolor="none")
