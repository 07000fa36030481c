"""Calls that stand ready in memory are those that Python would make: same arguments, same order, same exceptions."""

from __future__ import annotations

import gc
from typing import NamedTuple

import numpy as np
import pytest

from physics.compiler.decorators import kernel
from physics.parallel.bound_call import BoundCall, bound


class Pair(NamedTuple):
    """Arguments that belong together."""

    table: np.ndarray
    factor: float
    inner: tuple
    nothing: None


@kernel
def mixed(out, none, on, count, factor, table, records, pair):
    out[0] = 1.0 if none is None else 0.0
    out[1] = 1.0 if on else 0.0
    out[2], out[3] = count, factor
    out[4], out[5] = table[1, 2], table.shape[0] * 10 + table.shape[1]
    out[6] = records[1].speed
    out[7], out[8] = pair.table[2], pair.factor
    out[9], out[10] = pair.inner[0][1], pair.inner[1]
    out[11] = 1.0 if pair.nothing is None else 0.0


@pytest.mark.parametrize("view", [lambda a: a, lambda a: a[:, ::2], lambda a: a.T, np.asfortranarray])
@pytest.mark.parametrize("on", [True, False])
def test_every_kind_of_argument_arrives(view, on):
    table = view(np.arange(20.0).reshape(4, 5))
    records = np.zeros(3, dtype=[("mass", float), ("speed", float)])
    records["speed"] = (1.5, -2.5, 3.5)
    pair = Pair(np.array([7, 8, 9]), 0.25, (np.array([0.5, -0.5]), 11), None)
    out = np.zeros(12)
    bound(mixed, out, None, on, np.int64(-3), -1e-300, table, records, pair)()
    shape = table.shape[0] * 10 + table.shape[1]
    np.testing.assert_array_equal(out, [1, on, -3, -1e-300, table[1, 2], shape, -2.5, 9, 0.25, -0.5, 11, 1])


@kernel
def unpack(out, group):
    out[0], out[1], out[2] = group[0], group[1], group[2]
    out[3], out[4] = group[3][0], group[3][1]


@pytest.mark.parametrize(
    "group",
    [
        (1, 2, 3, (4, 5)),
        (True, 2, False, (4.5, True)),
        (True, False, True, (False, True)),
        (2.5, True, False, (3, 4.0)),
    ],
)
def test_groups_arrive_whether_or_not_their_words_are_their_structure(group):
    out = np.zeros(5)
    bound(unpack, out, group)()
    assert out.tolist() == [*map(float, group[:3]), *map(float, group[3])]


def test_arrays_are_bound_not_copied_and_kept():
    out, table = np.zeros(12), np.ones((3, 3))
    call = bound(mixed, out, None, True, 1, 1.0, table, np.zeros(2, dtype=[("speed", float)]), pair_of(np.zeros(3)))
    table[1, 2] = 42.0
    del table
    gc.collect()
    np.full(1000, 13.0)  # where a freed table might have been
    call()
    assert out[4] == 42.0


def pair_of(table) -> Pair:
    return Pair(table, 1.0, (np.zeros(2), 1), None)


def test_what_is_no_argument_of_a_kernel_is_refused():
    with pytest.raises(TypeError):
        BoundCall([(0, ("text",))])


@kernel
def note(notes, what):
    notes[0] += 1
    notes[notes[0]] = what
    if what < 0:
        raise ValueError("less than nothing")


@kernel
def give_back(notes):
    return notes[0]


def test_calls_are_made_in_order_each_time():
    notes = np.zeros(20, dtype=np.int64)
    call = bound(note, notes, 3).then(bound(note, notes, 1)).then(bound(note, notes, 2))
    for _ in range(2):
        call()
    assert notes[:7].tolist() == [6, 3, 1, 2, 3, 1, 2]


def test_an_argument_that_is_a_number_can_be_put_in_place_of_another():
    out, records = np.zeros(12), np.zeros(2, dtype=[("mass", float), ("speed", float)])
    call = bound(mixed, out, None, True, 1, 1.0, np.zeros((3, 3)), records, pair_of(np.zeros(3)))
    for count, factor in ((7, -0.5), (-1, 1e300)):
        call.put(3, count)
        call.put(4, factor)
        call()
        assert out[2:4].tolist() == [count, factor]


def test_an_exception_is_raised_and_ends_the_row():
    notes, sign = np.zeros(20, dtype=np.int64), 1
    call = bound(note, notes, 5).then(bound(note, notes, -sign)).then(bound(note, notes, 7))
    for times in (1, 2):
        with pytest.raises(ValueError, match="less than nothing"):
            call()
        assert notes[0] == 2 * times
    bound(note, notes, 8)()  # it is over with that
    assert notes[1:6].tolist() == [5, -1, 5, -1, 8]


def test_a_kernel_that_returns_something_has_no_entry():
    with pytest.raises(TypeError, match="give_back returns int64"):
        bound(give_back, np.zeros(2, dtype=np.int64))
