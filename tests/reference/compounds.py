"""Mass properties of compounds by quadrature over the volumes of their parts, and compounds taken apart."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial import Delaunay

import physics
from physics.rotations import product, rotation_matrices

# Gauss-Legendre rule of 5 points on [-1, 1], exact up to degree 9; second moments of all parts have degree 4 at most.
NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)

# Points and weight of the rule of four points on a tetrahedron, exact up to degree 2.
NEAR, FAR = (5 - 5**0.5) / 20, (5 + 3 * 5**0.5) / 20


def _grid(*axes):
    """Points (n, len(axes)) of a product rule, and their weights; an axis is (nodes, weights)."""
    points = np.stack(np.meshgrid(*(nodes for nodes, _ in axes), indexing="ij"), axis=-1).reshape(-1, len(axes))
    weights = np.prod(np.stack(np.meshgrid(*(w for _, w in axes), indexing="ij"), axis=-1), axis=-1).ravel()
    return points, weights


def _disks(heights, weights, squares):
    """Points and weights of disks about y at these heights, of these squares of radii."""
    s, phi = 0.5 * (NODES + 1), 2 * np.pi * np.arange(6) / 6
    found = []
    for y, w, square in zip(heights, weights, squares):
        rho = np.sqrt(square) * s
        ring, weight = _grid((np.arange(5), 0.5 * WEIGHTS * s * square * w), (phi, np.full(6, 2 * np.pi / 6)))
        rho = rho[ring[:, 0].astype(int)]
        found.append((np.stack([rho * np.cos(ring[:, 1]), np.full(len(rho), y), rho * np.sin(ring[:, 1])], 1), weight))
    return np.concatenate([p for p, _ in found]), np.concatenate([w for _, w in found])


def cloud(part: physics.Body):
    """Points (n, 3) of a part, and weights (n,), whose sums are integrals over its volume; frame of the part."""
    if isinstance(part, physics.Block):
        points, weights = _grid(*((0.5 * edge * NODES, 0.5 * edge * WEIGHTS) for edge in part.size))
        return points + part.center, weights
    if isinstance(part, physics.Capsule):
        r, half = part.radius, 0.5 * part.length
        cap = 0.5 * r * (NODES + 1)
        pieces = [_disks(half * NODES, half * WEIGHTS, np.full(5, r * r))]
        pieces += [_disks(side * (half + cap), 0.5 * r * WEIGHTS, r * r - cap * cap) for side in (1, -1)]
        return np.concatenate([p for p, _ in pieces]), np.concatenate([w for _, w in pieces])
    if isinstance(part, physics.Hull):
        points = np.array(part.points)
        corners = points[Delaunay(points).simplices]
        volumes = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6
        mix = np.full((4, 4), NEAR) + (FAR - NEAR) * np.eye(4)
        return (mix @ corners).reshape(-1, 3) - part.centroid, np.repeat(volumes / 4, 4)
    axes = np.full(3, part.radius) if isinstance(part, physics.Sphere) else np.array(part.semi_axes)
    points, weights = _disks(NODES, WEIGHTS, 1 - NODES**2)
    return points * axes, weights * np.prod(axes)


def mass_properties(compound: physics.Compound):
    """Mass, centre of mass and inertia tensor about it, in the frame of the parts."""
    clouds = []
    for part in compound.parts:
        points, weights = cloud(part)
        R = rotation_matrices(np.array(part.quat))
        clouds.append((part.pos + points @ R.T, weights * part.mass / weights.sum()))
    x, m = np.concatenate([p for p, _ in clouds]), np.concatenate([w for _, w in clouds])
    centre = m @ x / m.sum()
    r = x - centre
    return m.sum(), centre, np.einsum("n,nij->ij", m, np.einsum("n,ij->nij", (r * r).sum(1), np.eye(3))) - (m * r.T) @ r


def taken_apart(compound: physics.Compound) -> list[physics.Body]:
    """Parts of a compound as bodies of their own, where they are in the world."""
    R, quat = rotation_matrices(np.array(compound.quat)), np.array(compound.quat)
    return [
        replace(
            placed.part, pos=np.array(compound.pos) + R @ (placed.place - placed.R @ placed.part.center),
            quat=product(quat, np.array(placed.part.quat)),
        )
        for placed in compound.placed_parts
    ]  # fmt: skip
