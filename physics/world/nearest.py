"""Nearest points of bodies, walls and shapes in many worlds: the result, and the checks of arguments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from physics import validation
from physics.annotations import End
from physics.html_table import parts_table
from physics.kernels.multibody.data.hull_tables import CUBE
from physics.kernels.queries.nearest_queries import Found
from physics.kernels.state.layout import SPHERE
from physics.scene.bodies import Body
from physics.scene.pairs import end_index
from physics.scene.parts import SHAPE_CODES, with_parts
from physics.scene.scene import Scene
from physics.summary import parts_repr, shown
from physics.world.query_arguments import result
from physics.world.query_calls import CAPSULE

Ends = ArrayLike | Sequence[End]
"""Type of an argument: a name or an index of a body or a wall, or a list of them."""

# A point: a sphere without radius, its bounding radius, its centre and its polyhedron.
_POINT = (SPHERE, (0.0, 0.0, 0.0), 0.0, (0.0, 0.0, 0.0), None)

SOLIDS = {"block": CUBE, "capsule": CAPSULE}


class Nearest(NamedTuple):
    """Nearest points of n worlds, from `World.measure_distances` and `World.nearest_to`.

    The first of each two is the first body of the pair, or the shape; the second is a body or a wall of the scene.

    Attributes
    ----------
    gap : (n, rows) float64
        Distance [m]; negative where the two overlap: -gap is the shortest way that separates them. inf where nothing is
        within the largest distance.
    other : (n, rows) int64
        Index of the second body, or -1 - k for wall k, as in `physics.Contacts.ends`; -2**31 where there is none.
    normal : (n, rows, 3) float64
        Unit vector out of the second along the gap, world frame; zeros where there is none.
    point, other_point : (n, rows, 3) float64
        Nearest points of the first and of the second, world frame [m]: point = other_point + gap normal.
    """

    gap: np.ndarray
    other: np.ndarray
    normal: np.ndarray
    point: np.ndarray
    other_point: np.ndarray

    __repr__ = parts_repr
    _repr_html_ = parts_table

    def _parts(self) -> tuple[str, ...]:
        worlds, rows = self.gap.shape
        least = f"{self.gap.min():.6g} m" if self.gap.size else "none"
        return f"worlds={worlds}", f"rows={rows}", f"least gap: {least}"


Nearest.INTEGERS = ("other",)  # type: ignore[attr-defined]


def nearest_result(out: Nearest | None, worlds: int, rows: int) -> tuple[Nearest, Found]:
    """Return a result with `rows` rows for each world, `out` if it is given, and its arrays as kernels take them."""
    shape, vectors = (worlds, rows), (worlds, rows, 3)
    shapes = {"gap": shape, "other": shape, "normal": vectors, "point": vectors, "other_point": vectors}
    found = result(out, Nearest, shapes)
    rest = (array.reshape(-1, 3) for array in found[2:])
    return found, Found(found.gap.reshape(-1), found.other.reshape(-1), *rest)


def pairs_of(first: Ends, second: Ends, scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """Check pairs of bodies, or of bodies and walls (names, or -1 - k), and return both as indices (pairs,) int64."""
    a, b = _indices(first, "first", 0, scene), _indices(second, "second", -len(scene.walls), scene)
    if len(a) != len(b) and 1 not in (len(a), len(b)):
        raise ValueError(f"first has {len(a)} bodies and second has {len(b)}; allowed are as many, or one")
    a, b = (np.ascontiguousarray(part) for part in np.broadcast_arrays(a, b))
    if (a == b).any():
        raise ValueError(f"first and second are both {int(a[np.argmax(a == b)])}; allowed are different bodies")
    return a, b


def _indices(value: Ends, field: str, least: int, scene: Scene) -> NDArray[np.int64]:
    count, numbers = len(scene.bodies), _numbered(value, field, scene)
    try:
        array = np.atleast_1d(np.asarray(numbers))
    except ValueError:  # ragged
        array = np.zeros(0)
    if array.ndim != 1 or array.dtype.kind not in "iu":
        raise ValueError(f"{field} is {shown(value)}; allowed is an index or a name, or a list of them")
    bad = (array < least) | (array >= count)
    if bad.any():
        walls = f", and from -1 to {least} for walls" if least else ""
        raise ValueError(f"{field} is {shown(value)}; allowed are indices from 0 to {count - 1}{walls}")
    return array.astype(np.int64)


def _numbered(value: Ends, field: str, scene: Scene) -> Any:
    """Replace names of bodies and walls in `value`, an end or a list of ends, by their indices."""
    if isinstance(value, str):
        return end_index(scene, value, field)
    if isinstance(value, (list, tuple)):
        return [end_index(scene, end, field) if isinstance(end, str) else end for end in value]
    return value


def attitudes(value: ArrayLike, worlds: int) -> NDArray[np.float64]:
    """Convert attitudes for the poses of `worlds` worlds to unit quaternions (worlds or 1, poses or 1, 4)."""
    shapes = f"shape ({worlds}, poses, 4), (poses, 4) or (4,)"
    array = validation.floats(value, "quat", f"are numbers in {shapes}")
    if not 1 <= array.ndim <= 3 or array.shape[-1] != 4 or (array.ndim == 3 and array.shape[0] != worlds):
        raise ValueError(f"quat has shape {array.shape}; allowed is {shapes}")
    unit = validation.unit_quaternion(array, array.shape, "quat") if array.size else array
    return np.ascontiguousarray(unit.reshape((1,) * (3 - array.ndim) + array.shape))


def shape_numbers(shape: Body | None) -> tuple[int, Any, float, Any, Any]:
    """Numbers of a shape for kernels: code, half extents, radius of a hull, centre, solid as of `QueryCalls.ask`."""
    if shape is None:
        return _POINT
    validation.instance(shape, Body, "shape", "a body such as physics.Sphere(...), or None for a point")
    if shape.kind == "compound":
        raise ValueError(f"shape is {shown(shape)}; allowed are convex shapes: ask for each part of a compound")
    if shape.kind == "cylinder":
        raise ValueError(f"shape is {shown(shape)}; allowed are all convex shapes but cylinders")
    solid = shape.polyhedron if shape.kind == "hull" else SOLIDS.get(shape.kind)  # type: ignore[attr-defined]
    radius = float(solid.radius) if shape.kind == "hull" else 0.0
    dims, center = (tuple(map(float, part)) for part in (shape.dimensions, shape.center))
    return SHAPE_CODES[shape.kind], dims, radius, center, solid


def _kinds(body: Body) -> set[str]:
    """Shapes of a body, or of its parts."""
    return {part.kind for part in with_parts([body])}


def check_pairs(first: np.ndarray, second: np.ndarray, scene: Scene) -> None:
    """Refuse pairs of bodies of which one has a cylinder, and the other one another shape than a sphere."""
    has_cylinder = [b for b, body in enumerate(scene.bodies) if "cylinder" in _kinds(body)]
    for a, b in zip(first, second):
        if b < 0 or not {a, b} & set(has_cylinder):
            continue
        if all(body.kind != "sphere" for body in (scene.bodies[a], scene.bodies[b])):
            raise ValueError(
                f"first and second hold the bodies {a} and {b}, one of them a cylinder; allowed with it are spheres, "
                "walls and points"
            )


def check_shape(shape: Body | None, scene: Scene) -> None:
    """Refuse a shape that is neither a point nor a sphere in a scene with cylinders."""
    if shape is not None and shape.kind != "sphere" and any("cylinder" in _kinds(body) for body in scene.bodies):
        raise ValueError(
            f"shape is {shown(shape)}, and Scene.bodies holds a cylinder; allowed with it are spheres and points"
        )
