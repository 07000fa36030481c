"""The README is short, and what it says to copy works: each block of Python alone, the commands that set up."""

from __future__ import annotations

import pytest

from tests.docs import snippets

ROOT = snippets.ROOT
README = ROOT / "README.md"
BLOCKS = snippets.blocks(README, "python")


@pytest.mark.parametrize("block", BLOCKS, ids=[f"line {block.line}" for block in BLOCKS])
def test_each_block_runs_as_it_stands(block, tmp_path):
    snippets.run(block.code, README, tmp_path)


VENV = "python3 -m venv .venv && . .venv/bin/activate"
SMALL_TORCH = "pip install -c constraints.txt --no-deps torch --index-url https://download.pytorch.org/whl/cpu"
INSTALL = "pip install -c constraints.txt -e"


def test_the_readme_is_short_and_its_two_commands_stand():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 150
    blocks = snippets.blocks(ROOT / "README.md", "sh")
    commands = [" ".join(block.code.replace("\\\n", " ").split()) for block in blocks]
    assert f'{VENV} && {SMALL_TORCH} && {INSTALL} ".[agents]" && python -m agents.train' in commands
    assert f'{VENV} && {SMALL_TORCH} && {INSTALL} ".[dev]" && python -m pytest -n 2 --dist loadfile' in commands


def test_ci_installs_as_the_readme_says():
    script = ROOT / ".ci" / "run"
    if not script.exists():
        pytest.skip("needs a checkout with .ci")
    lines = script.read_text(encoding="utf-8").replace("install -q ", "install ").splitlines()
    assert lines.index(SMALL_TORCH) + 1 == lines.index(f'{INSTALL} ".[dev]"')
