"""Views of the parts of compounds, for pictures and the viewer."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from physics import Body, Compound
from rigid_env.rendering.frame import BodyView


def part_views(body: Body) -> tuple[BodyView, ...]:
    """Views of the parts of a compound, with their poses in its frame, from its centre of mass; () of other bodies."""
    return _views(body.parts) if isinstance(body, Compound) else ()


@lru_cache(maxsize=256)
def _views(parts: tuple[Body, ...]) -> tuple[BodyView, ...]:
    found = []
    for placed in Compound(parts, fixed=parts[0].fixed).placed_parts:
        part = placed.part
        dimensions = 2.0 * part.dimensions if part.kind == "block" else part.dimensions
        outline = {"corners": part.polyhedron.vertices, "faces": part.polyhedron.loops} if part.kind == "hull" else {}
        found.append(BodyView(part.kind, dimensions, placed.place, np.array(part.quat), **outline))
    return tuple(found)
