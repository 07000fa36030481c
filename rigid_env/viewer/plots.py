"""Plots beside the picture: energy, momentum, penetration, residual, distance from the reference, computing cost."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from rigid_env.viewer.history import Samples

POINTS = 400
"""Most points of a line; longer runs are thinned."""

SMALLEST = 1e-16
"""Number that replaces smaller ones before a logarithm."""

LEAST = 2
"""Fewest samples for which a line is drawn."""

FONT = "11px sans-serif"

COLOURS = ("#1c7ed6", "#e8590c", "#2b8a3e")


@dataclass(frozen=True)
class Plot:
    """Description of one plot over time.

    Parameters
    ----------
    title : str
        Title with the unit.
    columns : tuple of str
        Columns of `Samples`, one line each.
    factor : float
        Factor from the unit of the columns to the unit of the title; the page shows numbers with at most three
        decimals.
    is_log : bool
        True: the axis is logarithmic, for numbers within a few decades.
    is_power : bool
        True: the axis is linear and shows log₁₀ of the numbers, for many decades.
    """

    title: str
    columns: tuple[str, ...]
    factor: float = 1.0
    is_log: bool = False
    is_power: bool = False


PLOTS = (
    Plot("energy [J]", ("energy", "kinetic_energy", "potential_energy")),
    Plot("momentum [kg m/s]", ("momentum",)),
    Plot("penetration [µm]", ("penetration",), factor=1e6),
    Plot("log₁₀ residual", ("residual",), is_power=True),
    Plot("log₁₀ distance to reference [m]", ("error", "error_of_reference"), is_power=True),
    Plot("cost [µs/s]", ("cost", "cost_of_reference"), is_log=True),
)


class Plots:
    """All plots of `PLOTS` for which there are enough samples.

    Parameters
    ----------
    gui : viser.GuiApi
    folder : viser.GuiFolderHandle
        Folder of the page that holds the plots.
    """

    def __init__(self, gui, folder):
        self._gui, self._folder = gui, folder
        self._handles: dict[Plot, tuple[tuple[str, ...], Any]] = {}
        self._shown: tuple[int, float] = (0, 0.0)

    def show(self, samples: Samples) -> None:
        """Draw the samples; nothing is sent to the page if there are no new ones."""
        state = len(samples), float(samples.time[-1]) if len(samples) else 0.0
        if self._shown == state:
            return
        self._shown = state
        every = thinned(len(samples), POINTS)
        for plot in PLOTS:
            self._draw(plot, *drawn(plot, samples, every))

    def _draw(self, plot: Plot, columns: tuple[str, ...], data: tuple[np.ndarray, ...]) -> None:
        """Set the data of a plot; the plot is made anew if the set of its known columns has changed."""
        before, handle = self._handles.get(plot, ((), None))
        if columns == before:
            if columns:
                handle.data = data
            return
        if handle is not None:
            handle.remove()
        with self._folder:
            self._handles[plot] = columns, _add(self._gui, plot, columns, data) if columns else None


def drawn(plot: Plot, samples: Samples, every: np.ndarray) -> tuple[tuple[str, ...], tuple[np.ndarray, ...]]:
    """Columns of a plot that have enough finite samples, and its data: times [s] and a line of values for each column.

    `every` has the indices of the samples to draw. Times start where the first column is finite, since a line that
    begins with NaN hides the whole plot on a linear axis.
    """
    lines = {name: line(getattr(samples, name)[every], plot) for name in plot.columns}
    known = {name: np.isfinite(values) for name, values in lines.items()}
    columns = tuple(name for name in plot.columns if known[name].sum() >= LEAST)
    if not columns:
        return (), ()
    rows = known[columns[0]]
    return columns, (samples.time[every][rows], *(lines[name][rows] for name in columns))


def thinned(count: int, most: int) -> np.ndarray:
    """Indices of at most `most` of `count` samples, evenly spread, with the last sample among them."""
    if count <= most:
        return np.arange(count)
    return np.unique(np.linspace(0, count - 1, most).round().astype(np.int64))


def line(values: np.ndarray, plot: Plot) -> np.ndarray:
    """Values (n,) float64 as they are drawn in a plot: in its unit, and as log₁₀ if `Plot.is_power`."""
    values = plot.factor * values
    return np.log10(np.maximum(values, SMALLEST)) if plot.is_power else values


def _add(gui, plot: Plot, columns: tuple[str, ...], data: tuple[np.ndarray, ...]):
    from viser import uplot

    colours = dict(zip(plot.columns, COLOURS))
    lines = [uplot.Series(label=name.replace("_", " "), stroke=colours[name], width=1.5) for name in columns]
    scales = {"x": uplot.Scale(time=False), "y": uplot.Scale(distr=3 if plot.is_log else 1)}
    upright = uplot.Axis(font=FONT, size=56, ticks={"show": False}, grid={"show": not plot.is_log})
    return gui.add_uplot(
        data, (uplot.Series(label="time [s]"), *lines), title=plot.title, scales=scales,
        axes=(uplot.Axis(font=FONT), upright), aspect=1.6, padding=(10, 16, 0, 0), order=PLOTS.index(plot),
    )  # fmt: skip
