"""Overlays that explain a picture: the goal's disc, contact points, arrows of forces and torques, walls in front."""

from __future__ import annotations

import numpy as np

from rigid_env.rendering import palette
from rigid_env.rendering.bodies import goal_colour
from rigid_env.rendering.geometry import plane_axes, rotation_matrix
from rigid_env.rendering.layout import faces_point, is_floor
from rigid_env.rendering.meshes import body_mesh

ARROW_WIDTH, HEAD_LENGTH, HEAD_WIDTH, HALO_WIDTH = 3.0, 13.0, 11.0, 1.3
"""Width of an arrow's line, length and width of its head, and width of its white border [canvas units]."""

ARROW_LIMIT = 8.0
"""[m] Length of the longest arrow that is drawn; the force of an impact is cut to it."""

CONTACT_RADIUS = 4.2
"""Radius of the disc at a contact point [canvas units]."""

TORQUE_RADIUS = 0.42
"""Radius of the arc that shows a torque, in extents of the body."""

TORQUE_SWEEP = np.radians(300.0)
"""Largest angle of the arc that shows a torque [rad]."""

AXIS_WIDTH = 1.8
"""Width of the line along a torque's axis [canvas units]."""

PATH_WIDTH = 2.2
"""Width of the line along a body's path [canvas units]."""

RING_WIDTH = 2.4
"""Width of a goal's ring in the air, and of its stand [canvas units]."""

TORQUE_STEP = np.radians(6.0)
DISC_CORNERS = 72
GOAL_ALPHA = 46
HIDDEN_FADE = 0.5
NEAR_WALL_ALPHA = 12


def draw_goal(canvas, goal, room):
    """Draw a disc with ring and centre mark on the floor of a `Room`, below the target of a `GoalView`.

    A goal with an axis is a ring around the target instead, on a stand. Nothing is drawn if the goal is None or has no
    target.
    """
    if goal is None or goal.pos is None:
        return
    floors = [w for w in room.walls if is_floor(w)]
    normal = floors[0].normal if floors else np.array([0.0, 1.0, 0.0])
    height = normal @ goal.pos - floors[0].offset if floors else 0.0
    foot = goal.pos - height * normal
    colour = goal_colour(goal)
    if goal.axis is not None:
        _draw_ring(canvas, goal, foot, colour)
        return
    axes = plane_axes(normal)
    ring = _circle(foot, axes, goal.radius, np.linspace(0.0, 2.0 * np.pi, DISC_CORNERS, endpoint=False))
    canvas.polygon(ring, colour, GOAL_ALPHA)
    canvas.loop(ring, 2.0, colour)
    inner = foot + 0.82 * (ring - foot)
    canvas.loop(inner, 0.7, palette.mix(colour, palette.FLOOR, 0.35))
    arms = 0.16 * goal.radius * np.stack(axes)
    canvas.segments(foot - arms, foot + arms, 1.4, colour)


def _draw_ring(canvas, goal, foot, colour):
    """Draw the ring of a `GoalView`, with a line from its lowest point to `foot` (3,) [m] on the floor."""
    turns = np.linspace(0.0, 2.0 * np.pi, DISC_CORNERS, endpoint=False)
    ring = _circle(goal.pos, plane_axes(goal.axis), goal.radius, turns)
    canvas.polygon(ring, colour, GOAL_ALPHA)
    canvas.loop(ring, RING_WIDTH, colour)
    lowest = ring[np.argmin(np.linalg.norm(ring - foot, axis=1))]
    canvas.segments(lowest[None], foot[None], RING_WIDTH, palette.mix(colour, palette.FLOOR, 0.35))


def draw_path(canvas, frame, room):
    """Draw the path of a `Frame` as a line, and its projection onto the floors of a `Room`."""
    if len(frame.path) < 2:
        return
    for wall in room.walls:
        if is_floor(wall):
            feet = frame.path - (frame.path @ wall.normal - wall.offset)[:, None] * wall.normal
            canvas.segments(feet[:-1], feet[1:], PATH_WIDTH, palette.mix(palette.GRID, palette.SHADOW, 0.25))
    canvas.segments(frame.path[:-1], frame.path[1:], PATH_WIDTH, palette.PATH)


def draw_contacts(canvas, frame, room):
    """Draw discs at the contact points and red arrows of their forces; they are paler where a body hides them."""
    if len(frame.contact_points) == 0:
        return
    is_hidden = hidden_points(frame.contact_points, frame.solids.bodies, canvas.camera.eye)
    pixels, depths = canvas.project(frame.contact_points)
    is_in_sight = canvas.are_in_sight(pixels[:, None], depths[:, None])
    for i in np.lexsort((-depths, ~is_hidden)):
        if not is_in_sight[i]:
            continue
        fade = HIDDEN_FADE if is_hidden[i] else 0.0
        colour = palette.mix(palette.CONTACT, palette.HALO, fade)
        draw_arrow(canvas, frame.contact_points[i], frame.force_scale * frame.contact_forces[i], colour)
        canvas.disc(pixels[i], CONTACT_RADIUS + HALO_WIDTH, palette.HALO)
        canvas.disc(pixels[i], CONTACT_RADIUS, colour)


def draw_wrench(canvas, frame, room):
    """Draw orange arrows of applied forces and purple arcs of applied torques, at the centres of the bodies."""
    for body, torque in zip(frame.bodies, frame.applied_torque):
        _draw_torque(canvas, body, frame.force_scale * torque)
    for body, force in zip(frame.bodies, frame.applied_force):
        draw_arrow(canvas, body.pos, frame.force_scale * force, palette.APPLIED_FORCE)


def draw_arrow(canvas, start, vector, colour):
    """Draw an arrow on top of everything that is already drawn.

    Parameters
    ----------
    canvas : Canvas
    start, vector : (3,) float
        Start and direction with length, world frame [m]. A longer vector is cut to `ARROW_LIMIT`; an arrow shorter than
        a pixel is left out.
    colour : (3,) int
        sRGB.
    """
    length = np.linalg.norm(vector)
    if not 0.0 < length < np.inf:
        return
    tip = start + vector * min(1.0, ARROW_LIMIT / length)
    pixels = canvas.camera.project_polygon(np.stack([start, tip]), canvas.size)
    if len(pixels) == 2:
        _arrow_line(canvas, pixels, colour)


def has_near_walls(camera, room):
    """True if a wall of a `Room` is between the camera and the inside of the room."""
    return any(len(p) >= 3 and not faces_point(w, camera.eye) for w, p in zip(room.walls, room.wall_polygons))


def draw_near_walls(canvas, room):
    """Draw walls between the camera and the scene in front of everything, as an outline and a faint tint."""
    for index, wall in enumerate(room.walls):
        polygon = room.wall_polygons[index]
        if len(polygon) >= 3 and not faces_point(wall, canvas.camera.eye):
            canvas.polygon(polygon, (*palette.WALL_OUTLINE, NEAR_WALL_ALPHA))
            canvas.loop(polygon, 1.0, palette.mix(palette.WALL_OUTLINE, palette.HALO, 0.3))


def draw_far_outlines(canvas, room):
    """Draw the outlines of the walls behind the scene, except floors, which fade out."""
    for index, wall in enumerate(room.walls):
        polygon = room.wall_polygons[index]
        if len(polygon) >= 3 and faces_point(wall, canvas.camera.eye) and not is_floor(wall):
            canvas.loop(polygon, 1.1, palette.WALL_OUTLINE)


def hidden_points(points, bodies, eye):
    """Find points that a body hides from the eye.

    A point eye + s (point - eye) is inside a convex polyhedron if n·x ≤ n·vertex for all its faces; each face gives a
    lower or upper bound of s. The point is hidden if some s < 1 satisfies all bounds.

    Parameters
    ----------
    points : (n, 3) float
        [m], world frame.
    bodies : tuple of BodyView
    eye : (3,) float
        [m], world frame.

    Returns
    -------
    (n,) bool
    """
    rays = points - np.asarray(eye)
    is_hidden = np.zeros(len(points), dtype=bool)
    for body in bodies:
        mesh = body_mesh(body)
        R = rotation_matrix(body.quat)
        local_eye, local_rays = (np.asarray(eye) - body.pos) @ R, rays @ R
        room = np.sum(mesh.normals * mesh.vertices[mesh.faces[:, 0]], axis=1) - mesh.normals @ local_eye
        speed = local_rays @ mesh.normals.T
        with np.errstate(divide="ignore", invalid="ignore"):
            bound = room / speed
        enter = np.max(np.where(speed < 0.0, bound, -np.inf), axis=1)
        leave = np.min(np.where(speed > 0.0, bound, np.inf), axis=1)
        misses = np.any((speed == 0.0) & (room < 0.0), axis=1)
        margin = 1e-3
        is_hidden |= ~misses & (enter < leave - margin) & (enter < 1.0 - margin) & (leave > 0.0)
    return is_hidden


def _draw_torque(canvas, body, scaled):
    """Draw an arc with an arrow head around the axis of a torque; `scaled` (3,) is as long as the arc [m]."""
    size = np.linalg.norm(scaled)
    if not 0.0 < size < np.inf:
        return
    axis = scaled / size
    extent = body.dimensions.max() * (1.0 if body.kind == "block" else 2.0)
    radius = TORQUE_RADIUS * extent
    sweep = min(size / radius, TORQUE_SWEEP)
    angles = np.linspace(-0.5 * sweep, 0.5 * sweep, max(3, int(np.ceil(sweep / TORQUE_STEP))))
    axes = _axes_towards(canvas, body.pos, axis)
    pixels, depths = canvas.project(_circle(body.pos, axes, radius, angles))
    if not canvas.is_in_sight(pixels, depths):
        return
    ends = body.pos + 0.5 * radius * np.stack([-axis, axis])
    canvas.segments(ends[:1], ends[1:], AXIS_WIDTH + HALO_WIDTH, palette.HALO)
    canvas.segments(ends[:1], ends[1:], AXIS_WIDTH, palette.TORQUE)
    _arrow_line(canvas, pixels, palette.TORQUE)


def _axes_towards(canvas, centre, normal):
    """Two unit axes that span the plane of `normal`; the first is as near as possible to the camera's direction."""
    sight = np.asarray(canvas.camera.eye) - centre
    u = sight - (sight @ normal) * normal
    if np.linalg.norm(u) < 1e-3 * np.linalg.norm(sight):
        return plane_axes(normal)
    u /= np.linalg.norm(u)
    return u, np.cross(normal, u)


def _circle(centre, axes, radius, angles):
    u, v = axes
    return centre + radius * (np.cos(angles)[:, None] * u + np.sin(angles)[:, None] * v)


def _arrow_line(canvas, pixels, colour):
    """Draw a line through canvas pixels (n, 2) with an arrow head at its end, on a white border."""
    lengths = np.hypot(*np.diff(pixels, axis=0).T)
    total = lengths.sum()
    if total < canvas.unit:
        return
    scale = min(1.0, total / (1.6 * canvas.unit * HEAD_LENGTH))
    head = scale * canvas.unit * HEAD_LENGTH
    shaft, neck = _cut_back(pixels, lengths, head)
    along = pixels[-1] - neck
    along = along / max(np.hypot(*along), 1e-9)
    across = np.array([-along[1], along[0]])
    half = 0.5 * scale * canvas.unit * HEAD_WIDTH
    tip = pixels[-1]
    triangle = np.stack([tip, neck + half * across, neck - half * across])
    canvas.stroke(shaft, scale * ARROW_WIDTH + 2.0 * HALO_WIDTH, palette.HALO)
    canvas.stroke(np.concatenate([triangle, triangle[:1]]), 2.0 * HALO_WIDTH, palette.HALO)
    canvas.stroke(shaft, scale * ARROW_WIDTH, colour)
    canvas.fill(triangle, colour)


def _cut_back(pixels, lengths, cut):
    """Shorten a line through pixels (n, 2) by `cut` pixels at its end; returns the line and its new end.

    `lengths` (n - 1,) are the lengths of its segments [px].
    """
    keep = len(lengths)
    while keep > 1 and lengths[keep - 1] <= cut:
        cut -= lengths[keep - 1]
        keep -= 1
    a, b = pixels[keep - 1], pixels[keep]
    neck = b + min(1.0, cut / max(lengths[keep - 1], 1e-9)) * (a - b)
    return np.concatenate([pixels[:keep], neck[None]]), neck
