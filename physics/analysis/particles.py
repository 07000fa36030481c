"""Particle systems, and a rigid body as a system of particles.

The state of n particles is one vector of 6n numbers: position and velocity of
the first particle, then of the second, and so on. `pack` makes this vector and
`unpack` takes it apart. Everything here is plain NumPy, written to be read, and
tests compare the engine with it. Lengths are in metres, masses in kilograms,
vectors in the world frame.

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
    """Make the state vector (6n,) of n particles from `positions` [m] and `velocities` [m/s], both (n, 3)."""
    positions, velocities = np.asarray(positions, dtype=float), np.asarray(velocities, dtype=float)
    if positions.ndim != 2 or positions.shape[1] != 3 or positions.shape != velocities.shape:
        raise ValueError(
            f"positions and velocities are of shapes {positions.shape} and {velocities.shape};"
            " allowed is (n, 3) for both"
        )
    return np.hstack([positions, velocities]).ravel()


def unpack(state: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Split a state vector (6n,) into positions [m] and velocities [m/s], both (n, 3)."""
    state = np.asarray(state, dtype=float)
    if state.ndim != 1 or state.size % 6:
        raise ValueError(f"state is of shape {state.shape}; allowed is (6n,) for n particles")
    rows = state.reshape(-1, 6)
    return rows[:, :3].copy(), rows[:, 3:].copy()


def derivative(state: ArrayLike, forces: ArrayLike, masses: ArrayLike) -> np.ndarray:
    """Time derivative of the state of n particles: x' = v, v' = f / m.

    Parameters
    ----------
    state : (6n,)
        State vector from `pack`.
    forces : (n, 3)
        Total force on each particle [N].
    masses : (n,)
        Masses of the particles [kg].

    Returns
    -------
    (6n,) float64
        Velocities [m/s] and accelerations [m/s²], in the order of the state.
    """
    _, velocities = unpack(state)
    return pack(velocities, np.asarray(forces, dtype=float) / np.asarray(masses, dtype=float)[:, None])


def uniform_field(masses: ArrayLike, acceleration: ArrayLike) -> np.ndarray:
    """Forces m g (n, 3) [N] of a uniform field of `acceleration` (3,) [m/s²] on particles with `masses` (n,) [kg].

    They have no torque about the centre of mass c: Σ (r - c) x m g = (Σ m (r - c)) x g = 0.
    So gravity does not change the angular momentum of a football in flight.
    """
    return np.outer(masses, acceleration)


def total_wrench(points: ArrayLike, forces: ArrayLike, centre: ArrayLike = (0, 0, 0)) -> tuple[np.ndarray, np.ndarray]:
    """Total force, and total torque about `centre`, of forces that act at points.

    Parameters
    ----------
    points : (n, 3)
        Points p at which the forces act [m].
    forces : (n, 3)
        Forces f [N].
    centre : (3,)
        Reference point of the torque [m]; for the motion of a rigid body its centre of mass.

    Returns
    -------
    force, torque : (3,) float64
        Σ f [N] and Σ (p - centre) x f [N m].
    """
    arms = np.asarray(points, dtype=float) - np.asarray(centre, dtype=float)
    return np.sum(forces, axis=0, dtype=float), np.cross(arms, forces).sum(axis=0)


def total_momentum(masses: ArrayLike, velocities: ArrayLike) -> np.ndarray:
    """Linear momentum P = Σ m v (3,) [kg m/s] of particles with `masses` (n,) [kg] and `velocities` (n, 3) [m/s]."""
    return np.asarray(masses, dtype=float) @ np.asarray(velocities, dtype=float)


def total_angular_momentum(
    masses: ArrayLike, positions: ArrayLike, velocities: ArrayLike, about: ArrayLike = (0, 0, 0)
) -> np.ndarray:
    """Angular momentum Σ (x - about) x m v (3,) [kg m²/s] of n particles about a fixed point `about` (3,) [m].

    `masses` (n,) [kg], `positions` x (n, 3) [m], `velocities` v (n, 3) [m/s].
    """
    arms = np.asarray(positions, dtype=float) - np.asarray(about, dtype=float)
    return np.asarray(masses, dtype=float) @ np.cross(arms, velocities)


def kinetic_energy(masses: ArrayLike, velocities: ArrayLike) -> float:
    """Kinetic energy Σ m v²/2 [J] of particles with `masses` (n,) [kg] and `velocities` (n, 3) [m/s]."""
    return float(0.5 * np.asarray(masses, dtype=float) @ np.square(velocities).sum(axis=1))


def potential_energy(masses: ArrayLike, positions: ArrayLike, acceleration: ArrayLike) -> float:
    """Potential energy -Σ m g·x [J] of particles in a uniform field of `acceleration` g (3,) [m/s²]; 0 at the origin.

    `masses` (n,) [kg], `positions` x (n, 3) [m].
    """
    return float(-np.asarray(masses, dtype=float) @ (np.asarray(positions, dtype=float) @ acceleration))


def rigid_velocities(positions: ArrayLike, centre: ArrayLike, linvel: ArrayLike, angvel: ArrayLike) -> np.ndarray:
    """Velocities v + ω x (p - centre) (n, 3) [m/s] of points of a rigid body.

    Parameters
    ----------
    positions : (n, 3)
        Positions p of the points [m].
    centre, linvel : (3,)
        Centre of mass [m] and its velocity v [m/s].
    angvel : (3,)
        Angular velocity ω [rad/s].
    """
    arms = np.asarray(positions, dtype=float) - np.asarray(centre, dtype=float)
    return np.asarray(linvel, dtype=float) + np.cross(np.asarray(angvel, dtype=float), arms)


@dataclass(frozen=True, eq=False)
class RigidCloud:
    """Mass properties and momenta of n particles that are taken as one rigid body, from `as_rigid_body`.

    Attributes
    ----------
    mass_properties : MassProperties
        Mass [kg], centre of mass [m] and inertia [kg m²] about it, along the world axes.
    momentum : (3,) float64
        Linear momentum P [kg m/s].
    angular_momentum : (3,) float64
        Angular momentum L about the centre of mass [kg m²/s].
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
        """Angular velocity I⁻¹ L (3,) [rad/s]; ValueError for particles on one line, whose inertia has no inverse."""
        inertia = check_inertia(self.mass_properties.inertia, "mass_properties.inertia")
        return np.linalg.solve(inertia, self.angular_momentum)


def as_rigid_body(positions: ArrayLike, velocities: ArrayLike, masses: ArrayLike) -> RigidCloud:
    """Mass properties and momenta of n particles taken as one rigid body.

    Parameters
    ----------
    positions, velocities : (n, 3)
        Positions [m] and velocities [m/s] of the particles.
    masses : (n,)
        Masses [kg], greater than 0.

    Returns
    -------
    RigidCloud
        Rigid body with the momenta of the particles. If they move rigidly, its
        `linvel` and `angvel` describe their motion.
    """
    properties = point_cloud(positions, masses)
    return RigidCloud(
        properties,
        total_momentum(masses, velocities),
        total_angular_momentum(masses, positions, velocities, properties.centre),
    )
