"""First flights of the tosses, before any contact: they measure gravity, noise and the cube.

In flight the centre of mass follows a parabola and nothing of the contact model acts. So the first flights of the
tosses to fit give the scale of the recorded lengths, the noise of the first frame (how far its velocities are from
those of the whole flight), and how far the tracked point is from the centre of mass.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from rigid_env.lab.tosses import data
from rigid_env.lab.tosses.data import SAMPLE_DT, Tosses
from rigid_env.lab.tosses.replay import Starts, attitude, corner_height

# A flight ends when the lowest corner of the nominal cube is this near to the table [m]: further than a frame's
# measurement is off, nearer than what a frame of fall takes (8 mm at 1.2 m/s).
CLEARANCE = 0.005
LEAST_FRAMES = 8  # of a flight that says something about velocities
REST_SHARE = 0.05  # of the last frames of a toss, in which it is at rest


@dataclass(frozen=True)
class Flight:
    """Quantities measured from the flights.

    Attributes
    ----------
    flights : int
        How many were long enough.
    gravity : float
        In recorded lengths [m/s²].
    center_of_mass : tuple of 3 floats
        Of the cube relative to the tracked point, body frame, recorded lengths [m].
    residual : float
        Standard deviation of the positions from these parabolas [m].
    linvel_noise, angvel_noise : tuple of 3 floats
        Standard deviation of a first frame's velocity from that of the whole flight [m/s, rad/s], world frame.
    linvel_bias : tuple of 3 floats
        Mean of the same [m/s]; a backward difference is half a frame of gravity off, 0.033 m/s upwards.
    """

    flights: int
    gravity: float
    center_of_mass: tuple[float, ...]
    residual: float
    linvel_noise: tuple[float, ...]
    angvel_noise: tuple[float, ...]
    linvel_bias: tuple[float, ...]

    def to_dict(self) -> dict:
        """For JSON."""
        return asdict(self)


def rest_scale(tosses: Tosses) -> float:
    """Ratio of true to recorded lengths: half the nominal side over the median height of the resting cube's centre."""
    heights = [np.median(toss[-max(1, round(REST_SHARE * len(toss))) :, 2]) for toss in tosses]
    return float(data.HALF_WIDTH / np.median(heights))


def first_flight(toss: np.ndarray) -> np.ndarray:
    """The frames (n, 13) of a toss before its lowest corner first comes near the table."""
    low = toss[:, 2] - corner_height(toss[:, data.QUAT], data.SIDE)
    near = np.flatnonzero(low < CLEARANCE)
    return toss[: near[0]] if len(near) else toss


def measure_flight(tosses: Tosses) -> Flight:
    """Measure gravity, noise and drift in the first flights.

    Position = c + v t + g t²/2 + R(q) s, least squares over all flights for c and v of each and g and s of all: the
    tracked point is at s from the centre of mass.

    Raises
    ------
    ValueError
        No toss with a flight of `LEAST_FRAMES`.
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
    """Rows (3 n, 4) for (s, g) and right sides (3 n,) of one flight, with its own c and v projected out."""
    t, R = _times(flight), attitude(flight[:, data.QUAT]).as_matrix()
    basis, _ = np.linalg.qr(np.stack([np.ones_like(t), t], axis=1))
    rows = np.zeros((3, len(t), 4))
    rows[:, :, :3] = np.moveaxis(R, 1, 0)
    rows[2, :, 3] = -0.5 * t * t
    rows -= basis @ (basis.T @ rows)
    right = flight[:, data.POS] - basis @ (basis.T @ flight[:, data.POS])
    return rows.reshape(-1, 4), right.T.ravel()


def _velocity_errors(flight: np.ndarray, gravity: float, offset: np.ndarray) -> np.ndarray:
    """Velocity and angular velocity (6,) of the first frame minus those of the whole flight, world frame."""
    t, R = _times(flight), attitude(flight[:, data.QUAT])
    spin = ((R[1:] * R[:-1].inv()).as_rotvec() / SAMPLE_DT).mean(axis=0)
    center = flight[:, data.POS] - R.apply(offset)
    center[:, 2] += 0.5 * gravity * t * t
    linvel = np.polyfit(t, center, 1)[0] + np.cross(spin, R[0].apply(offset))
    return np.concatenate((flight[0, data.LINVEL] - linvel, R[0].apply(flight[0, data.ANGVEL]) - spin))


def disturb(begin: Starts, flight: Flight, rng: np.random.Generator) -> Starts:
    """Starts with velocities changed by normal random numbers of the measurement's noise."""
    linvel = begin.linvel + rng.normal(size=begin.linvel.shape) * flight.linvel_noise
    angvel = begin.angvel + rng.normal(size=begin.angvel.shape) * flight.angvel_noise
    return Starts(begin.pos, begin.quat, linvel, angvel)
