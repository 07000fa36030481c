"""Kernels run by Python: arithmetic of machine code at the lines of the source, and records with their fields."""

from __future__ import annotations

import linecache
import math
import traceback

import numpy as np
import pytest

from physics.compiler.interpreted.ieee_source import as_ieee
from physics.compiler.interpreted.records import records_of


def quotients(x, y):
    z = x
    z /= y
    return x / y, z


def functions(x):
    return math.sqrt(x), math.acos(2.0 + x), math.exp(1000.0), math.pi


def powers(x):
    return x**0, x**1, x**7, x**0.5


def closed_over(scale):
    def scaled(x, offset=1.0):
        """Keep what is around it."""
        return scale / x + offset

    return scaled


def fails(x):
    y = x / 2.0
    raise KeyError(y)


@pytest.mark.parametrize(("x", "y"), [(1.0, 0.0), (-1.0, 0.0), (1.0, -0.0), (3.0, 4.0)])
def test_a_quotient_by_zero_is_infinite(x, y):
    expected = x / y if y else math.copysign(math.inf, x * math.copysign(1.0, y))
    assert as_ieee(quotients)(x, y) == (expected, expected)


def test_zero_by_zero_is_no_number():
    assert all(map(math.isnan, as_ieee(quotients)(0.0, 0.0)))


def test_functions_of_math_raise_nothing():
    root, angle, large, pi = as_ieee(functions)(-1.0)
    assert math.isnan(root)
    assert angle == 0.0
    assert large == math.inf
    assert pi == math.pi
    assert math.isnan(as_ieee(functions)(1.0)[1])


@pytest.mark.parametrize("x", [0.1, -3.7, 1e200])
def test_a_whole_power_is_the_products_of_machine_code(x):
    """x (x² x⁴): another order of the products gives other last bits."""
    squared = x * x
    one, same, seventh, root = as_ieee(powers)(x)
    assert (one, same, seventh) == (1.0, x, (x * squared) * (squared * squared))
    assert math.isnan(root) if x < 0 else root == pytest.approx(math.sqrt(x), rel=1e-15)


def test_a_closure_keeps_what_is_around_it():
    made = as_ieee(closed_over(6.0))
    assert made(3.0) == 3.0
    assert made(0.0) == math.inf
    assert made.__doc__ == "Keep what is around it."
    assert made.__name__ == "scaled"


def test_a_statement_stands_at_its_line():
    """So that a debugger stops there."""
    with pytest.raises(KeyError) as caught:
        as_ieee(fails)(2.0)
    last = traceback.extract_tb(caught.value.__traceback__)[-1]
    assert last.filename == __file__
    assert last.line == "raise KeyError(y)"


def test_a_function_without_a_source_stays_as_it_is():
    found: dict = {}
    exec("def typed_in(x):\n    return x", found)
    assert as_ieee(found["typed_in"]) is found["typed_in"]


def test_an_edited_file_is_read_again(tmp_path):
    """As by `importlib.reload`: the line is the same, what stands in it is not."""
    path = tmp_path / "edited.py"
    for text, expected in (("1.0 / x", math.inf), ("-100.0 / x", -math.inf)):
        path.write_text(f"def share(x):\n    return {text}\n")
        found: dict = {}
        exec(compile(path.read_text(), str(path), "exec"), found)
        assert as_ieee(found["share"])(0.0) == expected


def test_a_function_of_a_notebook_has_a_source():
    """Its cell is no file; its lines are known to `linecache`."""
    source, found = "def share(x):\n    return 1.0 / x\n", {}
    linecache.cache["<cell>"] = (len(source), None, source.splitlines(keepends=True), "<cell>")
    exec(compile(source, "<cell>", "exec"), found)
    assert as_ieee(found["share"])(0.0) == math.inf
    del linecache.cache["<cell>"]


def test_fields_of_records_are_attributes_even_one_named_shape():
    """An attribute `shape` of NumPy's own records is theirs, not the field's: a block fell through the floor by it."""
    array = np.zeros(2, [("shape", int), ("mass", float), ("arm", float, (2, 3))])
    array["shape"] = 3, 4
    (lent,) = records_of((array,))
    assert lent.shape == (2,)
    second = lent[1]
    assert second.shape == 4
    second.mass, second.arm[1, 2] = 5.0, 6.0
    assert array["mass"][1] == 5.0
    assert array["arm"][1, 1, 2] == 6.0
    assert lent[1] is second
