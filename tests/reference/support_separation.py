"""Separation of two convex bodies from their support functions alone, by a search over all directions.

Along a unit vector n out of the second body the two are apart by σ(n) = n·(x - y) - s_1(-n) - s_2(n), with centres x
and y and support functions s. The largest σ is the distance of the bodies; if it is negative, the shortest way that
moves them apart. The search samples the sphere, then cones about the best samples, each of which shrinks where it finds
nothing better. It needs neither derivatives nor features, so that kinks of a support function do not matter.
"""

from __future__ import annotations

import numpy as np

import physics
from physics.rotations import rotation_matrices

SAMPLES, STARTS, TRIES, SHRINK, ROUNDS = 4000, 8, 60, 0.85, 250


def support(body: physics.Body, n: np.ndarray) -> np.ndarray:
    """Support function of a body about its position, for directions n (..., 3) of any length, world frame [m]."""
    local = n @ rotation_matrices(np.array(body.quat))
    d = body.dimensions
    if body.kind == "block":
        return np.abs(local) @ d
    if body.kind == "hull":
        return (local @ (body.polyhedron.vertices + np.asarray(body.center)).T).max(axis=-1)
    if body.kind == "ellipsoid":
        return np.linalg.norm(local * d, axis=-1)
    size = np.linalg.norm(n, axis=-1)
    if body.kind == "sphere":
        return d[0] * size
    along = np.abs(local[..., 1])
    if body.kind == "capsule":
        return 0.5 * body.length * along + body.radius * size
    return 0.5 * body.height * along + body.radius * np.hypot(local[..., 0], local[..., 2])


def along(one: physics.Body, other: physics.Body, n: np.ndarray) -> np.ndarray:
    """Separation of two bodies along unit vectors n (..., 3) out of the second one [m]."""
    return n @ (np.array(one.pos) - np.array(other.pos)) - support(one, -n) - support(other, n)


def separation(one: physics.Body, other: physics.Body) -> tuple[float, np.ndarray]:
    """Largest separation of two bodies [m], negative if they overlap, and its unit vector out of the second one."""
    rng = np.random.default_rng(0)
    n = _unit(rng.normal(size=(SAMPLES, 3)))
    found = along(one, other, n)
    best, value = n[np.argsort(-found)[:1]], np.sort(found)[-1:]
    for k in np.argsort(-found):  # starts that are no neighbours of each other
        if len(best) == STARTS:
            break
        if (best @ n[k]).max() < 0.97:
            best, value = np.vstack((best, n[k])), np.append(value, found[k])
    width = np.full(len(best), 0.3)
    for _ in range(ROUNDS):
        tries = _unit(best[:, None] + width[:, None, None] * rng.normal(size=(len(best), TRIES, 3)))
        found = along(one, other, tries)
        k, rows = found.argmax(axis=1), np.arange(len(best))
        better = found[rows, k] > value
        best[better], value[better] = tries[rows, k][better], found[rows, k][better]
        width[~better] *= SHRINK
    k = value.argmax()
    return float(value[k]), best[k]


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v, axis=-1, keepdims=True)
