"""Scenes as TOML files, which describe a scene without code.

A file has a table for each body, wall and effect. Its key `kind` names the class; the other keys are parameters of the
class, in SI units. Parameters that are left out keep their defaults. Files are read with the standard library's reader
and written with tomlkit.

A file may also hold tables for programs that use scenes, such as [environment]. They are returned unchecked.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import tomlkit

from physics import validation
from physics.io.plain import KINDS, build_all, plain_scene
from physics.io.scene_places import Places, SourceLines
from physics.keywords import known_keywords, nearest_first
from physics.scene.force_field import Field
from physics.scene.scene import Scene
from physics.summary import shown

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

# Number of the file format; a reader refuses newer formats than its own.
FORMAT = 1

# Tables that are no part of a scene: read, but left to the programs that know them.
OTHERS = ("environment",)


@dataclass(frozen=True)
class SceneFile:
    """Content of a scene file.

    Attributes
    ----------
    scene : Scene
        Scene of the file.
    others : dict of str to dict
        Tables of `OTHERS` that the file has, with their unchecked contents.
    places : Places
        Lines of the file, for errors about these tables.
    """

    scene: Scene
    others: dict[str, dict[str, Any]]
    places: Places


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
    for name, items in plain_scene(scene).items():
        tables = tomlkit.aot()
        for item in items:
            table = tomlkit.table()
            for key, value in item.items():
                table.add(key, value)
            tables.append(table)
        document.add(name, tables)
    return tomlkit.dumps(document)


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
    except IsADirectoryError as error:
        told = f"path is {str(path)!r}, which is a folder; allowed is a scene file (.toml)"
        raise IsADirectoryError(error.errno, told) from None
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
    return file_from_content(content, SourceLines(text, source), kinds)


def file_from_content(content: Mapping[str, Any], places: Places, kinds: Sequence[type[Field]] = ()) -> SceneFile:
    """Make the scene and the other tables from the plain data of a scene file; `places` makes the errors about it."""
    _check_head(places, content)
    known = {**KINDS, "effects": (*KINDS["effects"], *kinds)}
    lists = {name: build_all(places, name, content.get(name, []), known[name]) for name in KINDS}
    try:
        scene = Scene(**lists)
    except ValueError as error:
        raise places.error_of_scene(lists, str(error)) from None
    return SceneFile(scene, {name: content[name] for name in OTHERS if name in content}, places)


def _check_head(places: Places, content: Mapping[str, Any]) -> None:
    """Refuse unknown keys and tables of a file's head, and formats that are newer than this reader."""
    known = ("format", *KINDS, *OTHERS)
    for key in content:
        if key not in known:
            allowed = ", ".join(nearest_first(key, known))
            raise places.error(None, 0, key, f"{key} is not known; allowed are {allowed}")
    number = content.get("format", FORMAT)
    if type(number) is not int or number not in range(1, FORMAT + 1):
        raise places.error(None, 0, "format", f"format is {shown(number)}; allowed is {FORMAT}")
    for name in OTHERS:
        if not isinstance(content.get(name, {}), Mapping):
            raise places.error(None, 0, name, f"{name} is {shown(content[name])}; allowed is a table [{name}]")


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
