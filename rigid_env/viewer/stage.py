"""Picture of the viewer: draws looks into viser's scene, in named layers, and reports clicks and drags of bodies."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from physics import Scene, validation
from rigid_env.viewer import layers, scenery
from rigid_env.viewer.bodies import Bodies
from rigid_env.viewer.interface import Look
from rigid_env.viewer.marks import Fields, Goal
from rigid_env.viewer.scenery import Placement, place
from rigid_env.viewer.shapes import body_point, hit

LAYERS = {
    "walls": True, "contacts": True, "forces": True, "applied": True, "velocities": False, "axes": False,
    "bounds": False, "sleeping": True, "goal": True, "fields": True, "drag": True, "ghost": True,
}  # fmt: skip
"""Names of all layers, and whether each is shown by default."""


class Stage:
    """Picture of a simulation in the scene of a viser server, for every browser that is connected.

    Used from one thread. `show` sends only changes.

    Parameters
    ----------
    server : viser.ViserServer
    fields : physics.Scene, optional
        Scene whose wind, fluids and springs are drawn.
    bounds : pair of (3,) float, optional
        Lower and upper corner of a box that is in view from the start [m].
    """

    def __init__(self, server, fields: Scene | None = None, bounds=None):
        self._server, self._scene = server, server.scene
        self._fields, self._bounds = fields, bounds
        self._is_on = dict(LAYERS)
        self._on_drag: Callable | None = None
        self._on_click: Callable | None = None
        self._grip: tuple[int, np.ndarray] | None = None
        self._followed: int | None = None
        self._look: Look | None = None
        self._walls = None
        self.placement: Placement | None = None
        server.scene.set_up_direction("+y")
        scenery.light(self._scene)
        scenery.paint_background(self._scene)

    def show(self, look: Look) -> None:
        """Draw a `Look`; if its walls differ from the last look's, the room is made anew, and the camera stays."""
        with self._server.atomic():
            if self._walls != _walls_of(look):
                self._make_room(look)
            self._look = look
            self._center(look)
            self._bodies.show(look.frame, look.is_asleep if self._is_on["sleeping"] else None)
            for name, layer in self._layers.items():
                if self._is_on[name]:
                    layer.show(look)
        self._server.flush()

    def set_layer(self, name: str, is_on: bool) -> None:
        """Switch a layer of `LAYERS` on or off.

        Raises
        ------
        ValueError
            If the name is not in `LAYERS`.
        """
        self._is_on[validation.one_of(name, LAYERS, "layer")] = bool(is_on)
        if self._look is None:
            return
        if not is_on and name in self._layers:
            with self._server.atomic():
                self._layers[name].hide()
            self._server.flush()
        self.show(self._look)

    def has_layer(self, name: str) -> bool:
        """True if a layer of `LAYERS` is switched on; raises a ValueError for another name."""
        return self._is_on[validation.one_of(name, LAYERS, "layer")]

    def follow(self, body: int | None) -> None:
        """Keep a body at its place in the picture from now on; None: keep the room at its place.

        Raises
        ------
        ValueError
            If the last look has no body with this index.
        """
        if body is not None:
            body = validation.index(body, 0 if self._look is None else len(self._look.frame.bodies), "body")
        self._followed = body
        if self._look is not None:
            self.show(self._look)

    def on_drag(self, callback: Callable[[str, int, np.ndarray, np.ndarray], None]) -> None:
        """Set the function that is called when the user drags a body with the left button.

        Drags that start beside the bodies move the camera.

        Parameters
        ----------
        callback : callable
            ``(phase, body, point_body, target)``: "start", "update" or "end"; index of the body; the point that was
            grabbed, in the body's frame from `BodyView.pos` [m]; the place of the mouse at the depth of that point,
            world frame [m]. It is called in the server's thread: keep it short.
        """
        self._on_drag = callback

    def on_click(self, callback: Callable[[int, np.ndarray, np.ndarray], None]) -> None:
        """Set the function that is called when the user clicks on a body.

        Parameters
        ----------
        callback : callable
            ``(body, point, direction)``: index of the body; the clicked point of its surface, world frame [m]; unit
            vector of the line of sight. It is called in the server's thread: keep it short.
        """
        self._on_click = callback

    # --- room ----------------------------------------------------------------------------------------------

    def _make_room(self, look: Look) -> None:
        is_first = self.placement is None
        if not is_first:
            self._scene.remove_by_name("/scene")
        self.placement = placement = place(look, self._bounds)
        self._walls, self._followed = _walls_of(look), None
        self._root = self._scene.add_frame("/scene", show_axes=False)
        self._bodies = Bodies(self._scene, "/scene/bodies", placement, added=self._watch)
        kinds = {
            "walls": layers.Walls, "contacts": layers.Contacts, "forces": layers.Forces, "applied": layers.Applied,
            "velocities": layers.Velocities, "axes": layers.Axes, "bounds": layers.Bounds, "goal": Goal,
            "drag": layers.Drag, "ghost": layers.Ghost,
        }  # fmt: skip
        self._layers: dict[str, layers.Layer] = {name: kind(self._scene, placement) for name, kind in kinds.items()}
        self._layers["fields"] = Fields(self._scene, placement, self._fields)
        for name, layer in self._layers.items():
            if not self._is_on[name]:
                layer.hide()
        if is_first:
            self._aim()

    def _aim(self) -> None:
        camera, place_ = self._server.initial_camera, self.placement
        camera.fov = float(np.radians(place_.camera.fov_y))
        camera.look_at = place_.drawn(place_.camera.target).astype(float)
        camera.position = place_.drawn(place_.camera.eye).astype(float)
        camera.up = (0.0, 1.0, 0.0)
        self._server.on_client_connect(self._aim_early)

    def _aim_early(self, client) -> None:
        """Set the camera of a browser that connected before the camera was known; viser sets it only for later ones."""
        camera = self._server.initial_camera
        with client.atomic():
            client.camera.fov = camera.fov
            client.camera.position, client.camera.look_at = camera.position, camera.look_at
            client.camera.up_direction = camera.up

    def _center(self, look: Look) -> None:
        """Shift the whole scene horizontally so that the followed body stays in the middle of the picture."""
        shift = np.zeros(3)
        if self._followed is not None and self._followed < len(look.frame.bodies):
            shift = -self.placement.drawn(look.frame.bodies[self._followed].pos)
            shift[1] = 0.0
        self._root.position = shift

    # --- picking -------------------------------------------------------------------------------------------

    def _watch(self, node, members: np.ndarray) -> None:
        """Report drags and clicks on the bodies in a new node; `members` has the indices of these bodies."""

        async def dragged(event) -> None:
            self._drag(event.phase, int(members[event.instance_index or 0]), event)

        async def clicked(event) -> None:
            self._click(int(members[event.instance_index or 0]), event)

        node.on_drag("left")(dragged)
        node.on_click(clicked)

    def _drag(self, phase: str, body: int, event) -> None:
        look = self._look
        if self._on_drag is None or look is None or body >= len(look.frame.bodies):
            return
        if phase == "start" or self._grip is None or self._grip[0] != body:
            start = self._world(event.start_position)
            self._grip = body, body_point(look.frame.bodies[body], start)
        self._on_drag(phase, body, self._grip[1], self._world(event.end_position))
        if phase == "end":
            self._grip = None

    def _click(self, body: int, event) -> None:
        look = self._look
        if self._on_click is None or look is None or body >= len(look.frame.bodies):
            return
        direction = np.asarray(event.ray_direction, dtype=float)
        direction /= np.linalg.norm(direction)
        point = hit(look.frame.bodies[body], self._world(event.ray_origin), direction)
        if point is not None:
            self._on_click(body, point, direction)

    def _world(self, point) -> np.ndarray:
        """Convert a point (3,) of viser's scene to the world frame [m]."""
        return self.placement.world(np.asarray(point, dtype=float) - self._root.position)


def _walls_of(look: Look):
    """Hashable key of a look's walls; looks with equal keys share a room."""
    return tuple((*wall.normal.tolist(), wall.offset) for wall in look.frame.walls)
