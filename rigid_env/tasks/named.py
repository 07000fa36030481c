"""Numbers by name, for a task's functions."""

from __future__ import annotations

import numpy as np

from physics.keywords import nearest_first


class Named(dict):
    """Arrays by name. The error for an unknown name lists the known ones.

    Parameters
    ----------
    arrays : dict of str to array
    what : str
        What they are, for errors.
    is_written : bool
        Whether functions may write: a new value is then copied into the array, so that ``memory["a"] = x`` and
        ``memory["a"][:] = x`` do the same.
    """

    def __init__(self, arrays: dict[str, np.ndarray], what: str, is_written: bool = False):
        super().__init__(arrays)
        self._what, self._is_written = what, is_written

    def __missing__(self, name):
        allowed = ", ".join(nearest_first(str(name), self)) or "none"
        raise KeyError(f"{self._what} has no {name!r}; allowed are {allowed}")

    def __setitem__(self, name, value) -> None:
        if not self._is_written:
            raise TypeError(f"{self._what} got {name!r}; allowed is to read it")
        self[name][...] = value
