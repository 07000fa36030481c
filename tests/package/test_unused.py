"""No parameter is left that its function does not use, and no private function that its module does not.

`vulture` looks for names only, anywhere. A parameter shares its name with others, and so does a private function.
"""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Iterator
from functools import cache

import pytest

from tests.docs.snippets import ROOT

PACKAGES = ("physics", "rigid_env", "agents", "benchmarks")
CALLED = (
    "kernel",
    "cold_kernel",
    "entry_kernel",
    "shared_kernel",
    "inlined",
    "cache",
    "contextmanager",
    "staticmethod",
)
"""Decorators under which a function is called by its name, and by nobody else."""

EXCEPTIONS = {"_turned_scene", "_half_turn"}
"""Names of functions that may have an unused last parameter."""

FUNCTIONS = (ast.FunctionDef, ast.AsyncFunctionDef)


@cache
def sources() -> dict[str, ast.Module]:
    """Syntax trees of the packages, by path."""
    paths = (path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py")))
    return {str(path.relative_to(ROOT)): ast.parse(path.read_text(encoding="utf-8")) for path in paths}


def names(nodes) -> Counter:
    """Count the names and attributes among some nodes."""
    return Counter(node.id for node in nodes if isinstance(node, ast.Name)) + Counter(
        node.attr for node in nodes if isinstance(node, ast.Attribute)
    )


def passed_on(trees) -> set[str]:
    """Names of functions that are read without being called: whoever has them sets their parameters."""
    nodes = [node for tree in trees for node in ast.walk(tree)]
    called = {id(node.func) for node in nodes if isinstance(node, ast.Call)}
    return set(names([node for node in nodes if id(node) not in called]))


def unused_parameters(function: ast.FunctionDef) -> list[str]:
    """Parameters that neither the body nor a decorator, as in `if_given("contact.friction")`, names."""
    given = function.args
    parameters = [
        each.arg for each in (*given.posonlyargs, *given.args, *given.kwonlyargs, given.vararg, given.kwarg) if each
    ]
    used = names([node for line in function.body for node in ast.walk(line)])
    used.update(word for decorator in function.decorator_list for word in re.findall(r"\w+", ast.unparse(decorator)))
    return [name for name in parameters if name not in used and name not in ("self", "cls") and name[0] != "_"]


def own_functions(trees) -> Iterator[ast.FunctionDef]:
    """Functions, and private methods, whose name stands for nothing else and that are only called."""
    functions = [node for tree in trees for node in ast.walk(tree) if isinstance(node, FUNCTIONS)]
    methods = {
        id(each) for tree in trees for node in ast.walk(tree) if isinstance(node, ast.ClassDef) for each in node.body
    }
    times, taken = Counter(function.name for function in functions), passed_on(trees)
    for function in functions:
        is_public_method = id(function) in methods and not re.match("_[^_]", function.name)
        is_registered = any(ast.unparse(each) not in CALLED for each in function.decorator_list)
        if times[function.name] == 1 and function.name not in taken and not is_public_method and not is_registered:
            yield function


def faults(trees) -> list[str]:
    """Functions with parameters that they do not use, with these."""
    found = ((function.name, unused_parameters(function)) for function in own_functions(trees))
    return [f"{name}: {', '.join(unused)}" for name, unused in found if unused and name not in EXCEPTIONS]


def unused_functions(tree: ast.Module) -> list[str]:
    """Private functions of a module, not registered anywhere, that the module does not name."""
    read = names(list(ast.walk(tree)))
    private = (node for node in tree.body if isinstance(node, FUNCTIONS) and re.match("_[^_]", node.name))
    return [
        each.name for each in private
        if not read[each.name] and all(ast.unparse(decorator) in CALLED for decorator in each.decorator_list)
    ]  # fmt: skip


def test_every_parameter_is_used():
    assert faults(sources().values()) == []


@pytest.mark.parametrize("package", PACKAGES)
def test_every_private_function_is_used(package):
    trees = {path: tree for path, tree in sources().items() if path.startswith(package)}
    assert {path: unused_functions(tree) for path, tree in trees.items() if unused_functions(tree)} == {}


def test_what_is_not_used_is_found():
    tree = ast.parse("@inlined\ndef step(x, y, work):\n    return x\n\n\nstep(1, 2, 3)\n\n\ndef _left(): ...\n")
    assert faults([tree]) == ["step: y, work"]
    assert unused_functions(tree) == ["_left"]


@pytest.mark.parametrize(
    "text",
    [
        "def step(x): ...\n\n\nTABLE = [step]",
        "@if_given('x.y')\ndef step(x):\n    return 1",
        "def step(x): ...\n\n\ndef step(x, y): ...",
        "class Task:\n    def step(self, x): ...",
    ],
)
def test_a_signature_that_somebody_else_sets_passes(text):
    assert faults([ast.parse(text)]) == []
