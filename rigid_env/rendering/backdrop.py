"""Backdrop of a picture: background, floor and walls, shaded pixel by pixel; callers keep it for later pictures."""

from __future__ import annotations

import numpy as np

from rigid_env.rendering import palette
from rigid_env.rendering.geometry import plane_axes
from rigid_env.rendering.layout import faces_point, is_floor

MINOR, MAJOR = 1.0, 5.0
"""[m] Distance between the thin lines of the grid, and between its strong lines."""

MINOR_STRENGTH, MAJOR_STRENGTH = 0.20, 0.52
WALL_GRID = 1.7
"""Strength of the grid's lines on walls relative to floors; a floor is lighter, so its lines are easier to see."""

LINE_WIDTH = 0.022
"""[m] Width of a grid line. A line that would be thinner than a pixel is drawn a pixel wide, but fainter."""

WALL_OPACITY = 0.62
CORNER_SHADE, CORNER_REACH = 0.16, 1.1
"""Share of the light lost where walls meet, and the distance [m] over which the loss decays to 1/e."""


def draw_backdrop(camera, size, room):
    """Draw the background, and all walls whose front side faces the camera.

    The ray of each pixel meets a wall at the depth (offset - n·eye) / (n·ray). Among these points, only the one where
    the ray leaves the free space is inside all other walls. So at most one wall is drawn at a pixel.

    Parameters
    ----------
    camera : Camera
    size : (width, height)
        [px].
    room : Room
        Part of space that is shown, with its walls.

    Returns
    -------
    (height, width, 3) uint8
        Picture in sRGB.
    """
    width, height = size
    top, bottom = (np.array(c, dtype=np.float32) for c in (palette.BACKGROUND_TOP, palette.BACKGROUND_BOTTOM))
    down = np.linspace(0.0, 1.0, height, dtype=np.float32)[:, None, None]
    picture = np.broadcast_to(top + down * (bottom - top), (height, width, 3)).copy()
    rays = camera.rays(size)
    for index, wall in enumerate(room.walls):
        if faces_point(wall, camera.eye):
            _draw_wall(picture, rays, camera, room, index)
    return np.clip(np.rint(picture), 0, 255).astype(np.uint8)


def _draw_wall(picture, rays, camera, room, index):
    wall = room.walls[index]
    approach = rays @ wall.normal.astype(np.float32)
    distance = wall.offset - wall.normal @ np.array(camera.eye)
    depth = distance / np.where(approach < -1e-6, approach, np.nan)
    points = np.array(camera.eye, dtype=np.float32) + depth[..., None].astype(np.float32) * rays
    if is_floor(wall):
        colour, cover = palette.FLOOR, _fade(points, room)
    else:
        colour, cover = palette.WALL, WALL_OPACITY * _inside_bounds(points, room)
    shade = np.ones_like(depth)
    for other, view in enumerate(room.walls):
        if other != index:
            gap = points @ view.normal.astype(np.float32) - np.float32(view.offset)
            cover = cover * _step(gap)
            shade = shade - CORNER_SHADE * np.exp(-np.maximum(gap, 0.0) / CORNER_REACH)
    cover = np.nan_to_num(cover)
    lines = np.nan_to_num(_grid(points, wall.normal)) * (1.0 if is_floor(wall) else WALL_GRID)
    paint = np.array(colour, dtype=np.float32) * np.nan_to_num(shade, nan=1.0)[..., None]
    paint += lines[..., None] * (np.array(palette.GRID, dtype=np.float32) - paint)
    picture += cover[..., None] * (paint - picture)


def _fade(points, room):
    """Opacity of an open floor at points (..., 3): 1 inside the room, decreasing to 0 at the distance `room.fade`."""
    outside = np.maximum(room.lower - points, 0.0) + np.maximum(points - room.upper, 0.0)
    outside[..., 1] = 0.0
    far = np.clip(np.linalg.norm(outside, axis=-1) / room.fade, 0.0, 1.0)
    return (1.0 - far * far) ** 2


def _inside_bounds(points, room):
    cover = np.ones(points.shape[:2], dtype=np.float32)
    tolerance = 1e-4 * np.linalg.norm(room.upper - room.lower)
    for axis in range(3):
        coordinate = points[..., axis]
        cover *= _step(coordinate - room.lower[axis] + tolerance)
        cover *= _step(room.upper[axis] + tolerance - coordinate)
    return cover


def _pixel_footprint(values):
    """Change of a field (height, width) from one pixel to the next."""
    down, right = np.gradient(values)
    return np.abs(down) + np.abs(right) + 1e-9


def _step(gap):
    """Share of each pixel in which gap ≥ 0, to first order: an anti-aliased step function of `gap` (height, width)."""
    return np.clip(0.5 + gap / _pixel_footprint(gap), 0.0, 1.0)


def _grid(points, normal):
    """Strength of the grid's lines at points of a plane, anti-aliased.

    A line covers the share width / footprint of a pixel.
    """
    strength = 0.0
    for axis in plane_axes(normal):
        coordinate = points @ axis.astype(np.float32)
        footprint = _pixel_footprint(coordinate)
        drawn = np.maximum(LINE_WIDTH, footprint)
        for spacing, peak in ((MINOR, MINOR_STRENGTH), (MAJOR, MAJOR_STRENGTH)):
            off = np.abs(coordinate - spacing * np.rint(coordinate / spacing))
            cover = np.clip((0.5 * (drawn + footprint) - off) / footprint, 0.0, 1.0)
            crowded = np.clip(2.0 - 4.0 * footprint / spacing, 0.0, 1.0)
            strength = np.maximum(strength, peak * cover * crowded * np.minimum(1.0, 2.0 * LINE_WIDTH / drawn))
    return strength
