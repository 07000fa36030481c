"""Fields of a scene on the stage: arrows with labels, springs, the surfaces of fluids."""

from __future__ import annotations

import numpy as np

from physics import Scene
from rigid_env.rendering.geometry import plane_axes
from rigid_env.viewer.arrows import Arrows, Lines, spring
from rigid_env.viewer.look import Look
from rigid_env.viewer.marks import Mark, field_marks, spring_ends
from rigid_env.viewer.placement import Placement

FLOW, FLUID, SPRING = (64, 142, 196), (72, 150, 214), (92, 104, 128)
FLUID_OPACITY = 0.22


class Fields:
    """Marks of a scene's fields.

    Parameters
    ----------
    scene : viser.SceneApi
    placement : Placement
    fields : physics.Scene or None
        None has none.
    """

    def __init__(self, scene, placement: Placement, fields: Scene | None):
        self._scene, self._placement, self._fields = scene, placement, fields
        self._marks = () if fields is None else field_marks(fields)
        self._springs = Lines(scene, "/scene/fields/springs", placement, SPRING)
        self._arrows, self._nodes = Arrows(scene, "/scene/fields/flow", placement), None

    def show(self, look: Look) -> None:
        """Draw the marks; springs follow their bodies."""
        if not self._marks:
            return
        if self._nodes is None:
            self._nodes = [self._add(f"/scene/fields/{k}", mark) for k, mark in enumerate(self._marks)]
        for node in filter(None, self._nodes):
            node.visible = True
        flows = [np.asarray(mark.direction) for mark in self._marks if mark.direction is not None]
        vectors = [0.6 * self._placement.unit * flow / np.linalg.norm(flow) for flow in flows]
        starts = [self._place(mark) for mark in self._marks if mark.direction is not None]
        self._arrows.show(np.reshape(starts, (-1, 3)), np.reshape(vectors, (-1, 3)), FLOW)
        coils = [
            spring(*spring_ends(mark.spring, self._fields, look.frame.bodies), self._placement.unit)
            for mark in self._marks
            if mark.spring is not None
        ]
        self._springs.show(np.concatenate(coils) if coils else ())

    def hide(self) -> None:
        """Draw nothing until the next `show`."""
        self._arrows.hide()
        self._springs.hide()
        for node in filter(None, self._nodes or ()):
            node.visible = False

    def _place(self, mark: Mark) -> np.ndarray:
        """Start (3,) [m] of a mark's arrow: high in the room, one below the other."""
        room, order = self._placement.room, self._marks.index(mark)
        middle = 0.5 * (room.lower + room.upper)
        middle[1] = room.upper[1] - 0.15 * (1 + order) * self._placement.unit
        return middle

    def _add(self, name: str, mark: Mark):
        """Node of a mark that does not move, or None."""
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
        return self._scene.add_mesh_simple(
            name, corners, np.array([(0, 1, 2), (0, 2, 3)], dtype=np.uint32), color=FLUID, opacity=FLUID_OPACITY,
            flat_shading=True, side="double", cast_shadow=False, receive_shadow=False,
        )  # fmt: skip
