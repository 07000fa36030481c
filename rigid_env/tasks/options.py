"""Options of `reset`, all checked before anything changes."""

from __future__ import annotations

import reprlib
from collections.abc import Iterable, Mapping
from typing import Any

from physics.keywords import nearest_first


def require_known(
    options: Mapping[str, Any] | None, allowed: Iterable[str], field: str = "options"
) -> Mapping[str, Any]:
    """Check the keys of options, or of another named mapping; return the mapping, an empty one for None.

    Raises
    ------
    TypeError
        They are no dict.
    ValueError
        Naming a key that is not `allowed`, and the allowed ones, the nearest first.
    """
    if options is None:
        return {}
    if not isinstance(options, Mapping):
        raise TypeError(
            f"{field} is {reprlib.repr(options)}; allowed are None and a dict with keys of {', '.join(allowed)}"
        )
    for key in options:
        if key not in allowed:
            raise ValueError(f"{field} has the key {key!r}; allowed are {', '.join(nearest_first(key, allowed))}")
    return options
