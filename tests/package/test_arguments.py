"""A function has at most nine arguments, unless users see its signature: constructors for editors, and commands."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from tests.package.test_unused import sources

MOST = 9

SEEN = {
    "agents/accuracy_transfer.py main": "command",
    "agents/record.py main": "command",
    "agents/sweep.py main": "command",
    "agents/train.py main": "command",
    "benchmarks/soak.py main": "command",
    "physics/scene/bodies.py Block.__init__": "for editors: the dataclass makes another one",
    "physics/scene/bodies.py Ellipsoid.__init__": "for editors: the dataclass makes another one",
    "physics/scene/capsule.py Capsule.__init__": "for editors: the dataclass makes another one",
    "physics/scene/compound.py Compound.__init__": "for editors: the dataclass makes another one",
    "physics/scene/cylinder.py Cylinder.__init__": "for editors: the dataclass makes another one",
    "physics/scene/bodies.py Hull.__init__": "for editors: the dataclass makes another one",
    "physics/scene/bodies.py Sphere.__init__": "for editors: the dataclass makes another one",
    "physics/world/world.py World.set_parameters": "for users: all parameters by name",
    "rigid_env/cli/exploring.py run": "command",
    "rigid_env/cli/measuring.py accuracy": "command",
    "rigid_env/cli/measuring.py hard_cases": "command",
    "rigid_env/cli/viewing.py view": "command",
    "rigid_env/envs/task.py TaskEnv.__init__": "for editors: settings of any name are taken, besides",
    "rigid_env/envs/task.py TaskVectorEnv.__init__": "for editors: settings of any name are taken, besides",
}


def functions(node: ast.AST, name: str = "") -> Iterator[tuple[str, int]]:
    """Functions inside a node by their qualified names, with the numbers of their arguments, `self` apart."""
    for child in ast.iter_child_nodes(node):
        within = name
        if isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)):
            within = f"{name}.{child.name}".lstrip(".")
        if isinstance(child, (ast.FunctionDef, ast.AsyncFunctionDef, ast.Lambda)):
            yield within, len(arguments(child))
        yield from functions(child, within)


def arguments(function: ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda) -> list[str]:
    """Names of a function's arguments, without that of its object or class."""
    given = function.args
    rest = [each for each in (given.vararg, given.kwarg) if each is not None]
    named = [each.arg for each in (*given.posonlyargs, *given.args, *given.kwonlyargs, *rest)]
    return named[named[:1] in (["self"], ["cls"]) :]


def test_arguments_are_counted():
    found = functions(ast.parse("class A:\n def b(self, x, /, y, *, z, **w): return lambda u, *v: 0\ndef c(): ..."))
    assert list(found) == [("A.b", 4), ("A.b", 2), ("c", 0)]


def test_most_arguments():
    long = {f"{path} {name}" for path, tree in sources().items() for name, count in functions(tree) if count > MOST}
    assert long == set(SEEN)
