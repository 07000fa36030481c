"""Shapes of a scene's bodies as columns of force fields, see `physics.kernels.forces.body_shapes`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from physics.kernels.forces import body_shapes as at
from physics.scene.bodies import Body
from physics.scene.compound import Compound
from physics.scene.parts import SHAPE_CODES

DESCRIBED = ("hull", "capsule", "cylinder", "compound")
"""Kinds of bodies whose half extents do not tell their shape, and that the functions of shapes know."""


def have_axes(bodies: Sequence[Body]) -> bool:
    """True if the half axes of every body that moves tell its shape."""
    return all(body.fixed or body.kind not in DESCRIBED for body in bodies)


def shape_table(bodies: Sequence[Body]) -> np.ndarray:
    """Shapes of all bodies, (bodies, columns); rows are filled up with zeros."""
    rows = [_row(body) for body in bodies]
    table = np.zeros((len(rows), max(map(len, rows))))
    for b, row in enumerate(rows):
        table[b, : len(row)] = row
    return table


def _row(body: Body) -> np.ndarray:
    placed = body.placed_parts if isinstance(body, Compound) else ()
    parts = [(each.part, np.array(each.place, float), np.array(each.R, float)) for each in placed]
    records = parts or [(body, np.array(body.center, float), np.eye(3))]
    volumes = np.array([part.volume for part, _, _ in records])
    offset = np.linalg.norm(volumes @ [place for _, place, _ in records] / volumes.sum())
    reach = float(body.bounding_radius(body.dimensions)) + float(np.linalg.norm(body.center))
    row, triangles, end = [len(parts), reach, volumes.sum(), offset], [], at.FIRST_PART + at.PART_SIZE * len(records)
    for part, place, R in records:
        faces = triangles_of(part)
        row += [SHAPE_CODES[part.kind], *place, *R.ravel(), *part.dimensions, end, len(faces)]
        triangles.append(faces.ravel())
        end += faces.size
    return np.concatenate([row, *triangles])


def triangles_of(body: Body) -> np.ndarray:
    """Triangles of the faces of a hull, (n, 3 corners, 3) from its geometric centre [m]; of other bodies none."""
    if body.kind != "hull":
        return np.zeros((0, 3, 3))
    solid = body.polyhedron  # type: ignore[attr-defined]
    fans = [(loop[0], loop[k], loop[k + 1]) for loop in solid.loops for k in range(1, len(loop) - 1)]
    return solid.vertices[np.array(fans)]
