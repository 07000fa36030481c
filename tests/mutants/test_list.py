"""The list of mutants is up to date: each still applies, and its tests are there."""

from __future__ import annotations

import ast
from collections import Counter

import pytest

from tests.mutants.catalogue import MUTANTS, covered_folders
from tests.mutants.mutant import ROOT, Mutant
from tests.mutants.results import BROKEN, KILLED, SURVIVED, Results
from tests.mutants.runner import Outcome, verdict_of

LEAST, LEAST_OF_A_FOLDER = 64, 2


def test_there_are_enough_in_every_folder():
    assert len(MUTANTS) >= LEAST
    counts = {folder: sum(mutant.path.startswith(f"{folder}/") for mutant in MUTANTS) for folder in covered_folders()}
    assert {folder: count for folder, count in counts.items() if count < LEAST_OF_A_FOLDER} == {}


def test_names_are_unique():
    assert [name for name, count in Counter(mutant.name for mutant in MUTANTS).items() if count > 1] == []


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.name)
def test_a_mutant_applies_and_its_tests_are_there(mutant):
    ast.parse(mutant.mutated((ROOT / mutant.path).read_text(encoding="utf-8")))
    assert mutant.fault.endswith(".")
    assert mutant.tests
    for test in mutant.tests:
        path, *names = test.split("[")[0].split("::")
        tree = ast.parse((ROOT / path).read_text(encoding="utf-8"))
        assert set(names) <= {node.name for node in ast.walk(tree) if isinstance(node, (ast.FunctionDef, ast.ClassDef))}


def test_a_text_that_does_not_occur_once_is_told():
    mutant = Mutant("twice", "A fault.", "path.py", "a", "b", ())
    assert mutant.mutated("xa") == "xb"
    for text in ("", "aa"):
        with pytest.raises(ValueError, match="twice no longer applies"):
            mutant.mutated(text)


@pytest.mark.parametrize(
    ("status", "ran", "failure", "verdict"),
    [
        (0, 3, "", SURVIVED),
        (0, 0, "", BROKEN),
        (1, 1, "assert 1 == 2", KILLED),
        (1, 1, "AssertionError: ", KILLED),
        (1, 1, "numba.core.errors.TypingError: no", BROKEN),
        (1, 0, "", BROKEN),
        (2, 0, "", BROKEN),
        (5, 0, "", BROKEN),
        (-9, 0, "", BROKEN),
    ],
)
def test_only_a_failed_assertion_kills(status, ran, failure, verdict):
    assert verdict_of(Outcome(status, ran, failure, "some output"))[0] == verdict


def test_verdicts_are_kept_until_the_mutant_changes(tmp_path):
    path, mutant = tmp_path / "mutants.json", MUTANTS[0]
    Results(path).keep(mutant, KILLED, 1.0, "assert")
    assert Results(path).of(mutant)["verdict"] == KILLED
    assert Results(path).of(mutant._replace(new="other")) is None
    results = Results(path)
    results.forget_others(set())
    assert Results(path).rows == {}
