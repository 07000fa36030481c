"""The check of prose that CI runs finds what it should, and this checkout has none of it."""

from __future__ import annotations

import importlib.machinery
import importlib.util
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / ".ci" / "prose"


@pytest.fixture(scope="module")
def prose():
    """The script `.ci/prose` as a module."""
    if not SCRIPT.exists():
        pytest.skip("needs a checkout with .ci")
    loader = importlib.machinery.SourceFileLoader("prose", str(SCRIPT))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("prose", loader))
    loader.exec_module(module)
    return module


@pytest.mark.parametrize("opening", ["How", "Of", "That", "What", "Where", "Whether", "Which"])
def test_clauses_in_place_of_nouns_are_found(prose, opening):
    source = f'class Body:\n    """Rigid body."""\n\n    def touch(self):\n        """{opening} touches."""\n'
    assert [line for line, _ in prose.opening_faults(source)] == [4]


def test_verbs_and_nouns_pass(prose):
    source = '"""Offset of a wall."""\n\ndef clip():\n    """Clip a polygon.\n\n    What is left is convex."""\n'
    assert not list(prose.opening_faults(source))


def test_phrases_are_found_across_lines_and_in_comments(prose):
    text = "a body that is all\n    but at rest\n# what is asked\n# for\nNo more than that\n"
    assert [line for line, _ in prose.phrase_faults(text)] == [1, 3, 5]


def test_words_that_hold_a_phrase_pass(prose):
    assert not list(prose.phrase_faults("call butter, masked for, nobody itself"))
