"""Requirements of every plot of the command line."""

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
