"""Tosses made by the engine itself, and the measured ones where they are."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rigid_env.lab.tosses import data
from rigid_env.lab.tosses.replay import Cube, Starts, attitude, replay

MEASURED = Path(__file__).parents[3] / "shared" / "data" / "cube_tosses.npz"
FRAMES = 70


def make_tosses(count: int, cube: Cube, seed: int = 0) -> data.Tosses:
    """Tosses of a cube as the engine simulates them, 0.15 to 0.25 m above the table at the start."""
    rng = np.random.default_rng(seed)
    pos = np.column_stack([rng.normal(size=(count, 2)), rng.uniform(0.15, 0.25, count)])
    quat = np.roll(Rotation.random(count, random_state=seed).as_quat(), 1, axis=1)
    begin = Starts(pos, quat, rng.normal(0.0, 0.7, (count, 3)), rng.normal(0.0, 4.0, (count, 3)))
    lengths = np.full(count, FRAMES)
    poses, _ = replay(lengths, begin, cube)
    parts = []
    for i, rows in enumerate(poses.reshape(count, FRAMES, 7)):
        states = np.zeros((FRAMES, data.STATE_SIZE))
        states[:, :7] = rows
        states[1:, data.LINVEL] = np.diff(rows[:, :3], axis=0) / data.SAMPLE_DT
        states[0, data.LINVEL] = begin.linvel[i]
        states[:, data.ANGVEL] = attitude(rows[:, 3:]).inv().apply(begin.angvel[i])
        parts.append(states)
    return data.join(parts, np.arange(count), "made by the engine")


@pytest.fixture(scope="session")
def true_cube() -> Cube:
    return Cube(friction=0.25, restitution=0.3)


@pytest.fixture(scope="session")
def made(true_cube) -> data.Tosses:
    """24 tosses of `true_cube`."""
    return make_tosses(24, true_cube)


@pytest.fixture
def npz(made, tmp_path) -> Path:
    """`made`, as a file."""
    path = tmp_path / "made.npz"
    np.savez(path, states=made.states, offsets=made.offsets, source_index=made.numbers)
    return path


@pytest.fixture(scope="session")
def measured() -> data.Tosses:
    """The real tosses; skips where they are not."""
    if not MEASURED.exists():
        pytest.skip(f"{MEASURED.name} is not there")
    return data.load(MEASURED)
