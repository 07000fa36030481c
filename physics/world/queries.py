"""Queries of the present state of a batch of worlds, without a step: methods of `World`."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from physics import validation
from physics.kernels.queries.ray_cast import NOTHING, Hits, Rays, cast_rays, first_bad_row
from physics.parallel.exclusive import exclusive
from physics.summary import shown
from physics.world import choice
from physics.world.batch import Batch
from physics.world.query_calls import QueryCalls
from physics.world.ray_hits import RayHits, no_hits


class Querying(Batch):
    """Base of `World` with the methods that ask about its present state."""

    @exclusive
    def cast_rays(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        max_distance: float = math.inf,
        carrier: int | None = None,
        exclude: int | None = None,
        worlds: ArrayLike | None = None,
        out: RayHits | None = None,
    ) -> RayHits:
        """Find the first body or wall that each ray meets; the threads of the batch share the worlds.

        A ray that starts inside a body meets its surface from within, where it leaves. A wall is met from its free side
        only. Of bodies at equal distances the first is reported, and a body before a wall.

        Parameters
        ----------
        origins, directions : (n, rays, 3) array_like
            Starts of the rays [m] and their directions, of any length but 0, world frame, for n worlds. (rays, 3): the
            same for all worlds; (3,) and (n, 1, 3): the same for all rays.
        max_distance : float
            Largest distance of a hit [m].
        carrier : int, optional
            Index of a body that carries the sensor: origins and directions are in its frame, from its centre of mass.
        exclude : int, optional
            Index of a body that rays pass through. None: the carrier, if there is one.
        worlds : (n,) int array_like or (worlds,) mask, optional
            Indices of the worlds to ask, in this order; None: all.
        out : RayHits, optional
            Result of an earlier call with as many worlds and rays, which is overwritten and returned.

        Returns
        -------
        RayHits
            Distance, body or wall, and normal of each hit.

        Raises
        ------
        ValueError
            A wrong shape, a number that is not finite, a direction of zeros, a distance that is negative or NaN, or a
            body or a world that does not exist.
        RuntimeError
            Another thread is stepping or changing this world.

        Notes
        -----
        The distance is exact to rounding: a few 1e-16 times the distance of the origin from the body, plus the distance
        of both from the world's origin. The bits of a ray depend neither on other rays nor on other worlds.
        """
        indices = None if worlds is None else choice.world_indices(worlds, self.worlds, once=False)
        asked = self.worlds if indices is None else len(indices)
        start, way = _vectors(origins, asked, "origins"), _vectors(directions, asked, "directions", may_vanish=False)
        count = max(start.shape[1], way.shape[1])
        for table, field in ((start, "origins"), (way, "directions")):
            if table.shape[1] not in (1, count):
                raise ValueError(f"{field} has {table.shape[1]} rays; allowed are {count}, as in the other argument, and 1")
        rays = Rays(
            start.reshape(-1, 3), way.reshape(-1, 3), _row_steps(start), _row_steps(way),
            count, _distance(max_distance), self._code(carrier, "carrier"),
            self._code(carrier if exclude is None else exclude, "exclude"),
        )  # fmt: skip
        hits = no_hits(asked, count) if out is None else _result(out, asked, count)
        rows = Hits(hits.distance.reshape(-1), hits.hit.reshape(-1), hits.normal.reshape(-1, 3))
        self._ask(cast_rays, indices, rays, rows)
        return hits

    def _code(self, body: int | None, field: str) -> int:
        return NOTHING if body is None else validation.index(body, self.body_count, field)

    def _ask(self, kernel, indices: np.ndarray | None, *question) -> None:
        if self._queries is None:
            self._queries = QueryCalls(self)
        self._queries.ask(kernel, indices, *question)


def _vectors(value: ArrayLike, worlds: int, field: str, may_vanish: bool = True) -> NDArray[np.float64]:
    """Convert vectors for the rays of `worlds` worlds to a contiguous array (worlds or 1, rays or 1, 3).

    The first vector that is not finite, or has zeros only unless it `may_vanish`, is named in an error.
    """
    shapes = f"shape ({worlds}, rays, 3), (rays, 3) or (3,)"
    array = validation.floats(value, field, f"are numbers in {shapes}")
    if not 1 <= array.ndim <= 3 or array.shape[-1] != 3 or (array.ndim == 3 and array.shape[0] != worlds):
        raise ValueError(f"{field} has shape {array.shape}; allowed is {shapes}")
    table = np.ascontiguousarray(array.reshape((1,) * (3 - array.ndim) + array.shape))
    bad = first_bad_row(table.reshape(-1, 3), may_vanish)
    if bad >= 0:
        place = np.unravel_index(bad, array.shape[:-1])
        index = f"[{', '.join(map(str, map(int, place)))}]" if place else ""
        allowed = "finite numbers" if may_vanish else "finite numbers that are not all 0"
        raise ValueError(f"{field}{index} is {shown(array[place])}; allowed are {allowed}")
    return table


def _row_steps(table: np.ndarray) -> tuple[int, int]:
    """Steps in rows from a world to the next, and from a ray to the next; 0 where all have the same vector."""
    worlds, rays, _ = table.shape
    return (rays if worlds > 1 else 0), (1 if rays > 1 else 0)


def _distance(value: float) -> float:
    if type(value) is float and value >= 0.0:
        return value
    array = validation.shaped(value, (), "max_distance")
    if not array >= 0.0:
        raise ValueError(f"max_distance is {shown(array)}; allowed are numbers of at least 0, and inf")
    return float(array)


def _result(out: RayHits, worlds: int, rays: int) -> RayHits:
    """Return `out` if its arrays have room for these results."""
    validation.instance(out, RayHits, "out", "None or RayHits of an earlier call")
    for name, array, kind, parts in zip(RayHits._fields, out, (np.float64, np.int64, np.float64), ((), (), (3,))):
        shape = (worlds, rays, *parts)
        is_array = isinstance(array, np.ndarray) and array.shape == shape and array.dtype == kind
        if not is_array or not (array.flags.c_contiguous and array.flags.writeable):
            raise ValueError(
                f"out.{name} is {shown(array)}; allowed is a contiguous array of {kind.__name__} in shape {shape}"
            )
    return out
