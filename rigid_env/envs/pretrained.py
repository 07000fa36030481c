"""Trained policies in the package, at most one for each environment, as plain arrays that need only NumPy."""

from __future__ import annotations

import re
from pathlib import Path

from physics.keywords import nearest_first
from rigid_env.envs.registration import NAMESPACE

FOLDER = Path(__file__).parents[1] / "suite" / "policies"

PRETRAINED = "pretrained"
"""Word that selects the environment's own trained policy, in place of the path of a policy file."""

ID = re.compile(rf"(?:[\w.]+:)?{NAMESPACE}/(\w+-v\d+)")


def pretrained_ids() -> list[str]:
    """Return the ids of environments that have a trained policy."""
    return sorted(f"{NAMESPACE}/{path.stem}" for path in FOLDER.glob("*.npz"))


def is_id(text: str) -> bool:
    """True if a text is the id of an environment of this package, such as ``rigid_env/BlockReach-v0``."""
    return ID.fullmatch(text) is not None


def pretrained_path(env_id: str) -> Path:
    """Path of the policy file of an environment, by its id, which may begin with a module and a colon.

    Raises
    ------
    ValueError
        The environment has no trained policy.
    """
    found = ID.fullmatch(env_id)
    path = FOLDER / f"{found[1]}.npz" if found else FOLDER
    if not path.is_file():
        allowed = ", ".join(nearest_first(env_id, pretrained_ids()))
        raise ValueError(f"env is {env_id!r}, for which there is no trained policy; allowed are {allowed}")
    return path
