"""Switches: a function is chosen by the type of an argument, or of a member of one at any depth."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from physics.compiler.decorators import by_type, if_given, kernel, when


class Inner(NamedTuple):
    offset: float | None


class Outer(NamedTuple):
    factor: float | None
    inner: Inner


def _as_it_is(x, group):
    return x


@if_given("group.factor", _as_it_is)
def multiplied(x, group):
    """Product that cannot be compiled where the factor is None."""
    return x * group.factor


@if_given("group.inner.offset", 0.0)
def offset_of(group):
    """Number that cannot be compiled where it is None."""
    return 1.0 * group.inner.offset


@kernel
def scaled(x, group):
    return multiplied(x, group) + offset_of(group)


@kernel
def handed_on(x, group):
    return scaled(x, group)


@pytest.mark.parametrize("call", [scaled, handed_on])
@pytest.mark.parametrize("factor", [None, 3.0])
@pytest.mark.parametrize("offset", [None, 0.5])
def test_members_of_named_tuples_are_switches(call, factor, offset):
    expected = 2.0 * (1.0 if factor is None else factor) + (0.0 if offset is None else offset)
    assert call(2.0, Outer(factor, Inner(offset))) == expected


@if_given("switch")
def doubled(x, switch):
    """Nothing is returned where it is off."""
    x[0] *= 2.0


@kernel
def double(x, switch):
    doubled(x, switch)


@pytest.mark.parametrize(("switch", "expected"), [(None, 4.0), (True, 8.0)])
def test_a_bare_argument_is_a_switch(switch, expected):
    x = np.array([4.0])
    double(x, switch)
    assert x[0] == expected


@kernel
def without(x, switch):
    if switch is not None:
        x = x * switch
    return x


def test_numba_prunes_what_asks_whether_none_is_given():
    assert without(2.0, None) == 2.0
    assert without(2.0, 3.0) == 6.0


@when(lambda x: "Array" in type(x).__name__ or isinstance(x, np.ndarray), otherwise=-1.0)
def first_of(x):
    return x[0]


def _kind(x):
    if isinstance(x, np.ndarray) or "Array" in type(x).__name__:
        return lambda x: 1.0
    return lambda x: 0.0


is_array = by_type(_kind, _kind)


@kernel
def chosen(x):
    return first_of(x) + 10.0 * is_array(x)


def test_any_question_about_types_chooses():
    assert chosen(np.array([4.0])) == 14.0
    assert chosen(5.0) == -1.0
    assert is_array.__name__ == "_kind"


def test_a_name_that_is_assigned_in_branches_is_no_switch():
    """The value of a variable is known only at run time: both branches stay."""

    @kernel
    def last(x, flag):
        found = None if flag else x
        return 0.0 if found is None else 1.0

    assert last(1.0, False) == 1.0
