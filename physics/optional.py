"""Import of optional packages, such as matplotlib, by the functions that need them."""

from __future__ import annotations

import re
from importlib import import_module
from types import ModuleType

# Name of a package as people write it, and the line that installs it.
INSTALLED_BY = {
    "matplotlib": ("matplotlib", 'pip install "rigid-env[plot]"'),
    "mujoco": ("MuJoCo 3.3.7 or newer", 'pip install "mujoco>=3.3.7"'),
    "pandas": ("pandas", "pip install pandas"),
}


def load_optional(module: str, purpose: str) -> ModuleType:
    """Import a module of an optional package.

    Parameters
    ----------
    module : str
        Name of the module, such as ``pandas`` or ``matplotlib.figure``.
    purpose : str
        Subject of the error's sentence, such as "a plot" in "a plot needs matplotlib".

    Raises
    ------
    ModuleNotFoundError
        The package is not installed. The message names it, and the command that installs it.
    """
    try:
        return import_module(module)
    except ModuleNotFoundError:
        raise missing(module, purpose) from None


def missing(module: str, purpose: str) -> ModuleNotFoundError:
    """Make the error for a package that is not installed: it names the package and the command that installs it.

    The arguments are those of `load_optional`.
    """
    package = module.partition(".")[0]
    name, line = INSTALLED_BY[package]
    return ModuleNotFoundError(f"{purpose} needs {name}, which is not installed: {line}", name=package)


def find_optional(module: str, least: tuple[int, ...] = ()) -> ModuleType | None:
    """Import a module of an optional package; return None if the package is missing or older than version `least`."""
    try:
        found = import_module(module)
    except ModuleNotFoundError as error:
        if error.name != module.partition(".")[0]:  # it is installed, and lacks another one
            raise
        return None
    version = getattr(found, "__version__", "")
    return found if tuple(map(int, re.findall(r"\d+", version)[:3])) >= least else None
