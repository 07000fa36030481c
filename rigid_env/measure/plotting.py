"""What every plot of the command line needs."""

from __future__ import annotations

from importlib.util import find_spec

from gymnasium.error import DependencyNotInstalled


def require_matplotlib() -> None:
    """Say what to install, before anything is measured.

    Raises
    ------
    gymnasium.error.DependencyNotInstalled
        matplotlib is missing.
    """
    if find_spec("matplotlib") is None:
        raise DependencyNotInstalled('a plot needs matplotlib: pip install "rigid-env[agents]"')
