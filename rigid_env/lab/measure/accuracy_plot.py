"""Plot of error against computing time: one panel per scene, both axes logarithmic."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from physics.work_precision.frontier_plot import add_legend, draw_panel, make_figure, styles_of
from rigid_env.lab.measure.accuracy import Found
from rigid_env.lab.measure.plotting import require_matplotlib

COLUMNS = 3


def write_plot(results: Sequence[Found], path: str | Path, has_goals: bool = False) -> None:
    """Draw measurements into a file whose ending gives the format (png, svg, pdf).

    `has_goals` also draws the goals of this project.

    Raises
    ------
    ValueError
        There is no result, or matplotlib does not know the format.
    gymnasium.error.DependencyNotInstalled
        matplotlib is missing.
    """
    require_matplotlib()
    if not results:
        raise ValueError("results is empty; allowed is at least one scene")
    columns = min(COLUMNS, len(results))
    figure, panels = make_figure(math.ceil(len(results) / columns), columns)
    styles = styles_of([found.frontier for found in results])
    for panel, found in zip(panels, results):
        goals = found.job.goals if has_goals else ()
        draw_panel(panel, found.frontier, styles, found.job.key, found.job.what, goals)
    for panel in panels[len(results) :]:
        panel.set_axis_off()
    add_legend(figure, panels[: len(results)])
    Path(path).parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path)
