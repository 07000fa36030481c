"""Places where many jobs run: processes of this machine, a Ray cluster, Slurm, or a shell.

To add one: write a function as `local.launch` in a module here, and name the module in `LAUNCHERS`. It yields the end
of each job as it comes, in any order, and starts a job again whose process or machine was lost.
"""

from __future__ import annotations

import importlib

from rigid_env.launchers.job import Launch

LAUNCHERS = {"local": "local", "ray": "ray_tasks", "submitit": "submitit_jobs", "print": "printed"}


def load(name: str) -> Launch:
    """Return the function that runs jobs at a place, by a name of `LAUNCHERS`.

    Raises
    ------
    ValueError
        If there is no such place.
    """
    if name not in LAUNCHERS:
        raise ValueError(f"launcher is {name!r}; allowed are {', '.join(LAUNCHERS)}")
    return importlib.import_module(f"rigid_env.launchers.{LAUNCHERS[name]}").launch
