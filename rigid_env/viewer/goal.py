"""Goal of a task on the stage: a disc on the floor, a face of body 0, or both."""

from __future__ import annotations

import numpy as np

from rigid_env.rendering import GoalView
from rigid_env.rendering.bodies import goal_colour
from rigid_env.rendering.layout import is_floor
from rigid_env.rendering.meshes import BLOCK_FACES, block_mesh
from rigid_env.viewer.colours import vivid
from rigid_env.viewer.look import Look
from rigid_env.viewer.placement import Placement
from rigid_env.viewer.scenery import turn_to_normal
from rigid_env.viewer.shapes import rim

CORNERS = 64
DISC_OPACITY = 0.25
RING = 0.05
"""Width of the disc's ring, in its radii."""

LIFT = 0.004
"""Height of the disc over the floor, in units of the largest body."""

FACE_SHARE, FACE_LIFT = 0.22, 1.008


class Goal:
    """Disc and face of a `GoalView`; made anew when another face or colour is shown, else moved."""

    def __init__(self, scene, placement: Placement):
        self._scene, self._placement = scene, placement
        self._key, self._disc, self._face = None, [], None

    def show(self, look: Look) -> None:
        """Draw the goal of a `Look`, if it has one."""
        goal, bodies = look.frame.goal, look.frame.bodies
        key = goal and (goal.pos is not None, goal.goal_face, goal.reached)
        if key != self._key:
            self.hide()
            self._key = key
        if goal is None:
            return
        if goal.pos is not None:
            self._show_disc(goal)
        if goal.goal_face is not None and bodies and bodies[0].kind == "block":
            self._show_face(goal, bodies[0])

    def hide(self) -> None:
        """Draw nothing until the next `show`."""
        for node in (*self._disc, self._face):
            if node is not None:
                node.remove()
        self._key, self._disc, self._face = None, [], None

    def _show_disc(self, goal: GoalView) -> None:
        floors = [wall for wall in self._placement.room.walls if is_floor(wall)]
        normal = floors[0].normal if floors else np.array((0.0, 1.0, 0.0))
        height = normal @ goal.pos - floors[0].offset if floors else 0.0
        foot = goal.pos + (LIFT * self._placement.unit - height) * normal
        if not self._disc:
            colour = goal_colour(goal)
            self._disc = [
                self._add("disc", *_disc(), colour, DISC_OPACITY), self._add("ring", *_ring(), colour, None)
            ]  # fmt: skip
        for node in self._disc:
            node.position, node.wxyz = self._placement.drawn(foot), turn_to_normal(normal)
            node.scale = goal.radius * self._placement.scale

    def _show_face(self, goal: GoalView, body) -> None:
        if self._face is None:
            part = rim(
                block_mesh((1.0, 1.0, 1.0)).vertices, [BLOCK_FACES[goal.goal_face].tolist()], FACE_SHARE, FACE_LIFT
            )
            self._face = self._add("face", part.vertices, part.faces, goal_colour(goal), None)
        self._face.position, self._face.wxyz = self._placement.drawn(body.pos), body.quat
        self._face.scale = tuple((self._placement.scale * body.dimensions).tolist())

    def _add(self, name: str, vertices, faces, colour, opacity):
        return self._scene.add_mesh_simple(
            f"/scene/goal/{name}", vertices, faces, color=tuple(vivid(colour).tolist()), opacity=opacity,
            flat_shading=True, side="double", cast_shadow=False, receive_shadow=False,
        )  # fmt: skip


def _circle(radius: float) -> np.ndarray:
    angle = np.linspace(0.0, 2.0 * np.pi, CORNERS, endpoint=False)
    return radius * np.stack([np.cos(angle), np.zeros(CORNERS), np.sin(angle)], axis=1)


def _disc():
    """Triangles of a disc of radius 1 across y."""
    here = np.arange(CORNERS)
    faces = np.stack([np.full(CORNERS, CORNERS), np.roll(here, -1), here], axis=1)
    return np.concatenate([_circle(1.0), np.zeros((1, 3))]), faces


def _ring():
    """Triangles of its ring."""
    a = np.arange(CORNERS)
    b = np.roll(a, -1)
    faces = np.concatenate([np.stack([a, a + CORNERS, b], 1), np.stack([b, a + CORNERS, b + CORNERS], 1)])
    return np.concatenate([_circle(1.0), _circle(1.0 - RING)]), faces
