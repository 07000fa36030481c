"""Conversion of functions to the arithmetic of machine code: infinity or NaN where Python raises an exception.

Quotients, powers and functions of `math` in a kernel are replaced by calls of the functions here. For this the source
of the kernel is parsed and rewritten. All lines keep their numbers, so that a debugger stops at the statements of the
file.
"""

from __future__ import annotations

import ast
import linecache
import math
from collections.abc import Callable
from functools import cache
from types import CodeType, FunctionType, SimpleNamespace

import numpy as np


def divide(x, y):
    """Quotient of two numbers; infinite for a division by zero, NaN for 0 / 0."""
    try:
        return x / y
    except ZeroDivisionError:
        with np.errstate(all="ignore"):
            return float(np.float64(x) / np.float64(y))


def power(x, n):
    """Power of a number; for a small integer exponent by the same products as Numba's, in the same order."""
    if isinstance(n, int) and not isinstance(x, int) and 0 <= n <= _MAX_PRODUCTS:
        result = 1.0
        while n:
            if n & 1:
                result = result * x
            n >>= 1
            x = x * x if n else x
        return result
    with np.errstate(all="ignore"):
        return x**n if isinstance(x, int) else float(np.float64(x) ** n)


_MAX_PRODUCTS = 64


def _guarded(function: Callable) -> Callable:
    """Wrap a function of `math`: where it raises an exception, the wrapper returns NumPy's result."""
    named = {"acos": "arccos", "asin": "arcsin", "atan": "arctan", "pow": "power"}
    of_numpy = getattr(np, named.get(function.__name__, function.__name__), None)

    def call(*numbers):
        try:
            return function(*numbers)
        except (ValueError, OverflowError):
            if of_numpy is None:
                raise
            with np.errstate(all="ignore"):
                return float(of_numpy(*numbers))

    call.__name__, call.__doc__ = function.__name__, function.__doc__
    return call


IEEE_MATH = SimpleNamespace(
    **{name: value for name, value in vars(math).items() if not callable(value)},
    **{name: _guarded(value) for name, value in vars(math).items() if callable(value) and not name.startswith("_")},
)

_NAMES = {"__ieee_divide__": divide, "__ieee_power__": power, "__ieee_math__": IEEE_MATH}


class _Rewrite(ast.NodeTransformer):
    """Transformer of a syntax tree that replaces ``/``, ``**`` and `math` by `divide`, `power` and `IEEE_MATH`."""

    def visit_BinOp(self, node):
        self.generic_visit(node)
        name = {ast.Div: "__ieee_divide__", ast.Pow: "__ieee_power__"}.get(type(node.op))
        return node if name is None else _call(name, node, node.left, node.right)

    def visit_AugAssign(self, node):
        self.generic_visit(node)
        name = {ast.Div: "__ieee_divide__", ast.Pow: "__ieee_power__"}.get(type(node.op))
        if name is None:
            return node
        read = ast.parse(ast.unparse(node.target), mode="eval").body
        value = _call(name, node, ast.copy_location(read, node.target), node.value)
        return ast.fix_missing_locations(ast.copy_location(ast.Assign([node.target], value), node))

    def visit_Name(self, node):
        if node.id == "math":
            return ast.copy_location(ast.Name("__ieee_math__", node.ctx), node)
        return node


def _call(name: str, where: ast.AST, *arguments: ast.expr) -> ast.Call:
    made = ast.Call(ast.Name(name, ast.Load()), list(arguments), [])
    return ast.fix_missing_locations(ast.copy_location(made, where))


@cache
def _codes(file: str, source: str) -> dict[tuple[int, str], CodeType]:
    """Rewritten code of all functions in the source of a file, by first line and name."""
    try:
        tree = ast.parse(source)
    except SyntaxError:  # such as a cell of a notebook with commands that are no Python
        return {}
    found, left = {}, [compile(_Rewrite().visit(tree), file, "exec", dont_inherit=True)]
    while left:
        inner = [each for each in left.pop().co_consts if isinstance(each, CodeType)]
        found.update({(code.co_firstlineno, code.co_name): code for code in inner})
        left.extend(inner)
    return found


def as_ieee(function: FunctionType) -> FunctionType:
    """Convert a function to the arithmetic of machine code; it is returned unchanged if its source is unknown."""
    old = function.__code__
    linecache.checkcache(old.co_filename)  # it may have been edited
    source = "".join(linecache.getlines(old.co_filename, function.__globals__))
    code = _codes(old.co_filename, source).get((old.co_firstlineno, old.co_name))
    if code is None or code.co_name == "<lambda>":  # a line may hold several lambdas, which are not told apart
        return function
    function.__globals__.update(_NAMES)
    cells = dict(zip(old.co_freevars, function.__closure__ or (), strict=True))
    made = FunctionType(
        code,
        function.__globals__,
        function.__name__,
        function.__defaults__,
        tuple(cells[name] for name in code.co_freevars),
    )
    made.__kwdefaults__, made.__doc__ = function.__kwdefaults__, function.__doc__
    made.__qualname__, made.__module__, made.__dict__ = function.__qualname__, function.__module__, dict(vars(function))
    return made
