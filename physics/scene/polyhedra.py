"""Polyhedra of a scene's bodies, for the tables that kernels read."""

from __future__ import annotations

from physics.kernels.multibody.data.hull_tables import CUBE
from physics.scene.bodies import Body
from physics.scene.parts import with_parts


def polyhedra(bodies: tuple[Body, ...]) -> list:
    """Polyhedron of each body and part for `hull_tables.make_hulls`; an empty list if no pair needs them.

    A hull has its own polyhedron, a block the unit cube, a round body and a compound None. Hulls need them, and so do
    capsules and cylinders beside blocks. The parts of compounds follow behind all bodies.
    """
    kinds = {body.kind for body in with_parts(bodies)}
    is_needed = "hull" in kinds or ("block" in kinds and kinds & {"capsule", "cylinder"})
    return every_polyhedron(bodies) if is_needed else []


def every_polyhedron(bodies: tuple[Body, ...]) -> list:
    """Polyhedron of each body and part, also of blocks in a scene without hulls; None for a round body."""
    blocks = {"block": CUBE}
    return [body.polyhedron if body.kind == "hull" else blocks.get(body.kind) for body in with_parts(bodies)]
