"""Every wrong input of the table is refused with a message that says what is wrong, and changes nothing."""

from __future__ import annotations

import importlib
import pkgutil
from functools import cache

import numpy as np
import pytest

from tests import wrong_input

pytestmark = pytest.mark.interpreted

MODULES = [
    module
    for found in pkgutil.iter_modules(wrong_input.__path__)
    if not found.name.startswith("test_")
    and hasattr(module := importlib.import_module(f"{wrong_input.__name__}.{found.name}"), "CASES")
]
ROWS = [
    pytest.param(module, case, id=f"{module.__name__.rsplit('.', 1)[1]}-{case.id}")
    for module in MODULES
    for case in module.CASES
]

# A message is read on a screen.
LONGEST = 600


@cache
def subject(module, name):
    """The thing of a module's `SUBJECTS`, made once: wrong input must not change it."""
    return module.SUBJECTS[name]()


def bits(value) -> object:
    """The same for two values exactly when their bits are the same."""
    if isinstance(value, np.ndarray):
        return (value.dtype.str, value.shape, value.tobytes())
    if isinstance(value, dict):
        return {key: bits(part) for key, part in value.items()}
    if isinstance(value, (tuple, list)):
        return [bits(part) for part in value]
    if isinstance(value, float):
        return value.hex()
    return value


@pytest.mark.parametrize(("module", "case"), ROWS)
def test_it_is_refused_in_plain_words(module, case):
    arguments = () if case.on is None else (subject(module, case.on),)
    before = None if case.on is None else bits(module.state_of(*arguments))
    with pytest.raises(case.raises) as told:
        case.do(*arguments)
    message = str(told.value)
    assert told.type in case.raises, f"{told.type.__name__}: {message}"
    assert [word for word in case.words if word not in message] == [], message
    assert len(message) <= LONGEST, message
    if case.on is not None:
        assert bits(module.state_of(*arguments)) == before, "it changed something"


def test_ids_are_unique():
    for module in MODULES:
        ids = [case.id for case in module.CASES]
        assert len(set(ids)) == len(ids), module.__name__


def test_rows_say_field_and_value():
    """A row that asks for next to nothing could not fail."""
    assert [case.id for module in MODULES for case in module.CASES if not any(case.words)] == []
