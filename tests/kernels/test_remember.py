"""Numba's contexts, asked once: what is remembered is what Numba would say, and only our kernels get it."""

from __future__ import annotations

import operator

import numba
import numpy as np
import pytest
from numba.core import types
from numba.core.registry import cpu_target
from numba.np.numpy_support import from_dtype

from physics.compiler.fused.memoised_contexts import MemoisedTarget, memoised

PAIRS = [
    (types.float64, types.float64),
    (types.int64, types.float64),
    (types.int64, types.int64),
    (types.boolean, types.int64),
    (types.UniTuple(types.float64, 3), types.UniTuple(types.float64, 2)),
]


@pytest.fixture(scope="module", autouse=True)
def registries():
    """Load all of Numba's registries, as it does where it compiles; a kernel may come from disk instead."""
    cpu_target.typing_context.refresh()
    cpu_target.target_context.refresh()


@pytest.mark.parametrize("function", [operator.add, operator.lt, operator.eq], ids=lambda f: f.__name__)
@pytest.mark.parametrize("pair", PAIRS, ids=str)
def test_a_signature_is_the_one_that_numba_finds(function, pair):
    context = cpu_target.typing_context
    kind = memoised(context).resolve_value_type(function)
    if function is operator.add or pair[0] is not PAIRS[-1][0]:
        ours = memoised(context).resolve_function_type(kind, pair, {})
        again = memoised(context).resolve_function_type(kind, pair, {})
        assert ours is again
        assert ours == context.resolve_function_type(context.resolve_value_type(function), pair, {})


def test_what_does_not_exist_is_refused_each_time():
    context = memoised(cpu_target.typing_context)
    kind = context.resolve_value_type(operator.add)
    for _ in range(2):
        with pytest.raises(numba.TypingError):
            context.resolve_function_type(kind, (types.none, types.float64), {})


def test_members_of_a_record_are_told_apart_by_its_type():
    context = memoised(cpu_target.typing_context)
    first = numba.from_dtype(np.dtype([("x", np.float64), ("y", np.int64)]))
    other = numba.from_dtype(np.dtype([("x", np.int64)]))
    for _ in range(2):
        assert context.resolve_getattr(first, "x") == types.float64
        assert context.resolve_getattr(first, "y") == types.int64
        assert context.resolve_getattr(other, "x") == types.int64


def test_a_size_is_the_one_that_llvm_gives():
    context = cpu_target.target_context
    for kind in (types.boolean, types.int32, types.float64, types.UniTuple(types.float64, 3)):
        layout = context.get_data_type(kind)
        assert MemoisedTarget(context).get_abi_sizeof(layout) == context.get_abi_sizeof(layout)


def remembered() -> list[int]:
    """Number of signatures that each function remembers."""
    return [len(each.signatures) for each in memoised(cpu_target.typing_context).functions.values()]


def test_functions_of_others_are_answered_by_numba():
    """Questions in Numba's own context leave no trace in the remembered answers."""
    known = remembered()

    @numba.njit
    def other(a, b):
        return a - b

    assert other(np.float32(3), np.complex64(1)) == 2
    assert remembered() == known


def test_the_symbol_of_a_kernel_that_stands_does_not_count_the_types_of_the_process():
    """Two processes that compile at once keep one file for both: a whole of the other one has to find its symbol."""
    target = MemoisedTarget(cpu_target.target_context)
    first, later = (from_dtype(np.dtype([(name, np.float64)])) for name in ("symbol_first", "symbol_later"))
    tags = {"abi_tags": ["digest"], "uid": 0}
    assert target.mangler("solve", (first,), **tags) == target.mangler("solve", (later,), **tags)
    assert target.mangler("solve", (first,), abi_tags=["other"], uid=0) != target.mangler("solve", (first,), **tags)
