"""Choice of worlds of a batch, by indices or by a mask."""

from __future__ import annotations

import numpy as np

from physics.summary import shown


def world_indices(worlds, count: int, field: str = "worlds", once: bool = True) -> np.ndarray:
    """Check a user's choice of worlds; return their indices (k,) int64.

    Parameters
    ----------
    worlds : (k,) array_like of int, or (count,) of bool
        Indices of the chosen worlds, or a mask that is True for them.
    count : int
        Number of worlds of the batch.
    field : str
        Name of the argument in messages.
    once : bool
        Whether to refuse a world that is named twice.

    Raises
    ------
    ValueError
        `worlds` is neither a list of valid indices nor a mask, or names a world twice.
    """
    try:
        found = np.asarray(worlds)
    except ValueError:  # ragged
        raise _no_worlds(worlds, count, field) from None
    if found.dtype == bool and found.shape == (count,):
        found = np.flatnonzero(found)
    if found.ndim != 1 or (found.size and not np.issubdtype(found.dtype, np.integer)):
        raise _no_worlds(worlds, count, field)
    if found.size and not (found.min() >= 0 and found.max() < count):
        raise ValueError(f"{field} is {shown(worlds)}; allowed are indices from 0 to {count - 1}")
    if once and not (found[1:] > found[:-1]).all() and len(np.unique(found)) < len(found):
        raise ValueError(f"{field} is {shown(worlds)}; allowed is each world once")
    return found.astype(np.int64)


def _no_worlds(worlds, count: int, field: str) -> ValueError:
    allowed = f"a list of indices from 0 to {count - 1}, or a mask of {count} bools"
    return ValueError(f"{field} is {shown(worlds)}; allowed is {allowed}")
