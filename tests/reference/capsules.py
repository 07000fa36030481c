"""Distances of capsules by bounded least squares or by trying all features, and the fall of a capsule on its end."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, lsq_linear, minimize_scalar

import physics
from physics.rotations import rotation_matrices
from tests.reference.polyhedra_distance import Posed


def axis_of(capsule: physics.Capsule) -> tuple[np.ndarray, np.ndarray]:
    """Centre of a capsule, and the vector from there to an end of its axis [m]."""
    return np.array(capsule.pos), 0.5 * capsule.length * rotation_matrices(np.array(capsule.quat))[:, 1]


def _least_distance(columns, way, bounds) -> float:
    """Least |columns s - way| for s within ±bounds: a convex problem, solved by an active-set method."""
    found = lsq_linear(np.column_stack(columns), way, (-np.array(bounds), np.array(bounds)), method="bvls", tol=1e-15)
    return float(np.linalg.norm(np.column_stack(columns) @ found.x - way))


def gap_of_block(capsule: physics.Capsule, block: physics.Block) -> float:
    """Gap of a capsule and a block whose inside holds no point of the axis [m]."""
    x, u = axis_of(capsule)
    R = rotation_matrices(np.array(block.quat))
    half = 0.5 * np.array(block.size)
    return _least_distance([u, *(-R).T], np.array(block.pos) - x, [1, *half]) - capsule.radius


def gap_of_capsule(capsule: physics.Capsule, other: physics.Capsule) -> float:
    """Gap of two capsules [m]."""
    (x, u), (y, v) = axis_of(capsule), axis_of(other)
    return _least_distance([u, -v], y - x, [1, 1]) - capsule.radius - other.radius


def _distance_to_ellipsoid(y, semi_axes) -> float:
    """Distance of a point outside from an ellipsoid, in its frame, 0 inside.

    The nearest point has the coordinates a² y/(t + a²), for the root t > 0 of Σ (a y/(t + a²))² = 1.
    """
    squares = np.asarray(semi_axes) ** 2

    def excess(t):
        return float(np.sum(squares * (y / (t + squares)) ** 2)) - 1.0

    if excess(0.0) <= 0.0:
        return 0.0
    t = brentq(excess, 0.0, np.linalg.norm(y) * max(semi_axes) + 1.0, xtol=1e-15, rtol=1e-15)
    return float(np.linalg.norm(y - squares * y / (t + squares)))


def gap_of_ellipsoid(capsule: physics.Capsule, ball: physics.Ellipsoid) -> float:
    """Gap of a capsule and an ellipsoid whose inside holds no point of the axis [m]."""
    (x, u), R = axis_of(capsule), rotation_matrices(np.array(ball.quat))

    def distance(s):
        return _distance_to_ellipsoid((x + s * u - np.array(ball.pos)) @ R, ball.semi_axes)

    inner = minimize_scalar(distance, bounds=(-1, 1), method="bounded", options={"xatol": 1e-12}).fun
    return min(inner, distance(-1.0), distance(1.0)) - capsule.radius


def axis_as_polyhedron(capsule: physics.Capsule) -> Posed:
    """Axis of a capsule as a polyhedron of one edge, for `polyhedra_distance`."""
    x, u = axis_of(capsule)
    return Posed(np.array([x - u, x + u]), [], np.array([[0, 1]]))


@dataclass(frozen=True)
class Tipping:
    """A capsule tips over: its lower hemisphere rolls on a floor, in a plane.

    Let a be the angle of the axis with the upward direction, r the radius, l half the axis. The centre of the ball is r
    above the floor and moves by r a, and the centre of mass is l from it along the axis. With its velocity and the spin
    a', the energy is

        T + V = m (r² + 2 r l cos a + l²) a'²/2 + I a'²/2 + m g l cos a,

    from which Lagrange's equation follows.
    """

    radius: float
    half: float
    mass: float
    inertia: float  # across the axis, about the centre of mass [kg m²]
    gravity: float

    def state(self, start: float, time: float) -> tuple[np.ndarray, float]:
        """Place (2,) of the centre of mass [m] and angle [rad] after `time`, from rest at the angle `start`."""
        m, r, l = self.mass, self.radius, self.half

        def rate(_, y):
            a, w = y
            inertia = m * (r * r + 2 * r * l * np.cos(a) + l * l) + self.inertia
            return w, (m * r * l * np.sin(a) * w * w + m * self.gravity * l * np.sin(a)) / inertia

        a = solve_ivp(rate, (0, time), (start, 0.0), method="DOP853", rtol=1e-13, atol=1e-14).y[0, -1]
        return np.array([r * (a - start) + l * np.sin(a), r + l * np.cos(a)]), float(a)


@dataclass(frozen=True)
class Rocking:
    """A capsule rocks across a fixed one, in the plane across that one's axis, without slip.

    Let a be the angle of the normal from the upward direction, R the radius of the fixed capsule, r that of the other.
    The contact is R a from the middle of the rocking capsule. Its centre is then at

        (R + r) (sin a, cos a) - R a (cos a, -sin a),

    and moves at a' √(r² + R² a²). So the energy is

        T + V = (m r² + m R² a² + I) a'²/2 + m g ((R + r) cos a + R a sin a),

    from which Lagrange's equation follows. With r < R it oscillates.
    """

    fixed_radius: float
    radius: float
    mass: float
    inertia: float  # across the axis, about the centre of mass [kg m²]
    gravity: float

    def place(self, a: float) -> np.ndarray:
        """Centre (2,) at the angle a [m]."""
        R, sine, cosine = self.fixed_radius, np.sin(a), np.cos(a)
        return (R + self.radius) * np.array([sine, cosine]) - R * a * np.array([cosine, -sine])

    def angle(self, start: float, time: float) -> float:
        """Angle [rad] after `time`, from rest at the angle `start`."""
        m, R, r, g = self.mass, self.fixed_radius, self.radius, self.gravity

        def rate(_, y):
            a, w = y
            push = m * g * (R * a * np.cos(a) - r * np.sin(a)) + m * R * R * a * w * w
            return w, -push / (self.inertia + m * r * r + m * R * R * a * a)

        return float(solve_ivp(rate, (0, time), (start, 0.0), method="DOP853", rtol=1e-13, atol=1e-14).y[0, -1])
