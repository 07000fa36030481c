"""Messages for a missing package of an extra: its name and the line that installs it, before anything runs."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

from gymnasium.error import DependencyNotInstalled

from rigid_env import extras

ROOT = Path(__file__).parents[2]

HIDE = """
import sys
class Hidden:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in {names!r}:
            raise ModuleNotFoundError(f"No module named {{name!r}}", name=name)
sys.meta_path.insert(0, Hidden())
"""


def without(names: tuple[str, ...], tmp_path: Path, *arguments: str) -> subprocess.CompletedProcess:
    """Run Python in an empty folder, with `names` hidden from every import."""
    hook = tmp_path / "hook"
    hook.mkdir()
    (hook / "sitecustomize.py").write_text(HIDE.format(names=names), encoding="utf-8")
    (tmp_path / "work").mkdir()
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(hook), str(ROOT)]), "COLUMNS": "80"}
    return subprocess.run(
        [sys.executable, *arguments],
        capture_output=True, text=True, cwd=tmp_path / "work", env=environment, timeout=120,
    )  # fmt: skip


@pytest.mark.parametrize("command", ["train", "evaluate", "record", "accuracy_transfer"])
def test_a_command_of_agents_says_what_is_missing_before_anything_runs(command, tmp_path):
    done = without(("torch", "stable_baselines3"), tmp_path, "-m", f"agents.{command}", "--no-such-option")
    assert done.returncode == 1
    assert done.stderr.startswith(
        f"Error: python -m agents.{command} needs torch and Stable-Baselines3, which are not installed: "
        'pip install "rigid-env[agents]"'
    )
    assert "Traceback" not in done.stderr
    assert "the small torch: pip install -c constraints.txt --no-deps torch --index-url https://" in done.stderr
    assert done.stderr.count("\n") == 1
    assert list((tmp_path / "work").iterdir()) == []


@pytest.mark.exhaustive  # `.ci/run` trains with one each time
def test_a_command_of_agents_runs_where_nothing_is_missing(tmp_path):
    done = without((), tmp_path, "-m", "agents.evaluate", "--help")
    assert done.returncode == 0, done.stderr
    assert "confidence" in done.stdout


def test_baselines_do_without_the_extra(tmp_path):
    code = "import agents.baselines as b; print(b.baseline_policy('random', 'rigid_env/BlockReach-v0').__name__)"
    done = without(tuple(extras.EXTRAS["agents"]), tmp_path, "-c", code)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("names", "code", "message"),
    [
        (
            ("torch", "stable_baselines3"), "import rigid_env.envs.sb3",
            "rigid_env.envs.sb3 needs torch and Stable-Baselines3",
        ),
        pytest.param(
            ("stable_baselines3",), "import rigid_env.envs.sb3",
            "rigid_env.envs.sb3 needs Stable-Baselines3, which is not", marks=pytest.mark.exhaustive,
        ),
        (
            ("pygame",),
            "import rigid_env.envs.block_reach as e; e.BlockReachEnv(render_mode='rgb_array')",
            "rendering needs pygame, which is not",
        ),
        (
            ("PIL",),
            "import numpy, rigid_env.rendering.picture as p; p.write_png('a.png', numpy.zeros((4, 4, 3), 'uint8'))",
            "writing pictures needs Pillow, which is not",
        ),
    ],
)  # fmt: skip
def test_an_import_or_a_picture_names_the_extra(names, code, message, tmp_path):
    done = without(names, tmp_path, "-c", code)
    assert done.returncode == 1
    last = done.stderr.splitlines()[-1]
    assert last.startswith("gymnasium.error.DependencyNotInstalled: " + message), done.stderr
    assert 'pip install "rigid-env[' in last
    assert list((tmp_path / "work").iterdir()) == []


def test_the_line_for_a_checkout_works_from_its_folder_only(monkeypatch, tmp_path):
    assert extras.install_line("bench").endswith(f'or in {ROOT}: pip install -c constraints.txt -e ".[bench]"')
    monkeypatch.setattr(extras, "SOURCES", tmp_path)
    assert extras.install_line("bench") == 'pip install "rigid-env[bench]"'


def test_the_small_torch_is_that_of_the_readme(monkeypatch, tmp_path):
    """Named where torch is missing, and nowhere else; without a checkout there are no constraints."""
    line = f"pip install -c constraints.txt --no-deps torch {extras.CPU_TORCH}"
    assert line in (ROOT / "README.md").read_text(encoding="utf-8")
    assert extras.install_line("agents", has_torch=False).endswith(f"the small torch: {line}")
    assert "torch" not in extras.install_line("agents")
    monkeypatch.setattr(extras, "SOURCES", tmp_path)
    line = extras.install_line("agents", has_torch=False)
    assert line.startswith('pip install "rigid-env[agents]"; ')
    assert line.endswith(f"the small torch: pip install torch {extras.CPU_TORCH}")


def test_require_names_all_that_is_missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "mujoco", None)
    monkeypatch.setitem(sys.modules, "pydrake", None)
    monkeypatch.setitem(sys.modules, "pybullet", None)
    with pytest.raises(
        DependencyNotInstalled, match=r"^bench needs MuJoCo, PyBullet and Drake, which are not installed"
    ):
        extras.require("peers", purpose="bench")
    with pytest.raises(
        DependencyNotInstalled, match=r"^this command needs MuJoCo, which is not installed: pip install"
    ):
        extras.require("peers", "mujoco")
    extras.require("render", "PIL")


def test_the_extras_are_those_of_the_metadata():
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    assert extras.EXTRAS.keys() == declared.keys() - {"dev", "smoke"}
    providers = {
        "pygame": "pygame-ce",
        "PIL": "pillow",
        "yaml": "pyyaml",
        "pydrake": "drake",
        "torch": "stable-baselines3",
        "pandas": "ray",  # as ray[tune]
        "pyarrow": "ray",
        "jax": "minari",  # as minari[create]
    }

    def all_of(extra):
        names = {re.match(r"[\w-]+", line)[0] for line in declared[extra] if not line.startswith("rigid-env[")}
        for line in declared[extra]:
            if line.startswith("rigid-env["):
                names = names.union(*map(all_of, re.findall(r"\w+", line.split("[")[1])))
        return names

    for extra, modules in extras.EXTRAS.items():
        assert {providers.get(module, module.replace("_", "-")) for module in modules} <= all_of(extra)
