"""Scenes as TOML files: what a scene is, written down without its code.

One table per body, wall and effect; `kind` is the class, the other keys are its parameters under their names, in SI
units. What is left out keeps its default. Files are read with the standard library's reader and written with tomlkit.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Sequence
from dataclasses import MISSING, fields
from pathlib import Path

import tomlkit

from physics.effects import Actuator, Contact, Friction, Gravity, RollingFriction, Sleeping, SpinFriction
from physics.field import Field
from physics.fields import FIELDS
from physics.scene import HalfSpace, Scene
from physics.shapes import Block, Ellipsoid, Hull, Sphere

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

# Number of the format; a reader refuses what is newer than itself.
FORMAT = 1

BODIES = (Block, Sphere, Ellipsoid, Hull)
EFFECTS = (Gravity, Contact, Friction, RollingFriction, SpinFriction, Actuator, Sleeping, *FIELDS)
LISTS = ("bodies", "walls", "effects")


def save_scene(scene: Scene, path: str | Path) -> None:
    """Write a scene as TOML; `load_scene` gives an equal one.

    Fields of your own are written by the name of their class; `load_scene` wants that class among its `kinds`.

    Parameters
    ----------
    scene : Scene
    path : str or Path
    """
    Path(path).write_text(to_toml(scene), encoding="utf-8")


def to_toml(scene: Scene) -> str:
    """The text that `save_scene` writes."""
    document = tomlkit.document()
    document.add(tomlkit.comment("Metres, kilograms, seconds, radians; quaternions (w, x, y, z), body to world."))
    document.add("format", FORMAT)
    for name in LISTS:
        tables = tomlkit.aot()
        for item in getattr(scene, name):
            table = tomlkit.table()
            if name != "walls":
                table.add("kind", type(item).__name__)
            for key, value in _parameters(item).items():
                table.add(key, value)
            tables.append(table)
        if len(tables):
            document.add(name, tables)
    return tomlkit.dumps(document)


def _parameters(item) -> dict:
    """Parameters of a body, wall or effect that are not at their defaults, as lists and numbers."""
    found = {}
    for field in fields(item):
        value = getattr(item, field.name)
        if field.default is MISSING or value != field.default:
            found[field.name] = _plain(value)
    return found


def _plain(value):
    return [_plain(part) for part in value] if isinstance(value, tuple) else value


def load_scene(path: str | Path, kinds: Sequence[type[Field]] = ()) -> Scene:
    """Read a scene from a TOML file.

    Parameters
    ----------
    path : str or Path
    kinds : sequence of classes, optional
        Fields of your own that the file may name. A file never imports code by itself.

    Raises
    ------
    ValueError
        Naming file, line and key, the value, and what is allowed.
    OSError
        The file cannot be read.
    """
    path = Path(path)
    return from_toml(path.read_text(encoding="utf-8"), str(path), kinds)


def from_toml(text: str, source: str = "scene", kinds: Sequence[type[Field]] = ()) -> Scene:
    """The scene that a text describes; `source` is what messages call it."""
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ValueError(f"{source}: {error}") from None
    reader = _Reader(text, source)
    for key in content:
        if key not in ("format", *LISTS):
            raise reader.error(None, 0, key, f"{key} is not known; allowed are format, {', '.join(LISTS)}")
    if content.get("format", FORMAT) not in range(1, FORMAT + 1):
        raise reader.error(None, 0, "format", f"format is {content['format']!r}; allowed is {FORMAT}")
    known = {"bodies": BODIES, "walls": (HalfSpace,), "effects": (*EFFECTS, *kinds)}
    lists = {name: reader.build_all(name, content.get(name, []), known[name]) for name in LISTS}
    try:
        return Scene(**lists)
    except ValueError as error:
        raise ValueError(f"{source}: {error}") from None


class _Reader:
    """Builds the objects of a file, and knows on which line of it what stands."""

    def __init__(self, text: str, source: str):
        self._lines = text.splitlines()
        self._source = source

    def error(self, name: str | None, index: int, key: str | None, message: str) -> ValueError:
        """An error about a key of the table [[name]] number `index`, or of the file's head."""
        start = self._table_line(name, index)
        line = self._key_line(start, key) or start or 1
        place = "" if name is None else f"{name}[{index}]: "
        return ValueError(f"{self._source}, line {line}: {place}{message}")

    def _table_line(self, name: str | None, index: int) -> int:
        """Line of a table's header; 0 for the head of the file, and for a table written inline."""
        if name is None:
            return 0
        header = re.compile(rf"\s*\[\[\s*\"?{name}\"?\s*\]\]")
        found = [k for k, line in enumerate(self._lines, 1) if header.match(line)]
        return found[index] if index < len(found) else 0

    def _key_line(self, start: int, key: str | None) -> int | None:
        """Line of a key of the table whose header is on line `start`."""
        if key is None:
            return None
        wanted = re.compile(rf"\s*(\[\[?\s*)?\"?{re.escape(key)}\"?\s*[=\]]")
        for k, line in enumerate(self._lines[start:], start + 1):
            if wanted.match(line):
                return k
            if start and re.match(r"\s*\[\[", line):
                return None
        return None

    def build_all(self, name: str, tables, known: tuple[type, ...]) -> list:
        """The objects of a list of tables."""
        if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
            raise self.error(None, 0, name, f"{name} is {tables!r}; allowed are tables [[{name}]]")
        return [self._build(name, k, dict(table), known) for k, table in enumerate(tables)]

    def _build(self, name: str, index: int, table: dict, known: tuple[type, ...]):
        kinds = {kind.__name__: kind for kind in known}
        chosen = table.pop("kind", None) if len(known) > 1 else next(iter(kinds))
        if chosen not in kinds:
            raise self.error(name, index, "kind", f"kind is {chosen!r}; allowed are {', '.join(kinds)}")
        kind = kinds[chosen]
        parameters = {field.name: field for field in fields(kind)}
        for key in table:
            if key not in parameters:
                message = f"{key} is not known; allowed are {', '.join(parameters)}"
                raise self.error(name, index, key, message)
        for key, field in parameters.items():
            if field.default is MISSING and key not in table:
                raise self.error(name, index, None, f"{key} is missing; a {kind.__name__} needs it")
        try:
            return kind(**table)
        except ValueError as error:
            told = re.match(r"(?:\w+\.)?(\w+) ", str(error))
            key = told.group(1) if told and told.group(1) in parameters else None
            raise self.error(name, index, key, str(error)) from None
