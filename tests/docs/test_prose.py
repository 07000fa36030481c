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


def test_docstrings_of_constants_and_fields_are_found(prose):
    source = (
        'SIZE = 3\n"""Of pictures."""\nclass A:\n    a: int = 1\n    """How many."""\n    b = 2\n    """Count."""\n'
    )
    assert [line for line, _ in prose.opening_faults(source)] == [2, 5]


def test_strings_that_follow_no_assignment_are_none_of_a_constant(prose):
    assert not list(prose.opening_faults('SIZE = 3\nprint(SIZE)\n"""Of pictures."""\nTEXT = "How far"\n'))


WORDS_35 = " ".join(["word"] * 35)


def test_sentences_of_more_than_35_words_are_found_where_they_begin(prose):
    page = f"# Title\n\nShort. {WORDS_35}.\nThen {WORDS_35}.\n\nEnd.\n"
    (fault,) = prose.length_faults(page)
    assert fault == (4, "sentence of 36 words; write 35 at most: Then word word word word word ...")


@pytest.mark.parametrize(
    "between",
    [", e.g. ", " in Fig. ", " of 0.5 and ", " (cf. ", ": ", "; ", " [text](page.md#place) ", " at\n  ", " `a.b` "],
    ids=repr,
)
def test_sentences_go_on(prose, between):
    assert len(list(prose.length_faults(f"{WORDS_35}{between}more"))) == 1


@pytest.mark.parametrize(
    "between",
    [". ", "? ", "! ", ".) ", '." ', ".** ", "\n\n", "\n- ", "\n  2. ", "\n## ", "\n| cell |\n", "\n```\ncode\n```\n"],
    ids=repr,
)
def test_sentences_end(prose, between):
    page = f"{WORDS_35}{between}{WORDS_35}"
    assert [prose.word_count(sentence) for _, sentence in prose.sentences(page)] == [35, 35]


@pytest.mark.parametrize(
    "left_out",
    [
        f"| {WORDS_35} | more |",
        f"```sh\n{WORDS_35} more\n```",
        f"Formula:\n\n    {WORDS_35}\n\n    more {WORDS_35}\n\nand",
        f"<!-- {WORDS_35}\n{WORDS_35} -->",
        f"{WORDS_35} = + - → *",
    ],
    ids=["table", "fence", "indented", "comment", "signs"],
)
def test_tables_code_comments_and_signs_count_no_words(prose, left_out):
    assert not list(prose.length_faults(left_out))


def test_targets_of_links_count_no_words(prose):
    assert [prose.word_count(text) for _, text in prose.sentences("See [the page](a b c) and\n[it](pages/x.md).")] == [
        5
    ]


def test_indented_lines_of_an_item_count(prose):
    assert len(list(prose.length_faults(f"- An item that\n    goes on, {WORDS_35}\n"))) == 1


def test_phrases_are_found_across_lines_and_in_comments(prose):
    text = "a body that is all\n    but at rest\n# what is asked\n# for\nNo more than that\n"
    assert [line for line, _ in prose.phrase_faults(text)] == [1, 3, 5]


def test_words_that_hold_a_phrase_pass(prose):
    assert not list(prose.phrase_faults("call butter, masked for, nobody itself"))
