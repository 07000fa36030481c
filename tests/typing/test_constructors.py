"""Constructors that checkers see have the parameters that the dataclasses make."""

from __future__ import annotations

import ast
import importlib
import inspect

import pytest

MODULES = ("bodies", "capsule", "compound", "cylinder", "effects", "force_fields", "springs", "scene")


def declared(module) -> dict[str, list[str]]:
    """Parameters of each constructor under `TYPE_CHECKING`, keyword-only ones behind a star, by class."""
    found = {}
    for node in ast.parse(inspect.getsource(module)).body:
        inits = [each for each in ast.walk(node) if isinstance(each, ast.FunctionDef) and each.name == "__init__"]
        if isinstance(node, ast.ClassDef) and inits:
            given = inits[0].args
            stars = [f"*{each.arg}" for each in given.kwonlyargs]
            found[node.name] = [each.arg for each in given.args[1:]] + sorted(stars)
    return found


@pytest.mark.parametrize("name", MODULES)
def test_constructors(name):
    module = importlib.import_module(f"physics.scene.{name}")
    assert declared(module)
    for kind, names in declared(module).items():
        parameters = inspect.signature(getattr(module, kind)).parameters.values()
        made = [each.name for each in parameters if each.kind is not each.KEYWORD_ONLY]
        assert names == made + sorted(f"*{each.name}" for each in parameters if each.kind is each.KEYWORD_ONLY), kind
