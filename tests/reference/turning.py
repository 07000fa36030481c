"""Test whether bodies that turn freely meet, by looking very often: a slow oracle that shares nothing with the engine.

Free motion of a symmetric top is in closed form (Landau and Lifshitz, *Mechanics*, section 33): its axis goes about L
at |L|/I_t, and the body turns about that axis at ω_a (1 - I_a/I_t) besides. Its centre is on the parabola. The distance
of a block from a wall or from a ball is in closed form, too. Two convex polyhedra are apart by the largest separation
along the normals of their faces and the products of their edges (separating axes); negative: that overlap, along the
axis where it is least.

The least distance over a time is looked for at `LOOKS` moments, then twice more around the `BEST` smallest of them.
A distance changes by at most the speed of a point, so that between two of N looks over a turn of Θ it can fall by
(|v| T + Θ R)/(2N): with N = 1500, Θ = 9 and R = 1 m by 3e-3 m, after two refinements with 60 looks over two intervals
by 3e-6 m.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

LOOKS, FINER, BEST = 1500, 60, 4
FAR = 0.01  # [m]


@dataclass(frozen=True)
class Top:
    """A symmetric top in free flight, its axis the first of the body frame; lists of them where arrays have rows.

    Parameters
    ----------
    along, across : float
        Moments of inertia about the axis and across it [kg m²].
    pos, linvel, angvel : (n, 3)
        At t = 0, world frame.
    quat : (n, 4)
        (w, x, y, z), body to world.
    gravity : (3,)
        [m/s²].
    """

    along: float
    across: float
    pos: np.ndarray
    quat: np.ndarray
    linvel: np.ndarray
    angvel: np.ndarray
    gravity: np.ndarray

    def at(self, k: int, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Places (T, 3) and rotations (T, 3, 3) of number k at the times t (T,)."""
        x = self.pos[k] + t[:, None] * self.linvel[k] + 0.5 * t[:, None] ** 2 * self.gravity
        start = Rotation.from_quat(self.quat[k][[1, 2, 3, 0]])
        body = start.inv().apply(self.angvel[k])
        L = start.apply(np.array([self.along, self.across, self.across]) * body)
        own = body[0] * (1 - self.along / self.across)
        about = Rotation.from_rotvec(t[:, None] * L / self.across)
        spin = Rotation.from_rotvec(t[:, None] * np.array([own, 0.0, 0.0]))
        return x, (about * start * spin).as_matrix()


def box_corners(size) -> np.ndarray:
    """Corners (8, 3) of a block with these edges."""
    return np.array(list(product(*((-0.5 * s, 0.5 * s) for s in size))))


@dataclass(frozen=True)
class Polyhedron:
    """Corners (v, 3), unit normals (f, 3) of faces and unit directions (e, 3) of edges, body frame."""

    corners: np.ndarray
    normals: np.ndarray
    edges: np.ndarray


def polyhedron(points) -> Polyhedron:
    """The convex hull of some points."""
    points = np.asarray(points, dtype=float)
    hull = ConvexHull(points)
    sides = {tuple(sorted(pair)) for s in hull.simplices for pair in ((s[0], s[1]), (s[1], s[2]), (s[0], s[2]))}
    edges = np.array([points[b] - points[a] for a, b in sides])
    return Polyhedron(points[hull.vertices], _unlike(hull.equations[:, :3]), _unlike(edges))


def _unlike(rows) -> np.ndarray:
    """Unit vectors of rows, without those that are parallel to an earlier one."""
    kept: list[np.ndarray] = []
    for row in rows / np.linalg.norm(rows, axis=1)[:, None]:
        if all(abs(row @ other) < 1 - 1e-12 for other in kept):
            kept.append(row)
    return np.array(kept)


def apart_from_wall(x, R, corners, normal, offset) -> np.ndarray:
    """Distance (T,) of the lowest corner from a wall."""
    return x @ normal - offset + np.einsum("tij,vj,i->tv", R, corners, normal).min(axis=1)


def apart_from_ball(x, R, half, center, radius) -> np.ndarray:
    """Distance (T,) of a block with half edges `half` from a ball; inside the block down to minus the nearest face."""
    local = np.abs(np.einsum("tji,tj->ti", R, np.asarray(center) - x)) - half
    outside = np.linalg.norm(np.maximum(local, 0.0), axis=1)
    return outside + np.minimum(local.max(axis=1), 0.0) - radius


def ellipsoid_from_wall(x, R, axes, normal, offset) -> np.ndarray:
    """Distance (T,) of an ellipsoid with these semi-axes from a wall."""
    return x @ normal - offset - np.linalg.norm(axes * np.einsum("tji,j->ti", R, normal), axis=1)


def ellipsoid_from_ball(x, R, axes, center, radius) -> np.ndarray:
    """Distance (T,) of an ellipsoid from a ball; minus the radius where the ball's centre is inside.

    The nearest point y of a point p outside is y_i = a_i² p_i/(a_i² + t) with Σ (a_i p_i/(a_i² + t))² = 1: a sum that
    falls with t >= 0, which is found by halving.
    """
    p, a = np.einsum("tji,tj->ti", R, np.asarray(center) - x), np.asarray(axes, dtype=float)
    low, high = np.zeros(len(p)), a.max() * np.linalg.norm(p, axis=1)
    for _ in range(60):
        t = 0.5 * (low + high)
        is_short = (((a * p) / (a**2 + t[:, None])) ** 2).sum(axis=1) > 1
        low, high = np.where(is_short, t, low), np.where(is_short, high, t)
    y = a**2 * p / (a**2 + low[:, None])
    is_outside = ((p / a) ** 2).sum(axis=1) > 1
    return np.where(is_outside, np.linalg.norm(p - y, axis=1), 0.0) - radius


def apart_from_small(x, R, half, y, S, b: Polyhedron) -> np.ndarray:
    """`apart` of a block (half edges `half`): of a ball around b where that is `FAR` away, which is no more."""
    d = np.array(apart_from_ball(x, R, half, y, np.linalg.norm(b.corners, axis=1).max()))
    near = d < FAR
    if near.any():
        d[near] = apart(x[near], R[near], polyhedron(box_corners(2 * half)), y[near], S[near], b)
    return d


def apart(x, R, a: Polyhedron, y, S, b: Polyhedron) -> np.ndarray:
    """Largest separation (T,) of two polyhedra by their separating axes."""
    A = x[:, None] + np.einsum("tij,vj->tvi", R, a.corners)
    B = y[:, None] + np.einsum("tij,vj->tvi", S, b.corners)
    e, f = np.einsum("tij,vj->tvi", R, a.edges), np.einsum("tij,vj->tvi", S, b.edges)
    axes = [np.einsum("tij,vj->tvi", R, a.normals), np.einsum("tij,vj->tvi", S, b.normals)]
    crossed = np.cross(e[:, :, None], f[:, None]).reshape(len(x), -1, 3)
    size = np.linalg.norm(crossed, axis=2, keepdims=True)
    axes.append(np.where(size > 1e-9, crossed / np.maximum(size, 1e-9), axes[0][:, :1]))
    n = np.concatenate(axes, axis=1)
    p, q = np.einsum("tvi,tni->tnv", A, n), np.einsum("tvi,tni->tnv", B, n)
    return np.maximum(p.min(2) - q.max(2), q.min(2) - p.max(2)).max(axis=1)


def least(distance: Callable[[np.ndarray], np.ndarray], duration: float) -> tuple[float, float]:
    """(least distance over the time from 0 to `duration`, first distance): see the module."""
    t = np.linspace(0.0, duration, LOOKS)
    d = distance(t)
    found, width = d.min(), t[1]
    near = t[np.argsort(d)[:BEST]]
    for _ in range(2):
        t = np.clip((near[:, None] + np.linspace(-width, width, FINER)).ravel(), 0.0, duration)
        d2 = distance(t)
        found, width = min(found, d2.min()), 2 * width / (FINER - 1)
        near = t[np.argsort(d2)[:BEST]]
    return float(found), float(d[0])
