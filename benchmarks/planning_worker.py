"""Worker of `benchmarks.planning`: returns of sequences of actions in MuJoCo, one request after another.

It runs as a file, with the Python that has the peer: ``python -I planning_worker.py``. It needs NumPy and MuJoCo, and
mjbatch where that is the engine. The first line of its input is a `Setup` as JSON; the answer is a line of JSON with
versions, or with an ``error``. Each request then is `START` float64 of where the block is and the actions; its answer
is the seconds that they took, and the returns, as float64.
"""

from __future__ import annotations

import importlib
import json
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib import metadata
from typing import BinaryIO

import numpy as np

POSE, MOTION, NUMBERS = 7, 6, 6  # of a free body in MuJoCo, and of an action
START = POSE + MOTION + 4  # the body's pose and motion, x and z of the goal, the potential, the hold
PACKAGES = {"rollout": "mujoco", "batch": "mujoco", "mjbatch": "mjbatch"}  # of each engine


@dataclass(frozen=True)
class Setup:
    """Sizes and constants of a worker, JSON-able.

    Attributes
    ----------
    engine : {"rollout", "batch", "mjbatch"}
        `mujoco.rollout`, `mujoco.batch` or mjbatch.
    model : str
        MJCF of one free body.
    samples, horizon, steps, threads : int
        Sequences, control steps of each, physics steps in one of them, threads.
    limits : list of float
        Longest force [N] and torque [N m] of an action.
    reward : dict of str to float
        Constants of the reward of BlockReach, under their names in `rigid_env.tasks.kernels`.
    """

    engine: str
    model: str
    samples: int
    horizon: int
    steps: int
    threads: int
    limits: list[float]
    reward: dict[str, float]


class RolloutEngine:
    """States at the ends of control steps, by `mujoco.rollout`: all wrenches are handed over at once."""

    def __init__(self, setup: Setup):
        import mujoco
        from mujoco import rollout

        self.model, self.steps = mujoco.MjModel.from_xml_string(setup.model), setup.steps
        self.data = [mujoco.MjData(self.model) for _ in range(setup.threads)]
        self.rollout = rollout.Rollout(nthread=setup.threads)
        self.spec = int(mujoco.mjtState.mjSTATE_XFRC_APPLIED)
        self.control = np.zeros((setup.samples, setup.horizon, setup.steps, self.model.nbody, NUMBERS))
        self.states = np.empty((setup.samples, setup.horizon * setup.steps, 1 + POSE + MOTION))

    def __call__(self, start: np.ndarray, wrenches: np.ndarray) -> np.ndarray:
        """(samples, horizon, 13) poses and motions after wrenches (samples, horizon, 6) from one `start` (13,)."""
        self.control[..., -1, :] = wrenches[:, :, None]
        initial = np.concatenate(([0.0], start))[None]
        control = self.control.reshape(*self.states.shape[:2], -1)
        self.rollout.rollout(self.model, self.data, initial, control, control_spec=self.spec, state=self.states)
        return self.states[:, self.steps - 1 :: self.steps, 1:]


class BatchEngine:
    """States at the ends of control steps, by `mujoco.batch` or mjbatch: a call for each control step."""

    def __init__(self, setup: Setup):
        import mujoco

        batch = importlib.import_module("mjbatch" if setup.engine == "mjbatch" else "mujoco.batch")
        model = mujoco.MjModel.from_xml_string(setup.model)
        self.batch, self.steps = batch.Batch(model, setup.samples, setup.threads), setup.steps
        self.pose, self.motion, self.force, self.warm = (
            self.batch.bind(name) for name in ("qpos", "qvel", "xfrc_applied", "qacc_warmstart")
        )
        self.states = np.empty((setup.samples, setup.horizon, POSE + MOTION))

    def __call__(self, start: np.ndarray, wrenches: np.ndarray) -> np.ndarray:
        """As of `RolloutEngine`."""
        self.pose[:], self.motion[:], self.warm[:] = start[:POSE], start[POSE:], 0.0
        for k in range(wrenches.shape[1]):
            self.force[:, -1] = wrenches[:, k]
            self.batch.step(nstep=self.steps)
            self.states[:, k, :POSE], self.states[:, k, POSE:] = self.pose, self.motion
        return self.states


def make_wrenches(actions: np.ndarray, limits: np.ndarray) -> np.ndarray:
    """Forces and torques of actions (..., 6): numbers clipped to ±1, then each vector to its ball [N, N m]."""
    vectors = np.clip(actions, -1.0, 1.0).reshape(*actions.shape[:-1], 2, 3)
    lengths = np.sqrt(np.einsum("...i,...i->...", vectors, vectors))
    return (vectors * (limits / np.maximum(lengths, 1.0))[..., None]).reshape(actions.shape)


def sum_rewards(start: np.ndarray, states: np.ndarray, actions: np.ndarray, of: dict[str, float]) -> np.ndarray:
    """Sums of the rewards of BlockReach, each up to the end of its episode.

    Parameters
    ----------
    start : (START,) float64
    states : (samples, horizon, 13) float64
        At the ends of the control steps.
    actions : (samples, horizon, 6) float64
        That led there.
    of : dict of str to float
        Constants of the reward.

    Returns
    -------
    (samples,) float64
    """
    goal, potential, hold = start[POSE + MOTION : -2], start[-2], start[-1]
    distance = _length(goal - states[..., 0:3:2])
    speed, spin = _length(states[..., 7:10]), _length(states[..., 10:13])
    is_met = (distance <= of["REACH_TOLERANCE"]) & (speed <= of["REST_SPEED"]) & (spin <= of["REST_SPIN"])
    times = np.arange(float(states.shape[1]))
    # a hold lasts since the last control step on which goal and rest were not met
    holds = times - np.maximum.accumulate(np.where(is_met, -1.0 - hold, times), axis=1)
    potentials = -of["REACH_VALUE"] * distance - of["BRAKE_VALUE"] * speed * np.exp(-distance / of["BRAKE_RANGE"])
    potentials += of["HOLD_VALUE"] * holds / of["HOLD_STEPS"]
    efforts = (np.clip(actions, -1.0, 1.0) ** 2).sum(axis=-1)
    is_success = holds >= of["HOLD_STEPS"]
    rewards = np.diff(potentials, axis=1, prepend=potential) - of["STEP_COST"] - of["ACTION_COST"] * efforts
    rewards += of["SUCCESS_BONUS"] * is_success
    rewards[:, 1:] *= ~np.logical_or.accumulate(is_success, axis=1)[:, :-1]
    return rewards.sum(axis=1)


def _length(vectors: np.ndarray) -> np.ndarray:
    return np.sqrt(np.einsum("...i,...i->...", vectors, vectors))


class Rollouts:
    """Returns of sequences of actions in one engine.

    Parameters
    ----------
    setup : Setup
    """

    def __init__(self, setup: Setup):
        self.limits, self.reward = np.array(setup.limits), setup.reward
        self.states: Callable = (RolloutEngine if setup.engine == "rollout" else BatchEngine)(setup)

    def __call__(self, start: np.ndarray, actions: np.ndarray) -> np.ndarray:
        """(samples,) returns of actions (samples, horizon, 6) from one `start` (START,)."""
        states = self.states(start[: POSE + MOTION], make_wrenches(actions, self.limits))
        return sum_rewards(start, states, actions, self.reward)


def serve(requests: BinaryIO, answers: BinaryIO) -> None:
    """Answer requests until there are none."""
    setup = Setup(**json.loads(requests.readline()))
    try:
        rollouts = Rollouts(setup)
        names = {"numpy", "mujoco", PACKAGES[setup.engine]}
        told = {"versions": {name: metadata.version(name) for name in sorted(names)}}
    except ImportError as error:
        rollouts, told = None, {"error": str(error)}
    answers.write(json.dumps(told).encode() + b"\n")
    answers.flush()
    shape = (setup.samples, setup.horizon, NUMBERS)
    size = 8 * (START + int(np.prod(shape)))
    while rollouts is not None and len(request := requests.read(size)) == size:
        numbers = np.frombuffer(request)
        began = time.perf_counter()
        returns = rollouts(numbers[:START], numbers[START:].reshape(shape))
        seconds = time.perf_counter() - began
        answers.write(np.concatenate(([seconds], returns)).tobytes())
        answers.flush()


if __name__ == "__main__":
    # messages of the engine go to the errors: the output holds answers alone
    with os.fdopen(os.dup(sys.stdout.fileno()), "wb") as answers:
        os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
        serve(sys.stdin.buffer, answers)
