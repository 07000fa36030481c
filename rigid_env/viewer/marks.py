"""Marks in the picture for a task's goal, and for a scene's wind, fluids and springs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from physics import Buoyancy, Scene, Spring, Wind
from rigid_env.rendering import GoalView
from rigid_env.rendering.bodies import goal_colour
from rigid_env.rendering.geometry import plane_axes
from rigid_env.rendering.layout import is_floor
from rigid_env.rendering.meshes import BLOCK_FACES, block_mesh
from rigid_env.viewer.arrows import Arrows, Lines, Nodes, spring
from rigid_env.viewer.interface import Look
from rigid_env.viewer.scenery import Placement, turn_to_normal, vivid
from rigid_env.viewer.shapes import rim, world_point

CORNERS = 64
DISC_OPACITY = 0.25
RING = 0.05
"""Width of the ring around the goal's disc, in radii of the disc."""

LIFT = 0.004
"""Height of the goal's disc above the floor, in extents of the largest body."""

FACE_SHARE, FACE_LIFT = 0.22, 1.008

FLOW, FLUID, SPRING = (64, 142, 196), (72, 150, 214), (92, 104, 128)
FLUID_OPACITY = 0.22


def _sheet(scene, name: str, vertices, faces, colour, opacity):
    """Add a node of triangles to viser's scene that can be seen from both sides and cast no shadow."""
    return scene.add_mesh_simple(
        name, vertices, faces, color=colour, opacity=opacity, flat_shading=True, side="double", cast_shadow=False,
        receive_shadow=False,
    )  # fmt: skip


# --- goal ----------------------------------------------------------------------------------------------------------


class Goal:
    """Disc and face that show the goal of a task (`GoalView`); another face or colour needs new nodes."""

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
        """Remove the nodes until the next `show`."""
        for node in (*self._disc, self._face):
            if node is not None:
                node.remove()
        self._key, self._disc, self._face = None, [], None

    def _show_disc(self, goal: GoalView) -> None:
        floors = [wall for wall in self._placement.room.walls if is_floor(wall)]
        normal = floors[0].normal if floors else np.array((0.0, 1.0, 0.0))
        height = normal @ goal.pos - floors[0].offset if floors else 0.0
        foot = goal.pos + (LIFT * self._placement.unit - height) * normal
        if goal.axis is not None:
            foot, normal = goal.pos, goal.axis
        if not self._disc:
            self._disc = [
                self._add("disc", *_disc(), goal, DISC_OPACITY), self._add("ring", *_ring(), goal, None)
            ]  # fmt: skip
        for node in self._disc:
            node.position, node.wxyz = self._placement.drawn(foot), turn_to_normal(normal)
            node.scale = goal.radius * self._placement.scale

    def _show_face(self, goal: GoalView, body) -> None:
        if self._face is None:
            part = rim(
                block_mesh((1.0, 1.0, 1.0)).vertices, [BLOCK_FACES[goal.goal_face].tolist()], FACE_SHARE, FACE_LIFT
            )
            self._face = self._add("face", part.vertices, part.faces, goal, None)
        self._face.position, self._face.wxyz = self._placement.drawn(body.pos), body.quat
        self._face.scale = tuple((self._placement.scale * body.dimensions).tolist())

    def _add(self, name: str, vertices, faces, goal: GoalView, opacity):
        colour = tuple(vivid(goal_colour(goal)).tolist())
        return _sheet(self._scene, f"/scene/goal/{name}", vertices, faces, colour, opacity)


def _circle(radius: float) -> np.ndarray:
    angle = np.linspace(0.0, 2.0 * np.pi, CORNERS, endpoint=False)
    return radius * np.stack([np.cos(angle), np.zeros(CORNERS), np.sin(angle)], axis=1)


def _disc():
    """Vertices and triangles of a disc of radius 1 across the y axis."""
    here = np.arange(CORNERS)
    faces = np.stack([np.full(CORNERS, CORNERS), np.roll(here, -1), here], axis=1)
    return np.concatenate([_circle(1.0), np.zeros((1, 3))]), faces


def _ring():
    """Vertices and triangles of a ring across the y axis, with the outer radius 1 and the width `RING`."""
    a = np.arange(CORNERS)
    b = np.roll(a, -1)
    faces = np.concatenate([np.stack([a, a + CORNERS, b], 1), np.stack([b, a + CORNERS, b + CORNERS], 1)])
    return np.concatenate([_circle(1.0), _circle(1.0 - RING)]), faces


# --- fields --------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class Mark:
    """Mark of one field of a scene: an arrow, a plane or a spring.

    Parameters
    ----------
    label : str
        Text at the mark.
    direction : (3,) float or None
        Direction of the arrow, world frame; its length has no meaning.
    surface : (normal, offset) or None
        Surface of a fluid: the plane normal·x = offset [m].
    spring : physics.Spring or None
    """

    label: str
    direction: tuple[float, float, float] | None = None
    surface: tuple[tuple[float, float, float], float] | None = None
    spring: Spring | None = None


def field_marks(scene: Scene) -> tuple[Mark, ...]:
    """Marks of a scene's wind, fluids and springs; other fields have no place or direction to draw.

    Parameters
    ----------
    scene : Scene

    Returns
    -------
    tuple of Mark
    """
    marks = []
    for effect in scene.effects:
        if isinstance(effect, Wind) and np.any(effect.velocity):
            speed = float(np.linalg.norm(effect.velocity))
            marks.append(Mark(f"wind {speed:.3g} m/s", direction=tuple(effect.velocity)))
        elif isinstance(effect, Buoyancy):
            marks.append(Mark(f"fluid {effect.density:.4g} kg/m³", surface=(tuple(effect.normal), effect.offset)))
        elif isinstance(effect, Spring):
            marks.append(Mark(f"spring {effect.stiffness:.3g} N/m", spring=effect))
    return tuple(marks)


def spring_ends(spring: Spring, scene: Scene, bodies) -> tuple[np.ndarray, np.ndarray]:
    """Ends (3,) and (3,) of a spring of a scene, world frame [m]; `bodies` are the `BodyView` of a picture."""
    start = _on_body(spring.body, spring.point, scene, bodies)
    if spring.other is None:
        return start, np.asarray(spring.anchor, dtype=float)
    return start, _on_body(spring.other, spring.anchor, scene, bodies)


def _on_body(index: int, point, scene: Scene, bodies) -> np.ndarray:
    """Point of body `index` in the world frame (3,) [m], given from its centre of mass in the body frame."""
    return world_point(bodies[index], np.subtract(point, scene.bodies[index].center))


class Springs(Lines):
    """Coils that show a scene's springs."""

    name, colour = "/scene/fields/springs", SPRING


class Fields(Nodes):
    """Marks of a scene's wind, fluids and springs.

    Parameters
    ----------
    scene : viser.SceneApi
    placement : Placement
        Scale and origin of the drawing.
    fields : physics.Scene or None
        Scene that has the fields; None: no marks.
    """

    name = "/scene/fields"

    def __init__(self, scene, placement: Placement, fields: Scene | None):
        super().__init__(scene, placement)
        self._fields = fields
        self._marks = () if fields is None else field_marks(fields)
        self._springs = Springs(scene, placement)
        self._arrows = Arrows(scene, placement, f"{self._name}/flow")

    def show(self, look: Look) -> None:
        """Draw the marks of the fields; springs follow the bodies of a `Look`."""
        if not self._marks:
            return
        if not self._nodes:
            self._nodes = list(filter(None, map(self._add, self._marks)))
        self._move()
        flows = [mark for mark in self._marks if mark.direction is not None]
        reach = 0.6 * self._placement.unit
        vectors = [reach * np.array(flow.direction) / np.linalg.norm(flow.direction) for flow in flows]
        self._arrows.draw([self._place(flow) for flow in flows], vectors, FLOW)
        springs = [mark.spring for mark in self._marks if mark.spring is not None]
        bodies, unit = look.frame.bodies, self._placement.unit
        coils = [spring(*spring_ends(each, self._fields, bodies), unit) for each in springs]
        self._springs.draw(np.concatenate(coils) if coils else ())

    def hide(self) -> None:
        """Make the marks invisible until the next `show`."""
        super().hide()
        self._arrows.hide()
        self._springs.hide()

    def _place(self, mark: Mark) -> np.ndarray:
        """Start (3,) of a mark's arrow, world frame [m]: near the top of the room, each arrow below the one before."""
        room, order = self._placement.room, self._marks.index(mark)
        middle = 0.5 * (room.lower + room.upper)
        middle[1] = room.upper[1] - 0.15 * (1 + order) * self._placement.unit
        return middle

    def _add(self, mark: Mark):
        """Add a node for the part of a mark that does not move to viser's scene; None if there is no such part."""
        name = f"{self._name}/{self._marks.index(mark)}"
        if mark.direction is not None:
            return self._scene.add_label(
                name, mark.label, position=self._placement.drawn(self._place(mark)), anchor="bottom-center"
            )
        if mark.surface is None:
            return None
        room, (normal, offset) = self._placement.room, mark.surface
        middle = 0.5 * (room.lower + room.upper)
        foot = middle + (offset - np.dot(normal, middle)) * np.asarray(normal)
        u, v = plane_axes(normal)
        reach = 0.5 * np.linalg.norm(room.upper - room.lower)
        corners = self._placement.drawn(foot + reach * np.array([-u - v, u - v, u + v, -u + v]))
        return _sheet(
            self._scene, name, corners, np.array([(0, 1, 2), (0, 2, 3)], dtype=np.uint32), FLUID, FLUID_OPACITY
        )
