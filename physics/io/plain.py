"""Scenes as plain data: dicts, lists, numbers and text, the content of a scene file.

A body, wall or effect is a table: `kind` is the class, the other keys are its parameters under their names, in SI
units. Parameters that are left out keep their defaults.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import MISSING, fields
from typing import Any

from physics.io.scene_places import Places
from physics.keywords import nearest_first
from physics.scene.bodies import Block, Body, Ellipsoid, Hull, Sphere
from physics.scene.capsule import Capsule
from physics.scene.compound import PARTS, Compound
from physics.scene.cylinder import Cylinder
from physics.scene.effects import Actuator, Contact, Friction, Gravity, RollingFriction, Sleeping, SpinFriction
from physics.scene.force_fields import FIELDS
from physics.scene.motion import Motion
from physics.scene.scene import HalfSpace, Scene
from physics.scene.sensor import Sensor
from physics.summary import shown

BODIES = (Block, Sphere, Ellipsoid, Capsule, Cylinder, Hull, Compound)
EFFECTS = (Gravity, Contact, Friction, RollingFriction, SpinFriction, Actuator, Sleeping, *FIELDS)
KINDS: dict[str, tuple[type, ...]] = {
    "bodies": BODIES,
    "walls": (HalfSpace,),
    "effects": EFFECTS,
    "sensors": (Sensor,),
}
"""Classes that each list of a scene may hold."""


def plain_scene(scene: Scene) -> dict[str, list[dict[str, Any]]]:
    """Convert a scene to plain data: its lists that are not empty, by name, with a table for each element."""
    tables = {name: [plain_table(item) for item in getattr(scene, name)] for name in KINDS}
    return {name: table for name, table in tables.items() if table}


def plain_table(item) -> dict[str, Any]:
    """Convert a body, part, wall, effect, motion or sensor to a table; parameters at their defaults are left out."""
    found = {} if isinstance(item, (HalfSpace, Motion, Sensor)) else {"kind": type(item).__name__}
    for field in fields(item):
        value = getattr(item, field.name)
        if field.name == "mass" and isinstance(item, Body) and item.fixed:
            continue
        if field.default is MISSING or value != field.default:
            found[field.name] = _plain(value)
    return found


def _plain(value):
    if isinstance(value, (Motion, Body)):
        return plain_table(value)
    return [_plain(part) for part in value] if isinstance(value, tuple) else value


def read_effects(effects) -> tuple:
    """Read effects, each given as an object or as a table of a scene file.

    Raises
    ------
    ValueError
        Naming the effect's index, the key, the value, and what is allowed.
    """
    return tuple(
        build(Places(), "effects", k, effect, EFFECTS) if isinstance(effect, Mapping) else effect
        for k, effect in enumerate(effects)
    )


def build_all(places: Places, name: str, tables, known: tuple[type, ...]) -> list:
    """Make the objects of the list `name` from their `tables`; `known` are the classes that it may hold."""
    if not isinstance(tables, list) or not all(isinstance(table, Mapping) for table in tables):
        raise places.error(None, 0, name, f"{name} is {shown(tables)}; allowed are tables [[{name}]]")
    return [build(places, name, k, table, known) for k, table in enumerate(tables)]


def build(places: Places, name: str, index: int, table: Mapping[str, Any], known: tuple[type, ...]):
    """Make the object of one table of the list `name`.

    Raises
    ------
    ValueError
        Naming place and key, the value, and what is allowed.
    """
    table = dict(table)
    kinds = {kind.__name__: kind for kind in known}
    if len(known) == 1:
        chosen = next(iter(kinds))
    elif "kind" in table:
        chosen = table.pop("kind")
    else:
        raise places.error(name, index, None, f"kind is missing; allowed are {', '.join(kinds)}")
    if not isinstance(chosen, str) or chosen not in kinds:
        allowed = ", ".join(nearest_first(chosen, kinds) if isinstance(chosen, str) else kinds)
        raise places.error(name, index, "kind", f"kind is {shown(chosen)}; allowed are {allowed}")
    kind = kinds[chosen]
    parameters = {field.name: field for field in fields(kind) if field.init}
    for key in table:
        if key not in parameters:
            allowed = ", ".join(nearest_first(key, parameters))
            raise places.error(name, index, key, f"{key} is not known; allowed are {allowed}")
    for key, field in parameters.items():
        if field.default is MISSING and field.default_factory is MISSING and key not in table:
            raise places.error(name, index, None, f"{key} is missing; a {kind.__name__} needs it")
    if kind is Compound and isinstance(table["parts"], list):
        table["parts"] = [_part(places, name, index, k, part) for k, part in enumerate(table["parts"])]
    if kind is Sensor and isinstance(table["shape"], Mapping):
        table["shape"] = build(_PartPlaces(places, name, index, "shape"), name, 0, table["shape"], BODIES)
    try:
        return kind(**table)
    except (ValueError, TypeError) as error:
        told = re.match(r"(?:\w+\.)?(\w+)(?:\[[^]]*\])? ", str(error))
        key = told.group(1) if told and told.group(1) in parameters else None
        raise places.error(name, index, key, str(error)) from None


class _PartPlaces(Places):
    """Places of a part of a compound, or of the shape of a sensor, for errors: those of the table around it.

    `key` is that of the part or shape in table number `index` of the list `name`.
    """

    def __init__(self, places: Places, name: str, index: int, key: str = "parts"):
        super().__init__()
        self._places, self._of, self._key = places, (name, index), key

    def error(self, name: str | None, index: int, key: str | None, message: str) -> ValueError:
        place = f"parts[{index}]" if self._key == "parts" else self._key
        return self._places.error(*self._of, self._key, f"{place}: {message}")


def _part(places: Places, name: str, index: int, k: int, part: Any) -> Any:
    """Make part number `k` of the compound in table number `index`; what is no table stays as it is."""
    if not isinstance(part, Mapping):
        return part
    return build(_PartPlaces(places, name, index), name, k, part, PARTS)
