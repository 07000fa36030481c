"""Pictures of any `physics.World`: frames for the renderer, a stroboscopic picture, PNG and GIF files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from physics import HalfSpace, World, validation
from physics.kernels.state import layout as at
from rigid_env.extras import require
from rigid_env.rendering import BodyView, Camera, Frame, GoalView, WallView
from rigid_env.rendering.compounds import part_views
from rigid_env.rendering.geometry import rotation_matrix
from rigid_env.rendering.sensors import sensor_views

WEIGHT_ARROW = 2.5  # length of the arrow of a force as large as the weight of body 0 [m]
FULL_CHANGE = 40.0  # smallest change of a pixel that shows a body instead of the rim of a shadow [of 255]
FAINTEST = 0.25  # lower limit of the opacities in a stroboscopic picture; the last position has 1
GIF_COLOURS = 128
FAR_BEHIND = 1000.0  # distance of hidden bodies behind the camera, in distances from camera to target
UNIT_WEIGHT = 9.81  # gravity in the unit of forces where no gravity acts [m/s²]


def world_frame(
    world: World,
    index: int = 0,
    text: Sequence[str] = (),
    goal: GoalView | None = None,
    applied: np.ndarray | None = None,
    arrows: bool = True,
) -> Frame:
    """Make a frame of the present state of one world.

    Parameters
    ----------
    world : World
    index : int
        Index of the world in its batch.
    text : sequence of str
        Lines of text in the upper left corner.
    goal : GoalView, optional
    applied : (6,) or (bodies, 6) float, optional
        Force [N] and torque [N m] on body 0, or on each body, world frame; drawn at the geometric centre.
    arrows : bool
        False leaves out contacts and applied wrenches, and saves the time to compute contacts.

    Returns
    -------
    Frame
        Bodies, walls (if the scene has contact), sensors, contact points and forces.

    Raises
    ------
    ValueError
        If there is no world with this index.
    """
    index = validation.index(index, world.worlds, "index")
    bodies = tuple(_body_view(world, index, body) for body in range(world.body_count))
    walls = _wall_views(world.scene.walls) if world.plan.contact else ()
    sensors = sensor_views(world, index)
    if not arrows:
        return Frame(bodies, walls, goal, text=tuple(text), sensors=sensors)
    wrench = np.zeros((0, 6)) if applied is None else np.asarray(applied, dtype=float).reshape(-1, 6)
    points, forces = world.contacts(index)
    first = index * world.body_count + next(b for b, body in enumerate(world.scene.bodies) if not body.fixed)
    strength = float(np.linalg.norm(world.gravity[index])) or UNIT_WEIGHT
    return Frame(
        bodies=bodies,
        walls=walls,
        goal=goal,
        contact_points=points,
        contact_forces=forces,
        applied_force=wrench[:, :3],
        applied_torque=wrench[:, 3:],
        text=tuple(text),
        sensors=sensors,
        force_scale=WEIGHT_ARROW * float(world.params[first, at.INV_MASS]) / strength,
    )


@lru_cache(maxsize=16)
def _wall_views(walls: tuple[HalfSpace, ...]) -> tuple[WallView, ...]:
    return tuple(WallView(wall.normal, wall.offset) for wall in walls)


def _body_view(world: World, index: int, body: int) -> BodyView:
    kind = world.scene.bodies[body].kind
    params, quat = world.params[index * world.body_count + body], world.quat[index, body]
    stored, center = params[at.DIMENSIONS : at.DIMENSIONS + 3], params[at.CENTER : at.CENTER + 3]
    dimensions = 2.0 * stored if kind == "block" else stored
    solid = world.scene.bodies[body].polyhedron if kind == "hull" else None
    outline = {} if solid is None else {"corners": solid.vertices, "faces": solid.loops}
    pos = world.pos[index, body] + rotation_matrix(quat) @ center if center.any() else world.pos[index, body]
    return BodyView(kind, dimensions, pos, quat, **outline, parts=part_views(world.scene.bodies[body]))


def without_bodies(frame: Frame, camera: Camera) -> Frame:
    """Frame whose bodies are all behind the camera and which has no contacts: it shows only the unmoving parts."""
    eye, target = np.array(camera.eye), np.array(camera.target)
    behind = eye + FAR_BEHIND * (eye - target)
    bodies = tuple(replace(body, pos=behind) for body in frame.bodies)
    return replace(frame, bodies=bodies, contact_points=(), contact_forces=(), text=())


def stroboscope(pictures: Sequence[np.ndarray], empty: np.ndarray) -> np.ndarray:
    """Join pictures of a motion to one: earlier positions are fainter, the last one is opaque and on top.

    Parameters
    ----------
    pictures : sequence of (height, width, 3) uint8
        Pictures in order of time, at least one.
    empty : (height, width, 3) uint8
        Picture of the same scene without the moving bodies.

    Returns
    -------
    (height, width, 3) uint8
    """
    blend = empty.astype(np.float64)
    for picture, opacity in zip(pictures, np.linspace(FAINTEST, 1.0, len(pictures) + 1)[1:]):
        change = np.abs(picture.astype(np.float64) - empty).max(axis=2, keepdims=True)
        blend += opacity * np.minimum(change / FULL_CHANGE, 1.0) * (picture - blend)
    return np.rint(blend).astype(np.uint8)


def write_png(path: Path, picture: np.ndarray) -> None:
    """Write a picture (height, width, 3) uint8 as a PNG file."""
    _image_class().fromarray(picture).save(path)


def write_gif(path: Path, pictures: Sequence[np.ndarray], fps: float, colours: int = GIF_COLOURS) -> None:
    """Write pictures (height, width, 3) uint8 as an animated GIF that repeats forever.

    Parameters
    ----------
    path : Path
    pictures : sequence
    fps : float
        Pictures per second [1/s]. A GIF counts in hundredths of a second, so 25, 50 and 100 are played exactly.
    colours : int
        Number of colours of all pictures together.
    """
    images = [_image_class().fromarray(picture) for picture in pictures]
    typical = np.concatenate([pictures[k * (len(pictures) - 1) // 3] for k in range(4)])
    # an octree keeps the colours of small bodies and arrows, which a median cut gives to the floor
    palette = _image_class().fromarray(typical).quantize(colours, method=_image_class().Quantize.FASTOCTREE)
    images = [image.quantize(colours, palette=palette, dither=0) for image in images]
    images[0].save(path, save_all=True, append_images=images[1:], duration=round(1000 / fps), loop=0)


def _image_class():
    require("render", "PIL", purpose="writing pictures")
    from PIL import Image

    return Image
