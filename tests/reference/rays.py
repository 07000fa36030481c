"""Points at which a line meets convex bodies, by search along the line: a slow oracle with no closed form of a surface.

A body is the set of points where its gauge is at most 0: the largest height above its faces, or |A x| - 1 of an
ellipsoid. The gauge is convex, and so is its course along a line. Its minimum is found by a golden-section search, and
both ends of the part inside by bisection.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import physics
from physics.rotations import rotation_matrices

GOLDEN = (5**0.5 - 1) / 2
CUBE_FACES = np.vstack([np.eye(3), -np.eye(3)])


def gauge(body: physics.Body, pos, quat) -> Callable[[np.ndarray], float]:
    """Gauge of a body in a pose: a convex function of a point, at most 0 inside, in metres at a polyhedron."""
    R = rotation_matrices(np.asarray(quat))
    centre = np.asarray(pos) + R @ body.center
    if body.kind in ("sphere", "ellipsoid"):
        return lambda x: float(np.linalg.norm(((x - centre) @ R) / body.dimensions) - 1.0)
    if body.kind == "block":
        normals, offsets = CUBE_FACES, np.tile(body.dimensions, 2)
    else:
        shape = body.polyhedron
        normals = shape.normals
        offsets = np.array([normal @ shape.vertices[loop[0]] for normal, loop in zip(normals, shape.loops)])
    return lambda x: float((normals @ (R.T @ (x - centre)) - offsets).max())


def interval(inside: Callable[[np.ndarray], float], origin, direction, reach: float) -> tuple[float, float, float]:
    """(least gauge on the line, first and last t with a gauge of at most 0 for |t| <= reach); t is inf without any."""

    def f(t):
        return inside(origin + t * direction)

    a, b = -reach, reach
    c, d = b - GOLDEN * (b - a), a + GOLDEN * (b - a)
    fc, fd = f(c), f(d)
    for _ in range(90):
        if fc < fd:
            b, d, fd = d, c, fc
            c = b - GOLDEN * (b - a)
            fc = f(c)
        else:
            a, c, fc = c, d, fd
            d = a + GOLDEN * (b - a)
            fd = f(d)
    low = 0.5 * (a + b)
    least = f(low)
    if least > 0:
        return least, np.inf, np.inf
    return least, _crossing(f, low, -reach), _crossing(f, low, reach)


def _crossing(f, inner: float, outer: float) -> float:
    for _ in range(200):
        middle = 0.5 * (inner + outer)
        if middle in (inner, outer):
            break
        inner, outer = (middle, outer) if f(middle) <= 0 else (inner, middle)
    return inner


def first_hit(scene: physics.Scene, pos, quat, origin, direction, reach: float) -> tuple[float, int, float]:
    """(distance, code of body or wall or None, least |gauge| of a body that is nearly grazed) of a ray."""
    best, code, grazed = np.inf, None, np.inf
    for b, body in enumerate(scene.bodies):
        least, first, last = interval(gauge(body, pos[b], quat[b]), origin, direction, reach)
        grazed = min(grazed, abs(least))
        t = first if first >= 0 else last
        if 0 <= t < best:
            best, code = t, b
    for k, wall in enumerate(scene.walls):
        n = np.asarray(wall.normal)
        height, fall = n @ origin - wall.offset, -(n @ direction)
        if height >= 0 and fall > 0 and height / fall < best:
            best, code = height / fall, -1 - k
    return best, code, grazed
