"""Launchers of many jobs: in processes of this machine, on a Ray cluster, on Slurm, or as lines for a shell.

To add one, write a function like `local.launch` in a new module of this package, and name the module in `LAUNCHERS`.
The function yields the end of each job as soon as the job ends, in any order. It restarts a job if the job's process or
machine was lost.
"""

from __future__ import annotations

import importlib

from rigid_env.launchers.job import Launch

LAUNCHERS = {"local": "local", "ray": "ray_tasks", "submitit": "submitit_jobs", "print": "printed"}


def load(name: str) -> Launch:
    """Return the launch function of a name in `LAUNCHERS`.

    Raises
    ------
    ValueError
        If there is no such launcher.
    """
    if name not in LAUNCHERS:
        raise ValueError(f"launcher is {name!r}; allowed are {', '.join(LAUNCHERS)}")
    return importlib.import_module(f"rigid_env.launchers.{LAUNCHERS[name]}").launch
