"""Settings by dotted names, as the command line gives them: ``algorithm.learning_rate=3e-4``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace
from typing import Any

import yaml

from agents.config import RunConfig
from physics.keywords import nearest_first

OF_OPTIONS = {"env": "to name the environment alone", "algo": "--algo", "seed": "--seed, or --seeds of a sweep"}
"""Fields that have options of their own, because they decide the hyperparameters and the name of a run."""

OPEN_FIELDS = ("algorithm", "env_kwargs")  # of a `RunConfig`: dicts with entries of any name


def parse_settings(assignments: Sequence[str]) -> dict[str, Any]:
    """Parse texts such as ``algorithm.learning_rate=3e-4`` to values by dotted name; a value is YAML.

    Raises
    ------
    ValueError
        If a text has another form, or a name occurs twice.
    """
    found: dict[str, Any] = {}
    for text in assignments:
        name, sign, value = text.partition("=")
        if not (sign and name):
            raise ValueError(f"--set is {text!r}; allowed is NAME=VALUE, such as algorithm.learning_rate=3e-4")
        if name in found:
            raise ValueError(f"--set names {name} twice; allowed is once")
        found[name] = parse_value(value, name)
    return found


def parse_value(text: str, name: str) -> Any:
    """Parse a number, text, list or dict from YAML; 3e-4 is a number, too. `name` is the setting's, for errors.

    Raises
    ------
    ValueError
        If the text is no YAML.
    """
    try:
        return _with_numbers(yaml.safe_load(text))
    except yaml.YAMLError as error:
        raise ValueError(f"{name} is {text!r}; allowed is YAML, such as 3e-4, true, relu or [64, 64]") from error


def _with_numbers(value: Any) -> Any:
    """Replace texts that are numbers; YAML 1.1 reads 3e-4, which has no decimal point, as text."""
    if isinstance(value, list):
        return [_with_numbers(each) for each in value]
    if isinstance(value, dict):
        return {key: _with_numbers(each) for key, each in value.items()}
    if isinstance(value, str):
        try:
            return float(value)
        except ValueError:
            return value
    return value


def apply_settings(config: RunConfig, settings: Mapping[str, Any]) -> RunConfig:
    """Copy of a configuration with other values of some settings, given by dotted names.

    Every value in ``config.yaml`` has such a name.

    Parameters
    ----------
    config : RunConfig
    settings : mapping of str to object
        Fields of `RunConfig` by name, entries of its dicts by ``field.entry``.

    Raises
    ------
    ValueError
        If there is no such field, or its value is out of range.
    """
    for name, value in settings.items():
        head, *rest = name.split(".")
        known = [f.name for f in fields(RunConfig)]
        if head in OF_OPTIONS:
            raise ValueError(f"--set names {head}; allowed is {OF_OPTIONS[head]}")
        if head not in known:
            raise ValueError(f"{head} is no setting of a run; allowed are {', '.join(nearest_first(head, known))}")
        if not rest:
            config = replace(config, **{head: value})
        else:
            config = replace(config, **{head: _with_entry(getattr(config, head), rest, value, name)})
    return config


def _with_entry(table: Any, path: list[str], value: Any, name: str) -> dict[str, Any]:
    """Copy of nested dicts with another value at `path`, the keys from the outermost dict on."""
    if not isinstance(table, dict) or not path[0]:
        raise ValueError(f"{name} is {value!r}; allowed are entries of {', '.join(OPEN_FIELDS)} and of dicts in them")
    first, *rest = path
    return {**table, first: _with_entry(table.get(first, {}), rest, value, name) if rest else value}
