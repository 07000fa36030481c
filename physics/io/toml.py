"""Scenes as TOML files, which describe a scene without code.

A file has a table for each body, wall and effect. Its key `kind` names the class; the other keys are parameters of the
class, in SI units. Parameters that are left out keep their defaults. Files are read with the standard library's reader
and written with tomlkit.

A file may also hold tables for programs that use scenes, such as [environment]. They are returned unchecked.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Sequence
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Any

import tomlkit

from physics import validation
from physics.io.scene_places import SourceLines
from physics.keywords import known_keywords, nearest_first
from physics.scene.bodies import Block, Ellipsoid, Hull, Sphere
from physics.scene.effects import Actuator, Contact, Friction, Gravity, RollingFriction, Sleeping, SpinFriction
from physics.scene.force_field import Field
from physics.scene.force_fields import FIELDS
from physics.scene.scene import HalfSpace, Scene
from physics.summary import shown

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

# Number of the file format; a reader refuses newer formats than its own.
FORMAT = 1

BODIES = (Block, Sphere, Ellipsoid, Hull)
EFFECTS = (Gravity, Contact, Friction, RollingFriction, SpinFriction, Actuator, Sleeping, *FIELDS)
LISTS = ("bodies", "walls", "effects")

# Names of tables that are no part of a scene; they are read for the programs that use them.
OTHERS = ("environment",)


@dataclass(frozen=True)
class SceneFile:
    """Content of a scene file.

    Attributes
    ----------
    scene : Scene
        Scene of the file.
    others : dict of str to dict
        Tables of the file that are named in `OTHERS`, unchecked.
    lines : SourceLines
        Lines of the file, for errors about these tables.
    """

    scene: Scene
    others: dict[str, dict[str, Any]]
    lines: SourceLines


def save_scene(scene: Scene, path: str | Path) -> None:
    """Write a scene as a TOML file, from which `load_scene` reads an equal scene.

    A user's own fields are written with the name of their class; `load_scene` needs that class among its `kinds`.

    Parameters
    ----------
    scene : Scene
        Scene to write.
    path : str or Path
        Path of the file; an existing file is overwritten.
    """
    validation.instance(scene, Scene, "scene", "a physics.Scene")
    validation.path(path)
    Path(path).write_text(to_toml(scene), encoding="utf-8")


def to_toml(scene: Scene) -> str:
    """Make the TOML text of a scene, as `save_scene` writes it."""
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
    """Parameters of a body, wall or effect that differ from their defaults, by name; tuples become lists."""
    found = {}
    for field in fields(item):
        value = getattr(item, field.name)
        if field.default is MISSING or value != field.default:
            found[field.name] = _plain(value)
    return found


def _plain(value):
    return [_plain(part) for part in value] if isinstance(value, tuple) else value


@known_keywords
def load_scene(path: str | Path, kinds: Sequence[type[Field]] = ()) -> Scene:
    """Read a scene from a TOML file. Its table [environment], which only `rigid_env` uses, is ignored.

    Parameters
    ----------
    path : str or Path
        Path of the file.
    kinds : sequence of classes, optional
        Classes of a user's own fields that the file may name. Reading a file never imports code.

    Raises
    ------
    ValueError
        The file is no scene file, or a value is not allowed. The message names file, line, key and value.
    OSError
        The file cannot be read.
    """
    return load_file(path, kinds).scene


def load_file(path: str | Path, kinds: Sequence[type[Field]] = ()) -> SceneFile:
    """Read a scene and the other tables of a TOML file; arguments and errors are those of `load_scene`."""
    validation.path(path)
    try:
        text = Path(path).read_text(encoding="utf-8")
    except FileNotFoundError as error:
        told = f"path is {str(path)!r}, which does not exist; allowed is a scene file (.toml)"
        raise FileNotFoundError(error.errno, told) from None
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: byte {error.start} is no UTF-8; allowed is a text file in TOML") from None
    return file_from_toml(text, str(path), kinds)


def from_toml(text: str, source: str = "scene", kinds: Sequence[type[Field]] = ()) -> Scene:
    """Make a scene from a TOML text; messages call the text `source`. `kinds` is that of `load_scene`."""
    return file_from_toml(text, source, kinds).scene


def file_from_toml(text: str, source: str = "scene", kinds: Sequence[type[Field]] = ()) -> SceneFile:
    """Make a scene and the other tables from a TOML text; messages call the text `source`.

    `kinds` is that of `load_scene`.
    """
    kinds = _own_kinds(kinds)
    try:
        content = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ValueError(_syntax_error(text, source, str(error))) from None
    lines = SourceLines(text, source)
    _check_head(lines, content)
    known = {"bodies": BODIES, "walls": (HalfSpace,), "effects": (*EFFECTS, *kinds)}
    lists = {name: _build_all(lines, name, content.get(name, []), known[name]) for name in LISTS}
    try:
        scene = Scene(**lists)
    except ValueError as error:
        raise lines.error_of_scene(lists, str(error)) from None
    return SceneFile(scene, {name: content[name] for name in OTHERS if name in content}, lines)


def _check_head(lines: SourceLines, content: dict) -> None:
    """Refuse a file with unknown keys or tables at its top level, or with a newer format."""
    known = ("format", *LISTS, *OTHERS)
    for key in content:
        if key not in known:
            allowed = ", ".join(nearest_first(key, known))
            raise lines.error(None, 0, key, f"{key} is not known; allowed are {allowed}")
    number = content.get("format", FORMAT)
    if type(number) is not int or number not in range(1, FORMAT + 1):
        raise lines.error(None, 0, "format", f"format is {shown(number)}; allowed is {FORMAT}")
    for name in OTHERS:
        if not isinstance(content.get(name, {}), dict):
            raise lines.error(None, 0, name, f"{name} is {shown(content[name])}; allowed is a table [{name}]")


def _own_kinds(kinds) -> tuple:
    """Check the classes of a user's own fields that a file may name; return them as a tuple."""
    found = tuple(kinds) if isinstance(kinds, Iterable) else (kinds,)
    for kind in found:
        if not isinstance(kind, type) or not issubclass(kind, Field):
            raise ValueError(f"kinds holds {shown(kind)}; allowed are subclasses of physics.Field")
    return found


def _syntax_error(text: str, source: str, message: str) -> str:
    """Make the text of an error from the message of the TOML reader, with file, line and the text of that line."""
    told = re.fullmatch(r"(.*) \(at (?:line (\d+), column (\d+)|end of document)\)", message, re.DOTALL)
    if told is None:
        return f"{source}: {message}"
    lines = text.splitlines()
    line = int(told.group(2) or max(len(lines), 1))
    place = f"line {line}" + (f", column {told.group(3)}" if told.group(3) else ", at its end")
    stands = shown(lines[line - 1].strip()) if line <= len(lines) else "''"
    return f"{source}, {place}: {told.group(1)}, in {stands}; allowed is TOML, as `physics.save_scene` writes it"


def _build_all(lines: SourceLines, name: str, tables, known: tuple[type, ...]) -> list:
    """Make the bodies, walls or effects (`name`) of a file from their tables; `known` are the allowed classes."""
    if not isinstance(tables, list) or not all(isinstance(table, dict) for table in tables):
        raise lines.error(None, 0, name, f"{name} is {shown(tables)}; allowed are tables [[{name}]]")
    return [_build(lines, name, k, dict(table), known) for k, table in enumerate(tables)]


def _build(lines: SourceLines, name: str, index: int, table: dict, known: tuple[type, ...]):
    kinds = {kind.__name__: kind for kind in known}
    if len(known) == 1:
        chosen = next(iter(kinds))
    elif "kind" in table:
        chosen = table.pop("kind")
    else:
        raise lines.error(name, index, None, f"kind is missing; allowed are {', '.join(kinds)}")
    if not isinstance(chosen, str) or chosen not in kinds:
        allowed = ", ".join(nearest_first(chosen, kinds) if isinstance(chosen, str) else kinds)
        raise lines.error(name, index, "kind", f"kind is {shown(chosen)}; allowed are {allowed}")
    kind = kinds[chosen]
    parameters = {field.name: field for field in fields(kind) if field.init}
    for key in table:
        if key not in parameters:
            allowed = ", ".join(nearest_first(key, parameters))
            raise lines.error(name, index, key, f"{key} is not known; allowed are {allowed}")
    for key, field in parameters.items():
        if field.default is MISSING and field.default_factory is MISSING and key not in table:
            raise lines.error(name, index, None, f"{key} is missing; a {kind.__name__} needs it")
    try:
        return kind(**table)
    except (ValueError, TypeError) as error:
        told = re.match(r"(?:\w+\.)?(\w+)(?:\[[^]]*\])? ", str(error))
        key = told.group(1) if told and told.group(1) in parameters else None
        raise lines.error(name, index, key, str(error)) from None
