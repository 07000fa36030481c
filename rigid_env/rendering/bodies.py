"""Convex bodies: culled, flat-shaded faces and outlines, farthest body first."""

from __future__ import annotations

import numpy as np

from rigid_env.rendering import palette
from rigid_env.rendering.geometry import rotation_matrix
from rigid_env.rendering.meshes import body_mesh

SILHOUETTE_WIDTH, EDGE_WIDTH = 1.4, 1.0
"""[units] of the canvas."""

SILHOUETTE_DARKENING, EDGE_LIGHTENING = 0.55, 0.38
OCTANT_LIGHTENING = 0.42
"""Every second octant of a round body is lighter, so that its rotation can be seen."""

GOAL_FACE_TINT = 0.78
GOAL_FACE_INSET = 0.86
GOAL_OUTLINE_WIDTH = 2.2


def body_colour(body, index):
    """sRGB colour of a `BodyView`, the `index`-th of its frame, before light falls on it."""
    return tuple(body.colour) if body.colour is not None else palette.BODIES[index % len(palette.BODIES)]


def goal_colour(goal):
    """sRGB colour of a `GoalView`."""
    return palette.GOAL_REACHED if goal.reached else palette.GOAL


def draw_bodies(canvas, bodies, goal):
    """Draw all bodies on a `Canvas`; `goal` (GoalView or None) may highlight a face of body 0."""
    _, depths = canvas.project(np.array([b.pos for b in bodies]).reshape(-1, 3))
    for index in np.argsort(-depths, kind="stable"):
        face_goal = goal if index == 0 and goal is not None and goal.goal_face is not None else None
        _draw_body(canvas, bodies[index], body_colour(bodies[index], index), face_goal)


def _draw_body(canvas, body, colour, goal):
    mesh = body_mesh(body)
    R = rotation_matrix(body.quat)
    vertices, normals = body.pos + mesh.vertices @ R.T, mesh.normals @ R.T
    towards_eye = canvas.camera.eye - vertices[mesh.faces].mean(axis=1)
    towards_eye /= np.linalg.norm(towards_eye, axis=1, keepdims=True)
    is_visible = np.sum(normals * towards_eye, axis=1) > 0.0
    has_goal_face = goal is not None and body.kind == "block"
    surface = _surface_colours(mesh, colour)
    if has_goal_face:
        surface[goal.goal_face] = palette.mix(colour, goal_colour(goal), GOAL_FACE_TINT)
    shown = np.flatnonzero(is_visible)
    lit = palette.shade(surface[shown], normals[shown], towards_eye[shown])
    pixels, depths = canvas.project(vertices)
    is_whole = canvas.is_in_sight(pixels, depths)
    if is_whole:
        canvas.fill_all(pixels[mesh.faces[shown]], lit)
    else:
        for face, face_colour in zip(mesh.faces[shown], lit.tolist()):
            canvas.polygon(vertices[face], face_colour)
    _draw_edges(canvas, mesh, vertices, is_visible, colour)
    if has_goal_face:
        corners = vertices[mesh.faces[goal.goal_face]]
        _draw_goal_face(canvas, corners, is_visible[goal.goal_face], goal_colour(goal))


def _surface_colours(mesh, colour):
    """(m, 3) float64 sRGB of the faces, before light: one colour, or two in alternating octants."""
    colours = np.tile(np.array(colour, dtype=np.float64), (len(mesh.faces), 1))
    if mesh.is_smooth:
        is_light = np.prod(mesh.vertices[mesh.faces].mean(axis=1), axis=1) < 0.0
        colours[is_light] = palette.mix(colour, (255, 255, 255), OCTANT_LIGHTENING)
    return colours


def _draw_edges(canvas, mesh, vertices, is_visible, colour):
    """Dark silhouette; light edges between two visible faces of a block."""
    seen = is_visible[mesh.edges[:, 2:]].sum(axis=1)
    if not mesh.is_smooth:
        light = palette.mix(colour, (255, 255, 255), EDGE_LIGHTENING)
        starts, ends = mesh.edges[seen == 2, :2].T
        canvas.segments(vertices[starts], vertices[ends], EDGE_WIDTH, light)
    dark = palette.mix(colour, (10, 16, 32), SILHOUETTE_DARKENING)
    starts, ends = mesh.edges[seen == 1, :2].T
    canvas.segments(vertices[starts], vertices[ends], SILHOUETTE_WIDTH, dark)


def _draw_goal_face(canvas, corners, is_visible, colour):
    """An inset frame on the face; on a face turned away, its thin outline seen through the body."""
    centre = corners.mean(axis=0)
    inset = centre + GOAL_FACE_INSET * (corners - centre)
    if is_visible:
        canvas.loop(inset, GOAL_OUTLINE_WIDTH, palette.HALO)
    else:
        canvas.loop(inset, 0.5 * GOAL_OUTLINE_WIDTH, palette.mix(colour, (255, 255, 255), 0.35))
