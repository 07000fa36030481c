"""The ways to the environments in fresh processes: ids, prefix, classes, workers, and files in the way."""

from __future__ import annotations

import inspect
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import rigid_env
from tests import prepared

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "environments.md").read_text(encoding="utf-8")
SNIPPETS = re.findall(r"```python\n(.*?)```", PAGE, re.S)
SAFE = pytest.mark.skipif(sys.version_info < (3, 11), reason="python -P is there from 3.11 on")

PREFIXED = "import gymnasium as g; print(g.make('rigid_env:rigid_env/BlockReach-v0').spec.id)"


def python(folder: Path, *arguments: str, path: str = str(ROOT)) -> subprocess.CompletedProcess:
    """Run Python in a folder, with the sources on the path."""
    environment = {**os.environ, "PYTHONPATH": path}
    environment.pop("PYTHONSAFEPATH", None)
    return subprocess.run(
        [sys.executable, *arguments], capture_output=True, text=True, cwd=folder, env=environment, timeout=200
    )


@pytest.mark.parametrize("snippet", SNIPPETS, ids=range(1, len(SNIPPETS) + 1))
def test_snippets_of_the_page_run_as_they_stand(snippet, tmp_path):
    if "stable_baselines3" in snippet:
        pytest.importorskip("stable_baselines3")
    (file := tmp_path / "snippet.py").write_text(snippet, encoding="utf-8")
    status, output = prepared.run(file, tmp_path)
    assert status == 0, output


def test_the_page_lists_the_options():
    rows = set(re.findall(r"^\| `(\w+)` \|", PAGE, re.M))
    tasks = rigid_env.BlockReachEnv().task, rigid_env.BlockReorientEnv().task
    assert rows == {name for task in tasks for name in task.option_names} | {"reset_mask"}


def test_the_bare_id_needs_the_import(tmp_path):
    done = python(tmp_path, "-c", "import gymnasium as g; g.make('rigid_env/BlockReach-v0')")
    assert done.returncode == 1
    assert "NamespaceNotFound: Namespace rigid_env not found" in done.stderr
    done = python(tmp_path, "-c", "import gymnasium as g, rigid_env; print(g.spec('rigid_env/BlockReach-v0').id)")
    assert done.stdout.strip() == "rigid_env/BlockReach-v0", done.stderr


def test_importing_the_package_leaves_the_engine_alone(tmp_path):
    code = (
        "import sys, rigid_env; rigid_env.__version__; dir(rigid_env);"
        "print([m for m in sys.modules if m.partition('.')[0] in ('physics', 'numba', 'scipy')])"
    )
    done = python(tmp_path, "-c", code)
    assert done.stdout.strip() == "[]", done.stderr


def test_lazy_names():
    from rigid_env.envs.block_reach import BlockReachEnv
    from rigid_env.envs.block_reorient import BlockReorientVectorEnv

    assert rigid_env.BlockReachEnv is BlockReachEnv
    assert rigid_env.BlockReorientVectorEnv is BlockReorientVectorEnv
    assert set(rigid_env.__all__) <= set(dir(rigid_env))
    assert re.match(r"\d+(\.\d+)*|0\+unknown", rigid_env.__version__)
    told = "module 'rigid_env' has no attribute 'BlockPushEnv'; allowed are BlockReachEnv, "
    with pytest.raises(AttributeError, match=told):
        rigid_env.BlockPushEnv  # noqa: B018


def test_the_version_of_sources_that_are_not_installed(monkeypatch):
    from importlib import metadata

    def missing(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "version", missing)
    assert rigid_env._version() == "0+unknown"


def test_signatures_are_explicit_and_hold_the_tasks_defaults():
    from rigid_env.tasks.block import BlockTask

    def defaults(target, *but):
        found = inspect.signature(target).parameters
        assert all(p.kind not in (p.VAR_KEYWORD, p.VAR_POSITIONAL) for p in found.values())
        return {name: p.default for name, p in found.items() if name not in but and p.default is not p.empty}

    task = defaults(BlockTask.__init__, "worlds", "self")
    picture = {
        "render_mode": None, "width": 960, "height": 600, "camera": None, "arrows": True,
        "obs": "state", "obs_size": (84, 84), "obs_stack": 1, "contacts": 0, "impacts": 0,
    }  # fmt: skip
    for single in (rigid_env.BlockReachEnv, rigid_env.BlockReorientEnv):
        assert defaults(single) == {**task, **picture}
    batch = {"num_envs": 1, "max_episode_steps": "registered", **picture}
    for vector in (rigid_env.BlockReachVectorEnv, rigid_env.BlockReorientVectorEnv):
        assert defaults(vector, "autoreset_mode") == {**task, **batch}


# --- files in the way -----------------------------------------------------------------------------------------


def make_package(folder: Path, content: str = "") -> Path:
    folder.mkdir(parents=True)
    (folder / "__init__.py").write_text(content, encoding="utf-8")
    return folder / "__init__.py"


@pytest.mark.parametrize("kind", ["module", "package"])
@pytest.mark.parametrize("code", [PREFIXED, "import rigid_env", "import physics, rigid_env"])
def test_a_file_of_the_engines_name_is_named(kind, code, tmp_path):
    if kind == "module":
        (tmp_path / "physics.py").write_text("g = 9.81\n", encoding="utf-8")
        found = tmp_path / "physics.py"
    else:
        found = make_package(tmp_path / "physics")
    done = python(tmp_path, "-c", code)
    assert done.returncode == 1
    last = done.stderr.splitlines()[-1]
    assert last.startswith(f"ImportError: {found} hides the package 'physics' that rigid_env is built on: rename it"), (
        last
    )
    assert "python -P" in last


@SAFE
def test_the_ways_out_work(tmp_path):
    (tmp_path / "physics.py").write_text("g = 9.81\n", encoding="utf-8")
    assert python(tmp_path, "-P", "-c", PREFIXED).stdout.strip() == "rigid_env/BlockReach-v0"
    (tmp_path / "physics.py").rename(tmp_path / "my_physics.py")
    assert python(tmp_path, "-c", PREFIXED).stdout.strip() == "rigid_env/BlockReach-v0"


def test_a_folder_without_python_files_is_not_in_the_way(tmp_path):
    (tmp_path / "physics").mkdir()
    assert python(tmp_path, "-c", PREFIXED).stdout.strip() == "rigid_env/BlockReach-v0"


def test_another_distribution_of_the_engines_name_is_named(tmp_path):
    """In a site-packages that comes first, and one that has overwritten the engine's first file."""
    site = tmp_path / "site-packages"
    found = make_package(site / "physics")
    (site / "physics-1.2.dist-info").mkdir()
    (site / "physics-1.2.dist-info" / "METADATA").write_text("Metadata-Version: 2.1\nName: physics\nVersion: 1.2\n")
    (site / "physics-1.2.dist-info" / "RECORD").write_text("physics/__init__.py,,\n")
    done = python(tmp_path, "-c", "import rigid_env", path=os.pathsep.join([str(site), str(ROOT)]))
    last = done.stderr.splitlines()[-1]
    assert last.startswith(f"ImportError: {found} hides"), done.stderr
    assert "it came with physics: pip uninstall physics, then install rigid-env again" in last
    make_package(site / "physics" / "kernels")
    done = python(tmp_path, "-c", "import rigid_env", path=os.pathsep.join([str(site), str(ROOT)]))
    assert done.stderr.splitlines()[-1] == last


def test_an_archive_of_the_sources_is_the_engine(tmp_path):
    archive = tmp_path / "all.zip"
    with zipfile.ZipFile(archive, "w") as file:
        for package in ("physics", "rigid_env"):
            for path in (ROOT / package).rglob("*.py"):
                file.write(path, path.relative_to(ROOT))
    done = python(
        tmp_path,
        "-S",
        "-c",
        f"import sys; sys.path += {sys.path!r}; import rigid_env; print(rigid_env.__file__)",
        path=str(archive),
    )
    assert done.stdout.strip().startswith(str(archive)), done.stderr


def test_a_folder_of_the_name_agents(tmp_path):
    """Python takes the local one, before anything of this project runs; `-P` takes the installed one."""
    make_package(tmp_path / "agents")
    done = python(tmp_path, "-m", "agents.baselines")
    assert done.returncode == 1
    assert "No module named agents.baselines" in done.stderr
    if sys.version_info >= (3, 11):
        assert python(tmp_path, "-P", "-m", "agents.baselines").returncode == 0
