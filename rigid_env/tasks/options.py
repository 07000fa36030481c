"""Check of the keys of options, such as those of `reset`."""

from __future__ import annotations

import reprlib
from collections.abc import Iterable, Mapping
from typing import Any

from physics.keywords import nearest_first


def require_known(
    options: Mapping[str, Any] | None, allowed: Iterable[str], field: str = "options"
) -> Mapping[str, Any]:
    """Check that the keys of a mapping are allowed, and return the mapping; an empty one for None.

    Parameters
    ----------
    options : mapping or None
        Usually the options of `reset`.
    allowed : iterable of str
        Allowed keys.
    field : str
        Name of the mapping in an error.

    Raises
    ------
    TypeError
        `options` is no mapping.
    ValueError
        Naming a key that is not allowed, and the allowed ones, the nearest first.
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
