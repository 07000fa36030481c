"""Marks of the fields in a scene: an arrow with a label, a spring, the surface of a fluid."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from physics import Buoyancy, Scene, Spring, Wind
from rigid_env.viewer.picking import world_point


@dataclass(frozen=True, eq=False)
class Mark:
    """One field to be drawn.

    Parameters
    ----------
    label : str
    direction : (3,) float or None
        Of an arrow, world frame; its length does not count.
    surface : (normal, offset) or None
        Plane normal·x = offset [m] of a fluid.
    spring : physics.Spring or None
    """

    label: str
    direction: tuple[float, float, float] | None = None
    surface: tuple[tuple[float, float, float], float] | None = None
    spring: Spring | None = None


def field_marks(scene: Scene) -> tuple[Mark, ...]:
    """Marks of a scene's wind, fluids and springs; the other fields have no place or direction.

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
    """Ends (3,) and (3,) [m] of a spring on bodies of a frame, world frame."""
    start = _on_body(spring.body, spring.point, scene, bodies)
    if spring.other is None:
        return start, np.asarray(spring.anchor, dtype=float)
    return start, _on_body(spring.other, spring.anchor, scene, bodies)


def _on_body(index: int, point, scene: Scene, bodies) -> np.ndarray:
    """Point of a body from its centre of mass, body frame; a `BodyView` stands at the centre of the shape."""
    return world_point(bodies[index], np.subtract(point, scene.bodies[index].center))
