"""Fixtures that the tests of the environments share."""

from __future__ import annotations

import numpy as np
import pytest

from rigid_env.envs.block_reach import BlockReachEnv, BlockReachVectorEnv
from rigid_env.envs.block_reorient import BlockReorientEnv, BlockReorientVectorEnv

IDS = ("rigid_env/BlockReach-v0", "rigid_env/BlockReorient-v0")


@pytest.fixture(autouse=True)
def no_display(monkeypatch):
    """Windows open in memory."""
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")


@pytest.fixture(params=IDS)
def env_id(request) -> str:
    return request.param


@pytest.fixture(params=[BlockReachEnv, BlockReorientEnv])
def env_class(request):
    return request.param


@pytest.fixture(params=[BlockReachVectorEnv, BlockReorientVectorEnv])
def vector_class(request):
    return request.param


def random_actions(rng: np.random.Generator, steps: int, worlds: int) -> np.ndarray:
    """(steps, worlds, 6) float32; bold enough to throw the block about."""
    return rng.uniform(-1.0, 1.0, (steps, worlds, 6)).astype(np.float32)


def push(obs: np.ndarray) -> np.ndarray:
    """A hand-written controller for BlockReach: (..., 6) actions from (..., 24) observations.

    Pushes along the error of the velocity, which should be 1.5 / s times the offset but never above 3 m/s; at
    least as hard as friction (0.5 of the weight) holds. Lets go within half the tolerance.
    """
    offset, velocity = 5.0 * obs[..., :2], 5.0 * obs[..., [5, 7]]
    distance = np.linalg.norm(offset, axis=-1, keepdims=True)
    error = offset * np.minimum(1.5, 3.0 / np.maximum(distance, 1e-6)) - velocity
    size = np.linalg.norm(error, axis=-1, keepdims=True)
    action = np.zeros((*obs.shape[:-1], 6), dtype=np.float32)
    action[..., [0, 2]] = np.where(distance > 0.15, error / np.maximum(size, 1e-6) * np.minimum(0.5 + size, 1.0), 0.0)
    return action
