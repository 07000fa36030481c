"""Snippets of the README and the docs run as they stand."""

from __future__ import annotations

import shlex
from pathlib import Path

import pytest
import typer

import physics
from rigid_env.cli import app
from tests.docs import snippets
from tests.tiers.sweep import sweep

ROOT = snippets.ROOT
USAGE_ERROR = typer.BadParameter.__base__


# Pages whose scenes and trainings take long, and those whose blocks run one by one: `test_tasks_page`, `test_readme`.
LONG = ("docs/environments.md", "docs/tasks.md", "README.md")
# Pages of many small scenes, whose kernels take longer to compile than their steps take in Python.
SMALL = ("docs/conventions.md", "docs/effects.md", "docs/pictures.md", "docs/queries.md", "docs/reports.md")
PAGES = sweep(snippets.pages_with("python"), lambda page: snippets.name_of(page) not in LONG, snippets.name_of)
PAGES = [page._replace(marks=(*page.marks, pytest.mark.interpreted)) if page.id in SMALL else page for page in PAGES]


@pytest.mark.parametrize("page", PAGES)
def test_python_runs_as_it_stands(page, tmp_path):
    """All blocks of a page in their order, in one new process, in an empty folder."""
    snippets.run(snippets.program(page), page, tmp_path)


def shell_lines():
    """Command lines of all pages, without comments; a line that ends in a backslash goes on in the next."""
    for page in snippets.PAGES:
        for block in snippets.blocks(page, "sh"):
            for line in block.code.replace("\\\n", " ").splitlines():
                words = shlex.split(line, comments=True)
                if words:
                    yield pytest.param(page, words, id=f"{snippets.name_of(page)}: {' '.join(words)[:60]}")


def parse(words: list[str]) -> None:
    """Read a command line of `rigid-env` without running it; an unknown option or a wrong number is an error."""
    group = typer.main.get_command(app)
    name, command, rest = group.resolve_command(group.make_context("rigid-env", words), words)
    command.make_context(name, list(rest))


@pytest.mark.parametrize(("page", "words"), list(shell_lines()))
def test_commands_have_the_options_that_are_written(page, words, tmp_path, monkeypatch):
    if words[0] == "rigid-env":
        monkeypatch.chdir(tmp_path)
        parse(words[1:])
    elif words[:2] == ["python", "-m"]:
        path = ROOT / Path(*words[2].split("."))
        assert words[2] == "pytest" or path.with_suffix(".py").is_file() or (path / "__main__.py").is_file()
    elif words[0].startswith(".ci/"):
        assert (ROOT / words[0]).is_file()
    else:
        assert words[0] in ("python3", "pip")


def test_an_option_that_is_not_there_is_seen():
    parse(["run", "kick.toml", "--dt", "0.01"])
    for words in (["run", "kick.toml", "--bogus"], ["run", "kick.toml", "--dt", "bogus"], ["bogus"]):
        with pytest.raises(USAGE_ERROR):
            parse(words)


def test_scene_files_are_scenes(tmp_path):
    for page in snippets.pages_with("toml"):
        for block in snippets.blocks(page, "toml"):
            path = tmp_path / "scene.toml"
            path.write_text(block.code, encoding="utf-8")
            if "[[bodies]]" in block.code:  # the others are parts of files
                assert physics.load_scene(path).bodies


@pytest.mark.parametrize("page", snippets.PAGES, ids=snippets.name_of)
def test_links_lead_somewhere(page):
    for target in snippets.links(page):
        assert (page.parent / target).exists(), target


def test_a_block_that_is_not_run_says_why(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("<!-- not run: needs a day -->\n\n```python\nx = 1\n```\n\ntext\n\n```python\ny = 2\n```\n")
    first, second = snippets.blocks(page, "python")
    assert (first.skipped, first.line, second.skipped, second.line) == ("needs a day", 4, "", 10)
    assert snippets.program(page).splitlines() == [""] * 9 + ["y = 2"]
