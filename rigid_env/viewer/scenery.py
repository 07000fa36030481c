"""Scenery of the viewer: placement of a scene before viser's camera, light, background, floor and walls."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, hypot, log10

import numpy as np

from rigid_env.rendering import palette
from rigid_env.rendering.camera import Camera
from rigid_env.rendering.layout import FADE_LENGTH, Room, default_camera, is_floor, make_room
from rigid_env.viewer.interface import Look

SIGHT = 12.0
"""Distance of the camera from its target at first [drawn units]; viser's shadows reach 20 units in any scene."""

WINDOW = (1000, 640)
"""[px] Window in which the whole room is visible at first."""

SUN, SKY = 1.9, 1.1
"""Strengths of the directional lamp and of the light from all sides."""

SKY_COLOUR, GROUND_COLOUR = (255, 255, 255), (196, 204, 218)

WALL_OPACITY, OUTLINE_WIDTH = 0.5, 0.012
"""Opacity of a wall, and width of its outline [drawn units]."""

CELLS = 5
"""Cells of the floor's grid from one strong line to the next."""

FLOOR_SHADOW = 0.3
FADE_STRENGTH = 0.6

SHADE, SHADE_DISTANCE, SHADE_REACH = 0.02, 40.0, 9.0
"""Strength and distance of the lamp that casts shadows, and the radius that it lights [drawn units]."""

SATURATION = 1.6
"""Exponent that weakens the smaller channels of a colour, because viser's tone mapping makes all colours paler."""


@dataclass(frozen=True, eq=False)
class Placement:
    """Transformation from a scene's coordinates to the coordinates that viser draws.

    Parameters
    ----------
    room : Room
        Part of space that is shown.
    camera : Camera
        First camera.
    origin : (3,) float
        Point that is drawn at the origin, world frame [m].
    scale : float
        Drawn units per metre.
    """

    room: Room
    camera: Camera
    origin: np.ndarray
    scale: float

    @property
    def unit(self) -> float:
        """Extent of the largest body [m], by which arrows and lines are scaled."""
        return self.room.fade / FADE_LENGTH

    def drawn(self, points):
        """Convert points (..., 3) of the world [m] to drawn points, float32."""
        return ((np.asarray(points) - self.origin) * self.scale).astype(np.float32)

    def world(self, points) -> np.ndarray:
        """Convert drawn points (..., 3) to points of the world [m]."""
        return np.asarray(points, dtype=float) / self.scale + self.origin


def place(look: Look, bounds=None) -> Placement:
    """Choose a placement with the whole room of a scene in view, as the software renderer does.

    Parameters
    ----------
    look : Look
        State of the scene at any time; its bodies are in view.
    bounds : pair of (3,) float, optional
        Lower and upper corner of a box that is in view, too [m].

    Returns
    -------
    Placement
    """
    frame = look.frame
    pos = frame.poses.pos
    if len(pos):
        reach = np.asarray(look.radius)[:, None]
        lower, upper = (pos - reach).min(axis=0), (pos + reach).max(axis=0)
        if bounds is not None:
            lower, upper = np.minimum(lower, bounds[0]), np.maximum(upper, bounds[1])
        bounds = lower, upper
    room = make_room(frame.walls, frame.bodies, bounds)
    camera = default_camera(room, WINDOW)
    origin = 0.5 * (room.lower + room.upper)
    if frame.walls:
        origin[1] = room.lower[1]
    sight = hypot(*(np.array(camera.eye) - camera.target))
    return Placement(room, camera, origin, SIGHT / sight)


def vivid(colours) -> np.ndarray:
    """Make sRGB colours (..., 3), 0 to 255, more saturated; greys stay the same. Returns uint8."""
    colours = np.asarray(colours, dtype=float)
    strongest = np.maximum(colours.max(axis=-1, keepdims=True), 1.0)
    return np.rint(strongest * (colours / strongest) ** SATURATION).astype(np.uint8)


def light(scene) -> None:
    """Light viser's scene as `rendering.palette` does: from the sun and the sky, with shadows on floors.

    A weak spotlight casts the shadows. Shadows of a directional light would take three maps of the scene, each as large
    as the spotlight's, and without a GPU a picture would take ten times as long.
    """
    scene.configure_default_lights(enabled=False)
    scene.configure_environment_map(None)
    sun, towards = tuple((SHADE_DISTANCE * palette.LIGHT).tolist()), tuple((-palette.LIGHT).tolist())
    scene.add_light_directional("/light/sun", intensity=SUN, position=sun)
    scene.add_light_spot(
        "/light/shade", intensity=SHADE, cast_shadow=True, decay=0.0, angle=atan2(SHADE_REACH, SHADE_DISTANCE),
        position=sun, direction=towards,
    )  # fmt: skip
    scene.add_light_hemisphere(
        "/light/sky", sky_color=SKY_COLOUR, ground_color=GROUND_COLOUR, intensity=SKY, position=(0.0, 1.0, 0.0)
    )


def paint_background(scene) -> None:
    """Paint the background with the colours of `rendering.palette`, lighter at the top."""
    down = np.linspace(0.0, 1.0, 64)[:, None, None]
    top, bottom = np.array(palette.BACKGROUND_TOP), np.array(palette.BACKGROUND_BOTTOM)
    scene.set_background_image(np.rint(top + down * (bottom - top)).astype(np.uint8), format="png")


def add_walls(scene, root: str, placement: Placement) -> list:
    """Add the walls of a placement's room to viser's scene.

    A floor is a grid that fades out and shows shadows. Other walls are translucent from inside and only an outline from
    outside, so that no wall hides the bodies.

    Returns
    -------
    list of viser scene nodes
    """
    nodes = []
    for index, wall in enumerate(placement.room.walls):
        corners = placement.drawn(placement.room.wall_polygons[index])
        if len(corners) < 3:
            continue
        name = f"{root}/{index}"
        if is_floor(wall) and _is_rectangle(corners, wall.normal):
            nodes.append(_add_floor(scene, name, corners, wall.normal, placement))
        else:
            nodes += _add_pane(scene, name, corners, is_floor(wall))
    return nodes


def _add_floor(scene, name, corners, normal, placement: Placement):
    axes = np.stack(_axes(normal), axis=1)
    flat = corners @ axes
    middle = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    width, _, height = flat.max(axis=0) - flat.min(axis=0)
    cell = 10.0 ** round(log10(placement.unit / 3.0)) * placement.scale
    reach = float(np.linalg.norm(corners, axis=1).max())
    return scene.add_grid(
        name, float(width), float(height), plane="xz", cell_size=cell, section_size=CELLS * cell,
        cell_color=palette.mix(palette.GRID, palette.FLOOR, 0.6), section_color=palette.GRID,
        plane_color=palette.FLOOR, plane_opacity=1.0, shadow_opacity=FLOOR_SHADOW, fade_from="origin",
        fade_distance=1.02 * reach, fade_strength=FADE_STRENGTH, wxyz=_turn_to(axes), position=middle,
    )  # fmt: skip


def turn_to_normal(normal) -> np.ndarray:
    """Unit quaternion (4,), w first, of a rotation that turns y to a normal (3,), with x near the world's x axis."""
    return _turn_to(np.stack(_axes(np.asarray(normal)), axis=1))


def _add_pane(scene, name, corners, is_floor: bool) -> list:
    fan = np.array([(0, k, k + 1) for k in range(1, len(corners) - 1)], dtype=np.uint32)
    pane = scene.add_mesh_simple(
        name, corners, fan, color=palette.FLOOR if is_floor else palette.WALL, flat_shading=True, cast_shadow=False,
        opacity=None if is_floor else WALL_OPACITY, side="double" if is_floor else "front",
        receive_shadow=FLOOR_SHADOW if is_floor else False,
    )  # fmt: skip
    sides = np.stack([corners, np.roll(corners, -1, axis=0)], axis=1)
    return [
        pane, scene.add_line_segments(f"{name}/outline", sides, palette.WALL_OUTLINE, thickness=OUTLINE_WIDTH)
    ]  # fmt: skip


def _axes(normal):
    """Axes x, y and z of a floor's grid: y is the normal, and x is near the world's x axis."""
    x = np.array((1.0, 0.0, 0.0)) - normal[0] * normal
    x /= np.linalg.norm(x)
    return x, normal, np.cross(x, normal)


def _is_rectangle(corners, normal) -> bool:
    x, _, z = np.stack(_axes(normal), axis=0) @ corners.T.astype(float)
    box = (x.max() - x.min()) * (z.max() - z.min())
    area = 0.5 * abs(np.sum(x * np.roll(z, -1) - z * np.roll(x, -1)))
    return area > (1.0 - 1e-3) * box


def _turn_to(axes) -> np.ndarray:
    """Unit quaternion (4,), w first, of the rotation matrix `axes` (3, 3).

    It is the eigenvector of the largest eigenvalue of a symmetric matrix (Bar-Itzhack 2000).
    """
    K = np.array([
        [axes[0, 0] - axes[1, 1] - axes[2, 2], 0, 0, 0],
        [axes[0, 1] + axes[1, 0], axes[1, 1] - axes[0, 0] - axes[2, 2], 0, 0],
        [axes[0, 2] + axes[2, 0], axes[1, 2] + axes[2, 1], axes[2, 2] - axes[0, 0] - axes[1, 1], 0],
        [axes[2, 1] - axes[1, 2], axes[0, 2] - axes[2, 0], axes[1, 0] - axes[0, 1], np.trace(axes)],
    ])  # fmt: skip
    x, y, z, w = np.linalg.eigh(K)[1][:, -1]
    return np.array((w, x, y, z))
