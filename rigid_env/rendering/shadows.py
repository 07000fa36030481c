"""Soft shadows of convex bodies on walls: sharp at contacts, soft above, from samples of a sun with a disc.

Every sample of the sun is a light of its own: the `outlines` of the bodies along it `fall` onto a wall as convex
polygons. `shadow_layer` draws them.
"""

from __future__ import annotations

import numpy as np

from rigid_env.rendering import palette
from rigid_env.rendering.geometry import convex_hull, perpendiculars, plane_axes
from rigid_env.rendering.meshes import body_mesh, unit_mesh

SAMPLES = 16
SUN_RADIUS = 0.085
"""Tangent of half the sun's angular diameter; the real one's is 0.0047, but a softer shadow looks better."""

OUTLINE_POINTS = 16
GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))


def _sun_samples():
    """(SAMPLES, 3) unit vectors towards points spread evenly over the sun's disc (Vogel 1979)."""
    u, v = plane_axes(palette.LIGHT)
    k = np.arange(SAMPLES)
    radius, angle = SUN_RADIUS * np.sqrt((k + 0.5) / SAMPLES), k * GOLDEN_ANGLE
    samples = palette.LIGHT + (radius * np.cos(angle))[:, None] * u + (radius * np.sin(angle))[:, None] * v
    return samples / np.linalg.norm(samples, axis=1, keepdims=True)


SUN_SAMPLES = _sun_samples()

HEXAGONS = np.array([[c ^ 4, c ^ 6, c ^ 2, c ^ 3, c ^ 1, c ^ 5] for c in range(8)])
"""(8, 6). Corners of a block round its outline, in order, as seen from above corner c; see `meshes.BLOCK_FACES`."""

_ANGLES = 2.0 * np.pi * np.arange(OUTLINE_POINTS)[:, None] / OUTLINE_POINTS
_COSINES, _SINES = np.cos(_ANGLES), np.sin(_ANGLES)


def outlines(frame):
    """Outlines of a frame's bodies along the lights of the sun, bodies of one shape together.

    Parameters
    ----------
    frame : Frame

    Returns
    -------
    list of (members, points)
        Indices of n bodies, and points (n, SAMPLES or 1, k, 3) float64 [m], world frame: a loop for each light, or one
        for all.
    """
    members = {"block": [], "round": [], "hull": []}
    for index, body in enumerate(frame.bodies):
        members[body.kind if body.kind in members else "round"].append(index)
    found = []
    for kind, outlined in (("block", _block_outlines), ("round", _round_outlines)):
        if members[kind]:
            poses = frame.poses
            found.append(
                (members[kind], outlined(*(a[members[kind]] for a in (poses.pos, poses.rotation, poses.size))))
            )
    return found + [([i], _hull_outlines(frame.bodies[i], frame.poses.rotation[i])) for i in members["hull"]]


def _block_outlines(pos, R, size):
    """A block's corners except the one nearest to the light and its opposite."""
    corners = pos[:, None] + (unit_mesh("block").vertices * size[:, None]) @ np.swapaxes(R, 1, 2)
    top = (SUN_SAMPLES @ R > 0.0) @ (4, 2, 1)
    return corners[np.arange(len(pos))[:, None, None], HEXAGONS[top]]


def _round_outlines(pos, R, size):
    """Outline of a round body: one loop for all lights.

    On an ellipsoid x = R A u, |u| = 1, light grazes where its normal R A⁻¹ u is perpendicular to the light: the great
    circle of u perpendicular to A⁻¹ Rᵀ light.
    """
    u, v = perpendiculars((palette.LIGHT @ R) / size)
    circles = _COSINES * u[:, None] + _SINES * v[:, None]
    return (pos[:, None] + (circles * size[:, None]) @ np.swapaxes(R, 1, 2))[:, None]


def _hull_outlines(body, R):
    """Outlines of hulls: hulls of their corners in the planes perpendicular to the lights."""
    corners = body.pos + body_mesh(body).vertices @ R.T
    loops = []
    for light in SUN_SAMPLES:
        u, v = plane_axes(light)
        hull = convex_hull(np.stack([corners @ u, corners @ v], axis=1))
        loops.append((body.pos @ light) * light + hull[:, :1] * u + hull[:, 1:] * v)
    most = max(map(len, loops))
    return np.array([[*loop, *loop[-1:].repeat(most - len(loop), axis=0)] for loop in loops])[None]


def fall(points, wall, lights):
    """Points where light through other points meets a wall.

    Parameters
    ----------
    points : (n, 3) or (..., s, n, 3) float
        [m], world frame. The same for all lights, or of each its own.
    wall : WallView
    lights : (s, 3) float
        Unit vectors towards the light, with normal·light > 0.

    Returns
    -------
    (..., s, n, 3) float64
        [m], world frame, on the wall.
    """
    heights = points @ wall.normal - wall.offset
    return points - heights[..., None] * (lights / (lights @ wall.normal)[:, None])[:, None, :]
