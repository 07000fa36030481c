"""List of all hard cases in the order of their numbers, and a search by number or name."""

from __future__ import annotations

import pkgutil
from collections.abc import Sequence
from importlib import import_module

from physics.keywords import nearest_first
from rigid_env.hard_cases import cases
from rigid_env.hard_cases.case import Case

# A module of `cases` that defines cases has a tuple CASES.
_MODULES = [import_module(f"{cases.__name__}.{found.name}") for found in pkgutil.iter_modules(cases.__path__)]
_GATHERED = (case for module in _MODULES for case in getattr(module, "CASES", ()))
CASES: tuple[Case, ...] = tuple(sorted(_GATHERED, key=lambda case: case.number))


def find(wanted: Sequence[str] = ()) -> tuple[Case, ...]:
    """Find cases by names or numbers; returns them in the order of the list, or all cases if none is named.

    Raises
    ------
    ValueError
        There is no case with such a name or number.
    """
    numbers, names = [str(case.number) for case in CASES], [case.name for case in CASES]
    for name in wanted:
        if name not in (*numbers, *names):
            allowed = f"numbers from {numbers[0]} to {numbers[-1]}, and {', '.join(nearest_first(name, names))}"
            raise ValueError(f"case is {name!r}; allowed are {allowed}")
    return tuple(case for case in CASES if not wanted or {case.name, str(case.number)} & set(wanted))
