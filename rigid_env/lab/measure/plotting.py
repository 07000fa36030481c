"""Requirements of every plot of the command line."""

from __future__ import annotations

from rigid_env.extras import lacking, require

PURPOSE = "a plot"


def require_matplotlib() -> None:
    """Say what to install, before anything is measured.

    Raises
    ------
    gymnasium.error.DependencyNotInstalled
        matplotlib is missing.
    """
    require("plot", "matplotlib", purpose=PURPOSE)


def lacks_matplotlib() -> str:
    """The same message; "" where matplotlib is installed."""
    return lacking("plot", "matplotlib", purpose=PURPOSE)
