"""Distance of two symmetric convex bodies, by search over all directions: a slow oracle for `many.rounds`."""

from __future__ import annotations

import numpy as np

DIRECTIONS = 20_000
SCALES = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6)
PLANES = np.array([p for p in np.ndindex(2, 2, 2) if any(p)], dtype=float)  # a block's best direction may lie in one


def spread(count: int) -> np.ndarray:
    """Unit vectors (count, 3) evenly over the sphere (golden spiral)."""
    k = np.arange(count) + 0.5
    polar, turn = np.arccos(1 - 2 * k / count), np.pi * (1 + 5**0.5) * k
    return np.c_[np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)]


def ellipsoid_support(axes, C, n):
    """Support of an ellipsoid with the semi-axes along the columns of C, in the directions n (count, 3)."""
    return np.linalg.norm((n @ C) * axes, axis=1)


def block_support(half_edges, n):
    return np.abs(n) @ half_edges


def largest_separation(support_a, support_b, d, seed=0) -> float:
    """max over unit vectors n of n·d - s_a(n) - s_b(n) [m]: by all directions, then by ever smaller random turns.

    Off by about the square of the last turn, 1e-12 of the size of the bodies.
    """
    rng = np.random.default_rng(seed)

    def apart(n):
        return n @ d - support_a(n) - support_b(n)

    n = spread(DIRECTIONS)
    values = apart(n)
    best, at = values.max(), n[values.argmax()]
    for scale in SCALES:
        for _ in range(3):
            near = at + scale * rng.standard_normal((1000, 3))
            near = (near[None] * PLANES[:, None]).reshape(-1, 3)
            near = near[np.linalg.norm(near, axis=1) > 0.5]
            near /= np.linalg.norm(near, axis=1)[:, None]
            values = apart(near)
            if values.max() > best:
                best, at = values.max(), near[values.argmax()]
    return float(best)
