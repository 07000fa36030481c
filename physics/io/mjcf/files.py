"""Read and write MJCF files: with MuJoCo where it is installed, else by a reader of the files written here."""

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
    """Write a scene for MuJoCo.

    Bodies with mass, inertia, pose and velocity (hulls as meshes), planes, gravity, friction and springs (which
    `load_mjcf` does not read). The contacts are MuJoCo's soft ones with its defaults, its time step too.

    Parameters
    ----------
    scene : Scene
    path : str or Path
    drop : bool
        Leave out what MJCF cannot express instead of refusing; a comment in the file names it.

    Raises
    ------
    ValueError
        Naming the effects that MJCF cannot express, unless `drop`.
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
    """Read a scene from MJCF or URDF.

    MuJoCo compiles the file where it is installed, and the compiled model is read: free bodies of one box, sphere,
    ellipsoid or convex mesh, planes, gravity, one coefficient of friction, one damping of all free joints, and the
    pose and velocity of the first keyframe. Without MuJoCo the part of MJCF is read that `save_mjcf` writes.

    Parameters
    ----------
    path : str or Path
    drop : bool
        Leave out what a scene cannot hold instead of refusing, and return a list of it, too. Needs MuJoCo.

    Returns
    -------
    Scene
        Or, with `drop`, the scene and the list of what was left out, each with its line where that is known.

    Raises
    ------
    ValueError
        Naming the element that a scene here cannot hold, and its line.
    OSError
        The file cannot be read.
    ModuleNotFoundError
        `drop` without MuJoCo.
    """
    validation.path(path)
    try:
        text = Path(path).read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: byte {error.start} is no UTF-8; allowed is a text file in MJCF") from None
    scene, left = read_mjcf(text, str(path), drop, Path(path))
    return (scene, left) if drop else scene


def from_mjcf(text: str, source: str = "model") -> Scene:
    """Make the scene of an MJCF text; messages name the text `source`."""
    return read_mjcf(text, source)[0]


def read_mjcf(text: str, source: str, drop: bool = False, path: Path | None = None) -> tuple[Scene, list[str]]:
    """Scene of a text, and the list of elements left out; files that the model names are searched beside `path`."""
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
