"""Draw convex bodies on a canvas: flat-shaded faces with outlines, the farthest body first."""

from __future__ import annotations

from itertools import compress

import numpy as np

from rigid_env.rendering import palette
from rigid_env.rendering.frame import body_colour
from rigid_env.rendering.solids import pose

SILHOUETTE_WIDTH, EDGE_WIDTH = 1.4, 1.0
"""Width of a body's outline, and of an edge between two visible faces [canvas units]."""

SILHOUETTE_DARKENING, EDGE_LIGHTENING = 0.55, 0.38

GOAL_FACE_TINT = 0.78
GOAL_FACE_INSET = 0.86
GOAL_OUTLINE_WIDTH = 2.2


def goal_colour(goal):
    """sRGB colour of a `GoalView`."""
    return palette.GOAL_REACHED if goal.reached else palette.GOAL


def draw_bodies(canvas, frame, room):
    """Draw all bodies of a `Frame` on a `Canvas`; if the frame's goal is a face, highlight it on body 0.

    `room` is not used: all stages of drawing have the same arguments.
    """
    bodies, goal = frame.bodies, frame.goal
    if not bodies:
        return
    has_goal_face = goal is not None and goal.goal_face is not None and bodies[0].kind == "block"
    frame = frame.solids
    colours = [body_colour(body, index) for index, body in enumerate(frame.bodies)]
    tint = (goal.goal_face, palette.mix(colours[0], goal_colour(goal), GOAL_FACE_TINT)) if has_goal_face else None
    solids, depths = pose(canvas, frame, np.array(colours, dtype=np.float64), SILHOUETTE_WIDTH, tint)
    for index in np.argsort(-depths, kind="stable").tolist():
        _draw_solid(canvas, solids[index], colours[index])
        if index == 0 and has_goal_face:
            _draw_goal_face(canvas, solids[0], goal)


def _draw_solid(canvas, solid, colour):
    dark = palette.mix(colour, (10, 16, 32), SILHOUETTE_DARKENING)
    if solid.rim is not None:
        canvas.fill(solid.rim, dark)
    mesh, colours = solid.mesh, solid.colours[solid.is_visible].tolist()
    if solid.is_whole:
        canvas.fill_faces(solid.pixels, compress(mesh.corner_getters, solid.is_visible.tolist()), colours)
    else:
        for face, face_colour in zip(mesh.faces[solid.is_visible], colours):
            canvas.polygon(solid.vertices[face], face_colour)
    if solid.rim is None:
        _draw_edges(canvas, solid, colour, dark)


def _draw_edges(canvas, solid, colour, dark):
    """Draw light edges between two visible faces, then the dark silhouette; a round body has only the silhouette."""
    edges, is_smooth = solid.mesh.edges, solid.mesh.is_smooth
    seen = solid.is_visible[edges[:, 2:]].sum(axis=1)
    between, outer = edges[seen == 2, :2][: 0 if is_smooth else None], edges[seen == 1, :2]
    starts, ends = np.concatenate([between, outer]).T
    light = palette.mix(colour, (255, 255, 255), EDGE_LIGHTENING)
    widths = np.repeat((EDGE_WIDTH, SILHOUETTE_WIDTH), (len(between), len(outer)))
    colours = [light] * len(between) + [dark] * len(outer)
    if solid.is_whole:
        canvas.strokes(solid.pixels[starts], solid.pixels[ends], widths, colours)
    else:
        for line in zip(solid.vertices[starts, None], solid.vertices[ends, None], widths, colours):
            canvas.segments(*line)


def _draw_goal_face(canvas, solid, goal):
    """Draw a white loop inside the goal face, or a thin coloured one if the face is turned away."""
    corners = solid.vertices[solid.mesh.faces[goal.goal_face]]
    centre = corners.mean(axis=0)
    inset = centre + GOAL_FACE_INSET * (corners - centre)
    if solid.is_visible[goal.goal_face]:
        canvas.loop(inset, GOAL_OUTLINE_WIDTH, palette.HALO)
    else:
        canvas.loop(inset, 0.5 * GOAL_OUTLINE_WIDTH, palette.mix(goal_colour(goal), (255, 255, 255), 0.35))
