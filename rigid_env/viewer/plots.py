"""Plots beside the picture: energy, momentum, penetration, residual, and what accuracy costs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rigid_env.viewer.samples import UNITS, Samples

POINTS = 400
"""Points of a line at most: longer runs are thinned."""

SMALLEST = 1e-16
"""Stands in for zero on a logarithmic axis."""

COLOURS = ("#1c7ed6", "#e8590c", "#2b8a3e")


@dataclass(frozen=True)
class Plot:
    """One plot.

    Parameters
    ----------
    title : str
    columns : tuple of str
        Of `Samples`.
    is_log : bool
    """

    title: str
    columns: tuple[str, ...]
    is_log: bool = False


PLOTS = (
    Plot("energy", ("energy", "kinetic_energy", "potential_energy")),
    Plot("momentum", ("momentum",)),
    Plot("penetration", ("penetration",)),
    Plot("residual", ("residual",), is_log=True),
    Plot("error against reference", ("error", "error_of_reference"), is_log=True),
    Plot("cost", ("cost", "cost_of_reference"), is_log=True),
)


class Plots:
    """All plots of `PLOTS`, brought up to date together.

    Parameters
    ----------
    gui : viser.GuiApi
    """

    def __init__(self, gui):
        self._handles = [_add(gui, plot) for plot in PLOTS]
        self._shown: tuple[int, float] = (0, 0.0)

    def show(self, samples: Samples) -> None:
        """Draw the samples; nothing is sent where there are no new ones."""
        if not len(samples) or self._shown == (len(samples), float(samples.time[-1])):
            return
        self._shown = len(samples), float(samples.time[-1])
        every = thinned(len(samples), POINTS)
        time = samples.time[every]
        for plot, handle in zip(PLOTS, self._handles):
            lines = [line(getattr(samples, name)[every], plot.is_log) for name in plot.columns]
            is_there = any(np.isfinite(values).any() for values in lines)
            if handle.visible != is_there:
                handle.visible = is_there
            if is_there:
                handle.data = (time.copy(), *lines)


def thinned(count: int, most: int) -> np.ndarray:
    """Indices of at most `most` of `count` samples, evenly spread, the last one among them."""
    if count <= most:
        return np.arange(count)
    return np.unique(np.linspace(0, count - 1, most).round().astype(np.int64))


def line(values: np.ndarray, is_log: bool) -> np.ndarray:
    """(n,) float64 to draw; on a logarithmic axis what is zero stands at the bottom."""
    return np.where(values < SMALLEST, SMALLEST, values) if is_log else values.copy()


def _add(gui, plot: Plot):
    from viser import uplot

    lines = [
        uplot.Series(label=name.replace("_", " "), stroke=colour, width=1.5)
        for name, colour in zip(plot.columns, COLOURS)
    ]
    unit = UNITS[plot.columns[0]]
    scales = {"x": uplot.Scale(time=False), "y": uplot.Scale(distr=3 if plot.is_log else 1)}
    axes = (uplot.Axis(label="time [s]"), uplot.Axis(label=f"{plot.title} [{unit}]", size=64))
    nothing = tuple(np.zeros(0) for _ in range(1 + len(lines)))
    return gui.add_uplot(
        nothing, (uplot.Series(label="time [s]"), *lines), scales=scales, axes=axes, aspect=1.6, visible=False
    )
