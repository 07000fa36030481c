"""Warning about steps in which gravity moves a body so far that contacts mean little."""

from __future__ import annotations

import math
import warnings

import numpy as np

from physics.scene.effects import Gravity
from physics.scene.scene import Scene, SceneWarning, frames_of_package

# Way that gravity moves a body from rest in one step, in its bounding radii, from which on it warns. A marble of 5 mm
# falls that far in 0.3 s, the block of 3 m in 8 s.
MOST_RADII = 100.0


def warn_of_long_steps(scene: Scene, dt: float) -> None:
    """Warn if gravity moves a body further than `MOST_RADII` bounding radii in a step of `dt` [s].

    It is for scenes in which bodies may touch. Without contact such a step is exact.

    Warns
    -----
    SceneWarning
        With the way [m], and the step in which the body falls by its own radius [s].
    """
    gravity = scene.effect(Gravity)
    if gravity is None:
        return
    pull = float(np.linalg.norm(gravity.acceleration))
    moving = [body for body in scene.bodies if not body.fixed]
    least = min(float(body.bounding_radius(np.array(body.dimensions))) for body in moving)
    way = 0.5 * pull * dt * dt
    if way > MOST_RADII * least:
        advice = math.sqrt(2.0 * least / pull)
        warnings.warn(
            f"dt is {dt} s: gravity moves a body {way:.3g} m in a step, and the radius of the smallest one is "
            f"{least:.3g} m; contacts are met only roughly; in {advice:.2g} s it falls by its radius",
            SceneWarning,
            stacklevel=frames_of_package(),
        )
