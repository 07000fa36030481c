"""Switches: a branch on `x is None` is pruned for an argument and for a member of one, at any depth."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest

from physics.kernels.compile.decorators import kernel


class Inner(NamedTuple):
    offset: float | None


class Outer(NamedTuple):
    factor: float | None
    inner: Inner


@kernel
def scaled(x, group):
    """Neither branch could be typed with the other's argument: None has no product and no sum."""
    if group.factor is not None:
        x = x * group.factor
    if group.inner.offset is None:
        return x
    return x + group.inner.offset


@kernel
def chosen(x, switch):
    """An alternative, by one switch."""
    if switch is None:
        return x[0]  # x is an array here
    return x  # and a number here


@kernel
def handed_on(x, group):
    return scaled(x, group)


@pytest.mark.parametrize("call", [scaled, handed_on])
@pytest.mark.parametrize("factor", [None, 3.0])
@pytest.mark.parametrize("offset", [None, 0.5])
def test_members_of_named_tuples_are_switches(call, factor, offset):
    expected = 2.0 * (1.0 if factor is None else factor) + (0.0 if offset is None else offset)
    assert call(2.0, Outer(factor, Inner(offset))) == expected


def test_both_alternatives_of_a_switch_are_pruned():
    assert chosen(np.array([4.0]), None) == 4.0
    assert chosen(5.0, True) == 5.0


def test_a_name_that_is_assigned_in_branches_is_no_switch():
    """The value of a variable is known only at run time: both branches stay."""

    @kernel
    def last(x, flag):
        found = None if flag else x
        return 0.0 if found is None else 1.0

    assert last(1.0, False) == 1.0
