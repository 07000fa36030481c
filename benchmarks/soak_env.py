"""Environments under an agent that pushes with all its strength: nothing breaks, nothing is given that was not earned.

Rewards and successes are computed here from the states of the world and the documented formulas, by NumPy.
"""

from __future__ import annotations

import time
from pathlib import Path

import gymnasium as gym
import numpy as np
from scipy.spatial.transform import Rotation

import physics
import rigid_env  # noqa: F401 (registers the environments)
from rigid_env.tasks import layout as col

ENVS = {"fast": 64, "balanced": 64, "precise": 32, "reference": 32}  # worlds by preset: events take longer
HOLD_STEPS, BONUS = 10, 5.0
PERSISTENT = 60  # control steps for which a direction is held
DEEP = 0.02  # bounding radii that a block may go into a wall: 0.06 m of the default one
ROUNDING = 1e-9  # of a reward: sums of a dozen numbers of order ten
# Of a reward that knows an angle by its cosine, once by the kernel and once from SciPy's matrix. Each is a sum of
# products (2 eps) of a quaternion whose square is 1 to 4 eps: 12 eps between them, which at an angle of 0 are
# √(24 eps) = 7.3e-8 rad, at a weight of 2/rad in each of two potentials, and as much again by what multiplies it.
ANGLE_ROUNDING = 6e-7


def soak(name: str, accuracy: str, seconds: float, seed: int, keep: Path | None, tick) -> dict:
    """Push for so many seconds: counts of control steps, episodes, successes and of what went wrong."""
    folder = None if keep is None else keep / f"{name.split('/')[-1]}-{accuracy}"
    envs = gym.make_vec(
        name, num_envs=ENVS.get(accuracy, 16), accuracy=accuracy, friction=(0.1, 1.0), restitution=(0.0, 1.0),
        mass=(0.1, 100.0), size=((0.5, 0.5, 0.5), (5.0, 3.0, 2.0)), dump_faults=folder,
        autoreset_mode="Disabled",
    )  # fmt: skip
    rng = np.random.default_rng(seed)
    obs, _ = envs.reset(seed=seed)
    judge = Judge(envs.unwrapped.task)
    found = {"steps": 0, "episodes": 0, "successes": 0, "not_ok": 0, "wrong": {}}
    pusher = Pusher(rng, envs.num_envs)
    envs.unwrapped.task.world.step(dt=1e-9)  # compiles
    envs.reset(seed=seed)
    judge.begin(np.arange(envs.num_envs))
    deadline = time.monotonic() + seconds
    try:
        while time.monotonic() < deadline:
            action = pusher.action()
            obs, reward, terminated, truncated, info = envs.step(action)
            for what, count in judge.wrongs(envs, obs, reward, terminated, action).items():
                found["wrong"][what] = found["wrong"].get(what, 0) + count
            found["steps"] += envs.num_envs
            found["successes"] += int(terminated.sum())
            found["not_ok"] += int((info["physics_status"] != physics.Status.OK).sum())
            ended = terminated | truncated
            if ended.any():
                found["episodes"] += int(ended.sum())
                envs.reset(options={"reset_mask": ended})
                judge.begin(np.flatnonzero(ended))
            found["largest_reward_error"] = judge.largest
            tick(f"{name} {found['steps']} steps, {sum(found['wrong'].values())} wrong")
    except KeyboardInterrupt:
        pass
    envs.close()
    return found


class Pusher:
    """Actions of full strength: fresh ones, ones held for long, and ones held into a corner of the box."""

    def __init__(self, rng: np.random.Generator, count: int):
        self._rng, self._count, self._held, self._k = rng, count, np.zeros((count, 6)), 0

    def action(self) -> np.ndarray:
        """(count, 6) float32 in ±1; a third of the worlds each way."""
        rng = self._rng
        if self._k % PERSISTENT == 0:
            self._held = rng.choice([-1.0, 1.0], (self._count, 6))
            corner = np.arange(self._count) % 3 == 2
            self._held[corner, 1] = -1.0
            self._held[corner, 3:] *= rng.random((int(corner.sum()), 3)) < 0.3
        self._k += 1
        fresh = rng.uniform(-1.0, 1.0, self._held.shape)
        return np.where((np.arange(self._count) % 3 == 0)[:, None], fresh, self._held).astype(np.float32)


class Judge:
    """Rewards and successes of a batch, computed from states."""

    def __init__(self, task):
        self.task = task
        self.potential = self._potential(np.zeros(task.worlds))[0]
        self.hold = np.zeros(task.worlds)
        self.largest = 0.0  # error of a reward so far, relative to one and its size

    def begin(self, rows: np.ndarray) -> None:
        """These worlds start a new episode."""
        self.hold[rows] = 0.0
        self.potential[rows] = self._potential(self.hold)[0][rows]

    def _potential(self, hold) -> tuple[np.ndarray, np.ndarray]:
        """(potential, whether goal and rest are met) by the formulas in the documentation of `rigid_env.envs`."""
        world, record = self.task.world, self.task.record
        speed, spin = np.linalg.norm(world.linvel[:, 0], axis=1), np.linalg.norm(world.angvel[:, 0], axis=1)
        is_still = (speed <= 0.1) & (spin <= 0.1)
        if self.task.error_name == "distance":
            d = np.hypot(*(record[:, col.GOAL : col.GOAL + 2] - world.pos[:, 0, [0, 2]]).T)
            return -0.5 * d - 0.2 * speed * np.exp(-d / 2) + hold / HOLD_STEPS, is_still & (d <= 0.3)
        a = self.angle()
        return -2 * a - 0.1 * (speed + spin) * np.exp(-a / 0.3) + hold / HOLD_STEPS, is_still & (a <= 0.1)

    def angle(self) -> np.ndarray:
        """(worlds,) between the outward normal of the target face and straight down [rad]."""
        face = self.task.record[:, col.FACE].astype(int)
        axes = Rotation.from_quat(self.task.world.quat[:, 0], scalar_first=True).as_matrix()
        sign = np.where(face % 2 == 1, 1.0, -1.0)
        height = sign * axes[np.arange(len(face)), 1, face // 2]
        return np.arccos(np.clip(-height, -1.0, 1.0))

    def wrongs(self, envs, obs, reward, terminated, action) -> dict[str, int]:
        """Count the worlds in which a control step went wrong, by kind."""
        task, world = self.task, self.task.world
        met = self._potential(self.hold)[1]
        hold = np.where(met, np.minimum(self.hold + 1, HOLD_STEPS), 0.0)
        potential = self._potential(hold)[0]
        success = hold >= HOLD_STEPS
        cost = 0.01 + 0.0005 * (np.clip(action.astype(float), -1, 1) ** 2).sum(axis=1)
        expected = potential - self.potential - cost + BONUS * success
        self.potential, self.hold = potential, hold
        depth = -physics.diagnose(world).gap[:, 0] / np.linalg.norm(task.record[:, col.HALF : col.HALF + 3], axis=1)
        loose = ANGLE_ROUNDING if task.error_name == "angle" else ROUNDING
        error = np.abs(reward - expected) / (1 + np.abs(expected))
        self.largest = max(self.largest, float(error.max()))
        state = np.concatenate([world.pos, world.quat, world.linvel, world.angvel], axis=-1)[:, 0]
        found = {
            "state not finite": ~np.isfinite(state).all(axis=1),
            "observation outside its space": np.full(len(reward), not envs.observation_space.contains(obs)),
            "escaped": depth > 1.0,
            "deep in a wall": (depth > DEEP) & (depth <= 1.0),
            "reward not earned": ~(error <= loose),
            "success not earned": np.asarray(terminated) != success,
        }
        return {what: int(wrong.sum()) for what, wrong in found.items() if wrong.any()}
