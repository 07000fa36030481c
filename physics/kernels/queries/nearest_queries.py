"""Distances of pairs of bodies, the nearest body or wall to a shape, and bodies in sensors, in worlds of a batch."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from physics.compiler.decorators import if_given, inlined, kernel
from physics.kernels.math import quaternion as qt
from physics.kernels.math.vector import minus, plus, row_vector
from physics.kernels.multibody.data.contact_set import put_vector
from physics.kernels.multibody.data.parts import is_compound
from physics.kernels.parallel.work_stealing import for_each_world
from physics.kernels.queries.nearest_points import nearest_of_bodies, nearest_to_wall
from physics.kernels.queries.query_scratch import bounding_radius, pose_world
from physics.kernels.queries.ray_cast import NOTHING
from physics.kernels.state import layout as at


class Pairs(NamedTuple):
    """Pairs whose nearest points are requested, the same in all worlds."""

    first: np.ndarray  # (pairs,) int, bodies
    second: np.ndarray  # (pairs,) int, bodies, or -1 - k for wall k


class Probe(NamedTuple):
    """Shape in many poses; pose r of the k-th world has the row k * world_rows + r * pose_rows of each array."""

    shape: int  # code
    dims: tuple[float, float, float]  # half edges or semi-axes [m]
    hull_radius: float  # of the bounding sphere, if it is a hull [m]
    center: tuple[float, float, float]  # geometric centre from the place of a pose, own frame [m]
    pos: np.ndarray  # (rows, 3) places [m]
    quat: np.ndarray  # (rows, 4) attitudes
    pos_rows: tuple[int, int]  # (world_rows, pose_rows) of `pos`
    quat_rows: tuple[int, int]  # (world_rows, pose_rows) of `quat`
    count: int  # poses of a world
    max_distance: float  # [m]
    exclude: int  # body that is left out; NOTHING: none


class Region(NamedTuple):
    """Convex shape of a sensor, where it is in every world."""

    shape: int  # code
    dims: tuple[float, float, float]  # half edges or semi-axes [m]
    hull_radius: float  # of the bounding sphere, if it is a hull [m]
    center: tuple[float, float, float]  # geometric centre from the place, own frame [m]
    pos: tuple[float, float, float]  # place [m], in the frame of the carrier
    quat: tuple[float, float, float, float]  # attitude, in the frame of the carrier
    carrier: int  # body that carries the sensor; NOTHING: none
    sensor: int  # row of the results


class Found(NamedTuple):
    """Results, a row for each pair or pose of the first world, then of the second, and so on."""

    gap: np.ndarray  # (rows,) [m]; inf: nothing
    other: np.ndarray  # (rows,) int, second body, or -1 - k for wall k; NOTHING: nothing
    normal: np.ndarray  # (rows, 3) unit vector out of the second body, world frame
    point: np.ndarray  # (rows, 3) point of the first body or of the shape, world frame [m]
    other_point: np.ndarray  # (rows, 3) point of the second body, world frame [m]


@inlined
def _write(row, code, nearest, found):
    """Write the result `nearest` = (gap, n, p, q) into a row."""
    found.gap[row], found.other[row] = nearest[0], code
    put_vector(found.normal, row, 0, nearest[1])
    put_vector(found.point, row, 0, nearest[2])
    put_vector(found.other_point, row, 0, nearest[3])


@inlined
def _parts(b, scratch):
    """First part of body b and the end of its parts; of any other shape the shape alone."""
    if is_compound(b, scratch):
        return scratch.bodies.parts.span[b, 0], scratch.bodies.parts.span[b, 1]
    return b, b + 1


def _nearest_of_two(a, b, scratch):
    return nearest_of_bodies(a, b, scratch)


@if_given("scratch.bodies.parts", _nearest_of_two)
def _nearest(a, b, scratch):
    """Nearest points of bodies a and b, of all parts of compounds: (gap, n, p, q) as of `nearest_points`."""
    first, last = _parts(a, scratch)
    start, end = _parts(b, scratch)
    best = nearest_of_bodies(first, start, scratch)
    for part in range(first, last):
        for other in range(start, end):
            found = nearest_of_bodies(part, other, scratch)
            if found[0] < best[0]:
                best = found
    return best


def _nearest_to_its_wall(a, wall, scratch):
    return nearest_to_wall(a, wall, scratch)


@if_given("scratch.bodies.parts", _nearest_to_its_wall)
def _nearest_wall_point(a, wall, scratch):
    """Nearest points of body a, of all parts of a compound, and a wall: (gap, n, p, q) as of `nearest_points`."""
    first, last = _parts(a, scratch)
    best = nearest_to_wall(first, wall, scratch)
    for part in range(first, last):
        found = nearest_to_wall(part, wall, scratch)
        if found[0] < best[0]:
            best = found
    return best


@kernel
def measure_pairs_of_world(k, indices, bodies, scratch, pairs, found):
    """Find the nearest points of all pairs in the k-th of the worlds `indices`."""
    pose_world(indices[k], bodies, scratch)
    for r in range(pairs.first.shape[0]):
        a, b = pairs.first[r], pairs.second[r]
        if b < 0:
            nearest = _nearest_wall_point(a, -1 - b, scratch)
        else:
            nearest = _nearest(a, b, scratch)
        _write(k * pairs.first.shape[0] + r, b, nearest, found)


@inlined
def _pose_shape(row, x, q, shape, scratch):
    """Write a `Probe` or `Region` at the place x with the attitude q into row `row` of the bodies."""
    R, body = qt.to_matrix(q), scratch.bodies.body[row]
    body.shape = shape.shape
    body.dims[0], body.dims[1], body.dims[2] = shape.dims
    body.radius = bounding_radius(shape.shape, shape.dims, shape.hull_radius)
    for c in range(9):
        scratch.bodies.rotation[row, c] = R[c]
    put_vector(scratch.bodies.center, row, 0, plus(x, qt.matvec(R, shape.center)))


@inlined
def _pose_probe(row, place, attitude, probe, scratch):
    """Write the probe in one of its poses into row `row` of the bodies."""
    q = (probe.quat[attitude, 0], probe.quat[attitude, 1], probe.quat[attitude, 2], probe.quat[attitude, 3])
    _pose_shape(row, row_vector(probe.pos, place, 0), q, probe, scratch)


@inlined
def _pose_region(row, world, region, bodies, scratch):
    """Write the shape of a sensor, where it is in a world, into row `row` of the bodies."""
    x, q = region.pos, region.quat
    if region.carrier != NOTHING:
        i = world * bodies.shapes.shape[0] + region.carrier
        frame = (bodies.state[i, at.QUAT], bodies.state[i, at.QUAT + 1], bodies.state[i, at.QUAT + 2])
        turn = (frame[0], frame[1], frame[2], bodies.state[i, at.QUAT + 3])
        x = plus(row_vector(bodies.state, i, at.POS), qt.matvec(qt.to_matrix(turn), x))
        q = qt.multiply(turn, q)
    _pose_shape(row, x, q, region, scratch)


@inlined
def _is_beyond(a, b, distance, scratch):
    """True if the bounding spheres of two bodies are farther apart than `distance` [m]."""
    d = minus(row_vector(scratch.bodies.center, a, 0), row_vector(scratch.bodies.center, b, 0))
    far = distance + scratch.bodies.body[a].radius + scratch.bodies.body[b].radius
    return far < 0.0 or qt.dot(d, d) > far * far


@kernel
def _nearest_to_probe(probe, count, max_distance, exclude, scratch):
    """Nearest body or wall to the body in row `probe`: (code, (gap, n, p, q)).

    Of equal gaps the first body counts, and a body before a wall.
    """
    none = (0.0, 0.0, 0.0)
    best, code = (math.inf, none, none, none), NOTHING
    for b in range(count):
        if b != exclude and not _is_beyond(probe, b, min(best[0], max_distance), scratch):
            found = _nearest(probe, b, scratch)
            if found[0] <= max_distance and found[0] < best[0]:
                best, code = found, b
    for wall in range(scratch.walls.shape[0]):
        found = nearest_to_wall(probe, wall, scratch)
        if found[0] <= max_distance and found[0] < best[0]:
            best, code = found, -1 - wall
    return code, best


@kernel
def probe_world(k, indices, bodies, scratch, probe, found):
    """Find the nearest body or wall to the probe in each of its poses, in the k-th of the worlds `indices`."""
    pose_world(indices[k], bodies, scratch)
    count, row = bodies.shapes.shape[0], scratch.bodies.body.shape[0] - 1
    for r in range(probe.count):
        place = k * probe.pos_rows[0] + r * probe.pos_rows[1]
        _pose_probe(row, place, k * probe.quat_rows[0] + r * probe.quat_rows[1], probe, scratch)
        code, nearest = _nearest_to_probe(row, count, probe.max_distance, probe.exclude, scratch)
        _write(k * probe.count + r, code, nearest, found)


@kernel
def sense_world(k, indices, bodies, scratch, region, inside):
    """Note in `inside` (n, sensors, bodies) the bodies that touch a sensor's shape in the k-th of the worlds `indices`.

    Those that another shape of the sensor touches are left as they are.
    """
    pose_world(indices[k], bodies, scratch)
    row = scratch.bodies.body.shape[0] - 1
    _pose_region(row, indices[k], region, bodies, scratch)
    for b in range(bodies.shapes.shape[0]):
        is_open = b != region.carrier and not inside[k, region.sensor, b]
        if is_open and not _is_beyond(row, b, 0.0, scratch):
            inside[k, region.sensor, b] = _nearest(row, b, scratch)[0] <= 0.0


_measure_each = for_each_world(measure_pairs_of_world)
_probe_each = for_each_world(probe_world)
_sense_each = for_each_world(sense_world)


@kernel
def measure_pairs(queue, indices, bodies, scratch, pairs, found):
    """Find the nearest points of pairs at all places k of `indices` that the calling thread can take from `queue`."""
    _measure_each(queue, (indices, bodies, scratch, pairs, found))


@kernel
def probe_worlds(queue, indices, bodies, scratch, probe, found):
    """Find the nearest body or wall to a probe at all places k that the calling thread can take from `queue`."""
    _probe_each(queue, (indices, bodies, scratch, probe, found))


@kernel
def sense_worlds(queue, indices, bodies, scratch, region, inside):
    """Note the bodies that touch a sensor's shape at all places k that the calling thread can take from `queue`."""
    _sense_each(queue, (indices, bodies, scratch, region, inside))
