"""Check arguments of the native vector environments: autoreset mode, episode limit, reset mask, seeds."""

from __future__ import annotations

from typing import Any, Literal

import numpy as np
from gymnasium.vector import AutoresetMode

from rigid_env.tasks.declaration_checks import checked_limit

Autoreset = Literal["NextStep", "SameStep", "Disabled"]
"""Type of an argument: names of the modes in Gymnasium's `AutoresetMode`."""

NO_LIMIT = -1
"""Value with which `gymnasium.make` turns the time limit off; its None means the registered limit."""


def autoreset_mode(mode: AutoresetMode | str) -> AutoresetMode:
    """Return the autoreset mode, which is given as a mode or by its name; a ValueError for anything else."""
    try:
        return AutoresetMode(mode)
    except ValueError:
        allowed = ", ".join(repr(m.value) for m in AutoresetMode)
        raise ValueError(f"autoreset_mode is {mode!r}; allowed are {allowed}") from None


def episode_limit(value) -> int | None:
    """Check a limit of control steps per episode, and return it; None and `gymnasium.make`'s -1 give None, no limit."""
    is_off = isinstance(value, (int, np.integer)) and value == NO_LIMIT
    return None if is_off else checked_limit(value, "max_episode_steps")


def reset_mask(options: dict[str, Any], num_envs: int) -> np.ndarray:
    """Take the mask of the worlds to reset, (num_envs,) bool, out of `options`; without a mask all worlds."""
    mask = options.pop("reset_mask", None)
    if mask is None:
        return np.ones(num_envs, dtype=np.bool_)
    if not isinstance(mask, np.ndarray) or mask.dtype != np.bool_ or mask.shape != (num_envs,):
        raise ValueError(f"options reset_mask is {mask!r}; allowed is a bool array of shape ({num_envs},)")
    if not mask.any():
        raise ValueError(f"options reset_mask is {mask!r}; allowed are arrays with at least one True")
    return mask


def seed_list(seed, num_envs: int) -> list[int | None]:
    """Seeds of all worlds, an int or None each: an int s gives world i the seed s + i, a list has one for each."""
    if seed is None:
        return [None] * num_envs
    if _is_seed(seed):
        return [int(seed) + i for i in range(num_envs)]
    allowed = f"an integer of at least 0, None, or a list of {num_envs} such"
    if not isinstance(seed, (list, tuple, np.ndarray)) or np.ndim(seed) == 0:
        raise ValueError(f"seed is {seed!r}; allowed are {allowed}")
    if len(seed) != num_envs:
        raise ValueError(f"seed has {len(seed)} entries; allowed are {allowed}")
    for one in seed:
        if one is not None and not _is_seed(one):
            raise ValueError(f"seed holds {one!r}; allowed are {allowed}")
    return [None if one is None else int(one) for one in seed]


def _is_seed(value) -> bool:
    return isinstance(value, (int, np.integer)) and not isinstance(value, bool) and value >= 0
