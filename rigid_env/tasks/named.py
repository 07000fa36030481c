"""Dict of arrays by name that a task's functions read."""

from __future__ import annotations

import numpy as np

from physics.keywords import nearest_first


class Named(dict):
    """Dict of arrays by name, whose error for an unknown name lists the known ones.

    Parameters
    ----------
    arrays : dict of str to array
    what : str
        Name of the dict in errors, such as "memory".
    is_written : bool
        True lets functions assign: the new value is copied into the array, so that ``memory["a"] = x`` does the same as
        ``memory["a"][:] = x``. False: an assignment raises a TypeError.
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
