"""The recipes of `docs/extending.md` do what they say, carried out from their text."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

from tests.docs import recipes
from tests.tiers.sweep import sweep

TITLES = recipes.titles()
PROVEN = [title for title in TITLES if "task" not in title]  # in the default tier: `test_tasks_page` makes a task, too

EACH_EFFECT_HAS_A_CASE = """
from physics.scene.force_fields import FIELDS
from rigid_env.lab.measure.effects import CASES

names = {name.replace(" ", "") for name in CASES}
assert names.issuperset(kind.__name__.lower() for kind in FIELDS), names
"""

ONE_AFTER_ANOTHER = """
import json, sys, traceback

errors = {}
for title, program in json.loads(sys.argv[1]).items():
    try:
        exec(compile(program, title, "exec"), {"__name__": "__main__"})
    except BaseException:
        errors[title] = traceback.format_exc()
print(json.dumps(errors))
"""


@pytest.fixture(scope="module")
def changed_packages(tmp_path_factory):
    """A copy of the packages with all recipes carried out, so that their kernels are compiled under one digest."""
    folder = tmp_path_factory.mktemp("recipes")
    recipes.copy_packages(folder)
    for title in TITLES:
        recipes.apply(title, folder)
    return folder


def run(program: str, folder, cache, *arguments: str) -> subprocess.CompletedProcess:
    """Run a program on the packages in a folder."""
    environment = {
        **os.environ, "PYTHONPATH": str(folder), "NUMBA_CACHE_DIR": str(cache), "SDL_VIDEODRIVER": "dummy"
    }  # fmt: skip
    command = [sys.executable, "-c", program, *arguments]
    return subprocess.run(command, capture_output=True, text=True, cwd=folder, env=environment, timeout=600)


def test_there_are_four_in_order():
    kinds = ["an effect", "a shape", "a contact solver", "a task"]
    assert [f"Recipe {k}: add {kind}" for k, kind in enumerate(kinds, 1)] == TITLES


@pytest.mark.parametrize("title", TITLES)
def test_each_applies_alone_to_the_files_it_names(title, tmp_path):
    recipes.copy_packages(tmp_path)
    text = recipes.text_of(title)
    for path in recipes.apply(title, tmp_path):
        compile((tmp_path / path).read_text(encoding="utf-8"), path, "exec")
        assert f"`{path}`" in text


@pytest.fixture(scope="module")
def errors(changed_packages, is_exhaustive):
    """Errors of proofs that fail, by their title; the default tier imports the packages once for all."""
    cache = changed_packages / "cache"
    if not is_exhaustive:
        programs = {title: recipes.proof(title) for title in PROVEN} | {"cases": EACH_EFFECT_HAS_A_CASE}
        done = run(ONE_AFTER_ANOTHER, changed_packages, cache, json.dumps(programs))
        assert done.returncode == 0, done.stderr[-3000:]
        return json.loads(done.stdout)
    programs = {title: recipes.proof(title) for title in TITLES} | {"cases": EACH_EFFECT_HAS_A_CASE}
    ended = {title: run(program, changed_packages, cache) for title, program in programs.items()}
    return {title: done.stderr[-3000:] for title, done in ended.items() if done.returncode != 0}


@pytest.mark.interpreted
@pytest.mark.parametrize("title", sweep(TITLES, PROVEN))
def test_the_proof_holds(title, errors):
    assert title not in errors, errors[title]


@pytest.mark.interpreted
def test_an_added_effect_has_all_that_tests_ask_of_one(errors):
    assert "cases" not in errors, errors["cases"]


def test_a_hunk_that_does_not_fit_is_seen():
    assert recipes.changed("a = 1\nb = 2\n", " a = 1\n+c = 3\n", "file") == "a = 1\nc = 3\nb = 2\n"
    for text in ("b = 2\n", "a = 1\na = 1\n", "aa = 1\n"):
        with pytest.raises(AssertionError, match=r"file has [02] places of"):
            recipes.changed(text, "-a = 1\n", "file")
