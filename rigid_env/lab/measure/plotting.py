"""Figures of every plot of the command line, and what they require."""

from __future__ import annotations

from rigid_env.extras import lacking, require

PURPOSE = "a plot"


def require_matplotlib() -> None:
    """Raise an error with the line that installs matplotlib, before a measurement.

    Raises
    ------
    gymnasium.error.DependencyNotInstalled
        matplotlib is missing.
    """
    require("plot", "matplotlib", purpose=PURPOSE)


def lacks_matplotlib() -> str:
    """Line that installs matplotlib; "" where it is installed."""
    return lacking("plot", "matplotlib", purpose=PURPOSE)


def make_figure(width: float, height: float):
    """A `matplotlib.figure.Figure` of this size [in], written without a display.

    Raises
    ------
    gymnasium.error.DependencyNotInstalled
        matplotlib is missing.
    """
    require_matplotlib()
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height), layout="constrained")
    FigureCanvasAgg(figure)
    return figure
