"""Instructions of kernels: our lowering keeps Python's meaning, and is short."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections import namedtuple
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from numba.core.codegen import CPUCodeLibrary
from numba.core.typeinfer import CallConstraint

import physics
from physics.compiler.decorators import kernel, runtime_kernel
from physics.compiler.fused.code_libraries import PartLibrary
from physics.compiler.fused.type_inference import _Network
from physics.compiler.simd import Lanes
from tests.kernels.anew import anew

RECORD = np.dtype([("scale", np.float64), ("grid", np.float64, (3, 4)), ("line", np.float64, (5,)), ("n", np.int64)])


# --- elements ------------------------------------------------------------------------------------------------------


@kernel
def element(a, i):
    return a[i]


@kernel
def element_of_two(a, i, j):
    return a[i, j]


@kernel
def element_of_three(a, i, j, k):
    return a[i, j, k]


@kernel
def write(a, i, j, value):
    a[i, j] = value


def index(length: int):
    """Every index of an axis, counted from the front."""
    return st.integers(0, length - 1)


def grid(*shape: int) -> np.ndarray:
    return np.arange(1.0, 1.0 + np.prod(shape)).reshape(shape)


# Contiguous, with gaps, backwards, the other way about.
VIEWS = [lambda a: a, lambda a: a[:, ::2], lambda a: a[::-1], lambda a: a.T]


@pytest.mark.parametrize("view", VIEWS)
@given(data=st.data())
def test_an_element_is_the_one_that_numpy_gives(view, data):
    a = view(grid(5, 6))
    i, j = (data.draw(index(length)) for length in a.shape)
    assert element_of_two(a, i, j) == a[i, j]
    assert element_of_two(a, np.uint32(i), j) == a[i, j]
    assert element(a[:, 0], i) == a[i, 0]
    assert element(a[0], j) == a[0, j]


@given(index(2), index(3), index(4))
def test_an_element_of_three_axes(i, j, k):
    a = grid(2, 3, 4)
    assert element_of_three(a, i, j, k) == a[i, j, k]
    assert element_of_three(a.transpose(2, 0, 1), k, i, j) == a[i, j, k]


@pytest.mark.parametrize("kind", [np.float64, np.float32, np.int64, np.bool_])
@pytest.mark.parametrize("view", VIEWS)
@given(data=st.data())
def test_what_is_written_stands_there_and_nowhere_else(kind, view, data):
    a = view(np.zeros((5, 6), kind))
    i, j = (data.draw(index(length)) for length in a.shape)
    write(a, i, j, 1)  # an integer: it is converted
    expected = np.zeros_like(a)
    expected[i, j] = 1
    assert (a == expected).all()


@kernel
def last_of_each(a):
    return a[-1, 0] + 100.0 * a[0, -1]


def test_a_literal_counts_from_the_end_as_well():
    a = grid(3, 4)
    assert last_of_each(a) == a[-1, 0] + 100.0 * a[0, -1]


def users_element(a, i, j):
    return a[i, j]


of_user = runtime_kernel(users_element)


@kernel
def asks_user(a, i, j):
    return of_user(a, i, j)


@given(st.integers(-5, 4), st.integers(-6, 5))
def test_a_users_function_may_count_from_the_end(i, j):
    a = grid(5, 6)
    assert asks_user(a, i, j) == a[i, j]


CHECKED = """
import numpy as np
import physics
from physics import scenes
from physics.compiler.decorators import kernel
from physics.compiler.simd import load_lanes, store_lanes

@kernel
def element(a, i, j):
    return a[i, j]

@kernel
def moved(a, i, j, k, l):
    store_lanes(a, k, l, load_lanes(a, i, j))

@kernel
def asks(a, i, j):
    return element(a, i, j)

refused = 0
for i, j in ((0, 2), (2, 0), (-1, 0), (0, -1)):
    try:
        asks(np.ones((2, 2)), i, j)
    except IndexError:
        refused += 1
assert asks(np.ones((2, 2)), 1, 1) == 1.0
for place in ((1, 3, 0, 0), (2, 0, 0, 0), (0, 0, 1, 3), (0, 0, 2, 0)):  # four numbers at once, from place to place
    try:
        moved(np.ones((2, 6)), *place)
    except IndexError:
        refused += 1
moved(np.ones((2, 6)), 1, 2, 0, 2)
for scene, accuracy in ((scenes.drop(), "balanced"), (scenes.tower(3), "fast")):
    physics.World(scene, dt=0.01, accuracy=accuracy).step(steps=200)
print(refused)
"""


@pytest.mark.exhaustive
def test_indices_are_checked_where_that_is_asked_for(tmp_path):
    """Kernels do not look at them (a negative one reads what stands before): here all of two scenes are looked at."""
    root = str(Path(physics.__file__).parents[1])
    environment = {**os.environ, "NUMBA_BOUNDSCHECK": "1", "NUMBA_CACHE_DIR": str(tmp_path), "PYTHONPATH": root}
    program = tmp_path / "checked.py"  # Numba keeps only what a file holds
    program.write_text(CHECKED)
    done = subprocess.run([sys.executable, program], env=environment, capture_output=True, text=True, check=False)
    assert done.stdout.split() == ["8"], done.stderr


@kernel
def reshaped(a, rows, columns, i, j):
    """Reshape the elements from the third on to a matrix."""
    matrix = a[2 : 2 + rows * columns].reshape((rows, columns))
    return matrix[i, j] + 100.0 * matrix.shape[0] + 1000.0 * matrix.shape[1]


@given(st.integers(1, 4), st.integers(1, 5), st.data())
def test_an_array_with_another_shape(rows, columns, data):
    a = np.arange(30.0)
    i, j = data.draw(index(rows)), data.draw(index(columns))
    assert reshaped(a, rows, columns, i, j) == reshaped.py_func(a, rows, columns, i, j)


@kernel
def column_of_reshaped(a, j, k):
    """Sum of a column, which is read by its strides."""
    total = 0.0
    column = a.reshape((2, 3, 4))[:, j, k]
    for i in range(column.shape[0]):
        total = 10.0 * total + column[i]
    row = a.reshape((2, 3, 4))[1, :, k]
    for i in range(row.shape[0]):
        total = 10.0 * total + row[i]
    return total


@given(index(3), index(4))
def test_columns_of_an_array_with_another_shape(j, k):
    a = np.arange(24.0)
    assert column_of_reshaped(a, j, k) == column_of_reshaped.py_func(a, j, k)


# --- records -------------------------------------------------------------------------------------------------------


@kernel
def of_record(record, i, j):
    return record.grid[i, j] + record.line[j] * record.scale + record.grid[-1, -2] + record.line[0] * record.n


@kernel
def write_record(record, i, j, value):
    record.grid[i, j] = value
    record.n = i


@kernel
def sum_of_row(record):
    row, total = record.grid[1], 0.0
    for k in range(row.shape[0]):
        total += row[k]
    return total + row.shape[0] + row.size


def record_of(scale=0.5):
    records = np.zeros(1, RECORD)
    records["scale"], records["grid"], records["line"], records["n"] = scale, grid(3, 4), grid(5), 7
    return records


@given(index(3), index(4))
def test_arrays_in_a_record(i, j):
    record = record_of()[0]
    expected = record["grid"][i, j] + record["line"][j] * 0.5 + record["grid"][-1, -2] + record["line"][0] * 7
    assert of_record(record, i, j) == expected
    write_record(record, i, j, -3.0)
    expected = grid(3, 4)
    expected[i, j] = -3.0
    assert (record["grid"] == expected).all()
    assert (record["line"] == grid(5)).all()
    assert record["n"] == i


def test_a_view_of_an_array_in_a_record():
    assert sum_of_row(record_of()[0]) == grid(3, 4)[1].sum() + 4 + 4


@kernel
def write_inner(outer, i, j, value):
    inner = outer.second
    write_record(inner, i, j, value)
    outer.first.scale = inner.scale + value
    return sum_of_row(outer.second)


@given(index(3), index(4))
def test_records_in_a_record(i, j):
    """They are where NumPy has them, and another kernel takes one as any record."""
    outer = np.zeros(1, [("n", np.int64), ("first", RECORD), ("second", RECORD)])
    outer["first"], outer["second"] = record_of(2.0), record_of()
    expected = grid(3, 4)
    expected[i, j] = -3.0
    assert write_inner(outer[0], i, j, -3.0) == expected[1].sum() + 4 + 4
    assert (outer["second"]["grid"][0] == expected).all()
    assert outer["second"]["n"][0] == i
    assert (outer["first"]["grid"][0] == grid(3, 4)).all()
    assert outer["first"]["scale"][0] == -2.5
    assert (outer["first"]["n"][0], outer["n"][0]) == (7, 0)


# --- ranges and variables ------------------------------------------------------------------------------------------


@kernel
def counted(stop):
    numbers = 0
    for i in range(stop):
        numbers = 10 * numbers + i
    return numbers


@kernel
def counted_from(start, stop):
    numbers, last = 0, -99
    for i in range(start, stop):
        numbers, last = numbers + i * i, i
    return numbers, last


@kernel
def counted_by(start, stop, step):
    numbers, last = 0, -99
    for i in range(start, stop, step):
        numbers, last = 3 * numbers + i, i
    return numbers, last


@kernel
def first_past(limit, stop):
    total = 0
    for i in range(stop):
        for j in range(i, stop):
            if j % 3 == 1:
                continue
            if j > i + 4:
                break
            total += 10 * i + j
        else:
            total += 1000
        if total > limit:
            return total, i
    return total, -1


@given(st.integers(-3, 9), st.integers(-4, 9), st.integers(-3, 3).filter(bool), st.integers(0, 5000))
def test_loops_run_as_pythons_do(start, stop, step, limit):
    loops = [(counted, (stop,)), (counted_from, (start, stop)), (counted_by, (start, stop, step))]
    for loop, args in [*loops, (first_past, (limit, stop))]:
        assert loop(*args) == loop.py_func(*args)


@kernel
def backwards(first, last):
    numbers, seen = 0, -99
    for i in range(first, last, -1):
        numbers, seen = 3 * numbers + i, i
    for i in range(last, first, 3):
        numbers, seen = 3 * numbers + i, i
    for i in range(first, last, -2):
        numbers, seen = 3 * numbers + i, i
    return numbers, seen


@given(st.integers(-9, 9), st.integers(-9, 9))
def test_loops_with_steps_that_are_written_down(first, last):
    assert backwards(first, last) == backwards.py_func(first, last)


@kernel
def by_branches(x, n):
    a = b = x
    if x > 2.0:
        a = 2.0 * x
        c = a + 1.0
    else:
        c = -x
    for i in range(n):
        d = c + i
        if d > 5.0:
            b = a
        a, c = c, d
    while a > 10.0 and n > 0:
        a, n = a - b - 1.0, n - 1
    return a, b, c, n


@given(st.floats(-9, 9), st.integers(0, 9))
def test_variables_keep_their_values_through_branches_and_loops(x, n):
    assert by_branches(x, n) == by_branches.py_func(x, n)


@kernel
def nothing_yet(n):
    if n > 3:
        late = 1.0
    total = 0.0
    for i in range(n):
        if i > 3:
            total += late
        late = 2.0 + i
    return total


def test_a_variable_that_only_some_ways_assign():
    for n in (0, 3, 4, 8):
        assert nothing_yet(n) == nothing_yet.py_func(n)


# --- numbers and tuples --------------------------------------------------------------------------------------------

NUMBERS = st.floats(width=64) | st.sampled_from([0.0, -0.0, float("nan"), float("inf")])


def same(a, b) -> bool:
    """Bit for bit, but for what kind of NaN it is."""
    return np.array_equal(np.float64(a), np.float64(b), equal_nan=True) and np.signbit(a) == np.signbit(b)


@kernel
def extremes(x, y, z, k):
    return max(x, y), min(x, y), max(x, y, z), min(z, y, x), max(x, k), min(k, 3)


@given(NUMBERS, NUMBERS, NUMBERS, st.integers(-9, 9))
def test_the_largest_and_the_smallest_are_pythons(x, y, z, k):
    """The first of equal ones (of 0.0 and -0.0), and what NaN comes first stays."""
    assert all(map(same, extremes(x, y, z, k), extremes.py_func(x, y, z, k)))


@kernel
def truncated(x, n):
    return int(x), int(n)


@given(st.floats(-1e15, 1e15), st.integers(-(2**62), 2**62))
def test_a_number_becomes_an_integer_towards_zero(x, n):
    assert truncated(x, n) == (int(x), n)


@kernel
def powers(x, n):
    return x**1, x**2, x**3, x**4, x**7, x**0, x**-2, x**n


def test_a_power_that_is_written_down_is_a_product():
    """As Numba multiplies: from the right, squares first."""
    for x in (0.3, -1.7, 1e40, 3.0):
        first, square, cube, fourth, seventh, zeroth, inverse, other = powers(x, 5)
        assert (first, square, cube) == (x, x * x, x * (x * x))
        assert (fourth, seventh) == ((x * x) * (x * x), x * (x * x) * ((x * x) * (x * x)))
        assert (zeroth, inverse) == (1.0, 1.0 / (x * x))
        assert other == pytest.approx(x**5)


# --- products in sums ----------------------------------------------------------------------------------------------


@kernel
def sums_with_products(a, b, c, d, out):
    """Sums and differences of products and numbers, of numbers and of lanes."""
    out[0], out[1], out[2], out[3] = a * b + c, c + a * b, a * b - c, c - a * b
    out[4], out[5], out[6] = a * b + c * d, a * b - c * d, a * b - b * a
    x, y, z = Lanes(a, b, c, d), Lanes(b, c, d, a), Lanes(c, d, a, b)
    sums, differences = x * y + z, z - x * y
    for lane in range(4):
        out[7 + lane], out[11 + lane] = sums[lane], differences[lane]


FEW_DIGITS = st.floats(-1e100, 1e100).filter(lambda x: x == 0.0 or abs(x) > 1e-100)


@given(FEW_DIGITS, FEW_DIGITS, FEW_DIGITS, FEW_DIGITS)
@example(1.0 + 2.0**-52, 1.0 - 2.0**-52, -1.0, 3.0)
@example(0.1, 0.3, -0.03, 1.0)
def test_a_product_in_a_sum_is_rounded_with_it(a, b, c, d):
    """Against exact fractions: once for both; of two products in a sum the second, in a difference none of them."""
    out = np.zeros(15)
    sums_with_products(a, b, c, d, out)
    A, B, C, D = map(Fraction, (a, b, c, d))
    once = [float(exact) for exact in (A * B + C, C + A * B, A * B - C, C - A * B)]
    np.testing.assert_array_equal(out[:4], once)
    assert out[4] == float(Fraction(a * b) + C * D)
    assert out[5] == a * b - c * d
    assert out[6] == 0.0
    first, second, third = [A, B, C, D], [B, C, D, A], [C, D, A, B]
    np.testing.assert_array_equal(out[7:11], [float(x * y + z) for x, y, z in zip(first, second, third, strict=True)])
    np.testing.assert_array_equal(out[11:], [float(z - x * y) for x, y, z in zip(first, second, third, strict=True)])


@kernel
def power(x, n):
    return x**n


@kernel
def inverse(x):
    return 1.0 / x


def test_dividing_by_zero_is_no_error_whatever_numba_has_compiled_for_itself():
    """Its `x ** n` divides, for these types as `inverse` does, and there dividing by zero is an error."""
    x = np.float32(0.0)
    assert power(np.float32(2.0), -1) == 0.5
    assert inverse(x) == np.inf


TURNS = (0.5, -2.0, 8.25, 3.0)


@kernel
def chosen(x, y, k):
    of_numbers = (x, y, x * y, 7.0)
    of_tuples = ((x, y, 1.0), (y, x, 2.0))
    one = of_tuples[k % 2]
    return of_numbers[k] + TURNS[k], one[0], one[2], k in (1, 3), y in (2.0, x)


@given(st.floats(-9, 9), st.floats(-9, 9), index(4))
def test_a_member_of_a_tuple_is_the_one_that_is_asked_for(x, y, k):
    assert chosen(x, y, k) == chosen.py_func(x, y, k)


def users_member(x, k):
    return (x, 2.0 * x, 3.0 * x)[k]


member_of_user = runtime_kernel(users_member)


@kernel
def asks_member(x, k):
    return member_of_user(x, k)


@given(st.integers(-3, 2))
def test_a_users_function_may_count_from_the_end_of_a_tuple(k):
    assert asks_member(1.5, k) == users_member(1.5, k)


# --- calls ---------------------------------------------------------------------------------------------------------


def refuse(x):
    if x < 0.0:
        raise ValueError("x is negative")
    return 2.0 * x


def guard(x):
    try:
        return inner(x)
    except Exception:
        return -1.0


inner = runtime_kernel(refuse)
guarded = runtime_kernel(guard)


@kernel
def in_between(x):
    return 1.0 + inner(x)


@kernel
def outer(x):
    return 1.0 + in_between(x)


@kernel
def outer_guarded(x):
    return guarded(x)


def test_what_a_users_function_raises_gets_through_the_kernels():
    assert outer(3.0) == 8.0
    with pytest.raises(ValueError, match="x is negative"):
        outer(-3.0)
    assert outer(4.0) == 10.0


def test_what_a_users_function_catches_does_not():
    assert outer_guarded(3.0) == 6.0
    assert outer_guarded(-3.0) == -1.0


@kernel
def both_ways(x):
    """Two structures, one within another, from several ends."""
    if x > 1.0:
        return (x, (x * x, 2)), x > 2.0
    if x < -1.0:
        return (1.0, (2.0, 3)), False
    return (-x, (x, 1)), True


@kernel
def nothing(a, x):
    a[0] = x


@kernel
def perhaps(x):
    if x > 0.0:
        return x
    return None


@kernel
def row_of(a, k):
    return a[k]


@kernel
def takes_a_view(a):
    row = row_of(a, 1)
    row[0] = 7.0
    return row[2] + row.shape[0]


def test_a_kernel_returns_a_view():
    a = grid(3, 4)
    assert takes_a_view(a) == a[1, 2] + 4.0
    assert a[1, 0] == 7.0


@kernel
def takes_values(a, x):
    (first, (second, count)), is_large = both_ways(x)
    nothing(a, x)
    there = perhaps(x)
    late = -1.0 if there is None else there
    return first, second, count, is_large, late


@given(st.floats(-3, 3))
def test_kernels_return_numbers_tuples_and_nothing(x):
    a, expected = np.arange(4.0), np.arange(4.0)
    assert takes_values(a, x) == takes_values.py_func(expected, x)
    assert (a == expected).all()


# --- how much is written -------------------------------------------------------------------------------------------


@kernel
def straight(record, a, i):
    x, y = record.grid[i, 1], record.line[2]
    a[i, 0] = x + y
    return a[i, 1]


@kernel
def calls_straight(record, a, i):
    return straight(record, a, i)


def instructions_of(function, monkeypatch, *args) -> dict[str, list[str]]:
    """Names of the instructions of a kernel that is not kept, and of the parts it is the first to call."""
    written = {}
    for library_class in (CPUCodeLibrary, PartLibrary):

        def noted(library, module, add=library_class.add_ir_module):
            written[library.name] = re.findall(r"^  (?:%\S+ = )?([a-z]+)", str(module), re.MULTILINE)
            add(library, module)

        monkeypatch.setattr(library_class, "add_ir_module", noted)
    anew(function)(*args)
    monkeypatch.undo()
    return written


def test_an_element_takes_no_memory_of_its_own(monkeypatch):
    """Numba's own lowering makes 6 places in memory and 255 instructions of this part."""
    written = instructions_of(calls_straight, monkeypatch, record_of()[0], grid(3, 4), 1)["straight"]
    assert "alloca" not in written
    assert written.count("load") == 3
    assert written.count("store") == 1
    assert len(written) < 60


Wide = namedtuple("Wide", [f"a{k}" for k in range(12)])  # 12 arrays, 84 words


@kernel
def of_wide(wide, i):
    return wide.a3[i] + wide.a11.shape[0]


@kernel
def some_of_wide(wide, i):
    row = wide.a3
    if i > 1:
        row = wide.a7
    return of_wide(wide, i) + 100.0 * row[i]


@kernel
def calls_with_wide(wide, n):
    total = 0.0
    for i in range(n):
        total += some_of_wide(wide, i)
    return total


@kernel
def changed_wide(wide):
    swapped = Wide(
        wide.a11, wide.a10, wide.a9, wide.a8, wide.a7, wide.a6, wide.a5, wide.a4, wide.a3, wide.a2, wide.a1, wide.a0
    )
    return of_wide(swapped, 1) + 1000.0 * of_wide(wide, 1)


def test_a_large_tuple_is_handed_on_by_its_address(monkeypatch):
    wide = Wide(*(np.arange(4.0) + 10 * k for k in range(12)))
    written = instructions_of(calls_with_wide, monkeypatch, wide, 4)
    assert calls_with_wide(wide, 4) == calls_with_wide.py_func(wide, 4)
    assert len(written["some_of_wide"]) < 70  # 84 words to hand on, if it were word by word, and as many to take
    assert changed_wide(wide) == changed_wide.py_func(wide)


# --- types ---------------------------------------------------------------------------------------------------------


@kernel
def becomes_float(n):
    total = 0
    for i in range(n):
        total = total + 0.5 * i
    return total


@kernel
def calls_becomes_float(n):
    return becomes_float(n) + becomes_float(n + 1)


def test_a_variable_gets_the_type_that_all_its_values_have():
    assert calls_becomes_float(4) == 3.0 + 5.0


@kernel
def two_calls(x):
    return abs(x) + abs(x + 1.0)


def test_a_constraint_is_looked_at_again_only_if_something_changed(monkeypatch):
    looked = []

    def noted(constraint, typeinfer, resolve=CallConstraint.resolve):
        looked.append(constraint)
        resolve(constraint, typeinfer, *[typeinfer.typevars], fnty=typeinfer.typevars[constraint.func].getone())

    rounds = []
    propagate = _Network.propagate

    def counted_rounds(network, typeinfer):
        rounds.append(network)
        return propagate(network, typeinfer)

    monkeypatch.setattr(_Network, "propagate", counted_rounds)
    monkeypatch.setattr(CallConstraint, "__call__", noted)

    assert anew(two_calls)(-3.0) == 5.0
    assert len(rounds) == 2  # the second to see that nothing changes
    calls = [each for each in looked if type(each) is CallConstraint]
    assert len(calls) == len(set(map(id, calls))) == 2
