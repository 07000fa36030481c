"""Replay measured tosses: each from its first frame, with the same physical parameters for all."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

import physics
from physics.annotations import Preset
from rigid_env.lab.tosses import data
from rigid_env.lab.tosses.data import SAMPLE_DT, Tosses

# Number of tosses in a batch. They have similar lengths, since a batch runs until its longest toss ends.
BATCH = 50


@dataclass(frozen=True)
class Cube:
    """Physical parameters of the cube and the table, the same for every toss.

    Parameters
    ----------
    friction, restitution : float
        Coefficients.
    side : float
        Edge of the cube [m].
    inertia : float
        Moment of inertia about every axis, at the nominal mass [kg m²]. Only the ratio to the mass has an effect.
    gravity : float
        [m/s²].
    table : float
        Height of the table [m].
    heavy_x, heavy_y, heavy_z : float
        Centre of mass relative to the cube's centre, which is tracked, body frame [m].
    """

    friction: float = 0.18
    restitution: float = 0.1
    side: float = data.SIDE
    inertia: float = data.INERTIA
    gravity: float = data.GRAVITY
    table: float = 0.0
    heavy_x: float = 0.0
    heavy_y: float = 0.0
    heavy_z: float = 0.0

    @property
    def center_of_mass(self) -> np.ndarray:
        """Centre of mass (3,) relative to the cube's centre, body frame [m]."""
        return np.array([self.heavy_x, self.heavy_y, self.heavy_z])

    def scene(self) -> physics.Scene:
        """Scene of the cube above the table; z is up."""
        body = physics.Block(
            size=(self.side,) * 3, mass=data.MASS, pos=(0.0, 0.0, self.table + self.side),
            center=-self.center_of_mass, inertia_body=(self.inertia,) * 3,
        )  # fmt: skip
        effects = [
            physics.Gravity((0.0, 0.0, -self.gravity)),
            physics.Contact(restitution=self.restitution),
            physics.Friction(self.friction),
        ]
        return physics.Scene([body], [physics.HalfSpace((0.0, 0.0, 1.0), self.table)], effects)


@dataclass(frozen=True)
class Recording:
    """Measurement model of the recorded numbers, the same for all tosses.

    Parameters
    ----------
    length_scale : float
        True length per recorded length; 1 takes the recording as it is.
    is_midframe : bool
        True: the velocity of a frame, a backward difference, is that of half a frame earlier, and gravity acts for this
        half frame. False: it is the velocity at the frame.
    """

    length_scale: float = 1.0
    is_midframe: bool = False

    def lengths(self, states: np.ndarray) -> np.ndarray:
        """Convert recorded states (frames, 13) to true lengths."""
        scaled = states.copy()
        scaled[:, data.POS] *= self.length_scale
        scaled[:, data.LINVEL] *= self.length_scale
        return scaled


@dataclass(frozen=True)
class Starts:
    """States from which tosses are simulated, world frame.

    Attributes
    ----------
    pos, quat, linvel, angvel : (tosses, 3|4|3|3) float64
        States in true lengths [m, -, m/s, rad/s].
    """

    pos: np.ndarray
    quat: np.ndarray
    linvel: np.ndarray
    angvel: np.ndarray


def attitude(quat: np.ndarray) -> Rotation:
    """Convert quaternions (n, 4), w first, to rotations of SciPy."""
    return Rotation.from_quat(np.roll(quat, -1, axis=-1))


def corner_height(quat: np.ndarray, side: float) -> np.ndarray:
    """Vertical distance (n,) of a cube's lowest corner below its centre [m], for attitudes (n, 4); z is up."""
    return 0.5 * side * np.abs(attitude(quat).as_matrix()[:, 2]).sum(axis=1)


def starts(tosses: Tosses, cube: Cube, recording: Recording) -> Starts:
    """Starting states of tosses, from the first frame of each, which is the only frame that a replay uses."""
    first = recording.lengths(tosses.first)
    quat, linvel = first[:, data.QUAT], first[:, data.LINVEL].copy()
    if recording.is_midframe:
        linvel[:, 2] -= 0.5 * SAMPLE_DT * cube.gravity
    return Starts(first[:, data.POS], quat, linvel, attitude(quat).apply(first[:, data.ANGVEL]))


def sunken(begin: Starts, cube: Cube) -> np.ndarray:
    """Depth (tosses,) of the lowest corner below the table at the start [m]; 0 if it is above."""
    return np.maximum(cube.table - begin.pos[:, 2] + corner_height(begin.quat, cube.side), 0.0)


def replay(
    lengths: np.ndarray, begin: Starts, cube: Cube, accuracy: Preset | physics.Accuracy = "balanced", threads: int = 1
) -> tuple[np.ndarray, float]:
    """Simulate tosses from their starts, and sample them at the times of the recording.

    A cube that starts below the table is lifted until it touches it (`sunken`), since the engine refuses to start
    inside a wall.

    Parameters
    ----------
    lengths : (tosses,) int
        Frames of each toss, the start included.
    begin : Starts
    cube : Cube
    accuracy : str or Accuracy
        Accuracy of the simulation, whose step is the time between two frames.
    threads : int

    Returns
    -------
    poses : (sum of lengths, 7) float64
        Position of the centre [m] and quaternion, toss after toss, in true lengths.
    us : float
        Wall-clock time of the steps alone, per simulated second of one toss [µs].

    Raises
    ------
    ValueError
        A parameter that the engine refuses.
    """
    scene = cube.scene()
    offsets = np.concatenate(([0], np.cumsum(lengths)))
    poses = np.empty((offsets[-1], 7))
    pos = begin.pos.copy()
    pos[:, 2] += sunken(begin, cube)
    seconds = simulated = 0.0
    for chosen in batches(lengths):
        world = physics.World(scene, worlds=len(chosen), dt=SAMPLE_DT, accuracy=accuracy, threads=threads)
        arm = attitude(begin.quat[chosen]).apply(cube.center_of_mass)
        linvel = begin.linvel[chosen] + np.cross(begin.angvel[chosen], arm)
        world.set_state(
            (pos[chosen] + arm)[:, None], begin.quat[chosen, None], linvel[:, None], begin.angvel[chosen, None]
        )
        table, spent = _watch(world, int(lengths[chosen].max()))
        seconds += spent
        simulated += len(chosen) * (len(table) - 1) * SAMPLE_DT
        for column, i in enumerate(chosen):
            poses[offsets[i] : offsets[i + 1]] = table[: lengths[i], column]
    poses[:, :3] -= attitude(poses[:, 3:]).apply(cube.center_of_mass)
    return poses, 1e6 * seconds / simulated


def batches(lengths: np.ndarray) -> Iterator[np.ndarray]:
    """Yield indices of tosses in groups of similar length."""
    order = np.argsort(-np.asarray(lengths), kind="stable")
    return iter(np.array_split(order, -(-len(order) // BATCH)))


def _watch(world: physics.World, frames: int) -> tuple[np.ndarray, float]:
    """Step a world; returns poses (frames, worlds, 7), the present ones first, and the time of the steps [s]."""
    step = physics.Stepper(world)
    table = np.empty((frames, world.worlds, 7))
    seconds = 0.0
    for k in range(frames):
        if k > 0:
            start = time.perf_counter()
            step()
            seconds += time.perf_counter() - start
        table[k, :, :3], table[k, :, 3:] = world.pos[:, 0], world.quat[:, 0]
    return table, seconds
