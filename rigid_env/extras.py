"""Optional dependencies: report the missing package of an extra, and the line that installs it.

A command that cannot do without calls `require` before anything runs. One that has more to give than a picture asks
`lacking`, and ends with that line. Nothing is imported to find out.
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
    "ray": {"ray": "Ray"},
    "submitit": {"submitit": "submitit"},
    "pettingzoo": {"pettingzoo": "PettingZoo"},
    "bench": {"mujoco": "MuJoCo"},
    "peers": {"mujoco": "MuJoCo", "pybullet": "PyBullet", "pydrake": "Drake"},
}
"""Modules of each extra of `pyproject.toml` that are imported, with the names by which users know them.

The extra `agents` brings tensorboard, moviepy and imageio-ffmpeg as well: name them where one is needed.
"""

CPU_TORCH = "--index-url https://download.pytorch.org/whl/cpu"
"""Option of pip that finds torch for the processor alone; without it pip on Linux installs CUDA, too."""

SOURCES = Path(__file__).parents[1]


def require(extra: str, *modules: str, purpose: str = "this command") -> None:
    """Raise if modules of an extra are not installed.

    Parameters
    ----------
    extra : {"render", "plot", "view", "agents", "ray", "submitit", "pettingzoo", "bench", "peers"}
    *modules : str
        Names as imported; the default is all of `EXTRAS[extra]`.
    purpose : str
        The subject of the message: "a plot", "training an agent".

    Raises
    ------
    gymnasium.error.DependencyNotInstalled
        Naming the missing packages and the line that installs them.
    """
    if told := lacking(extra, *modules, purpose=purpose):
        raise DependencyNotInstalled(told)


def lacking(extra: str, *modules: str, purpose: str) -> str:
    """Names of an extra's missing modules and the line that installs them; "" if none is missing.

    Arguments as of `require`, which raises instead.
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
    except ValueError:  # in sys.modules without a spec: it is there
        return True


def install_line(extra: str, has_torch: bool = True) -> str:
    """Command that installs an extra; in a checkout of the sources it installs these as editable, too.

    If torch is missing, a second line follows, which installs the small torch of the same versions. It must be run
    first.
    """
    line, torch = f'pip install "rigid-env[{extra}]"', f"pip install torch {CPU_TORCH}"
    if (SOURCES / "pyproject.toml").is_file() and (SOURCES / "constraints.txt").is_file():
        line += f', or in {SOURCES}: pip install -c constraints.txt -e ".[{extra}]"'
        torch = f"pip install -c constraints.txt --no-deps torch {CPU_TORCH}"
    return line if has_torch else f"{line}; first, if no GPU is to be used, the small torch: {torch}"
