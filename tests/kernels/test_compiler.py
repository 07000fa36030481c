"""The compile cache: keyed on the content of all kernel sources, respectful of the user's folder, hit by a second
process."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import physics
from physics.compiler import cache_folder


def test_digest_changes_with_any_edit_and_any_rename(tmp_path: Path):
    (tmp_path / "a.py").write_text("x = 1\n")
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "b.py").write_text("y = 2\n")
    first = cache_folder.source_digest(tmp_path)
    assert cache_folder.source_digest(tmp_path) == first
    (tmp_path / "sub" / "b.py").write_text("y = 3\n")
    second = cache_folder.source_digest(tmp_path)
    (tmp_path / "sub" / "b.py").rename(tmp_path / "sub" / "c.py")
    third = cache_folder.source_digest(tmp_path)
    assert len({first, second, third}) == 3


def test_an_edit_of_any_kernel_makes_other_machine_code(tmp_path: Path):
    """Kernels stand in many folders, and the compilers beside them."""
    shutil.copytree(Path(physics.__file__).parent, tmp_path / "physics", ignore=shutil.ignore_patterns("__pycache__"))
    program = "from physics.compiler.cache_folder import folder_name; print(folder_name())"

    def name() -> str:
        environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
        command = [sys.executable, "-c", program]
        return subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True, check=True).stdout

    names = [name()]
    for edited in ("kernels/flight/free_flight.py", "kernels/multibody/solver/solve.py", "compiler/simd.py"):
        path = tmp_path / "physics" / edited
        path.write_text(path.read_text(encoding="utf-8") + "# edited\n", encoding="utf-8")
        names.append(name())
    assert len(set(names)) == 4


PROGRAM = """
import json, physics
from physics.kernels.time_stepping.step import step_worlds
world = physics.World(physics.Scene([physics.Block((5, 3, 2), 6.0, angvel=(1, 2, 3))]), dt=0.01)
world.step()
stats = step_worlds.stats
print(json.dumps({"hits": sum(stats.cache_hits.values()), "misses": sum(stats.cache_misses.values()),
                  "q": world.quat[0, 0].tolist()}))
"""


def _fresh_process(cache: Path) -> dict:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str(cache)}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        env=environment,
        capture_output=True,
        text=True,
        check=True,
        timeout=300,
    )
    return json.loads(done.stdout)


def test_a_second_process_compiles_nothing_and_gets_the_same_bits(tmp_path: Path):
    first, second = _fresh_process(tmp_path), _fresh_process(tmp_path)
    assert (first["hits"], first["misses"]) == (0, 1)
    assert (second["hits"], second["misses"]) == (1, 0)
    assert first["q"] == second["q"]
    folders = {path.relative_to(tmp_path).parts[0] for path in tmp_path.rglob("*.nbc")}
    assert folders == {cache_folder.cache_dir().name}
