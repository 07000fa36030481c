"""Soft shadows of convex bodies on walls, from samples of a sun with a disc: sharp at contacts, softer at a distance.

Each sample of the sun is a light of its own. The outlines of bodies as seen from it, from `outlines`, are projected
onto a wall as convex polygons, by `fall`. `shadow_layer` draws them.
"""

from __future__ import annotations

import numpy as np

from rigid_env.rendering import palette
from rigid_env.rendering.geometry import convex_hull, perpendiculars, plane_axes, unit_vectors
from rigid_env.rendering.meshes import body_mesh, unit_mesh

SAMPLES = 16
SUN_RADIUS = 0.085
"""Tangent of half the sun's angular diameter; that of the real sun is 0.0047, but a softer shadow looks better."""

OUTLINE_POINTS = 16
LEAST_SHADOW = 1e-9  # sine of the angle between light and axis below which the shadow of a capsule is a circle
GOLDEN_ANGLE = np.pi * (3.0 - np.sqrt(5.0))


def _sun_samples():
    """Unit vectors (SAMPLES, 3) towards points spread evenly over the sun's disc (Vogel 1979)."""
    u, v = plane_axes(palette.LIGHT)
    k = np.arange(SAMPLES)
    radius, angle = SUN_RADIUS * np.sqrt((k + 0.5) / SAMPLES), k * GOLDEN_ANGLE
    samples = palette.LIGHT + (radius * np.cos(angle))[:, None] * u + (radius * np.sin(angle))[:, None] * v
    return samples / np.linalg.norm(samples, axis=1, keepdims=True)


SUN_SAMPLES = _sun_samples()

HEXAGONS = np.array([[c ^ 4, c ^ 6, c ^ 2, c ^ 3, c ^ 1, c ^ 5] for c in range(8)])
"""Corners (8, 6) of a block's outline in order, as seen from a direction above corner c; see `meshes.BLOCK_FACES`."""

_ANGLES = 2.0 * np.pi * np.arange(OUTLINE_POINTS)[:, None] / OUTLINE_POINTS
_COSINES, _SINES = np.cos(_ANGLES), np.sin(_ANGLES)


def outlines(frame):
    """Outlines of a frame's bodies as seen from each sample of the sun; bodies of one shape are grouped.

    Parameters
    ----------
    frame : Frame

    Returns
    -------
    list of (members, points)
        Indices of n bodies, and points (n, SAMPLES or 1, k, 3) float64 [m], world frame: a closed loop of k points for
        each sample, or one loop for all samples.
    """
    members = {"block": [], "round": [], "capsule": [], "hull": []}
    for index, body in enumerate(frame.bodies):
        kind = "hull" if body.kind == "cylinder" else body.kind
        members[kind if kind in members else "round"].append(index)
    found = []
    closed_forms = ("block", _block_outlines), ("round", _round_outlines), ("capsule", _capsule_outlines)
    for kind, outlined in closed_forms:
        if members[kind]:
            poses = frame.poses
            found.append(
                (members[kind], outlined(*(a[members[kind]] for a in (poses.pos, poses.rotation, poses.size))))
            )
    return found + [([i], _hull_outlines(frame.bodies[i], frame.poses.rotation[i])) for i in members["hull"]]


def _block_outlines(pos, R, size):
    """Outlines of blocks: all corners except the one nearest to the light and the opposite one."""
    corners = pos[:, None] + (unit_mesh("block").vertices * size[:, None]) @ np.swapaxes(R, 1, 2)
    top = (SUN_SAMPLES @ R > 0.0) @ (4, 2, 1)
    return corners[np.arange(len(pos))[:, None, None], HEXAGONS[top]]


def _round_outlines(pos, R, size):
    """Outlines of spheres and ellipsoids: one loop for all samples of the sun.

    A point of the surface is x = R A u with |u| = 1. Light is tangent to the surface where its normal R A⁻¹ u is
    perpendicular to the light: on the great circle of u perpendicular to A⁻¹ Rᵀ light.
    """
    u, v = perpendiculars((palette.LIGHT @ R) / size)
    circles = _COSINES * u[:, None] + _SINES * v[:, None]
    return (pos[:, None] + (circles * size[:, None]) @ np.swapaxes(R, 1, 2))[:, None]


def _capsule_outlines(pos, R, size):
    """Outlines of capsules: half a circle about each end of the axis, one loop for all samples of the sun.

    The circles are perpendicular to the light. They are parted across the shadow of the axis.
    """
    axis = R[:, :, 1]
    across = axis - (axis @ palette.LIGHT)[:, None] * palette.LIGHT
    is_upright = np.linalg.norm(across, axis=1) < LEAST_SHADOW
    across[is_upright] = plane_axes(palette.LIGHT)[0]
    u = unit_vectors(across)
    circles = _COSINES * u[:, None] + _SINES * np.cross(palette.LIGHT, u)[:, None]
    ends = np.sign(_COSINES) * ((size[:, 1] - size[:, 0])[:, None] * axis)[:, None]
    return (pos[:, None] + size[:, :1, None] * circles + ends)[:, None]


def _hull_outlines(body, R):
    """Outlines of one hull or cylinder: for each sample of the sun the convex hull of its mesh, along the light."""
    corners = body.pos + body_mesh(body).vertices @ R.T
    loops = []
    for light in SUN_SAMPLES:
        u, v = plane_axes(light)
        hull = convex_hull(np.stack([corners @ u, corners @ v], axis=1))
        loops.append((body.pos @ light) * light + hull[:, :1] * u + hull[:, 1:] * v)
    most = max(map(len, loops))
    return np.array([[*loop, *loop[-1:].repeat(most - len(loop), axis=0)] for loop in loops])[None]


def fall(points, wall, lights):
    """Project points onto a wall along the directions of lights: the shadows of the points.

    Parameters
    ----------
    points : (n, 3) or (..., s, n, 3) float
        World frame [m]; the same points for all lights, or n points for each.
    wall : WallView
    lights : (s, 3) float
        Unit vectors towards the light, with normal·light > 0.

    Returns
    -------
    (..., s, n, 3) float64
        Points on the wall, world frame [m].
    """
    heights = points @ wall.normal - wall.offset
    return points - heights[..., None] * (lights / (lights @ wall.normal)[:, None])[:, None, :]
