"""Meshes of all bodies in the camera's view: posed, lit and projected, bodies of one shape at once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rigid_env.rendering import palette
from rigid_env.rendering.camera import NEAR
from rigid_env.rendering.geometry import perpendiculars, unit_vectors
from rigid_env.rendering.meshes import Mesh, body_mesh, unit_mesh

OCTANT_LIGHTENING = 0.42
"""Share of white in every second octant of a round body, which makes its rotation visible."""

FACET, FEW = 8.0, 16
"""Longest edge of a round body's facets [px of the picture], and the number of round bodies up to which it is used.
With
more of them the length grows, so that the total number of facets stays the same."""

SUBDIVISIONS = (4, 6, 8, 10, 12)
"""Allowed subdivisions of a round body's mesh (`meshes.SPHERE_SUBDIVISIONS`); small bodies in the picture get fewer."""

RIM_POINTS = 32
"""Number of points in the outline of a round body."""

OWN_MESH = ("hull", "capsule", "cylinder")
"""Kinds of bodies whose meshes have their size; all others share meshes of unit size."""

_ANGLES = 2.0 * np.pi * np.arange(RIM_POINTS)[:, None] / RIM_POINTS
_COSINES, _SINES = np.cos(_ANGLES), np.sin(_ANGLES)


@dataclass(frozen=True, eq=False)
class Solid:
    """One body in the camera's view.

    Parameters
    ----------
    mesh : Mesh
        Mesh of the unit shape, for its faces and edges.
    vertices : (v, 3) float64
        Vertices of the body, world frame [m].
    pixels : (v, 2) float64
        Vertices on the canvas [px].
    is_visible : (f,) bool
        Faces that face the camera.
    colours : (f,) int
        Colours of the visible faces in the light, in the canvas's format.
    rim : (k, 2) float64 or None
        Outline of a round body on the canvas, in order [px]; None for other bodies.
    is_whole : bool
        Whether the body can be drawn without clipping.
    """

    mesh: Mesh
    vertices: np.ndarray
    pixels: np.ndarray
    is_visible: np.ndarray
    colours: np.ndarray
    rim: np.ndarray | None
    is_whole: bool


def pose(canvas, frame, colours, rim_width, face_tint=None):
    """Pose, light and project the bodies of a frame for a canvas.

    Parameters
    ----------
    canvas : Canvas
    frame : Frame
    colours : (n, 3) float
        sRGB of the bodies before shading, 0..255.
    rim_width : float
        Width of the line around a round body [canvas units]; the line lies half outside of the body and half on it.
    face_tint : (face, colour) or None
        Another colour of one face of body 0.

    Returns
    -------
    solids : list of Solid
    depths : (n,) float64
        Depths of the bodies along the line of sight [m].
    """
    _, depths = canvas.project(frame.poses.pos)
    groups = {}
    for index, mesh in enumerate(_meshes(canvas, frame.bodies, depths)):
        groups.setdefault(id(mesh), (mesh, []))[1].append(index)
    solids = [None] * len(frame.bodies)
    for mesh, members in groups.values():
        tint = face_tint if members[0] == 0 else None
        for index, solid in zip(members, _pose_alike(canvas, mesh, frame, members, colours[members], rim_width, tint)):
            solids[index] = solid
    return solids, depths


def _meshes(canvas, bodies, depths):
    """Yield the unit mesh of each body; a hull, capsule or cylinder has a mesh of its own size."""
    focal = canvas.camera.focal(canvas.size[1]) / canvas.scale
    count = sum(body.kind in ("sphere", "ellipsoid") for body in bodies)
    facet = FACET * max(1.0, count / FEW) ** 0.5
    for body, depth in zip(bodies, depths.tolist()):
        if body.kind == "block":
            yield unit_mesh("block")
        elif body.kind in OWN_MESH:
            yield body_mesh(body)
        else:
            radius = focal * max(body.dimensions.tolist()) / max(depth, NEAR)
            fine = (n for n in SUBDIVISIONS if 0.5 * np.pi * radius <= n * facet)
            yield unit_mesh("sphere", next(fine, SUBDIVISIONS[-1]))


def _pose_alike(canvas, mesh, frame, members, colours, rim_width, face_tint):
    """Yield the `Solid` of each of the bodies `members`, which share a mesh."""
    eye = np.array(canvas.camera.eye)
    pos, R, size = (array[members] for array in (frame.poses.pos, frame.poses.rotation, frame.poses.size))
    turned = np.swapaxes(R, 1, 2)
    rims, is_stretched = None, frame.bodies[members[0]].kind not in OWN_MESH
    if not is_stretched:
        size = np.ones_like(size)
    elif mesh.is_smooth:
        rims = _rims(canvas, pos, R, size, eye, rim_width)
        # the mesh ends at the inner border of the line around it
        half = 0.5 * rim_width * canvas.unit / canvas.camera.focal(canvas.size[1])
        size = size - np.minimum(half * np.linalg.norm(eye - pos, axis=1)[:, None], 0.4 * size)
    vertices = pos[:, None] + (mesh.vertices * size[:, None]) @ turned
    centres = pos[:, None] + (mesh.centres * size[:, None]) @ turned
    normals = (mesh.normals / size[:, None]) @ turned
    towards_eye = eye - centres
    is_visible = np.einsum("nfi,nfi->nf", normals, towards_eye) > 0.0
    lit = _light(canvas, mesh, normals, towards_eye, is_visible, colours, face_tint)
    pixels, depths = canvas.project(vertices.reshape(-1, 3))
    pixels, depths = pixels.reshape(*vertices.shape[:2], 2), depths.reshape(vertices.shape[:2])
    is_whole = canvas.are_in_sight(pixels, depths)
    for i in range(len(members)):
        rim = rims[i] if rims is not None and is_whole[i] else None
        yield Solid(mesh, vertices[i], pixels[i], is_visible[i], lit[i], rim, bool(is_whole[i]))


def _light(canvas, mesh, normals, towards_eye, is_visible, colours, face_tint):
    """Colours (n, f) int of n bodies' visible faces in the light, in the canvas's format; 0 for invisible faces."""
    body, face = np.nonzero(is_visible)
    surface = colours[body]
    if mesh.is_smooth:
        odd = mesh.is_odd_octant[face]
        surface[odd] += OCTANT_LIGHTENING * (255.0 - surface[odd])
    if face_tint is not None:
        surface[(body == 0) & (face == face_tint[0])] = face_tint[1]
    lit = np.zeros(is_visible.shape, dtype=np.int64)
    lit[body, face] = canvas.stored(
        palette.shade(surface, unit_vectors(normals[body, face]), unit_vectors(towards_eye[body, face]))
    )
    return lit


def _rims(canvas, pos, R, size, eye, width):
    """Outlines (n, k, 2) of ellipsoids on the canvas [px], moved outwards by half a line's width.

    In the frame in which the ellipsoid x = pos + R A u is the unit sphere |u| = 1, the eye is at w = A⁻¹ Rᵀ (eye -
    pos). Lines of sight are tangent to it where u·w = 1: on a circle around w / |w|², of radius √(1 - 1/|w|²).
    """
    w = np.einsum("nij,ni->nj", R, eye - pos) / size
    square = np.maximum(np.sum(w * w, axis=1), 1.0)[:, None]
    radius = np.sqrt(1.0 - 1.0 / square)
    a, b = perpendiculars(w)
    grazed = (w / square)[:, None] + radius[:, None] * (_COSINES * a[:, None] + _SINES * b[:, None])
    points = pos[:, None] + (grazed * size[:, None]) @ np.swapaxes(R, 1, 2)
    pixels, _ = canvas.project(points.reshape(-1, 3))
    pixels = pixels.reshape(len(pos), -1, 2)
    along = np.roll(pixels, -1, axis=1) - np.roll(pixels, 1, axis=1)
    outwards = unit_vectors(np.stack([along[..., 1], -along[..., 0]], axis=-1))
    outwards *= np.sign(np.sum(outwards * (pixels - pixels.mean(axis=1, keepdims=True)), axis=-1, keepdims=True))
    return pixels + 0.5 * width * canvas.unit * outwards
