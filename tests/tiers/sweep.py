"""Parameters of a test of which the default tier takes a few."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import pytest


def sweep(values: Iterable, keep: Iterable | Callable[..., bool], id: Callable | None = None) -> list:
    """Mark values that `keep` does not hold as exhaustive.

    Parameters
    ----------
    values : iterable
        Arguments of `pytest.mark.parametrize`: a value or a tuple of values each, or a `pytest.param`.
    keep : container or callable
        Values of the default tier, or a function of a value that is true for them.
    id : callable, optional
        From a value to the name of its test.
    """
    values = list(values)
    is_kept = keep if callable(keep) else list(keep).__contains__
    assert any(is_kept(value) for value in values), "the default tier would have none"
    made = []
    for value in values:
        arguments = value if isinstance(value, tuple) else (value,)
        marks = () if is_kept(value) else pytest.mark.exhaustive
        made.append(pytest.param(*arguments, marks=marks, id=id(value) if id else None))
    return made
