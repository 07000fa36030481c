"""Parts of a scene's bodies, as kernels take them: each body, and behind all bodies the parts of compounds."""

from __future__ import annotations

from collections.abc import Iterable

from physics.kernels.multibody.data.parts import Part
from physics.kernels.state.layout import BLOCK, CAPSULE, COMPOUND, CYLINDER, ELLIPSOID, HULL, SPHERE
from physics.scene.bodies import Body
from physics.scene.compound import Compound

SHAPE_CODES = {
    "block": BLOCK,
    "sphere": SPHERE,
    "ellipsoid": ELLIPSOID,
    "hull": HULL,
    "capsule": CAPSULE,
    "compound": COMPOUND,
    "cylinder": CYLINDER,
}


def with_parts(bodies: Iterable[Body]) -> tuple[Body, ...]:
    """All bodies, and behind them the parts of their compounds."""
    bodies = tuple(bodies)
    return bodies + tuple(part for body in bodies if isinstance(body, Compound) for part in body.parts)


def part_list(bodies: Iterable[Body]) -> list[Part]:
    """List the parts of all compounds among the bodies, for `parts.make_parts` of the kernels."""
    return [
        Part(
            b, SHAPE_CODES[placed.part.kind], placed.part.dimensions,
            float(placed.part.bounding_radius(placed.part.dimensions)), placed.place, placed.R,
        )
        for b, body in enumerate(bodies) if isinstance(body, Compound) for placed in body.placed_parts
    ]  # fmt: skip


def part_count(bodies: Iterable[Body]) -> int:
    """Number of bodies and of parts of compounds together."""
    return len(with_parts(bodies))
