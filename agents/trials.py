"""Trials of a sweep: one run for each environment, seed and combination of settings, named by its settings."""

from __future__ import annotations

import hashlib
import re
import shlex
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

import yaml

from agents.config import HYPERPARAMETERS, RunConfig, default_algorithm, make_config, short_name
from agents.settings import apply_settings, parse_value

# One thread per trial, since many trials share a machine.
THREADS = {"threads": 1, "torch_threads": 1}

# Values that may stand in the name of a folder; other values, and longer ones, are replaced by a digest.
_PLAIN = re.compile(r"[\w.+-]{1,24}")


@dataclass(frozen=True)
class Trial:
    """One run of a sweep.

    Parameters
    ----------
    name : str
        Name of its folder; the same settings have the same name at any time and place.
    config : RunConfig
    settings : dict
        Values that replace hyperparameters, by dotted name.
    hyperparameters : Path
        File of hyperparameters.
    """

    name: str
    config: RunConfig
    settings: Mapping[str, Any]
    hyperparameters: Path = HYPERPARAMETERS

    def command(self, out: Path) -> str:
        """Shell command that runs the trial in a folder below `out`, or continues it."""
        words = ["python", "-m", "agents.train", "--folder", str(out / self.name), "--no-video",
                 "--env", self.config.env, "--algo", self.config.algo, "--seed", str(self.config.seed)]  # fmt: skip
        for name, value in self.settings.items():
            text = yaml.safe_dump(value, default_flow_style=True, width=10**6).removesuffix("...\n").strip()
            words += ["--set", f"{name}={text}"]
        if self.hyperparameters != HYPERPARAMETERS:
            words += ["--hyperparameters", str(self.hyperparameters.resolve())]
        return shlex.join(words)


def make_trials(
    envs: Sequence[str],
    seeds: Sequence[int],
    grid: Mapping[str, Sequence[Any]],
    algo: str | None = None,
    hyperparameters: Path = HYPERPARAMETERS,
) -> list[Trial]:
    """Make a trial for every combination of environments, settings and seeds, in this order.

    Parameters
    ----------
    envs : sequence of str
        Gymnasium ids.
    seeds : sequence of int
    grid : mapping of str to sequence
        Values of each setting, by dotted name (`agents.settings`).
    algo : str, optional
        None: the first algorithm of each environment in the file.
    hyperparameters : Path

    Raises
    ------
    ValueError
        If there is no such setting, or two trials would be the same.
    """
    trials = {}
    for env, values, seed in product(envs, product(*grid.values()), seeds):
        settings = dict(zip(grid, values))
        name = algo or default_algorithm(env, hyperparameters)
        config = make_config(env, name, seed, hyperparameters)
        config = apply_settings(config, {**THREADS, **settings})
        trial = Trial(_name(config, settings), config, {**THREADS, **settings}, hyperparameters)
        if trial.name in trials:
            raise ValueError(f"{trial.name} is twice in the sweep; allowed is every environment, seed and value once")
        trials[trial.name] = trial
    return list(trials.values())


def _name(config: RunConfig, settings: Mapping[str, Any]) -> str:
    parts = [f"{short_name(config.env)}-{config.algo}"]
    parts += [f"{name}={_label(value)}" for name, value in settings.items()]
    return "-".join([*parts, f"s{config.seed}"])


def _label(value: Any) -> str:
    text = repr(value) if isinstance(value, float) else str(value)
    return text if _PLAIN.fullmatch(text) else hashlib.sha256(repr(value).encode()).hexdigest()[:8]


def parse_grid(assignments: Iterable[str]) -> dict[str, list[Any]]:
    """Parse texts such as ``algorithm.learning_rate=1e-3,3e-4`` to lists of values, by dotted name.

    Raises
    ------
    ValueError
        If a text has another form, or a name occurs twice.
    """
    grid: dict[str, list[Any]] = {}
    for text in assignments:
        name, sign, values = text.partition("=")
        if not (sign and name and values):
            raise ValueError(f"--set is {text!r}; allowed is NAME=VALUE,..., as algorithm.learning_rate=1e-3,3e-4")
        if name in grid:
            raise ValueError(f"--set names {name} twice; allowed is once, with commas between the values")
        grid[name] = [parse_value(value, name) for value in _split(values)]
    return grid


def _split(text: str) -> list[str]:
    """Split a text at commas outside brackets."""
    parts, depth = [""], 0
    for character in text:
        depth += (character in "[{") - (character in "]}")
        if character == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += character
    return parts


def parse_seeds(text: str) -> list[int]:
    """Seeds of a text such as ``0-4`` or ``1,3,7-9``.

    Raises
    ------
    ValueError
        If it is none.
    """
    seeds: list[int] = []
    for part in text.split(","):
        first, _, last = part.strip().partition("-")
        if not (first.isdigit() and (last or first).isdigit() and int(last or first) >= int(first)):
            raise ValueError(f"seeds is {text!r}; allowed are numbers and ranges, such as 0-4 or 1,3,7-9")
        seeds += range(int(first), int(last or first) + 1)
    return seeds
