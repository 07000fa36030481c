"""Short explanations of arguments, draws and infos, for the tables in a task's documentation."""

from __future__ import annotations

import inspect
import re
from collections.abc import Iterable
from typing import TYPE_CHECKING

from physics.keywords import nearest_first
from rigid_env.tasks.draws import parameter_of
from rigid_env.tasks.parameters import WALL_PARAMETERS

if TYPE_CHECKING:
    from rigid_env.tasks.declaration import Declaration

ARGUMENTS = {
    "accuracy": "preset of the engine, a `physics.Accuracy`, or a dict of its settings",
    "effects": "`physics` effects besides (`physics.Drag()`, ...), or instead of the task's of that class",
    "draws": "distributions instead of the task's, by name",
    "frame_skip": "physics steps per control step",
    "dt": "physics step [s]",
    "dump_faults": "folder for what led to a state that was not finite (`rigid-env replay`)",
    "threads": "threads that share a step of a batch",
}
"""Explanations of the arguments that all tasks have, by name."""

OF_ENVIRONMENTS = {
    "render_mode": '`"rgb_array"`, `"human"` or None',
    "width": "of pictures [px]",
    "height": "of pictures [px]",
    "obs": 'observations: `"state"`, the table above, or `"pixels"`, pictures (uint8)',
    "obs_size": "height and width of these [px]",
    "obs_stack": "of the last so many control steps, along the last axis, the newest last",
    "contacts": "contacts told in `info`, those with the largest forces",
    "impacts": "pairs that collided told in `info`: the largest impulses",
    "camera": "of pictures: a `rigid_env.rendering.Camera`, or a dict of its parameters; None sees the room",
    "arrows": "whether pictures show contacts, forces and torques",
}
"""Explanations of the arguments that environments add to those of a task, by name."""

OWN_CAMERA = "of pictures: a `rigid_env.rendering.Camera`, or a dict of its parameters; None takes that of the task"
"""Explanation of the argument `camera` of a task that declares one."""

PARAMETERS = {
    "mass": "mass [kg]",
    "size": "edges or diameters [m]",
    "radius": "radius of a sphere [m]",
    "friction": "Coulomb coefficient",
    "restitution": "restitution",
    "gravity": "strength of gravity [m/s²]",
    "wall_friction": "Coulomb coefficient of walls",
    "wall_restitution": "restitution of walls",
}
"""Explanations of draws that are physical parameters, by name."""


def draw_meaning(name: str) -> str:
    """Explanation of a draw by its name, with the unit of a physical parameter; "the task's own" for any other draw."""
    found = parameter_of(name)
    if found is None:
        return "the task's own"
    parameter, part = found
    if part is None:
        return PARAMETERS[parameter]
    if parameter in WALL_PARAMETERS:
        return PARAMETERS[parameter].replace("of walls", f"of wall {part}")
    return f"{PARAMETERS[parameter]} of body {part}"


def explanations_of(task: Declaration) -> dict[str, str]:
    """Explanations that a task declares in `explanations`, those of its base classes included, by key of infos."""
    found: dict[str, str] = {}
    for owner in reversed(type(task).__mro__):
        found |= vars(owner).get("explanations", {})
    return {**found, **task.explanations}  # those of the task itself last


def check_explanations(task: Declaration, keys: Iterable[str]) -> None:
    """Raise a ValueError if a task's own `explanations` explain a key that is not among the `keys` of its infos."""
    own = vars(type(task)).get("explanations", {})
    unknown = sorted(set(own) - set(keys))
    if unknown:
        known = ", ".join(nearest_first(unknown[0], keys))
        raise ValueError(f"explanations of {type(task).__name__} have {unknown[0]!r}; allowed are {known}")


def argument_meaning(kind: type, name: str) -> str:
    """Explanation of a constructor's argument.

    Parameters
    ----------
    kind : type
        Class of the task.
    name : str
        Name of the argument.

    Returns
    -------
    str
        Explanation of the draw with this name, or the text under ``Parameters`` in the docstring of the class or of its
        first base that has one; else "".
    """
    if parameter_of(name):
        return draw_meaning(name)
    for owner in kind.__mro__:
        doc = inspect.cleandoc(owner.__doc__ or "")
        parts = re.search(r"^Parameters\n-+\n(.*?)(?=\n\w+\n-+\n|\n## |\Z)", doc, re.DOTALL | re.MULTILINE)
        for names, text in re.findall(
            r"^(\S[^:\n]*?)(?: :.*)?\n((?: {4}.*\n?)+)", parts[1] if parts else "", re.MULTILINE
        ):
            if name in names.split(", "):
                return " ".join(text.split())
    return ""
