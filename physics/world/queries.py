"""Queries of the present state of a batch of worlds, without a step: methods of `World`."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from physics import validation
from physics.kernels.queries.nearest_queries import Pairs, Probe, measure_pairs, probe_worlds, sense_worlds
from physics.kernels.queries.ray_cast import NOTHING, Hits, Rays, cast_rays
from physics.parallel.exclusive import exclusive
from physics.scene.bodies import Body
from physics.scene.body_names import body_index
from physics.world import choice
from physics.world.batch import Batch
from physics.world.nearest import (
    Ends,
    Nearest,
    attitudes,
    check_pairs,
    check_shape,
    nearest_result,
    pairs_of,
    shape_numbers,
)
from physics.world.query_arguments import common_count, largest_distance, result, row_steps, vectors
from physics.world.query_calls import QueryCalls
from physics.world.ray_hits import RayHits
from physics.world.sensors import sensor_regions, sensor_result


class Querying(Batch):
    """Base of `World` with the methods that ask about its present state."""

    @exclusive
    def cast_rays(
        self,
        origins: ArrayLike,
        directions: ArrayLike,
        max_distance: float = math.inf,
        carrier: int | str | None = None,
        exclude: int | str | None = None,
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
        carrier : int or str, optional
            Index or name of a body that carries the sensor: origins and directions are in its frame, from its centre of
            mass.
        exclude : int or str, optional
            Index or name of a body that rays pass through. None: the carrier, if there is one.
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
        indices, asked = self._asked(worlds)
        start, way = vectors(origins, asked, "origins"), vectors(directions, asked, "directions", may_vanish=False)
        count = common_count({"origins": start, "directions": way}, "rays")
        rays = Rays(
            start.reshape(-1, 3), way.reshape(-1, 3), row_steps(start), row_steps(way),
            count, largest_distance(max_distance), self._code(carrier, "carrier"),
            self._code(carrier if exclude is None else exclude, "exclude"),
        )  # fmt: skip
        shape = asked, count
        hits = result(out, RayHits, {"distance": shape, "hit": shape, "normal": (*shape, 3)})
        rows = Hits(hits.distance.reshape(-1), hits.hit.reshape(-1), hits.normal.reshape(-1, 3))
        self._ask(cast_rays, indices, rays, rows)
        return hits

    @exclusive
    def measure_distances(
        self, first: Ends, second: Ends, worlds: ArrayLike | None = None, out: Nearest | None = None
    ) -> Nearest:
        """Find the nearest points of pairs of bodies, or of bodies and walls, whether they may touch or not.

        Parameters
        ----------
        first : int, str or (pairs,) sequence of them
            Indices or names of bodies.
        second : int, str or (pairs,) sequence of them
            Indices or names of bodies and walls; wall k has the index -1 - k.
        worlds : (n,) int array_like or (worlds,) mask, optional
            Indices of the worlds to ask, in this order; None: all.
        out : Nearest, optional
            Result of an earlier call with as many worlds and pairs, which is overwritten and returned.

        Returns
        -------
        Nearest
            Gap, normal and nearest points of each pair in each world.

        Raises
        ------
        ValueError
            A body, wall or world that does not exist, a body paired with itself, different numbers of both, or a
            cylinder paired with another body than a sphere.
        RuntimeError
            Another thread is stepping or changing this world.
        """
        indices, asked = self._asked(worlds)
        a, b = pairs_of(first, second, self.scene)
        check_pairs(a, b, self.scene)
        found, rows = nearest_result(out, asked, len(a))
        self._ask(measure_pairs, indices, Pairs(a, b), rows)
        return found

    @exclusive
    def nearest_to(
        self,
        shape: Body | None,
        pos: ArrayLike,
        quat: ArrayLike = (1.0, 0.0, 0.0, 0.0),
        max_distance: float = math.inf,
        exclude: int | str | None = None,
        worlds: ArrayLike | None = None,
        out: Nearest | None = None,
    ) -> Nearest:
        """Find the nearest body or wall to a shape, or to a point, that is no part of the scene.

        Parameters
        ----------
        shape : Body or None
            Shape, such as ``physics.Block(size, mass)``; its mass and start do not matter. None: a point.
        pos, quat : (n, poses, 3|4) array_like
            Poses of the shape, as of a body: centre of mass [m] and attitude (w, x, y, z), for n worlds. (poses, 3|4):
            the same for all worlds; (3|4,) and (n, 1, 3|4): the same for all poses.
        max_distance : float
            Largest gap of a result [m]; bodies farther away are left out, and cost less time.
        exclude : int or str, optional
            Index or name of a body that is left out.
        worlds : (n,) int array_like or (worlds,) mask, optional
            Indices of the worlds to ask, in this order; None: all.
        out : Nearest, optional
            Result of an earlier call with as many worlds and poses, which is overwritten and returned.

        Returns
        -------
        Nearest
            The nearest body or wall, with its gap, normal and nearest points, for each pose in each world. Of equal
            gaps the first body counts, and a body before a wall.

        Raises
        ------
        ValueError
            A wrong shape, a number that is not finite, no unit quaternion, a body or world that does not exist, or a
            cylinder in the scene, where the shape is neither a point nor a sphere.
        RuntimeError
            Another thread is stepping or changing this world.
        """
        indices, asked = self._asked(worlds)
        place, turn = vectors(pos, asked, "pos", "poses"), attitudes(quat, asked)
        count = common_count({"pos": place, "quat": turn}, "poses")
        code, dims, radius, center, solid = shape_numbers(shape)
        check_shape(shape, self.scene)
        probe = Probe(
            code, dims, radius, center, place.reshape(-1, 3), turn.reshape(-1, 4), row_steps(place), row_steps(turn),
            count, largest_distance(max_distance), self._code(exclude, "exclude"),
        )  # fmt: skip
        found, rows = nearest_result(out, asked, count)
        self._ask(probe_worlds, indices, probe, rows, solid=solid)
        return found

    def overlaps(
        self,
        shape: Body | None,
        pos: ArrayLike,
        quat: ArrayLike = (1.0, 0.0, 0.0, 0.0),
        margin: float = 0.0,
        exclude: int | str | None = None,
        worlds: ArrayLike | None = None,
    ) -> NDArray[np.bool_]:
        """Test which poses of a shape touch or overlap a body or a wall: (n, poses) bool.

        `margin` [m] is a gap that counts as touching. `nearest_to` has all other arguments and the errors.
        """
        return np.isfinite(self.nearest_to(shape, pos, quat, margin, exclude, worlds).gap)

    @exclusive
    def read_sensors(self, worlds: ArrayLike | None = None, out: NDArray[np.bool_] | None = None) -> NDArray[np.bool_]:
        """Find the bodies that touch or overlap each sensor of the scene, in the present state.

        Parameters
        ----------
        worlds : (n,) int array_like or (worlds,) mask, optional
            Indices of the worlds to ask, in this order; None: all.
        out : (n, sensors, bodies) bool array, optional
            Result of an earlier call, which is overwritten and returned.

        Returns
        -------
        (n, sensors, bodies) bool array
            True for a body that touches or overlaps a sensor of `Scene.sensors`, whether it moves or is fixed. It is
            False for the body that carries the sensor.

        Raises
        ------
        ValueError
            A world that does not exist, or `out` of another shape.
        RuntimeError
            Another thread is stepping or changing this world.
        """
        indices, asked = self._asked(worlds)
        inside = sensor_result(out, (asked, len(self.scene.sensors), self.body_count))
        if self._regions is None:
            self._regions = sensor_regions(self.scene)
        for region, solid in self._regions:
            self._ask(sense_worlds, indices, region, inside, solid=solid)
        return inside

    def _asked(self, worlds: ArrayLike | None) -> tuple[NDArray[np.int64] | None, int]:
        """Indices of the worlds to ask, or None for all, and their number."""
        if worlds is None:
            return None, self.worlds
        indices = choice.world_indices(worlds, self.worlds, once=False)
        return indices, len(indices)

    def _code(self, body: int | str | None, field: str) -> int:
        if isinstance(body, str):
            return body_index(body, field, self.scene)
        return NOTHING if body is None else validation.index(body, self.body_count, field)

    def _ask(self, kernel, indices: np.ndarray | None, *question, solid=None) -> None:
        if self._queries is None:
            self._queries = QueryCalls(self)
        self._queries.ask(kernel, indices, *question, solid=solid)
