"""List of all hard cases in the order of their numbers, and a search by number or name."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module

from physics.keywords import nearest_first
from rigid_env.hard_cases.case import Case

# Modules of `rigid_env.hard_cases.cases`; each defines a tuple CASES.
MODULES = (
    "flight", "bounces", "impacts", "friction", "rolling", "tipping", "scaling", "piles", "leaning", "arch",
    "chains", "stiff", "turning", "letting_go", "random_scenes", "company",
)  # fmt: skip


_GATHERED = (case for name in MODULES for case in import_module(f"rigid_env.hard_cases.cases.{name}").CASES)
CASES: tuple[Case, ...] = tuple(sorted(_GATHERED, key=lambda case: case.number))


def find(wanted: Sequence[str] = ()) -> tuple[Case, ...]:
    """Find cases by names or numbers; returns them in the order of the list, or all cases if none is named.

    Raises
    ------
    ValueError
        There is no case with such a name or number.
    """
    known = {key: case for case in CASES for key in (case.name, str(case.number))}
    for name in wanted:
        if name not in known:
            raise ValueError(
                f"case is {name!r}; allowed are numbers from {CASES[0].number} to {CASES[-1].number}, and "
                + ", ".join(nearest_first(name, [case.name for case in CASES]))
            )
    chosen = {known[name].number for name in wanted} or {case.number for case in CASES}
    return tuple(case for case in CASES if case.number in chosen)
