"""Configuration of a run, with hyperparameters from a YAML file, and the paths of the run's files."""

from __future__ import annotations

import re
import shutil
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import yaml
from filelock import FileLock, Timeout

import physics
from physics.accuracy import resolve

HYPERPARAMETERS = Path(__file__).with_name("hyperparameters.yml")

ALGORITHMS = ("ppo", "sac")

LOCK = ".lock"  # file in the folder of a run

# Fields that may change when a run continues from its checkpoint.
CHANGEABLE = ("target", "max_steps", "threads", "evaluation_accuracy")


class RunInUse(ValueError):
    """Error of a run that another process is working on."""


@dataclass(frozen=True)
class RunConfig:
    """Everything that decides a run; it is written to `config.yaml` in the run's folder.

    Parameters
    ----------
    env : str
        Gymnasium id, with the module that registers it before a colon if this is another than ``rigid_env``.
    algo : {"ppo", "sac"}
    seed : int
        Seed of the policy's weights, the exploration and the environments.
    num_envs : int
        Number of worlds in the training batch.
    max_steps : int
        Environment steps, of all worlds together, after which training ends.
    target : float
        Success rate at which training ends, in (0, 1].
    accuracy : str or dict
        Accuracy of the engine in training: a preset, or the fields of a `physics.Accuracy`.
    evaluation_accuracy : str or dict
        The same for evaluation and videos.
    threads : int
        Threads of the engine.
    torch_threads : int
        Threads of torch.
    algorithm : dict
        Keyword arguments of the class in Stable-Baselines3. ``policy_kwargs.activation_fn`` is a name in `torch.nn`.
        ``hindsight`` has the arguments of `HerReplayBuffer`, for environments with goals. ``action_noise`` has
        ``sigma`` and ``theta`` of an Ornstein-Uhlenbeck process, per control step. A ``learning_rate`` with ``start``
        and ``end`` decreases linearly until `max_steps`.
    env_kwargs : dict
        Further arguments of the environment.

    Raises
    ------
    ValueError
        The message names the field, its value and what is allowed.
    """

    env: str
    algo: str
    seed: int
    num_envs: int
    max_steps: int
    target: float
    accuracy: str | dict[str, Any] = "balanced"
    evaluation_accuracy: str | dict[str, Any] = "balanced"
    threads: int = 2
    torch_threads: int = 1
    algorithm: dict[str, Any] = field(default_factory=dict)
    env_kwargs: dict[str, Any] = field(default_factory=dict)

    def __post_init__(self):
        if self.algo not in ALGORITHMS:
            raise ValueError(f"algo is {self.algo!r}; allowed are {', '.join(ALGORITHMS)}")
        for name in ("num_envs", "max_steps", "threads", "torch_threads"):
            value = getattr(self, name)
            if isinstance(value, bool) or not isinstance(value, int) or value < 1:
                raise ValueError(f"{name} is {value!r}; allowed are integers of at least 1")
        if isinstance(self.seed, bool) or not isinstance(self.seed, int) or self.seed < 0:
            raise ValueError(f"seed is {self.seed!r}; allowed are integers of at least 0")
        for name in ("algorithm", "env_kwargs"):
            if not isinstance(getattr(self, name), dict):
                raise ValueError(f"{name} is {getattr(self, name)!r}; allowed is a dict: set one of its entries")
        for name in ("accuracy", "evaluation_accuracy"):
            value = getattr(self, name)
            resolve(physics.Accuracy(**value) if isinstance(value, dict) else value, name)
        if not 0.0 < self.target <= 1.0:
            raise ValueError(f"target is {self.target!r}; allowed are success rates over 0 and up to 1")

    @property
    def evaluation_arguments(self) -> dict[str, Any]:
        """Keyword arguments of the environment in evaluation and videos."""
        return {**self.env_kwargs, "accuracy": self.evaluation_accuracy}

    def write(self, path: Path) -> None:
        """Write the configuration as YAML."""
        path.write_text(yaml.safe_dump(asdict(self), sort_keys=False), encoding="utf-8")


def read_hyperparameters(env: str, algo: str, path: Path = HYPERPARAMETERS) -> dict[str, Any]:
    """Read the entry of an environment and an algorithm in a file of hyperparameters.

    Parameters
    ----------
    env : str
        Gymnasium id. A module before a colon is left out in the file.
    algo : str
    path : Path

    Returns
    -------
    dict
        Fields of `RunConfig`.

    Raises
    ------
    ValueError
        If there is no such entry, or it has an unknown key.
    """
    known = _entries(env, path)
    if algo not in known:
        raise ValueError(f"algo is {algo!r}; allowed with {env} are {', '.join(known)}")
    entry = known[algo]
    unknown = set(entry) - {f.name for f in fields(RunConfig)}
    if unknown:
        raise ValueError(f"{path.name}: {env}, {algo} has the unknown keys {', '.join(sorted(unknown))}")
    return entry


def default_algorithm(env: str, path: Path = HYPERPARAMETERS) -> str:
    """First algorithm of an environment in a file of hyperparameters; a ValueError if the environment is not in it."""
    return next(iter(_entries(env, path)))


def environments_of(path: Path = HYPERPARAMETERS) -> list[str]:
    """Ids of all environments in a file of hyperparameters."""
    return list(yaml.safe_load(path.read_text(encoding="utf-8")))


def short_name(env_id: str) -> str:
    """Name of an environment in files: BlockReach-v0 of ``rigid_env/BlockReach-v0``."""
    return re.split("[:/]", env_id)[-1]


def _entries(env: str, path: Path) -> dict[str, dict[str, Any]]:
    """Entries of an environment in a file of hyperparameters, by algorithm."""
    table = yaml.safe_load(path.read_text(encoding="utf-8"))
    name = env.rpartition(":")[2]
    if name not in table:
        own = f"another file, --hyperparameters FILE, may have an entry {name!r}"
        raise ValueError(f"env is {env!r}; allowed are those of {path.name}: {', '.join(table)}; {own}")
    return table[name]


def make_config(env: str, algo: str, seed: int, path: Path = HYPERPARAMETERS, **changes: Any) -> RunConfig:
    """Make the configuration of a new run: hyperparameters of the file, with those `changes` that are not None.

    Raises
    ------
    ValueError
        See `read_hyperparameters` and `RunConfig`.
    """
    entry = read_hyperparameters(env, algo, path)
    env = env.removeprefix("rigid_env:")  # another module must be imported to make the environment
    try:
        config = RunConfig(env=env, algo=algo, seed=0, **entry)
    except ValueError as error:
        raise ValueError(f"{path.name}, {env}, {algo}: {error}") from error
    return change(config, seed=seed, **changes)


def change(config: RunConfig, **changes: Any) -> RunConfig:
    """Copy of a configuration with those `changes` of fields that are not None.

    `agents.settings` changes entries of its dicts.
    """
    return replace(config, **{name: value for name, value in changes.items() if value is not None})


@dataclass(frozen=True)
class RunFolder:
    """Paths of the files of a run.

    Parameters
    ----------
    path : Path
        Folder of the run.
    """

    path: Path

    @property
    def config(self) -> Path:
        """Path of the configuration (YAML)."""
        return self.path / "config.yaml"

    @property
    def model(self) -> Path:
        """Path of the trained model, in Stable-Baselines3's format."""
        return self.path / "model.zip"

    @property
    def checkpoints(self) -> Path:
        """Folder of the checkpoints, which are named by their step, see `agents.checkpoint`."""
        return self.path / "checkpoints"

    @property
    def monitor(self) -> Path:
        """Path of the list of training episodes: return, length, seconds, success; `load_results` of SB3 reads it."""
        return self.path / "monitor.csv"

    @property
    def curve(self) -> Path:
        """Path of the learning curve (CSV); a `.png` with the same name is its picture."""
        return self.path / "curve.csv"

    @property
    def evaluation(self) -> Path:
        """Path of the evaluation of the trained model on fresh episodes (JSON)."""
        return self.path / "evaluation.json"

    @property
    def result(self) -> Path:
        """Path of the run's result (JSON)."""
        return self.path / "result.json"

    @property
    def video(self) -> Path:
        """Path of the video of some episodes; without ffmpeg it ends in `.gif`."""
        return self.path / "episodes.mp4"

    def read_config(self) -> RunConfig:
        """Read the configuration of the run.

        Raises
        ------
        ValueError
            If the folder is not that of a run.
        """
        if not self.config.is_file():
            raise ValueError(f"run is {str(self.path)!r}; allowed is the folder of a run, with a config.yaml")
        return RunConfig(**yaml.safe_load(self.config.read_text(encoding="utf-8")))

    @contextmanager
    def locked(self) -> Iterator[None]:
        """Context manager that keeps other processes from writing into the run; the lock also ends with the process.

        Raises
        ------
        RunInUse
            If another process writes into it.
        """
        lock = FileLock(self.path / LOCK)
        try:
            lock.acquire(timeout=0)
        except Timeout:
            raise RunInUse(f"run is {str(self.path)!r}, which another process works on; allowed is to wait") from None
        try:
            yield
        finally:
            lock.release()

    def discard(self) -> None:
        """Remove the folder if the run has written nothing into it, and the folder above if it is then empty."""
        if {path.name for path in self.path.iterdir()} <= {LOCK}:
            shutil.rmtree(self.path)
            with suppress(OSError):
                self.path.parent.rmdir()


def make_folder(out: Path, config: RunConfig) -> RunFolder:
    """Make a new folder in `out`, named by environment, algorithm, seed and time; no two processes get the same one."""
    name = f"{short_name(config.env)}-{config.algo}-s{config.seed}-{time.strftime('%Y%m%d-%H%M%S')}"
    path, count = out / name, 1
    while True:
        try:
            path.mkdir(parents=True)
            return RunFolder(path)
        except FileExistsError:
            count += 1
            path = out / f"{name}-{count}"
