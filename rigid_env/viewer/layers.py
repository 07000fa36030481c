"""Layers of the viewer's picture that can be switched: each draws its part of a `Look`, or hides it."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from rigid_env.rendering import BodyView, palette
from rigid_env.rendering.geometry import plane_axes
from rigid_env.viewer.arrows import HEAD_LENGTH, Arrows, Lines, Nodes, path, spring
from rigid_env.viewer.bodies import Bodies
from rigid_env.viewer.interface import Look
from rigid_env.viewer.scenery import Placement, add_walls
from rigid_env.viewer.shapes import leave, octants

VELOCITY, SPIN = (196, 58, 148), (150, 104, 208)
"""RGB colours of the arrows of velocity and angular velocity."""

DRAG = (44, 54, 74)
BOUND = (96, 116, 150)
BOUND_OPACITY = 0.16

POINT = 0.036
"""Size of a contact point, in extents of the largest body."""

AXIS, AXIS_RADIUS = 0.75, 0.012
"""Length of a body's axis in diameters of the body, and its radius in extents of the largest body."""

TORQUE_RADIUS, TORQUE_SWEEP, TORQUE_POINTS = 0.62, np.radians(300.0), 32
"""Arc that shows a torque: its radius in extents of the body, its largest angle [rad], and its number of points."""

EARTH = 9.81
"""[m/s²] Gravity that scales arrows of velocity: after a fall by half a body's size, the arrow is half as long as the
body."""


class Layer(Protocol):
    """Part of the viewer's picture with a switch."""

    def show(self, look: Look) -> None:
        """Draw this part of a `Look`."""

    def hide(self) -> None:
        """Make this part invisible until the next `show`."""


class Walls(Nodes):
    """Floor and walls of the room, which are added once."""

    def __init__(self, scene, placement: Placement):
        super().__init__(scene, placement, "/scene/walls")
        self._nodes = add_walls(scene, self._name, placement)

    def show(self, look: Look) -> None:
        self._move()


class Contacts(Nodes):
    """Contact points, drawn as dots."""

    name = "/scene/contacts"

    def show(self, look: Look) -> None:
        points = look.frame.contact_points
        if len(points) == 0:
            self.hide()
            return
        drawn = self._placement.drawn(points)
        if self._nodes:
            self._move(points=drawn)
            return
        size = POINT * self._placement.unit * self._placement.scale
        self._nodes = [
            self._scene.add_point_cloud(
                self._name, drawn, palette.CONTACT, point_size=size, point_shape="circle", precision="float32",
                point_shading="flat",
            )
        ]  # fmt: skip


class Forces(Arrows):
    """Arrows of contact forces, scaled by the smallest body, so that forces on a large body do not hide it."""

    name = "/scene/forces"

    def show(self, look: Look) -> None:
        frame = look.frame
        self.unit = unit = min(map(extent, frame.bodies), default=self.unit)
        self.draw(frame.contact_points, force_scale(frame, unit) * frame.contact_forces, palette.CONTACT)


class Arcs(Lines):
    """Arcs that show torques."""

    name, colour = "/scene/applied/arc", palette.TORQUE


class Applied:
    """Arrows of applied forces, from the surfaces of the bodies, and arcs with arrow heads for applied torques."""

    def __init__(self, scene, placement: Placement):
        self._force = Arrows(scene, placement, "/scene/applied/force")
        self._turn = Arrows(scene, placement, "/scene/applied/turn")
        self._arc = Arcs(scene, placement)

    def show(self, look: Look) -> None:
        frame, unit = look.frame, self._force.unit
        if not frame.bodies or not len(frame.applied_force):
            self.hide()
            return
        scale = force_scale(frame, unit)
        forces, torques = scale * frame.applied_force, scale * frame.applied_torque
        starts = np.array([leave(body, force) for body, force in zip(frame.bodies, forces)])
        self._force.draw(starts, forces, palette.APPLIED_FORCE)
        arcs = [torque_arc(body, torque) for body, torque in zip(frame.bodies, torques)]
        arcs = [arc for arc in arcs if len(arc)]
        self._arc.draw(np.concatenate([path(arc) for arc in arcs]) if arcs else ())
        ends = np.array([arc[-2:] for arc in arcs]).reshape(-1, 2, 3)
        ways = ends[:, 1] - ends[:, 0]
        lengths = np.linalg.norm(ways, axis=1, keepdims=True)
        self._turn.draw(ends[:, 1], HEAD_LENGTH * unit * ways / lengths, palette.TORQUE)

    def hide(self) -> None:
        for part in (self._force, self._turn, self._arc):
            part.hide()


class Velocities(Arrows):
    """Arrows of velocities and angular velocities, from the surfaces of the bodies."""

    name = "/scene/velocities"

    def show(self, look: Look) -> None:
        bodies, unit = look.frame.bodies, self.unit
        rates = np.concatenate([look.linvel, look.angvel])
        starts = [leave(body, rate) for body, rate in zip(bodies * 2, rates)]
        scales = np.repeat((0.5 * (unit / EARTH) ** 0.5, 0.5 * unit * (unit / EARTH) ** 0.5), len(bodies))
        colours = np.repeat((VELOCITY, SPIN), len(bodies), axis=0)
        self.draw(starts, scales[:, None] * rates, colours)


class Axes(Nodes):
    """Body axes, from the centre of each shape: x red, y green, z blue."""

    name = "/scene/axes"
    _count = 0

    def show(self, look: Look) -> None:
        if not look.frame.bodies:
            self.hide()
            return
        poses, scale = look.frame.poses, self._placement.scale
        pos, sizes = self._placement.drawn(poses.pos), (AXIS * 2.0 * scale * np.asarray(look.radius)).astype(np.float32)
        quat = np.array([body.quat for body in look.frame.bodies], dtype=np.float32).reshape(-1, 4)
        if self._count != len(pos):
            self._count = len(pos)
            longest = max(float(np.max(look.radius, initial=0.0)) * 2.0 * AXIS, 1e-9)
            radius = AXIS_RADIUS * self._placement.unit / longest
            self._nodes = [
                self._scene.add_batched_axes(self._name, quat, pos, sizes, axes_length=1.0, axes_radius=radius)
            ]
        self._move(batched_positions=pos, batched_wxyzs=quat, batched_scales=sizes)


class Bounds(Nodes):
    """Translucent spheres that hold the bodies."""

    name = "/scene/bounds"
    _count = 0

    def show(self, look: Look) -> None:
        if not look.frame.bodies:
            self.hide()
            return
        pos = self._placement.drawn(look.frame.poses.pos)
        sizes = (self._placement.scale * np.asarray(look.radius)).astype(np.float32)
        if len(pos) != self._count:
            self._count, upright = len(pos), np.tile(np.eye(4, dtype=np.float32)[0], (len(pos), 1))
            self._nodes = [
                self._scene.add_batched_meshes_simple(
                    f"{self._name}/{k}", part.vertices, part.faces, upright, pos, batched_scales=sizes, lod="off",
                    batched_colors=BOUND, opacity=BOUND_OPACITY, cast_shadow=False, receive_shadow=False,
                )
                for k, part in enumerate(octants())
            ]  # fmt: skip
        self._move(batched_positions=pos, batched_scales=sizes)


class Drag(Lines):
    """Coil of the spring from the dragged body to the mouse."""

    name, colour = "/scene/drag", DRAG

    def show(self, look: Look) -> None:
        self.draw(() if look.drag is None else spring(*look.drag, self._placement.unit))


class Ghost:
    """Translucent bodies of the same scene at the accuracy ``reference``."""

    def __init__(self, scene, placement: Placement):
        self._bodies = Bodies(scene, "/scene/ghost", placement, is_ghost=True)

    def show(self, look: Look) -> None:
        if look.ghost is None:
            self.hide()
        else:
            self._bodies.show(look.ghost)

    def hide(self) -> None:
        self._bodies.clear()


def force_scale(frame, unit: float) -> float:
    """Length of an arrow per unit of force [m/N].

    `Frame.force_scale` is meant for bodies of 5 m; it is reduced for a smaller `unit`, the extent of a body [m].
    """
    return frame.force_scale * min(1.0, unit / 5.0)


def extent(body: BodyView) -> float:
    """Largest size of a body along its own axes [m]."""
    return float(body.dimensions.max()) * (1.0 if body.kind == "block" else 2.0)


def torque_arc(body: BodyView, scaled) -> np.ndarray:
    """Points (n, 3) [m] of an arc around a body and the axis of a torque.

    `scaled` (3,) has the direction of the torque, and the length of the arc [m]. A short arc has no points.
    """
    size = float(np.linalg.norm(scaled))
    radius = TORQUE_RADIUS * extent(body)
    sweep = min(size / radius, TORQUE_SWEEP) if np.isfinite(size) else 0.0
    if sweep < 0.2:
        return np.zeros((0, 3))
    u, v = plane_axes(scaled / size)
    angles = np.linspace(-0.5 * sweep, 0.5 * sweep, TORQUE_POINTS)
    return body.pos + radius * (np.cos(angles)[:, None] * u + np.sin(angles)[:, None] * v)
