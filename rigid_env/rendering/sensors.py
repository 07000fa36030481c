"""Draw sensors on a canvas: translucent silhouettes of their regions, with an outline, over all bodies."""

from __future__ import annotations

import numpy as np

from physics import Body, World
from physics.rotations import product, rotation_matrices
from physics.scene.sensor import carrier_index
from rigid_env.rendering import palette
from rigid_env.rendering.camera import NEAR
from rigid_env.rendering.frame import BodyView
from rigid_env.rendering.geometry import convex_hull
from rigid_env.rendering.meshes import body_mesh

OPACITY = 60
"""Opacity of a region, 0 to 255."""

OUTLINE_WIDTH = 1.4
"""[canvas units]"""


def sensor_views(world: World, index: int) -> tuple[BodyView, ...]:
    """Views of the convex shapes of all sensors of a scene, where they are in world number `index`."""
    found = []
    for k, sensor in enumerate(world.scene.sensors):
        carrier = carrier_index(sensor, world.scene.bodies, f"Scene.sensors[{k}]")
        for shape, pos, quat in sensor.regions():
            if carrier is not None:
                turn = world.quat[index, carrier]
                pos, quat = world.pos[index, carrier] + rotation_matrices(turn) @ pos, product(turn, quat)
            found.append(_view(shape, pos + rotation_matrices(quat) @ np.array(shape.center), quat))
    return tuple(found)


def _view(shape: Body, pos: np.ndarray, quat: np.ndarray) -> BodyView:
    dimensions = 2.0 * shape.dimensions if shape.kind == "block" else shape.dimensions
    solid = shape.polyhedron if shape.kind == "hull" else None  # type: ignore[attr-defined]
    outline = {} if solid is None else {"corners": solid.vertices, "faces": solid.loops}
    return BodyView(shape.kind, dimensions, pos, quat, **outline)


def draw_sensors(canvas, frame, room):
    """Draw the sensors of a `Frame` on a `Canvas`; one that reaches behind the camera is left out.

    `room` is not used: all stages of drawing have the same arguments.
    """
    for view in frame.sensors:
        vertices = body_mesh(view).vertices @ rotation_matrices(view.quat).T + view.pos
        pixels, depths = canvas.project(vertices)
        if (depths > NEAR).all():
            rim = convex_hull(pixels)
            canvas.fill(rim, palette.SENSOR, OPACITY)
            canvas.stroke(np.concatenate([rim, rim[:1]]), OUTLINE_WIDTH, palette.SENSOR)
