"""Names and lists that a user types in a shell, such as scenes and presets: look them up, and complete them."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from physics import Scene

SCENE_FILES = (".toml", ".xml", ".urdf")  # as of `rigid_env.tasks.scene_source`, which takes long to import
CANONICAL = (
    "drop", "flight", "tumble", "rest", "shove", "corner_drop", "slide", "ramp", "bounce", "rolling_sphere",
    "vertex_drop", "closed_box", "tower", "heap", "football", "incline",
)  # fmt: skip
"""Names of `physics.scenes.SCENES`, listed here because that module takes long to import."""


def load_scene(name: str) -> tuple[str, Scene]:
    """Find the scene of a name or a file; returns a short name for it, and the scene.

    Raises
    ------
    ValueError
        No such scene or file, or a mistake in the file: it is named with file, line and key.
    """
    from rigid_env.tasks.scene_source import find_scene

    found = find_scene(name)
    return found.name, found.scene


def checked_preset(name: str | None) -> str | None:
    """Check that `name` is a preset, for the `callback` of an option, and return it; None stays None."""
    from physics import PRESETS
    from physics.keywords import nearest_first

    if name is not None and name not in PRESETS:
        raise typer.BadParameter(f"{name!r}; allowed are {', '.join(nearest_first(name, PRESETS))}")
    return name


def listed(text: str) -> list[str]:
    """Split a list with commas, such as ``fast,balanced``."""
    return [part.strip() for part in text.split(",") if part.strip()]


def listed_presets(text: str) -> list[str]:
    """Split a list of presets with commas.

    Raises
    ------
    ValueError
        A name is no preset, or there is none.
    """
    from physics import PRESETS, validation

    return [validation.one_of(name, PRESETS, "accuracy") for name in listed(text) or [text]]


def listed_steps(text: str) -> list[float]:
    """Split a list of steps [s] with commas.

    Raises
    ------
    ValueError
        A part of the list is no positive number.
    """
    from physics import validation

    try:
        found = [float(part) for part in listed(text)]
    except ValueError:
        raise ValueError(f"steps is {text!r}; allowed are numbers [s] with commas between them") from None
    return [float(validation.positive(step, (), "steps")) for step in found]


# --- completion in a shell -------------------------------------------------------------------------------------------


def complete_scene(incomplete: str) -> list[str]:
    """Canonical scenes and scene files whose names begin with the typed text."""
    from physics import scenes

    return [*_starting(incomplete, scenes.SCENES), *_scene_files(incomplete)]


def complete_preset(incomplete: str) -> list[str]:
    """Presets whose names begin with the typed text."""
    from physics import PRESETS

    return _starting(incomplete, PRESETS)


def complete_presets(incomplete: str) -> list[str]:
    """Completions of a list of presets with commas, whose last name is incomplete."""
    from physics import PRESETS

    return _listed(incomplete, PRESETS)


def complete_truth(incomplete: str) -> list[str]:
    """Scenes whose accuracy can be measured, and scene files, whose names begin with the typed text."""
    from rigid_env.lab.measure import accuracy

    return [*_starting(incomplete, accuracy.names()), *_scene_files(incomplete)]


def complete_trained(incomplete: str) -> list[str]:
    """Environments that have a trained policy."""
    from rigid_env.envs.pretrained import pretrained_ids

    return _starting(incomplete, pretrained_ids())


def complete_peers(incomplete: str) -> list[str]:
    """Completions of a list of other engines with commas, whose last name is incomplete."""
    from rigid_env.lab.measure import peers

    return _listed(incomplete, peers.ENGINES)


def complete_effect(incomplete: str) -> list[str]:
    """Effects whose computing time can be measured and whose names begin with the typed text."""
    from rigid_env.lab.measure.effects import CASES

    return _starting(incomplete, CASES)


def complete_case(incomplete: str) -> list[str]:
    """Hard cases whose names begin with the typed text."""
    from rigid_env.hard_cases import registry

    return _starting(incomplete, (case.name for case in registry.CASES))


def _scene_files(incomplete: str) -> list[str]:
    """Scene files and folders whose paths begin with the typed text."""
    folder, _, start = incomplete.rpartition("/")
    place = Path(folder + "/") if folder or incomplete.startswith("/") else Path()
    files = (path for path in sorted(place.glob("*")) if path.is_dir() or path.suffix in SCENE_FILES)
    prefix = incomplete.removesuffix(start)
    return [prefix + path.name + ("/" if path.is_dir() else "") for path in files if path.name.startswith(start)]


def _starting(incomplete: str, known: Iterable[str]) -> list[str]:
    return [name for name in known if name.startswith(incomplete)]


def _listed(incomplete: str, known: Iterable[str]) -> list[str]:
    """Completions of the last name in a list of `known` names with commas; names already listed are left out."""
    done, comma, last = incomplete.rpartition(",")
    return [done + comma + name for name in _starting(last, known) if name not in done.split(",")]
