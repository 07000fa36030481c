"""Particle systems, and a rigid body as one of them.

The state of n particles is one vector of 6n numbers, position and velocity of
the first particle, then of the second, and so on: `pack` and `unpack` go to and
from it. Everything here is plain NumPy, written to be read and to check the
engine with. Lengths in metres, masses in kilograms, world frame.

Sources: Witkin and Baraff, *Physically Based Modeling* (SIGGRAPH course notes,
1997): "Particle System Dynamics", sections 1-2 (phase space, derivative);
"Rigid Body Simulation I", sections 2.5-2.10 (velocity of a point of a rigid
body, centre of mass, force and torque, momenta).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from physics.mass.inertia import MassProperties, check_inertia, point_cloud


def pack(positions: ArrayLike, velocities: ArrayLike) -> np.ndarray:
    """State vector (6n,) of n particles from `positions` [m] and `velocities` [m/s], both (n, 3)."""
    positions, velocities = np.asarray(positions, dtype=float), np.asarray(velocities, dtype=float)
    if positions.ndim != 2 or positions.shape[1] != 3 or positions.shape != velocities.shape:
        raise ValueError(
            f"positions and velocities are of shapes {positions.shape} and {velocities.shape};"
            " allowed is (n, 3) for both"
        )
    return np.hstack([positions, velocities]).ravel()


def unpack(state: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Positions [m] and velocities [m/s], both (n, 3), of a state vector (6n,)."""
    state = np.asarray(state, dtype=float)
    if state.ndim != 1 or state.size % 6:
        raise ValueError(f"state is of shape {state.shape}; allowed is (6n,) for n particles")
    rows = state.reshape(-1, 6)
    return rows[:, :3].copy(), rows[:, 3:].copy()


def derivative(state: ArrayLike, forces: ArrayLike, masses: ArrayLike) -> np.ndarray:
    """Time derivative of the state: x' = v, v' = f / m, particle by particle.

    Parameters
    ----------
    state : (6n,)
        As of `pack`.
    forces : (n, 3)
        Total force on each particle [N].
    masses : (n,)
        [kg].

    Returns
    -------
    (6n,) float64
        Velocities [m/s] and accelerations [m/s²], in the order of the state.
    """
    _, velocities = unpack(state)
    return pack(velocities, np.asarray(forces, dtype=float) / np.asarray(masses, dtype=float)[:, None])


def uniform_field(masses: ArrayLike, acceleration: ArrayLike) -> np.ndarray:
    """Forces m g (n, 3) [N] of a uniform field of `acceleration` (3,) [m/s²] on `masses` (n,).

    They have no torque about the centre of mass: Σ (r - c) x m g = (Σ m (r - c)) x g = 0.
    A football in flight keeps its angular momentum.
    """
    return np.outer(masses, acceleration)


def total_wrench(points: ArrayLike, forces: ArrayLike, centre: ArrayLike = (0, 0, 0)) -> tuple[np.ndarray, np.ndarray]:
    """Resultant of forces at points: total force and total torque about `centre`.

    Parameters
    ----------
    points : (n, 3)
        Points of application [m].
    forces : (n, 3)
        [N].
    centre : (3,)
        [m], the centre of mass for what drives a rigid body.

    Returns
    -------
    force, torque : (3,) float64
        Σ f [N] and Σ (p - centre) x f [N m].
    """
    arms = np.asarray(points, dtype=float) - np.asarray(centre, dtype=float)
    return np.sum(forces, axis=0, dtype=float), np.cross(arms, forces).sum(axis=0)


def total_momentum(masses: ArrayLike, velocities: ArrayLike) -> np.ndarray:
    """Linear momentum P = Σ m v (3,) [kg m/s]."""
    return np.asarray(masses, dtype=float) @ np.asarray(velocities, dtype=float)


def total_angular_momentum(
    masses: ArrayLike, positions: ArrayLike, velocities: ArrayLike, about: ArrayLike = (0, 0, 0)
) -> np.ndarray:
    """Angular momentum Σ (x - about) x m v (3,) [kg m²/s] about a fixed point `about` (3,) [m]."""
    arms = np.asarray(positions, dtype=float) - np.asarray(about, dtype=float)
    return np.asarray(masses, dtype=float) @ np.cross(arms, velocities)


def kinetic_energy(masses: ArrayLike, velocities: ArrayLike) -> float:
    """Kinetic energy Σ m v²/2 [J]."""
    return float(0.5 * np.asarray(masses, dtype=float) @ np.square(velocities).sum(axis=1))


def potential_energy(masses: ArrayLike, positions: ArrayLike, acceleration: ArrayLike) -> float:
    """Potential energy -Σ m g·x [J] in a uniform field of `acceleration` g (3,) [m/s²]; 0 at the origin."""
    return float(-np.asarray(masses, dtype=float) @ (np.asarray(positions, dtype=float) @ acceleration))


def rigid_velocities(positions: ArrayLike, centre: ArrayLike, linvel: ArrayLike, angvel: ArrayLike) -> np.ndarray:
    """Velocities v + ω x (p - centre) (n, 3) [m/s] of points of a rigid body.

    Parameters
    ----------
    positions : (n, 3)
        Where the points are [m].
    centre, linvel : (3,)
        Centre of mass [m] and its velocity v [m/s].
    angvel : (3,)
        ω [rad/s].
    """
    arms = np.asarray(positions, dtype=float) - np.asarray(centre, dtype=float)
    return np.asarray(linvel, dtype=float) + np.cross(np.asarray(angvel, dtype=float), arms)


@dataclass(frozen=True, eq=False)
class RigidCloud:
    """Rigid body made of n particles.

    Attributes
    ----------
    mass_properties : MassProperties
        Mass [kg], centre of mass [m] and inertia [kg m²] about it, world axes.
    momentum : (3,) float64
        P [kg m/s].
    angular_momentum : (3,) float64
        L about the centre of mass [kg m²/s].
    """

    mass_properties: MassProperties
    momentum: np.ndarray
    angular_momentum: np.ndarray

    @property
    def linvel(self) -> np.ndarray:
        """Velocity of the centre of mass, P / M (3,) [m/s]."""
        return self.momentum / self.mass_properties.mass

    @property
    def angvel(self) -> np.ndarray:
        """Angular velocity I⁻¹ L (3,) [rad/s]; ValueError for particles on one line, which have none."""
        inertia = check_inertia(self.mass_properties.inertia, "mass_properties.inertia")
        return np.linalg.solve(inertia, self.angular_momentum)


def as_rigid_body(positions: ArrayLike, velocities: ArrayLike, masses: ArrayLike) -> RigidCloud:
    """Mass properties and momenta of n particles taken as one rigid body.

    Parameters
    ----------
    positions, velocities : (n, 3)
        [m] and [m/s].
    masses : (n,)
        [kg], greater than 0.

    Returns
    -------
    RigidCloud
        Its `linvel` and `angvel` are those of the particles if these move rigidly,
        and otherwise those of the rigid motion with the same momenta.
    """
    properties = point_cloud(positions, masses)
    return RigidCloud(
        properties,
        total_momentum(masses, velocities),
        total_angular_momentum(masses, positions, velocities, properties.centre),
    )
