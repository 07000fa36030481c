"""Trained policies that come with the package, as plain arrays that NumPy alone runs: one for an environment."""

from __future__ import annotations

import re
from pathlib import Path

from rigid_env.envs.registration import NAMESPACE

FOLDER = Path(__file__).parents[1] / "suite" / "policies"

PRETRAINED = "pretrained"
"""Word that stands for the policy of an environment where a file of a policy may be named."""

ID = re.compile(rf"(?:[\w.]+:)?{NAMESPACE}/(\w+-v\d+)")


def pretrained_ids() -> list[str]:
    """Return the ids of environments that have a trained policy."""
    return sorted(f"{NAMESPACE}/{path.stem}" for path in FOLDER.glob("*.npz"))


def is_id(text: str) -> bool:
    """Return whether a text is the id of an environment of this package, such as ``rigid_env/BlockReach-v0``."""
    return ID.fullmatch(text) is not None


def pretrained_path(env_id: str) -> Path:
    """Return the file of the policy of an environment, by its id; a module to import before a colon may stand there.

    Raises
    ------
    ValueError
        If it has none.
    """
    found = ID.fullmatch(env_id)
    path = FOLDER / f"{found[1]}.npz" if found else FOLDER
    if not path.is_file():
        raise ValueError(f"env is {env_id!r}, without a trained policy; allowed are {', '.join(pretrained_ids())}")
    return path
