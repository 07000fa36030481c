"""Numba's temporaries of two variables never get one name.

Numba 0.68 calls the value that is loaded from variable `v` by the instruction at byte o, the n-th temporary of its
basic block, `$vo.n` (`numba.core.byteflow.State.make_temp`) with nothing between v and o. `$W1234.11` may therefore be
W1 at byte 234 or W12 at byte 34. Where both are made, each in a block of its own, the later one is renamed in its
definition and not in its use, and the function cannot be typed. Which bytes the instructions stand at differs from one
Python to the next; no pair of names that could meet is safe on all of them.

The first test is on names alone and holds for every Python. The second looks at the temporaries that Numba makes on the
Python it runs on, and the third at what Numba does with two that meet.
"""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from types import CellType, CodeType, FunctionType

import pytest
from numba import njit
from numba.core.bytecode import ByteCode, FunctionIdentity
from numba.core.byteflow import Flow, _flatten_inst_regs
from numba.core.errors import TypingError, UnsupportedBytecodeError

import physics

PACKAGE = Path(physics.__file__).parent
# Kernels, and the modules with kernels of their own besides.
WORLD = PACKAGE / "world"  # with kernels of its own
SOURCES = sorted(
    [
        *(PACKAGE / "kernels").rglob("*.py"),
        *(PACKAGE / "compiler").rglob("*.py"),
        WORLD / "report.py",
        WORLD / "parameters.py",
    ]
)

# Prefixes that Numba itself puts before the byte: a variable `phi3` meets them like one called `phi`.
OF_NUMBA = {"assertion_error", "common_constant", "const", "exception", "phi", "predicate", "setup_with_exitfn"}

# A function without any of these is one basic block on every Python, whose temporaries are numbered.
BRANCHES = (
    ast.Assert,
    ast.BoolOp,
    ast.For,
    ast.If,
    ast.IfExp,
    ast.Raise,
    ast.Try,
    ast.While,
    ast.With,
    ast.comprehension,
)


def _functions(source: str) -> Iterator[tuple[ast.FunctionDef | ast.Lambda, set[str]]]:
    """Every function of a source text, with the names of its local variables."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, (ast.FunctionDef, ast.Lambda)):
            arguments = {each.arg for each in ast.walk(node) if isinstance(each, ast.arg)}
            stored = {
                each.id for each in ast.walk(node) if isinstance(each, ast.Name) and isinstance(each.ctx, ast.Store)
            }
            yield node, arguments | stored


def _has_branches(function: ast.AST) -> bool:
    return any(
        isinstance(node, BRANCHES) or (isinstance(node, ast.Compare) and len(node.ops) > 1)
        for node in ast.walk(function)
    )


def names_that_could_meet(source: str) -> list[tuple[str, str, str]]:
    """(function, v, v and digits) of all functions with more than one basic block.

    A byte is written without leading zeros, so that v and v0 never meet.
    """
    met = []
    for function, names in _functions(source):
        if not _has_branches(function):
            continue
        for name in sorted(names):
            for stem in {name[:end] for end in range(1, len(name)) if name[end:].isdecimal() and name[end] != "0"}:
                if stem in names or stem in OF_NUMBA:
                    met.append((getattr(function, "name", "lambda"), stem, name))
    return met


def temporaries_that_meet(function: FunctionType) -> dict[str, list[int]]:
    """Temporaries that more than one basic block makes, each with the bytes at which those blocks begin."""
    flow = Flow(ByteCode(FunctionIdentity.from_function(function)))
    flow.run()
    made = defaultdict(list)
    for start, block in flow.block_infos.items():
        registers = set(_flatten_inst_regs(tuple(of.values()) for _, of in block.insts))
        for name in {each for each in registers if each.startswith("$")}:
            made[name].append(start)
    return {name: starts for name, starts in made.items() if len(starts) > 1}


def _code_objects(code: CodeType) -> Iterator[CodeType]:
    for constant in code.co_consts:
        if isinstance(constant, CodeType):
            yield constant
            yield from _code_objects(constant)


def _as_function(code: CodeType) -> FunctionType:
    return FunctionType(code, {}, closure=tuple(CellType(None) for _ in code.co_freevars))


# --- the kernels ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.relative_to(PACKAGE).as_posix())
def test_no_two_names_of_a_kernel_could_meet(path: Path):
    found = names_that_could_meet(path.read_text(encoding="utf-8"))
    assert not found, f"{path.name}: rename one of each pair: {found}"


def test_no_two_temporaries_of_a_kernel_meet():
    looked_at, met = 0, []
    for path in SOURCES:
        if path.parent.name == "fused":  # no kernels there
            continue
        for code in _code_objects(compile(path.read_text(encoding="utf-8"), str(path), "exec")):
            try:
                found = temporaries_that_meet(_as_function(code))
            except (UnsupportedBytecodeError, ValueError):  # a class, or a function that cannot be a kernel
                continue
            looked_at += 1
            met += [(path.name, code.co_name, found)] if found else []
    assert not met
    assert looked_at > 900


# --- the checks ----------------------------------------------------------------------------------------------------

# As it stood in `two_contacts`, where no Python 3.12 could compile it.
PUSHED_APART = """
def pushed_apart({0}, W12, {1}, b1, b2):
    s = 1.0 / ({0}[0] * {1}[0] - W12[0] * W12[0])
    p1, p2 = s * (W12[0] * b2 - {1}[0] * b1), s * (W12[0] * b1 - {0}[0] * b2)
    if p1 < 0.0:
        p1, p2 = 0.0, -b2 / {1}[0]
    elif p2 < 0.0:
        p1, p2 = -b1 / {0}[0], 0.0
    return (
        ({0}[0] * p1 + W12[0] * p2, {0}[3] * p1 + W12[3] * p2, {0}[6] * p1 + W12[6] * p2),
        (W12[0] * p1 + {1}[0] * p2, W12[1] * p1 + {1}[3] * p2, W12[2] * p1 + {1}[6] * p2),
    )
"""


def test_the_names_that_no_python_3_12_compiled_are_found():
    assert names_that_could_meet(PUSHED_APART.format("W1", "W2")) == [("pushed_apart", "W1", "W12")]
    assert names_that_could_meet(PUSHED_APART.format("W11", "W22")) == []


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ("def f(x):\n    x2 = x * x\n    return x2 if x > 0.0 else x", [("f", "x", "x2")]),
        ("def f(x):\n    x2 = x * x\n    return x2 + x", []),  # one block
        ("def f(x):\n    x0 = x * x\n    return x0 if x > 0.0 else x", []),  # no byte is written 034
        ("def f(x):\n    phi3 = x * x\n    return phi3 if x > 0.0 else x", [("f", "phi", "phi3")]),
        ("def g(x):\n    def f(x1):\n        return 1.0 < x1 < x1\n    return f", [("g", "x", "x1")]),
    ],
)
def test_which_names_could_meet(source: str, found: list):
    assert names_that_could_meet(source) == found


def _with_temporaries_that_meet() -> FunctionType:
    """A function (x1, x12, y) in which a temporary of x12 has the name of a later one of x1.

    So many products and signs stand before and after the use of each that they meet on the Python it runs on.
    """
    for before, after, less, minus in product(range(3, 20), range(4, 40), range(3), range(0, 6, 2)):
        source = f"""def f(x1, x12, y):
            s = {"y * " * before}x12{" * y" * after} * {"-" * minus}y
            if y > 2.0:
                s = s + 1.0
            return {"y * " * (before - less)}s + x1 * {"y * " * after}y
        """
        made: dict[str, FunctionType] = {}
        exec(source, made)
        if temporaries_that_meet(made["f"]):
            return made["f"]
    raise AssertionError("no such function found")


def test_where_temporaries_meet_numba_compiles_nothing_rather_than_something_else():
    function = _with_temporaries_that_meet()
    assert function(1.0, 2.0, 1.0) == 3.0
    with pytest.raises(TypingError, match="cannot be determined"):
        njit(function)(1.0, 2.0, 1.0)
    code = function.__code__
    names = tuple("x_1" if name == "x1" else name for name in code.co_varnames)
    renamed = FunctionType(code.replace(co_varnames=names), {})
    assert not temporaries_that_meet(renamed)
    assert njit(renamed)(1.0, 2.0, 1.0) == 3.0
