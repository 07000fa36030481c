"""Files of machine code: whatever is wrong with one costs a line and a compilation, never a process."""

from __future__ import annotations

import json
import os
import pickle
import resource
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from benchmarks.processes import killed_after
from physics.compiler import cache_folder
from physics.compiler.fused import cache_files
from physics.compiler.fused.one_process import WAITING
from tests.tiers.sweep import sweep

ROOT = str(Path(__file__).parents[2])

KERNELS = """
import math
from physics.compiler.decorators import entry_kernel, kernel

@kernel
def part(x):
    return math.sqrt(x) + 1.0

@entry_kernel
def whole(x):
    return part(x) * part(x + 1.0)

@entry_kernel
def other(x):
    return part(x)
"""

PROGRAM = """
import sys
sys.path.insert(0, sys.argv[1])
from kernels import other, whole
print(other(2.0).hex() + whole(2.0).hex(), sum(whole.stats.cache_hits.values()))
"""

STEPS = """
import physics
from physics.kernels.time_stepping.step import step_worlds
world = physics.World(physics.Scene([physics.Sphere(0.5, mass=1.0, linvel=(1, 2, 3))]), dt=0.01, accuracy="fast")
world.step(steps=3)
print(world.state.tobytes().hex(), sum(step_worlds.stats.cache_hits.values()))
"""


class Program:
    """A program with a kernel: of a few lines, or that of a step."""

    def __init__(self, folder: Path, text: str, name: str):
        (folder / "kernels.py").write_text(KERNELS)
        self.text, self.name, self.folder = text, name, str(folder)

    def command_and_environment(self, cache: Path, before: str = "") -> tuple[list, dict]:
        environment = {**os.environ, "PYTHONPATH": ROOT, "NUMBA_CACHE_DIR": str(cache)}
        return [sys.executable, "-c", before + self.text, self.folder], environment

    def run(self, cache: Path, **more) -> tuple[str, int, list[str]]:
        """Read what it prints in a new process, how often its kernel was loaded, lines on standard error."""
        command, environment = self.command_and_environment(cache)
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=200, **more)
        assert done.returncode == 0, done.stderr
        found, hits = done.stdout.split()
        lines = [line for line in done.stderr.splitlines() if "compiling a kernel for this scene" not in line]
        return found, int(hits), lines

    def file(self, cache: Path) -> Path:
        """The file of its machine code."""
        (path,) = cache.rglob(f"*{self.name}*.nbc")
        return path


@pytest.fixture(scope="module", params=sweep(["whole", "step_worlds"], ["whole"]))
def program(request, tmp_path_factory) -> Program:
    texts = {"whole": PROGRAM, "step_worlds": STEPS}
    return Program(tmp_path_factory.mktemp("program"), texts[request.param], request.param)


@pytest.fixture(scope="module")
def kept(program, tmp_path_factory) -> tuple[Path, str]:
    """A folder of kernels, and what they lead to."""
    folder = tmp_path_factory.mktemp("kept")
    state, hits, lines = program.run(folder)
    assert (hits, lines) == (0, [])
    return folder, state


def _truncated(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-1000])


def _empty(path: Path) -> None:
    path.write_bytes(b"")


def _garbage(path: Path) -> None:
    path.write_bytes(os.urandom(5000))


def _one_bit(path: Path) -> None:
    """In the middle of machine code, which would run."""
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


def _foreign_pickle(path: Path) -> None:
    path.write_bytes(pickle.dumps({"something": "else"}))


def _of_another_kernel(path: Path) -> None:
    other = next(each for each in path.parent.glob("*.nbc") if each != path)
    shutil.copy(other, path)


def _directory(path: Path) -> None:
    path.unlink()
    path.mkdir()
    (path / "file").write_text("not ours")


DAMAGES = [_truncated, _empty, _garbage, _one_bit, _foreign_pickle, _of_another_kernel, _directory]


@pytest.mark.parametrize("damage", sweep(DAMAGES, [_one_bit, _foreign_pickle]))
def test_a_damaged_file_is_compiled_anew_and_said_so_once(damage, program, kept, tmp_path):
    folder, state = kept
    cache = tmp_path / "cache"
    shutil.copytree(folder, cache)
    path = program.file(cache)
    damage(path)
    found, hits, lines = program.run(cache)
    assert (found, hits) == (state, 0)
    assert len(lines) == 1, lines
    assert str(path) in lines[0]
    assert "compiled anew" in lines[0]
    assert program.run(cache) == (state, 1, [])  # it is healed


@pytest.mark.parametrize("damage", [_truncated, _empty, _garbage, _one_bit, _foreign_pickle])
def test_damage_is_seen_before_anything_is_unpickled(damage, tmp_path):
    path = tmp_path / "file"
    cache_files.write_cache_file(path, b"purpose", pickle.dumps(list(range(3000))))
    damage(path)
    with pytest.raises(cache_files.DamagedFileError):
        cache_files.read_cache_file(path, b"purpose")


LIBRARY = """
import math
import numba
from physics.compiler.decorators import entry_kernel

@numba.njit
def of_user(x):
    return math.erf(x) + math.gamma(x) ** 0.3

@entry_kernel
def work(x):
    return of_user(x)
"""

OF_LIBRARY = """
import json, sys
sys.path.insert(0, sys.argv[1])
from library import work
print(json.dumps([work(0.5), sum(work.stats.cache_hits.values()), "numba.np.arraymath" in sys.modules]))
"""


def test_machine_code_is_loaded_without_what_only_compiling_needs(tmp_path):
    """And finds in another process what it calls outside of itself."""
    (tmp_path / "library.py").write_text(LIBRARY)
    environment = {**os.environ, "PYTHONPATH": ROOT, "NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-c", OF_LIBRARY, str(tmp_path)]
    found = [
        json.loads(subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout)
        for _ in range(2)
    ]
    (value, *first), (again, *second) = found
    assert value == again
    assert (first, second) == ([0, True], [1, False])


class Gone:
    """A class that is not there when it is read."""


def test_what_cannot_be_unpickled_is_damaged_too(program, kept, tmp_path, monkeypatch):
    """Whole and of this kernel, of a class that no longer exists."""
    folder, state = kept
    cache = tmp_path / "cache"
    shutil.copytree(folder, cache)
    path = program.file(cache)
    before = (
        "import physics\nfrom physics.compiler.fused import disk_cache\n"
        f"disk_cache.dumps = lambda value: {pickle.dumps(Gone()).replace(b'Gone', b'Lost')!r}\n"
    )
    path.unlink()
    command, environment = program.command_and_environment(cache, before)
    subprocess.run(command, env=environment, check=True, capture_output=True, timeout=200)
    found, _, lines = program.run(cache)
    assert found == state
    assert len(lines) == 1
    assert "compiled anew" in lines[0]
    assert program.run(cache) == (state, 1, [])


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="no owners")
def test_a_file_that_others_may_write_is_not_unpickled(tmp_path):
    """Nor one of another user; of root's it is."""

    class Evil:
        def __reduce__(self):
            return os.mkdir, (str(tmp_path / "ran"),)

    path = tmp_path / "file.nbc"
    cache_files.write_cache_file(path, b"purpose", pickle.dumps([1]))
    assert path.stat().st_mode & 0o777 & cache_folder.WRITABLE_BY_OTHERS == 0
    assert cache_files.read_cache_file(path, b"purpose") == [1]
    cache_files.write_cache_file(path, b"purpose", pickle.dumps(Evil()))
    for mode in (0o664, 0o646):
        path.chmod(mode)
        with pytest.raises(cache_files.ForeignFileError):
            cache_files.read_cache_file(path, b"purpose")
    path.chmod(0o644)
    if os.getuid() == 0:
        os.chown(path, 12345, -1)
        with pytest.raises(cache_files.ForeignFileError):
            cache_files.read_cache_file(path, b"purpose")
    assert not (tmp_path / "ran").exists()


@pytest.mark.parametrize("umask", [0o000, 0o002, 0o077])
def test_files_are_nobody_elses_under_any_umask(umask, tmp_path):
    before = os.umask(umask)
    try:
        cache_files.write_cache_file(tmp_path / "folder" / "file.nbc", b"", pickle.dumps(3))
    finally:
        os.umask(before)
    assert cache_files.read_cache_file(tmp_path / "folder" / "file.nbc", b"") == 3


def test_a_file_for_another_purpose_is_damaged(tmp_path):
    cache_files.write_cache_file(tmp_path / "file", b"one", pickle.dumps(1))
    with pytest.raises(cache_files.DamagedFileError):
        cache_files.read_cache_file(tmp_path / "file", b"other")


def test_what_others_may_write_costs_a_compilation_and_a_line(program, kept, tmp_path, is_exhaustive):
    folder, state = kept
    cache = tmp_path / "cache"
    shutil.copytree(folder, cache)
    path = program.file(cache)
    path.chmod(0o666)
    content = path.read_bytes()
    for _ in range(2 if is_exhaustive else 1):
        found, hits, lines = program.run(cache)
        assert (found, hits, len(lines)) == (state, 0, 1)
        assert "other users may write to it" in lines[0]
    assert path.read_bytes() == content


def test_a_folder_that_cannot_be_made(program, kept, tmp_path):
    (tmp_path / "file").write_text("in the way")
    found, hits, lines = program.run(tmp_path / "file" / "cache")
    assert (found, hits, len(lines)) == (kept[1], 0, 1)
    assert "cannot be kept" in lines[0]


def test_a_full_disk(program, kept, tmp_path):
    """As far as a limit of the size of files can tell: nothing can be written, and nothing is left behind."""

    def no_room():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (1000, 1000))

    found, hits, lines = program.run(tmp_path, preexec_fn=no_room)
    assert (found, hits, len(lines)) == (kept[1], 0, 1)
    assert "cannot be kept" in lines[0]
    assert [path for path in tmp_path.rglob("*") if path.is_file()] == []


def test_processes_at_once_and_killed_ones(program, kept, tmp_path, is_exhaustive):
    """Killed at any time from before the first file until after the last."""
    command, environment = program.command_and_environment(tmp_path)
    for k in range(12) if is_exhaustive else (1, 4):
        process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(0.8 + 0.15 * k)
        process.kill()
        process.wait()
    assert program.run(tmp_path)[::2] == (kept[1], [])
    assert program.run(tmp_path) == (kept[1], 1, [])
    shutil.rmtree(tmp_path)
    both = [subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    with killed_after(both[0], 200.0), killed_after(both[1], 200.0):
        assert [each.communicate()[0].split()[0] for each in both] == [kept[1]] * 2
    assert program.run(tmp_path) == (kept[1], 1, [])


def test_of_several_processes_one_compiles(program, kept, tmp_path):
    """Four at once on an empty cache: one file each, no lock is left, and the same results."""
    command, environment = program.command_and_environment(tmp_path)
    started = [subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True) for _ in range(4)]
    ends = []
    for each in started:
        with killed_after(each, 200.0):
            ends.append(each.communicate()[0].split())
    assert [found for found, _ in ends] == [kept[1]] * 4
    assert sorted(hits for _, hits in ends) == ["0", "1", "1", "1"]
    assert list(tmp_path.rglob("*.lock")) == []


def test_a_process_that_dies_while_it_compiles_holds_nobody_up(program, kept, tmp_path):
    path = program.file(kept[0])
    lock = tmp_path / path.parent.name / f"{path.name}.lock"
    holder = (
        "import sys, time; from filelock import FileLock\n"
        "lock = FileLock(sys.argv[1]); lock.acquire(); print(1, flush=True); time.sleep(99)"
    )
    lock.parent.mkdir(parents=True)
    holding = subprocess.Popen([sys.executable, "-c", holder, str(lock)], stdout=subprocess.PIPE, text=True)
    assert holding.stdout.readline() == "1\n"
    command, environment = program.command_and_environment(tmp_path)
    waiting = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    with killed_after(waiting, 200.0):
        line = waiting.stderr.readline()
        holding.kill()
        assert waiting.communicate()[0].split() == [kept[1], "0"]
    assert line == f"rigid-env: {WAITING}\n"
    holding.wait()
    assert list(tmp_path.rglob("*.lock")) == []


def test_sources_at_another_place_compile_nothing(program, kept, tmp_path):
    """A copy of `physics`: its kernels are those of the original. A program's own file is known by its place."""
    if program.name == "whole":
        pytest.skip("a program's own kernels")
    shutil.copytree(Path(ROOT) / "physics", tmp_path / "physics", ignore=shutil.ignore_patterns("__pycache__"))
    command, environment = program.command_and_environment(kept[0])
    done = subprocess.run(command, env={**environment, "PYTHONPATH": str(tmp_path)}, capture_output=True, text=True)
    assert done.stdout.split() == [kept[1], "1"], done.stderr
