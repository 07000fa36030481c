"""Settings of a scene outside the arrays of a world; they must agree where a state is restored."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any
from zlib import crc32

from physics.scene.effects import Actuator, Contact, Friction, Sleeping
from physics.scene.force_field import Field
from physics.scene.scene import Scene

NUMBERS_IN_PLAN = (Actuator, Sleeping)
"""Effects whose numbers are part of the plan, not parameters of a world."""


def scene_settings(scene: Scene) -> dict[str, str]:
    """Settings of a scene by name, as text that can be compared, shown and kept in a file.

    They exclude sizes, masses, inertias and the numbers of most effects, which are parameters of each world.
    """
    return {
        "bodies": ", ".join(map(_body, scene.bodies)),
        "walls": ", ".join(map(repr, scene.walls)),
        "effects": ", ".join(sorted(map(_effect, scene.effects))),
    }


def other_setting(ours: Mapping[str, Any], theirs: Mapping[str, Any]) -> tuple[str, Any, Any] | None:
    """Name of the first setting that differs, with both values (None: unknown); None if all agree."""
    for name in (*ours, *theirs):
        if ours.get(name) != theirs.get(name):
            return name, ours.get(name), theirs.get(name)
    return None


def _body(body) -> str:
    """Kind of a body, and a checksum of the corners of a hull."""
    return f"hull {crc32(body.polyhedron.vertices.tobytes()):08x}" if body.kind == "hull" else body.kind


def _effect(effect) -> str:
    """Name of an effect, with its settings that decide the choice of kernel."""
    if isinstance(effect, NUMBERS_IN_PLAN):
        return repr(effect)
    if isinstance(effect, Contact):
        return " with ".join(["Contact", *_switches(effect)])
    if isinstance(effect, Friction) and effect.axis is not None:
        return f"Friction(axis={effect.axis})"
    return effect.kind.__name__.lstrip("_") if isinstance(effect, Field) else type(effect).__name__


def _switches(contact: Contact) -> list[str]:
    """Switches of a contact, without its numbers."""
    named = [name for name in ("restitution", "tangential", "stiffness") if getattr(contact, name) is not None]
    return named + ["walls alone"] * (not contact.between_bodies)
