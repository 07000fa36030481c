"""Free flights at the start of the tosses, before any contact: they measure gravity, noise and the centre of mass.

In flight the centre of mass follows a parabola, and the contact model has no effect. So these flights give the scale of
the recorded lengths, and the noise of the first frame: the difference between its velocities and those of the whole
flight. They also give the position of the centre of mass relative to the tracked point.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rigid_env.lab.tosses import data
from rigid_env.lab.tosses.data import SAMPLE_DT, Tosses
from rigid_env.lab.tosses.replay import Starts, attitude, corner_height

# Height of the nominal cube's lowest corner at which a flight ends [m]. It is more than the error of a measurement, and
# less than the cube falls in one frame (8 mm at 1.2 m/s).
CLEARANCE = 0.005
LEAST_FRAMES = 8  # least frames of a flight from which velocities are measured
REST_SHARE = 0.05  # share of a toss, at its end, in which the cube is at rest


@dataclass(frozen=True)
class Flight:
    """Quantities measured from the free flights.

    Attributes
    ----------
    flights : int
        Number of flights that were long enough.
    gravity : float
        Gravity in recorded lengths [m/s²].
    center_of_mass : tuple of 3 floats
        Centre of mass of the cube relative to the tracked point, body frame, recorded lengths [m].
    residual : float
        Standard deviation of the positions from the fitted parabolas [m].
    linvel_noise, angvel_noise : tuple of 3 floats
        Standard deviation of a first frame's velocity from that of the whole flight [m/s, rad/s], world frame.
    linvel_bias : tuple of 3 floats
        Mean of the same difference [m/s]; a backward difference is off by half a frame of gravity, 0.033 m/s upwards.
    """

    flights: int
    gravity: float
    center_of_mass: tuple[float, ...]
    residual: float
    linvel_noise: tuple[float, ...]
    angvel_noise: tuple[float, ...]
    linvel_bias: tuple[float, ...]


def rest_scale(tosses: Tosses) -> float:
    """Ratio of true to recorded lengths: half the nominal side over the median height of the resting cube's centre."""
    heights = [np.median(toss[-max(1, round(REST_SHARE * len(toss))) :, 2]) for toss in tosses]
    return float(data.HALF_WIDTH / np.median(heights))


def first_flight(toss: np.ndarray) -> np.ndarray:
    """Frames (n, 13) of a toss before its lowest corner first comes near the table."""
    low = toss[:, 2] - corner_height(toss[:, data.QUAT], data.SIDE)
    near = np.flatnonzero(low < CLEARANCE)
    return toss[: near[0]] if len(near) else toss


def measure_flight(tosses: Tosses) -> Flight:
    """Measure gravity, centre of mass, noise and bias in the first flights.

    The model is position = c + v t + g t²/2 + R(q) s, by least squares over all flights: each flight has its own c and
    v, and all share g and s, the vector from the centre of mass to the tracked point.

    Raises
    ------
    ValueError
        No toss has a flight of `LEAST_FRAMES`.
    """
    flights = [flight for flight in map(first_flight, tosses) if len(flight) >= LEAST_FRAMES]
    if not flights:
        raise ValueError(f"{tosses.source}: no toss begins with {LEAST_FRAMES} frames in the air; nothing to measure")
    matrix, right = (np.concatenate(part) for part in zip(*map(_equations, flights)))
    solution = np.linalg.lstsq(matrix, right, rcond=None)[0]
    offset, gravity = solution[:3], float(solution[3])
    apart = np.array([_velocity_errors(flight, gravity, offset) for flight in flights])
    noise, bias = apart.std(axis=0), apart.mean(axis=0)
    return Flight(
        flights=len(flights), gravity=gravity, center_of_mass=tuple((-offset).tolist()),
        residual=float((right - matrix @ solution).std()), linvel_noise=tuple(noise[:3].tolist()),
        angvel_noise=tuple(noise[3:].tolist()), linvel_bias=tuple(bias[:3].tolist()),
    )  # fmt: skip


def _times(flight: np.ndarray) -> np.ndarray:
    return SAMPLE_DT * np.arange(len(flight))


def _equations(flight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Linear equations of one flight of n frames: matrix (3 n, 4) and right sides (3 n,).

    The unknowns are those of `measure_flight` that all flights share: the vector s and the strength of gravity. The
    flight's own start c and velocity v are eliminated.
    """
    t, R = _times(flight), attitude(flight[:, data.QUAT]).as_matrix()
    basis, _ = np.linalg.qr(np.stack([np.ones_like(t), t], axis=1))
    rows = np.zeros((3, len(t), 4))
    rows[:, :, :3] = np.moveaxis(R, 1, 0)
    rows[2, :, 3] = -0.5 * t * t
    rows -= basis @ (basis.T @ rows)
    right = flight[:, data.POS] - basis @ (basis.T @ flight[:, data.POS])
    return rows.reshape(-1, 4), right.T.ravel()


def _velocity_errors(flight: np.ndarray, gravity: float, offset: np.ndarray) -> np.ndarray:
    """Velocity and angular velocity (6,) of a flight's first frame minus those of the whole flight, world frame."""
    t, R = _times(flight), attitude(flight[:, data.QUAT])
    spin = ((R[1:] * R[:-1].inv()).as_rotvec() / SAMPLE_DT).mean(axis=0)
    center = flight[:, data.POS] - R.apply(offset)
    center[:, 2] += 0.5 * gravity * t * t
    linvel = np.polyfit(t, center, 1)[0] + np.cross(spin, R[0].apply(offset))
    return np.concatenate((flight[0, data.LINVEL] - linvel, R[0].apply(flight[0, data.ANGVEL]) - spin))


def disturb(begin: Starts, flight: Flight, rng: np.random.Generator) -> Starts:
    """Add normal random numbers with the measurement's noise to the velocities of starts."""
    linvel = begin.linvel + rng.normal(size=begin.linvel.shape) * flight.linvel_noise
    angvel = begin.angvel + rng.normal(size=begin.angvel.shape) * flight.angvel_noise
    return Starts(begin.pos, begin.quat, linvel, angvel)
