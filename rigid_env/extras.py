"""Optional dependencies: find missing packages of an extra, and the command that installs them.

A command that needs the packages calls `require` before anything runs. A command whose picture alone needs them calls
`lacking`, and prints the message at its end. Both find packages without importing them.
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from gymnasium.error import DependencyNotInstalled

EXTRAS: dict[str, dict[str, str]] = {
    "render": {"pygame": "pygame", "PIL": "Pillow"},
    "agents": {
        "torch": "torch",
        "stable_baselines3": "Stable-Baselines3",
        "matplotlib": "matplotlib",
        "yaml": "PyYAML",
        "filelock": "filelock",
        "pygame": "pygame",
        "PIL": "Pillow",
    },
    "plot": {"matplotlib": "matplotlib"},
    "view": {"viser": "viser"},
    "ray": {"ray": "Ray", "pandas": "pandas", "pyarrow": "pyarrow"},
    "submitit": {"submitit": "submitit"},
    "minari": {"minari": "Minari", "h5py": "h5py", "jax": "JAX"},
    "pettingzoo": {"pettingzoo": "PettingZoo"},
    "bench": {"mujoco": "MuJoCo"},
    "peers": {"mujoco": "MuJoCo", "pybullet": "PyBullet", "pydrake": "Drake"},
}
"""Modules of each extra of `pyproject.toml`, with the names by which users know them.

The extra `agents` also installs tensorboard, moviepy and imageio-ffmpeg: name these modules where they are needed."""

CPU_TORCH = "--index-url https://download.pytorch.org/whl/cpu"
"""Option of pip for the build of torch that runs on the processor only; without it pip on Linux installs CUDA, too."""

SOURCES = Path(__file__).parents[1]


def require(extra: str, *modules: str, purpose: str = "this command") -> None:
    """Raise an error if modules of an extra are not installed.

    Parameters
    ----------
    extra : {"render", "plot", "view", "agents", "ray", "submitit", "minari", "pettingzoo", "bench", "peers"}
    *modules : str
        Names as imported; the default is all of `EXTRAS[extra]`.
    purpose : str
        Subject of the message: "a plot", "training an agent".

    Raises
    ------
    gymnasium.error.DependencyNotInstalled
        Naming the missing packages and the command that installs them.
    """
    if told := lacking(extra, *modules, purpose=purpose):
        raise DependencyNotInstalled(told)


def lacking(extra: str, *modules: str, purpose: str) -> str:
    """Message with an extra's missing packages and the command that installs them; "" if none is missing.

    Arguments as of `require`, which raises this message as an error.
    """
    names = [EXTRAS[extra].get(module, module) for module in modules or EXTRAS[extra] if not is_installed(module)]
    if not names:
        return ""
    listed = " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))
    verb = "is" if len(names) == 1 else "are"
    line = install_line(extra, has_torch="torch" not in names)
    return f"{purpose} needs {listed}, which {verb} not installed: {line}"


def is_installed(module: str) -> bool:
    """True if a top-level module can be found; it is not imported."""
    try:
        return find_spec(module) is not None
    except ImportError:
        return False
    except ValueError:  # it is in sys.modules without a spec, so it is installed
        return True


def install_line(extra: str, has_torch: bool = True) -> str:
    """Command that installs an extra; in a checkout of the sources also the command that installs it from there.

    If torch is missing (`has_torch` is False), a further command follows, to be run first: it installs the small build
    of torch without CUDA.
    """
    line, torch = f'pip install "rigid-env[{extra}]"', f"pip install torch {CPU_TORCH}"
    if (SOURCES / "pyproject.toml").is_file() and (SOURCES / "constraints.txt").is_file():
        line += f', or in {SOURCES}: pip install -c constraints.txt -e ".[{extra}]"'
        torch = f"pip install -c constraints.txt --no-deps torch {CPU_TORCH}"
    return line if has_torch else f"{line}; first, if no GPU is to be used, the small torch: {torch}"
