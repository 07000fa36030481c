"""Functions with the arithmetic of machine code: infinite or no number where Python raises an exception.

A quotient, a power and a function of `math` of a kernel are calls of functions here. A function is parsed and written
anew for that, line by line where it stands, so that a debugger stops at the statements of its file.
"""

from __future__ import annotations
import __future__

import ast
import copy
import inspect
import math
import textwrap
from collections.abc import Callable
from functools import cache
from pathlib import Path
from types import CodeType, FunctionType, SimpleNamespace

import numpy as np


def divide(x, y):
    """Quotient of two numbers; of one by zero infinite, of zero by zero no number."""
    try:
        return x / y
    except ZeroDivisionError:
        with np.errstate(all="ignore"):
            return float(np.float64(x) / np.float64(y))


def power(x, n):
    """Power: for a small whole exponent the products that Numba takes, in its order."""
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
    """A function of `math` that gives what NumPy gives where Python raises."""
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
    """Calls of `divide`, `power` and `IEEE_MATH` in place of operators and of `math`."""

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
def _tree(file: str) -> dict[int, ast.FunctionDef]:
    """Functions of a file by the line in which they or their decorators begin."""
    found = {}
    for node in ast.walk(ast.parse(Path(file).read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef):
            for line in (node.lineno, *(each.lineno for each in node.decorator_list)):
                found[line] = node
    return found


def _definition(function: FunctionType) -> ast.FunctionDef | None:
    """Return the source of a function as a tree; None where there is none, as of one typed in."""
    code = function.__code__
    found = None
    if Path(code.co_filename).is_file():
        found = _tree(code.co_filename).get(code.co_firstlineno)
    if found is None:
        try:
            lines, first = inspect.getsourcelines(function)
            found = ast.parse(textwrap.dedent("".join(lines))).body[0]
        except (OSError, TypeError, SyntaxError, IndexError):
            return None
        ast.increment_lineno(found, max(first, 1) - 1)
    return found if isinstance(found, ast.FunctionDef) and found.name == code.co_name else None


def as_ieee(function: FunctionType) -> FunctionType:
    """Make a function whose numbers behave as those of machine code; the same one where its source is not known."""
    found = _definition(function)
    if found is None:
        return function
    definition = copy.deepcopy(found)
    definition.decorator_list, definition.returns = [], None
    code = _compiled(_Rewrite().visit(definition), function)
    function.__globals__.update(_NAMES)
    cells = dict(zip(function.__code__.co_freevars, function.__closure__ or (), strict=True))
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


def _compiled(definition: ast.FunctionDef, function: FunctionType) -> CodeType:
    """Code of a function; what it takes from functions around it stays so."""
    free = function.__code__.co_freevars
    module = ast.parse(f"def around({', '.join(free)}):\n    pass")
    around = module.body[0]
    around.body = [definition, ast.Return(ast.Name(definition.name, ast.Load()))]
    ast.fix_missing_locations(ast.copy_location(around, definition))
    for each in ast.walk(around):  # what was added stands where the function does
        if hasattr(each, "end_lineno") and each.end_lineno < each.lineno:
            ast.copy_location(each, definition)
    outer = compile(
        module, function.__code__.co_filename, "exec", dont_inherit=True, flags=__future__.annotations.compiler_flag
    )
    within = next(each for each in outer.co_consts if isinstance(each, CodeType))
    return next(each for each in within.co_consts if isinstance(each, CodeType) and each.co_name == definition.name)
