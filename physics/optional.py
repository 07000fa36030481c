"""Packages that are imported only when a call needs them."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType

# Name of a package as people write it, and the line that installs it.
INSTALLED_BY = {
    "matplotlib": ("matplotlib", 'pip install "rigid-env[plot]"'),
    "mujoco": ("MuJoCo", "pip install mujoco"),
    "pandas": ("pandas", "pip install pandas"),
}


def load_optional(module: str, purpose: str) -> ModuleType:
    """Import a module of an optional package.

    Parameters
    ----------
    module : str
        Such as ``pandas`` or ``matplotlib.figure``.
    purpose : str
        The subject of the message: "a plot".

    Raises
    ------
    ModuleNotFoundError
        The package is not installed: names it, and the line that installs it.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError:
        package = module.partition(".")[0]
        name, line = INSTALLED_BY[package]
        raise ModuleNotFoundError(f"{purpose} needs {name}, which is not installed: {line}", name=package) from None


def find_optional(module: str) -> ModuleType | None:
    """Module of an optional package, or None where the package is not installed."""
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        if error.name != module.partition(".")[0]:  # it is installed, and lacks another one
            raise
        return None
