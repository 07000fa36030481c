"""Plot of the report on tosses (with matplotlib, in the extra ``agents``)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from physics.work_precision.frontier_plot import add_legend
from rigid_env.lab.measure.plotting import make_figure
from rigid_env.lab.tosses.report import Report

SIZE = (10.0, 7.0)  # [in]
DPI = 120


def write_plot(path: Path, report: Report) -> None:
    """Draw a report into a file: four panels, position on the left and rotation on the right.

    The upper panels show error against computing time at each accuracy, the lower ones error along the toss.
    """
    figure = make_figure(*SIZE)
    axes = figure.subplots(2, 2)
    for column, (name, unit) in enumerate((("position", "cube widths"), ("rotation", "deg"))):
        _draw_ladder(axes[0, column], report, name, unit)
        _draw_along(axes[1, column], report, name, unit)
    add_legend(figure, [axes[0, 0]])
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=DPI)


def _draw_ladder(axes, report: Report, name: str, unit: str) -> None:
    times = [rung.us for rung in report.ladder]
    errors = [getattr(rung.rest, f"{name}_mean") for rung in report.ladder]
    axes.axhline(
        min(errors), color="tab:red", linestyle="--", linewidth=1.0, label="model error: finer steps do not help"
    )
    axes.axhline(
        getattr(report.limits.noise, f"{name}_mean"), color="0.5", linestyle=":", label="noise of the first frame"
    )
    axes.plot(times, errors, "o", label="mean over the tosses not fitted")
    for k, (rung, us, error) in enumerate(zip(report.ladder, times, errors)):
        place = (0, 7 if k % 2 else -14)  # alternately above and below the points, since neighbours may be close
        axes.annotate(rung.accuracy, (us, error), xytext=place, textcoords="offset points", ha="center", fontsize=8)
    axes.set_xscale("log")
    axes.set_xlim(min(times) / 2.0, max(times) * 2.0)
    axes.set_ylim(0.0, 1.25 * max(errors))
    axes.set_xlabel("wall-clock time per simulated second [µs]")
    axes.set_ylabel(f"{name} error [{unit}]")


def _draw_along(axes, report: Report, name: str, unit: str) -> None:
    values = getattr(report.limits, f"along_{name}")
    share = (np.arange(len(values)) + 0.5) / len(values)
    axes.plot(100.0 * share, values, "-")
    axes.set_xlim(0.0, 100.0)
    axes.set_ylim(0.0, None)
    axes.set_xlabel("part of the toss that is over [%]")
    axes.set_ylabel(f"{name} error [{unit}]")
