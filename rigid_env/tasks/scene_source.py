"""Find a scene, and the other tables of its file, by the name of a canonical scene or the path of a file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import physics
from physics import scenes
from physics.io.mjcf.files import load_mjcf
from physics.io.scene_places import Places
from physics.io.toml import SceneFile, file_from_content, load_file
from physics.keywords import alike, nearest_first
from physics.summary import shown

MJCF_FILES = (".xml", ".urdf")
"""Endings of files in MJCF, the format of MuJoCo, and in URDF, which the same reader loads."""

SCENE_FILES = (".toml", *MJCF_FILES)
"""Endings of files that hold a scene."""

ENDINGS = f"{', '.join(SCENE_FILES[:-1])} or {SCENE_FILES[-1]}"
"""Endings of `SCENE_FILES` as words of a sentence."""

SceneSource = physics.Scene | str | os.PathLike | Mapping[str, Any]
"""Type of an argument: a scene, the name of a canonical one, a file, or the content of one as plain data."""


class Found(NamedTuple):
    """Scene of a user, and the contents of its file.

    Attributes
    ----------
    name : str
        Short name for titles.
    scene : physics.Scene
    file : SceneFile or None
        Contents of the scene file. None: the scene is from no file, or from a file in MJCF or URDF, which holds only a
        scene.
    """

    name: str
    scene: physics.Scene
    file: SceneFile | None


def find_scene(scene: SceneSource | None) -> Found:
    """Find a user's scene: an object, the name of a canonical scene, the path of a scene file, or the content of one.

    Raises
    ------
    ValueError
        No such scene or file, or a mistake in the file: it is named with file, line and key.
    """
    if isinstance(scene, physics.Scene):
        return Found("Scene", scene, None)
    if isinstance(scene, Mapping):
        file = file_from_content(scene, Places("scene"))
        return Found("Scene", file.scene, file)
    allowed = f"a scene file ({ENDINGS})"
    if not isinstance(scene, (str, os.PathLike)) or not os.fspath(scene):
        raise ValueError(
            f"scene is {shown(scene)}; allowed are {allowed}, its content as a dict, a canonical scene, "
            "or a physics.Scene"
        )
    name = os.fspath(scene)
    path = Path(name)
    if path.suffix.lower() in SCENE_FILES or path.is_file():
        if not path.is_file():
            what = "is a folder" if path.is_dir() else "does not exist"
            raise ValueError(
                f"scene is {name!r}, which {what}; allowed is a scene file{_nearest(path)}, or a canonical scene"
            )
        if path.suffix.lower() in MJCF_FILES:
            return Found(path.stem, load_mjcf(path), None)
        file = load_file(path)
        return Found(path.stem, file.scene, file)
    if name in scenes.SCENES:
        return Found(name, scenes.by_name(name), None)
    raise ValueError(f"scene is {name!r}; allowed are {', '.join(nearest_first(name, scenes.SCENES))}, or {allowed}")


def _nearest(path: Path) -> str:
    """Words about the scene file in the same folder whose name is most like that of `path`; "" if none is alike."""
    files = {each.name: each for each in path.parent.glob("*") if each.suffix.lower() in SCENE_FILES}
    found = alike(path.name, files)
    return f", such as {str(files[found[0]])!r}" if found else ""
