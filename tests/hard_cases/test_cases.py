"""Every hard case at the default accuracy and 10 ms: each check derives its own limit. And what a case is."""

from __future__ import annotations

import math

import pytest

from rigid_env.hard_cases import registry
from rigid_env.hard_cases.case import Case, Check, Setting, UnsupportedError, at_least, none_of, within
from rigid_env.lab.hard_cases.run import Status, run_case
from tests.hard_cases import tier


@pytest.mark.parametrize("case", tier.cases("balanced"))
def test_the_case_comes_out_as_it_must(case):
    tier.check(case, "balanced")


@pytest.mark.interpreted
@pytest.mark.parametrize("dt", [0.02, 0.05])
def test_a_moving_frame_changes_nothing_at_long_steps(dt):
    """A stage that gains energy is solved again; speed along a frictionless wall must not decide whether it gains."""
    (case,) = registry.find(["far-away"])
    failed = [check for check in case.run(Setting("balanced", dt, is_thorough=False)) if not check.passes]
    assert not failed, "\n".join(map(str, failed))


def test_cases_are_numbered_and_named_once_and_say_where_their_outcome_comes_from():
    numbers = [case.number for case in registry.CASES]
    assert numbers == sorted(set(numbers))
    assert len({case.name for case in registry.CASES}) == len(numbers)
    for case in registry.CASES:
        assert case.name == case.name.lower()
        assert not case.name.isdigit()
        assert len(case.run.__doc__) > 100
        assert set(case.faults) <= {"fast", "balanced", "precise", "reference"}


def test_cases_are_found_by_name_and_number():
    assert [case.number for case in registry.find(("parabola", "2"))] == [2, 4]
    assert registry.find() == registry.CASES
    with pytest.raises(ValueError, match=r"case is 'zino'; allowed are numbers from .*zeno"):
        registry.find(("zino",))


@pytest.mark.parametrize(
    ("check", "passes", "margin"),
    [
        (Check("x", 1.0, 4.0), True, 0.75),
        (Check("x", 5.0, 4.0), False, -0.25),
        (Check("x", -5.0, 4.0), True, 1.0),
        (Check("x", math.nan, 4.0), False, -math.inf),
        (Check("x", math.inf, 4.0), False, -math.inf),
        (Check("x", -math.inf, 4.0), False, -math.inf),
        (Check("x", math.nextafter(0.3, 1.0), 0.3), False, 0.0),
        (Check("x", 0.0, 0.0), True, 1.0),
        (Check("x", 1e-300, 0.0), False, -math.inf),
        (within("x", 9.0, 10.0, 2.0), True, 0.5),
        (within("x", 7.0, 10.0, 2.0), False, -0.5),
        (within("x", math.nan, 10.0, 2.0), False, -math.inf),
        (at_least("x", 3.0, 2.0), True, 0.5),
        (at_least("x", 1.0, 2.0), False, -0.5),
        (at_least("x", 9.0, 2.0), True, 1.0),
        (at_least("x", math.nextafter(0.3, 0.0), 0.3), False, 0.0),
        (at_least("x", math.nan, 2.0), False, -math.inf),
        (at_least("x", math.inf, 2.0), False, -math.inf),
        (none_of("x", 0), True, 1.0),
        (none_of("x", True), False, -math.inf),
    ],
)
def test_checks_pass_within_their_limits_only(check, passes, margin):
    assert check.passes is passes
    assert check.margin == pytest.approx(margin)


def test_what_goes_wrong_inside_a_case_is_a_failure_and_what_cannot_be_expressed_no_pass():
    def breaks(on):
        raise ZeroDivisionError("of a test")

    def cannot(on):
        raise UnsupportedError("no such thing")

    def empty(on):
        return []

    found = [run_case(Case(1, "a", "a", "a", run), Setting()) for run in (breaks, cannot, empty)]
    assert [one.status for one in found] == [Status.FAILS, Status.UNSUPPORTED, Status.FAILS]
    assert found[0].reason == "ZeroDivisionError: of a test"
