"""The design of the schemes: one can be deleted, one can be added, and nothing else knows them."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
SECONDS = 120  # until a process that steps a block in plain Python is given up


def run(code: list[str], folder: Path) -> str:
    """Run Python over the sources in a folder, without a compiler; what it prints."""
    environment = {**os.environ, "PYTHONPATH": str(folder), "RIGID_ENV_COMPILER": "python"}
    done = subprocess.run(
        [sys.executable, *code], cwd=folder, env=environment, capture_output=True, text=True, timeout=SECONDS
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def sources(*folders: str) -> list[Path]:
    return [path for folder in folders for path in sorted((ROOT / folder).rglob("*.py"))]


STEP = """
import physics
world = physics.World(physics.scenes.drop(), dt=0.01, accuracy="balanced")
world.step(steps=3)
print(physics.__file__, world.pos[0, 0].tolist(), [str(scheme) for scheme in physics.schemes.SCHEMES])
try:
    physics.World(physics.scenes.drop(), accuracy="precise")
except ValueError as error:
    print(error)
"""


def test_a_scheme_is_deleted_with_its_kernels_its_module_and_one_line(tmp_path):
    """The block falls at `balanced` as before, and `precise` is refused by name."""
    shutil.copytree(ROOT / "physics", tmp_path / "physics", ignore=shutil.ignore_patterns("__pycache__"))
    shutil.rmtree(tmp_path / "physics/kernels/event_driven")
    (tmp_path / "physics/schemes/events.py").unlink()
    modules = tmp_path / "physics/schemes/__init__.py"
    text = modules.read_text(encoding="utf-8")
    assert text.count('    "events",\n') == 1
    modules.write_text(text.replace('    "events",\n', ""), encoding="utf-8")
    without, refusal = run(["-c", STEP], tmp_path).splitlines()
    assert without.startswith(str(tmp_path))
    assert "event-driven" not in without
    assert "Accuracy.scheme is 'events', which none of the schemes" in refusal
    with_all = run(["-c", STEP], ROOT).splitlines()[0]
    assert re.findall(r"\[.*?\]", without)[0] == re.findall(r"\[.*?\]", with_all)[0]


def test_a_scheme_is_added_by_the_rules():
    assert run([str(Path(__file__).with_name("toy_scheme.py"))], ROOT) == "falls as it should\n"


def test_nothing_else_knows_the_layout_of_a_contact_memory():
    """Kernels write it, schemes read it."""
    names = (
        "WALL_MEMORY_\\w+",
        "WARM_(STAGE|CONTACT|BODY|IMPULSE|POINT|HEADER)\\w*",
        "persistent_contacts",
        "data\\.warm_start",
    )
    columns = re.compile(rf"\b({'|'.join(names)})\b")
    readers = [
        path.relative_to(ROOT).as_posix()
        for path in sources("physics", "rigid_env", "agents", "benchmarks")
        if not path.is_relative_to(ROOT / "physics/kernels") and columns.search(path.read_text(encoding="utf-8"))
    ]
    assert readers == ["physics/schemes/body_memory.py", "physics/schemes/wall_memory.py"]


def test_a_scheme_is_asked_and_not_named():
    """Modules of schemes are imported by their list alone."""
    names = re.compile(r"physics\.schemes(\.| import )(walls|springs|many_bodies|events)\b")
    found = [str(path) for path in sources("physics", "rigid_env", "agents", "benchmarks")]
    assert len(found) > 300
    assert not [path for path in found if names.search(Path(path).read_text(encoding="utf-8"))]
