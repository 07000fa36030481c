"""Checkers see exact types in a user's program, accept it as it stands, and find planted mistakes."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROGRAM = Path(__file__).with_name("user_program.py")

MISTAKES = {
    "method": ("world.snapshot()", "world.snapsot()"),
    "preset": ('accuracy="fast"', 'accuracy="fasst"'),
    "keyword": ("threads=2", "thread=2"),
    "keyword of an environment": ('walls="corner"', 'wall="corner"'),
    "shape": ("physics.Ellipsoid(", "physics.Elipsoid("),
    "effect": ("physics.Gravity([0", "physics.Gravitation([0"),
}

# Packages whose types the program does not need: mypy would read thousands of their files.
SKIPPED = (
    "torch", "numba", "llvmlite", "matplotlib", "pandas", "pygame", "viser", "scipy", "rich", "typer",
    "stable_baselines3", "physics.kernels", "rigid_env.lab",
)  # fmt: skip


def planted(folder: Path) -> dict[str, int]:
    """Write the program as it stands and one copy with all mistakes; the line of each mistake."""
    text = PROGRAM.read_text(encoding="utf-8")
    (folder / "correct.py").write_text(text, encoding="utf-8")
    lines = {}
    for name, (right, wrong) in MISTAKES.items():
        assert text.count(right) >= 1, right
        lines[name] = text.count("\n", 0, text.index(right)) + 1
        text = text.replace(right, wrong, 1)
    (folder / "mistaken.py").write_text(text, encoding="utf-8")
    return lines


def check(found: dict[str, dict[int, str]], lines: dict[str, int]) -> None:
    """Compare the errors of a checker, by file and line, with the mistakes; nothing else may be wrong."""
    assert found.get("correct.py", {}) == {}
    missed = {name for name, line in lines.items() if line not in found.get("mistaken.py", {})}
    assert not missed, found


def test_mypy(tmp_path_factory: pytest.TempPathFactory) -> None:
    pytest.importorskip("mypy", reason="mypy is not installed: it is in the extra `dev`")
    folder = tmp_path_factory.mktemp("mypy")
    lines = planted(folder)
    skipped = "".join(f"[mypy-{name}.*]\nfollow_imports = skip\nignore_missing_imports = True\n" for name in SKIPPED)
    config = f"[mypy]\nstrict = True\nfollow_imports = silent\nmypy_path = {ROOT}\ncache_dir = {folder / 'cache'}\n"
    (folder / "mypy.ini").write_text(config + skipped, encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "mypy", "--config-file", "mypy.ini", "correct.py", "mistaken.py"],
        cwd=folder,
        capture_output=True,
        text=True,
    )
    found: dict[str, dict[int, str]] = {}
    for name, line, told in re.findall(r"^(\w+\.py):(\d+): error: (.*)$", done.stdout, re.MULTILINE):
        found.setdefault(name, {})[int(line)] = told
    assert done.returncode == 1, done.stdout + done.stderr
    check(found, lines)


def test_pyright(tmp_path: Path) -> None:
    if find_spec("pyright") is None:
        pytest.skip("pyright is not installed: it is in the extra `dev`")
    lines = planted(tmp_path)
    settings = {"include": ["correct.py", "mistaken.py"], "extraPaths": [str(ROOT)], "pythonVersion": "3.10"}
    (tmp_path / "pyrightconfig.json").write_text(json.dumps(settings), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "pyright", "--outputjson", "--pythonpath", sys.executable, "-p", str(tmp_path)],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    try:
        told = json.loads(done.stdout)["generalDiagnostics"]
    except (ValueError, KeyError):
        pytest.skip(f"pyright cannot be run here, which needs node or a network: {done.stderr.strip()[-200:]}")
    found: dict[str, dict[int, str]] = {}
    for each in told:
        if each["severity"] == "error":
            line = each["range"]["start"]["line"] + 1
            found.setdefault(Path(each["file"]).name, {})[line] = each["message"]
    check(found, lines)
