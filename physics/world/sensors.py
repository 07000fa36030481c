"""Regions of a scene's sensors as query kernels take them, and the check of a result that a user hands in."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from physics.kernels.queries.nearest_queries import Region
from physics.kernels.queries.ray_cast import NOTHING
from physics.scene.scene import Scene
from physics.scene.sensor import carrier_index
from physics.summary import shown
from physics.world.nearest import shape_numbers


def sensor_regions(scene: Scene) -> list[tuple[Region, Any]]:
    """Convex shapes of all sensors of a scene, each with its solid, as `QueryCalls.ask` takes both."""
    found = []
    for k, sensor in enumerate(scene.sensors):
        carrier = carrier_index(sensor, scene.bodies, f"Scene.sensors[{k}]")
        for shape, pos, quat in sensor.regions():
            code, dims, radius, center, solid = shape_numbers(shape)
            place, turn = tuple(pos.tolist()), tuple(quat.tolist())
            carried_by = NOTHING if carrier is None else carrier
            found.append((Region(code, dims, radius, center, place, turn, carried_by, k), solid))
    return found


def sensor_result(out: Any, shape: tuple[int, int, int]) -> NDArray[np.bool_]:
    """Array of False of this shape: `out`, if it is given, or a new one."""
    if out is None:
        return np.zeros(shape, np.bool_)
    is_array = isinstance(out, np.ndarray) and out.shape == shape and out.dtype == np.bool_
    if not is_array or not (out.flags.c_contiguous and out.flags.writeable):
        raise ValueError(f"out is {shown(out)}; allowed is a contiguous array of bool in shape {shape}")
    out[...] = False
    return out
