"""Hard cases as tests: which of them the default tier runs, and how.

What does not hold is expected to fail, with the reason found (`Case.faults`), and fails here when it does hold.
"""

from __future__ import annotations

import pytest

from rigid_env.hard_cases import registry
from rigid_env.hard_cases.case import Case, Setting, UnsupportedError

DT = 0.01

# Numbers of cases that take more than some seconds in Python, by accuracy. All cases run with --exhaustive.
LONG = {
    "balanced": {25, 26, 27, 28, 30, 31, 32, 42, 44, 45, 47, 50},
    "precise": {2, 6, 8, 9, 19, 21, 22, 24, 25, 26, *range(27, 68)} - {35, 36, 37, 64},
}

# Numbers of cases whose kernels other tests of the default tier compile, too.
COMPILED = {
    "balanced": {1, 2, 6, 15, 16, 17, 20, 21, 22, 24, 36, 39, 40, 41, 46, *range(56, 62)},
    "precise": {1, 5, 15, 16, 17, 18, 20, 23},
}


def tier_of(case: Case, accuracy: str) -> list:
    """Marks that decide when and how a case is run."""
    if case.number in LONG[accuracy]:
        return [pytest.mark.exhaustive]
    return [] if case.number in COMPILED[accuracy] else [pytest.mark.interpreted]


def cases(accuracy: str) -> list:
    """Every case, as parameters of a test."""
    found = []
    for case in registry.CASES:
        reason = case.faults.get(accuracy)
        marks = tier_of(case, accuracy)
        if reason:
            marks.append(pytest.mark.xfail(strict=True, raises=AssertionError, reason=reason))
        found.append(pytest.param(case, id=f"{case.number}-{case.name}", marks=marks))
    return found


def check(case: Case, accuracy: str) -> None:
    """Run a case; each of its checks must pass."""
    try:
        checks = case.run(Setting(accuracy, DT, is_thorough=False))
    except UnsupportedError as error:
        pytest.skip(f"not supported: {error}")
    assert checks
    failed = [check for check in checks if not check.passes]
    assert not failed, "\n".join(map(str, failed))
