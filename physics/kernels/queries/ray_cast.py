"""Cast rays into the worlds of a batch: the nearest body or wall that each ray meets."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from physics.compiler.decorators import entry_kernel, inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, row_vector, times
from physics.kernels.multibody.data.capsules import is_capsule
from physics.kernels.multibody.data.contact_set import put_vector, row_matrix
from physics.kernels.multibody.data.cylinders import is_cylinder
from physics.kernels.multibody.data.hull_tables import FIRST_FACE, LAST_FACE
from physics.kernels.multibody.data.parts import body_of, is_compound
from physics.kernels.parallel.work_stealing import for_each_world
from physics.kernels.queries.box_tree import build_tree, find_bodies, safe_inverse
from physics.kernels.queries.query_scratch import pose_world
from physics.kernels.queries.ray_shapes import (
    ray_block,
    ray_capsule,
    ray_cylinder,
    ray_ellipsoid,
    ray_plane,
    ray_polyhedron,
    ray_sphere,
)
from physics.kernels.state.layout import BLOCK, HULL, POS, SPHERE, WALL_NORMAL, WALL_OFFSET

# Code of neither a body nor a wall: of a ray that hits nothing, and of no excluded body.
NOTHING = -(2**31)

# Squares of lengths from here to the inverse are far from underflow and overflow.
_LEAST_SQUARE = 1.0e-200


class Rays(NamedTuple):
    """Rays of some worlds; ray r of the k-th world has the row k * world_rows + r * ray_rows of each array."""

    origins: np.ndarray  # (rows, 3) [m]
    directions: np.ndarray  # (rows, 3) of any length but 0
    origin_rows: tuple[int, int]  # (world_rows, ray_rows) of `origins`
    direction_rows: tuple[int, int]  # (world_rows, ray_rows) of `directions`
    count: int  # rays of a world
    max_distance: float  # [m]
    carrier: int  # body in whose frame origins and directions are given, from its centre of mass; NOTHING: world frame
    exclude: int  # body that rays pass through; NOTHING: none


class Hits(NamedTuple):
    """Results of a ray cast: a row for each ray of the first world, then for each ray of the second, and so on."""

    distance: np.ndarray  # (rows,) [m]; inf: nothing
    hit: np.ndarray  # (rows,) int, body, or -1 - k for wall k; NOTHING: nothing
    normal: np.ndarray  # (rows, 3) unit normal out of the body or wall, world frame; 0: nothing


@kernel
def _ray_body(b, o, d, scratch):
    """First point of a ray on a body or part b: (t [m], normal, world frame); of a compound its parts have it."""
    if is_compound(b, scratch):
        return math.inf, (0.0, 0.0, 0.0)
    arm, R = minus(o, row_vector(scratch.bodies.center, b, 0)), row_matrix(scratch.bodies.rotation, b)
    shape, dims = scratch.bodies.body[b].shape, scratch.bodies.body[b].dims
    if shape == SPHERE:
        return ray_sphere(arm, d, dims[0])
    arm, way, dims = qt.transposed_matvec(R, arm), qt.transposed_matvec(R, d), (dims[0], dims[1], dims[2])
    if is_capsule(b, scratch):
        t, n = ray_capsule(arm, way, dims)
    elif is_cylinder(b, scratch):
        t, n = ray_cylinder(arm, way, dims)
    elif shape == BLOCK:
        t, n = ray_block(arm, way, dims)
    elif shape == HULL:
        hulls, offsets = scratch.narrowphase.hulls, scratch.narrowphase.face_offsets
        t, n = ray_polyhedron(arm, way, hulls.of[b, FIRST_FACE], hulls.of[b, LAST_FACE], hulls.normals, offsets)
    else:
        t, n = ray_ellipsoid(arm, way, dims)
    return t, qt.matvec(R, n)


@inlined
def _nearest_wall(o, d, best, scratch):
    """Nearest wall that a ray meets within the distance `best`: (t, code, normal)."""
    code, normal = NOTHING, (0.0, 0.0, 0.0)
    for wall in range(scratch.walls.shape[0]):
        t, n = ray_plane(o, d, row_vector(scratch.walls, wall, WALL_NORMAL), scratch.walls[wall, WALL_OFFSET])
        if t < best or (t == best and code == NOTHING and t < math.inf):
            best, code, normal = t, -1 - wall, n
    return best, code, normal


@kernel
def cast_ray(o, d, farthest, exclude, scratch):
    """Nearest body or wall that a ray meets within the distance `farthest`: (t [m], code, normal).

    Of bodies at equal distances the first counts, and a body counts before a wall.
    """
    best, code, normal = _nearest_wall(o, d, farthest, scratch)
    tree, inverse = scratch.tree, (safe_inverse(d[0]), safe_inverse(d[1]), safe_inverse(d[2]))
    rows = tree.child.shape[0]
    first, end = find_bodies(o, inverse, best, tree)
    for k in range(first, end):
        part = tree.item[k] - rows
        b = body_of(part, scratch)
        if b != exclude and not tree.distance[k] > best:
            t, n = _ray_body(part, o, d, scratch)
            if t < best or (t == best and t < math.inf and (code < 0 or b < code)):
                best, code, normal = t, b, n
    return (math.inf if code == NOTHING else best), code, normal


@inlined
def _unit(a):
    """Vector a divided by its length, which is not 0; if squares would over- or underflow, a is scaled first."""
    square = qt.dot(a, a)
    if not _LEAST_SQUARE < square < 1.0 / _LEAST_SQUARE:
        s = max(abs(a[0]), abs(a[1]), abs(a[2]))
        a = (a[0] / s, a[1] / s, a[2] / s)
        square = qt.dot(a, a)
    return times(1.0 / math.sqrt(square), a)


@kernel
def cast_rays_of_world(k, indices, bodies, scratch, rays, hits):
    """Cast all rays of the k-th of the worlds `indices`; write `hits`."""
    pose_world(indices[k], bodies, scratch)
    build_tree(scratch)
    x, R = (0.0, 0.0, 0.0), (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
    if rays.carrier >= 0:
        x = row_vector(bodies.state, indices[k] * bodies.shapes.shape[0] + rays.carrier, POS)
        R = row_matrix(scratch.bodies.rotation, rays.carrier)
    for r in range(rays.count):
        o = row_vector(rays.origins, k * rays.origin_rows[0] + r * rays.origin_rows[1], 0)
        d = _unit(row_vector(rays.directions, k * rays.direction_rows[0] + r * rays.direction_rows[1], 0))
        if rays.carrier >= 0:
            o, d = plus(x, qt.matvec(R, o)), qt.matvec(R, d)
        place = k * rays.count + r
        hits.distance[place], hits.hit[place], normal = cast_ray(o, d, rays.max_distance, rays.exclude, scratch)
        put_vector(hits.normal, place, 0, normal)


_for_each = for_each_world(cast_rays_of_world)


@kernel
def cast_rays(queue, indices, bodies, scratch, rays, hits):
    """Cast the rays of all places k of `indices` that the calling thread can take from `queue`."""
    _for_each(queue, (indices, bodies, scratch, rays, hits))


@entry_kernel
def first_bad_row(rows, may_vanish):
    """First row of an array (n, 3) with a number that is not finite or, unless `may_vanish`, with zeros only; or -1."""
    for i in range(rows.shape[0]):
        a = row_vector(rows, i, 0)
        size = max(abs(a[0]), abs(a[1]), abs(a[2]))
        if not (abs(a[0]) < math.inf and abs(a[1]) < math.inf and abs(a[2]) < math.inf):
            return i
        if not may_vanish and size == 0.0:
            return i
    return -1
