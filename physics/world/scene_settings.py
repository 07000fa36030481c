"""Settings of a scene that no array of a world holds. A snapshot is restored only into a scene with equal settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any
from zlib import crc32

from physics.scene.effects import Actuator, Contact, Friction, Sleeping
from physics.scene.force_field import Field
from physics.scene.groups import GROUP, MASK
from physics.scene.materials import find_materials
from physics.scene.pairs import FRICTION_RULE, RESTITUTION_RULE
from physics.scene.scene import HalfSpace, Scene

NUMBERS_IN_PLAN = (Actuator, Sleeping)
"""Effects whose numbers are the same for all worlds, since the plan holds them and not the arrays of a world."""


def scene_settings(scene: Scene) -> dict[str, str]:
    """Settings of a scene by name (bodies, walls, effects), as text to be compared, shown and stored in a file.

    Sizes, masses, inertias and the numbers of most effects are not among them: each world has its own.
    """
    return {
        "bodies": ", ".join(map(_body, scene.bodies)),
        "walls": ", ".join(map(_wall, scene.walls)) + "; they differ" * find_materials(scene).differ_at_walls,
        "effects": ", ".join(sorted(map(_effect, scene.effects))),
    }


def other_setting(ours: Mapping[str, Any], theirs: Mapping[str, Any]) -> tuple[str, Any, Any] | None:
    """Find the first setting that differs between two scenes: return its name and both values, or None if all agree.

    A value is None where a scene lacks the setting.
    """
    for name in (*ours, *theirs):
        if ours.get(name) != theirs.get(name):
            return name, ours.get(name), theirs.get(name)
    return None


def _body(body) -> str:
    """Text for a body: its kind, for a hull or compound a checksum of its shape, whether it is fixed, its groups."""
    kind = f"hull {crc32(body.polyhedron.vertices.tobytes()):08x}" if body.kind == "hull" else body.kind
    if body.kind == "compound":
        kind = f"compound {crc32(b''.join(_placed(each) for each in body.placed_parts)):08x}"
    kind = f"fixed {kind}" if body.fixed else kind
    return " with ".join([kind, *_settings(body, {"group": GROUP, "mask": MASK})])


def _placed(placed) -> bytes:
    """Bytes of the shape of a compound's part: its kind, pose, dimensions, and the corners of a hull."""
    part = placed.part
    shape = part.polyhedron.vertices if part.kind == "hull" else part.dimensions
    return part.kind.encode() + b"".join(each.tobytes() for each in (placed.place, placed.R, shape))


def _wall(wall: HalfSpace) -> str:
    """Text for a wall: its plane, and which coefficients it has, without their numbers, which each world has."""
    plane = repr(replace(wall, name=None, friction=None, restitution=None))
    own = [name for name in ("friction", "restitution") if getattr(wall, name) is not None]
    return " with ".join([plane, *own])


def _effect(effect) -> str:
    """Text for an effect: its name, and its settings that are the same in all worlds."""
    if isinstance(effect, NUMBERS_IN_PLAN):
        return repr(effect)
    if isinstance(effect, Contact):
        return " with ".join(["Contact", *_switches(effect)])
    if isinstance(effect, Friction):
        named = _settings(effect, {"axis": None, "rule": FRICTION_RULE, "pairs": ()})
        return f"Friction({', '.join(named)})" if named else "Friction"
    return effect.kind.__name__.lstrip("_") if isinstance(effect, Field) else type(effect).__name__


def _switches(contact: Contact) -> list[str]:
    """Names of the declared parts of a `Contact`, without their numbers, such as ``restitution``."""
    named = [name for name in ("restitution", "tangential", "stiffness") if getattr(contact, name) is not None]
    named += ["walls alone"] * (not contact.between_bodies)
    return named + _settings(contact, {"restitution_rule": RESTITUTION_RULE, "restitution_pairs": ()})


def _settings(effect, usual: Mapping[str, Any]) -> list[str]:
    """Texts ``name=value`` for the fields of an effect whose values are not the `usual` ones."""
    return [f"{name}={getattr(effect, name)!r}" for name in usual if getattr(effect, name) != usual[name]]
