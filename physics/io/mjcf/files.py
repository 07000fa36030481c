"""Reading and writing of MJCF files; without MuJoCo only files that `save_mjcf` has written can be read."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, overload

from physics import validation
from physics.io.mjcf import compiled_reader, plain_reader
from physics.io.mjcf.left_out import LeftOut
from physics.io.mjcf.text import ModelError, parse
from physics.io.mjcf.writer import to_mjcf
from physics.optional import find_optional, missing
from physics.scene.scene import Scene

LEAST_MUJOCO = (3, 3, 7)  # version whose `MjSpec` numbers its elements


def save_mjcf(scene: Scene, path: str | Path, drop: bool = False) -> None:
    """Write a scene as an MJCF file for MuJoCo.

    The file holds bodies with mass, inertia, pose and velocity (hulls as meshes), planes, gravity, friction, and
    springs, which `load_mjcf` does not read. MuJoCo will simulate it with its soft contacts and its default time step.

    Parameters
    ----------
    scene : Scene
        Scene to write.
    path : str or Path
        Path of the file.
    drop : bool
        Whether to leave out effects, fields and sensors that MJCF cannot express, instead of refusing the scene. A
        comment in the file names them. A body with a motion is written, and stands still.

    Raises
    ------
    ValueError
        The scene has something that MJCF cannot express, and `drop` is False. The message names it.
    """
    validation.instance(scene, Scene, "scene", "a physics.Scene")
    validation.path(path)
    Path(path).write_text(to_mjcf(scene, drop), encoding="utf-8")


@overload
def load_mjcf(path: str | Path, drop: Literal[False] = False) -> Scene: ...
@overload
def load_mjcf(path: str | Path, drop: Literal[True]) -> tuple[Scene, list[str]]: ...
@overload
def load_mjcf(path: str | Path, drop: bool) -> Scene | tuple[Scene, list[str]]: ...
def load_mjcf(path: str | Path, drop: bool = False) -> Scene | tuple[Scene, list[str]]:
    """Read a scene from an MJCF or URDF file.

    If MuJoCo is installed, it compiles the file. The scene gets these parts of the compiled model: free bodies of one
    box, sphere, ellipsoid or convex mesh, planes, gravity, friction of every pair, one damping of all free joints,
    and the pose and velocity of the first keyframe. Without MuJoCo only elements that `save_mjcf` writes are read.

    Parameters
    ----------
    path : str or Path
        Path of the file.
    drop : bool
        Whether to leave out elements that a scene cannot hold, instead of refusing the file. Needs MuJoCo.

    Returns
    -------
    Scene
        The scene. With `drop`: the scene, and a list of messages about the elements left out, with their lines where
        these are known.

    Raises
    ------
    ValueError
        The file has an element that a scene cannot hold. The message names it, and its line.
    OSError
        The file cannot be read.
    ModuleNotFoundError
        `drop` without MuJoCo.
    """
    validation.path(path)
    try:
        text = Path(path).read_text(encoding="utf-8")
    except IsADirectoryError as error:
        told = f"path is {str(path)!r}, which is a folder; allowed is a file in MJCF (.xml)"
        raise IsADirectoryError(error.errno, told) from None
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: byte {error.start} is no UTF-8; allowed is a text file in MJCF") from None
    scene, left = read_mjcf(text, str(path), drop, Path(path))
    return (scene, left) if drop else scene


def from_mjcf(text: str, source: str = "model") -> Scene:
    """Make a scene from an MJCF text; error messages call the text `source`."""
    return read_mjcf(text, source)[0]


def read_mjcf(text: str, source: str, drop: bool = False, path: Path | None = None) -> tuple[Scene, list[str]]:
    """Make a scene from an MJCF text; return it, and messages about the elements left out (if `drop`).

    Errors call the text `source`. Files that the text names, such as meshes, are searched beside `path`.
    """
    mujoco = find_optional("mujoco", LEAST_MUJOCO)
    if drop and mujoco is None:
        raise missing("mujoco", "load_mjcf with drop=True")
    left = LeftOut(drop)
    try:
        root = parse(text)
        if mujoco is not None:
            return compiled_reader.read_scene(mujoco, text, root, path, left), left.messages
        return plain_reader.read_scene(root), left.messages
    except ModelError as error:
        place = f", {error.place}" if error.place else ""
        raise ValueError(f"{source}{place}: {error}") from None
    except ValueError as error:
        raise ValueError(f"{source}: {error}") from None
