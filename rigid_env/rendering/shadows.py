"""Soft shadows of convex bodies on walls: a sun with a disc, sampled; sharp where they touch, soft above."""

from __future__ import annotations

import numpy as np

from rigid_env.rendering import palette
from rigid_env.rendering.geometry import clip_polygon, convex_hull, plane_axes, rotation_matrix
from rigid_env.rendering.layout import faces_point
from rigid_env.rendering.meshes import body_mesh

SAMPLES = 22
SUN_RADIUS = 0.085
"""Tangent of half the sun's angular diameter; the real one's is 0.0047, but a softer shadow looks better."""

SAMPLE_ALPHA = 5
"""0..255. One sample's; all of them darken by 1 - (1 - 5/255)^22 = 35 percent."""

OUTLINE_POINTS = 32
GRAZING = 0.05
"""Least sine of the angle between light and wall for which a shadow is drawn."""

GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))


def _sun_samples():
    """(SAMPLES, 3) unit vectors towards points spread evenly over the sun's disc (Vogel 1979)."""
    u, v = plane_axes(palette.LIGHT)
    k = np.arange(SAMPLES)
    radius, angle = SUN_RADIUS * np.sqrt((k + 0.5) / SAMPLES), k * GOLDEN_ANGLE
    samples = palette.LIGHT + (radius * np.cos(angle))[:, None] * u + (radius * np.sin(angle))[:, None] * v
    return samples / np.linalg.norm(samples, axis=1, keepdims=True)


SUN_SAMPLES = _sun_samples()


def outline(body):
    """Points whose hull along the light is the body's shadow.

    Parameters
    ----------
    body : BodyView

    Returns
    -------
    (n, 3) float64
        [m], world frame. A block's or hull's corners. On an ellipsoid x = R A u, |u| = 1, light grazes where its normal
        R A⁻¹ u is perpendicular to the light: the great circle of u perpendicular to A⁻¹ Rᵀ light.
    """
    R = rotation_matrix(body.quat)
    if body.kind in ("block", "hull"):
        return body.pos + body_mesh(body).vertices @ R.T
    pole = (R.T @ palette.LIGHT) / body.dimensions
    u, v = plane_axes(pole / np.linalg.norm(pole))
    angle = 2.0 * np.pi * np.arange(OUTLINE_POINTS) / OUTLINE_POINTS
    circle = np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * v
    return body.pos + (circle * body.dimensions) @ R.T


def fall(points, wall, lights):
    """Points where light through other points meets a wall.

    Parameters
    ----------
    points : (n, 3) float
        [m], world frame.
    wall : WallView
    lights : (s, 3) float
        Unit vectors towards the light, with normal·light > 0.

    Returns
    -------
    (s, n, 3) float64
        [m], world frame, on the wall.
    """
    heights = points @ wall.normal - wall.offset
    return points - heights[:, None] * (lights / (lights @ wall.normal)[:, None])[:, None, :]


def draw_shadows(canvas, room, bodies):
    """Darken the walls under the bodies, on a `Canvas`.

    Parameters
    ----------
    canvas : Canvas
    room : Room
    bodies : tuple of BodyView
    """
    outlines = [outline(body) for body in bodies]
    for wall, shown in zip(room.walls, room.wall_polygons):
        is_lit = np.min(SUN_SAMPLES @ wall.normal) > GRAZING
        if len(shown) < 3 or not is_lit or not faces_point(wall, canvas.camera.eye):
            continue
        sides, offsets = _side_planes(shown, wall.normal)
        for points in outlines:
            fallen = fall(points, wall, SUN_SAMPLES)
            gaps = fallen @ sides.T - offsets
            if np.any(np.all(gaps < 0.0, axis=(0, 1))):
                continue
            is_crossed = np.any(gaps < 0.0, axis=(0, 1))
            if not np.any(is_crossed):
                _fill_whole(canvas, fallen, wall.normal)
            else:
                _fill_clipped(canvas, fallen, wall.normal, zip(sides[is_crossed], offsets[is_crossed]))


def _fill_whole(canvas, fallen, normal):
    """Hulls of the projected points: a convex polygon in front of the camera stays convex in the picture."""
    pixels, depths = canvas.project(fallen.reshape(-1, 3))
    if not canvas.is_in_sight(pixels, depths):
        _fill_clipped(canvas, fallen, normal, ())
        return
    for sample in pixels.reshape(*fallen.shape[:2], 2):
        canvas.fill(convex_hull(sample), palette.SHADOW, SAMPLE_ALPHA)


def _fill_clipped(canvas, fallen, normal, bounds):
    bounds = tuple(bounds)
    u, v = plane_axes(normal)
    for sample in fallen:
        hull = convex_hull(np.stack([sample @ u, sample @ v], axis=1))
        polygon = (sample[0] @ normal) * normal + hull[:, :1] * u + hull[:, 1:] * v
        for side, offset in bounds:
            polygon = clip_polygon(polygon, side, offset)
            if len(polygon) < 3:
                break
        else:
            canvas.polygon(polygon, palette.SHADOW, SAMPLE_ALPHA)


def _side_planes(polygon, normal):
    """Half-spaces normals (k, 3), offsets (k,) that cut a convex polygon (k, 3) out of its plane."""
    sides = np.cross(normal, np.roll(polygon, -1, axis=0) - polygon)
    offsets = np.sum(sides * polygon, axis=1)
    signs = np.sign(sides @ polygon.mean(axis=0) - offsets)
    return signs[:, None] * sides, signs * offsets
