"""Figures for the plots of the command line, and the check that matplotlib is installed."""

from __future__ import annotations

from rigid_env.extras import lacking, require

PURPOSE = "a plot"


def require_matplotlib() -> None:
    """Raise an error with the command that installs matplotlib, if it is missing; called before a measurement.

    Raises
    ------
    gymnasium.error.DependencyNotInstalled
        matplotlib is missing.
    """
    require("plot", "matplotlib", purpose=PURPOSE)


def lacks_matplotlib() -> str:
    """Message with the command that installs matplotlib; "" if it is installed."""
    return lacking("plot", "matplotlib", purpose=PURPOSE)


def make_figure(width: float, height: float):
    """Make a `matplotlib.figure.Figure` of this size [in], which needs no display.

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
