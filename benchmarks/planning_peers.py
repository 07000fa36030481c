"""Peers of `benchmarks.planning`: our planner, with returns that another process finds in MuJoCo."""

from __future__ import annotations

import contextlib
import json
import subprocess
import tempfile
from dataclasses import asdict
from pathlib import Path

import numpy as np

from agents.planner import Planner, PlannerSettings
from benchmarks import planning_worker
from benchmarks.planning_worker import NUMBERS, Setup
from benchmarks.processes import PATIENCE, killed_after, wait_for_end
from physics.kernels.state import layout as at
from physics.rotations import rotation_matrices
from physics.world.snapshot import KEPT
from rigid_env.lab.measure.mujoco_scene import model_xml
from rigid_env.lab.measure.timing import Stopwatch
from rigid_env.tasks import kernels
from rigid_env.tasks import layout as col
from rigid_env.tasks.block_reach import BlockReach
from rigid_env.tasks.state import TaskState

ENGINES = {"rollout": "mujoco.rollout", "batch": "mujoco.batch", "mjbatch": "mjbatch"}
REWARD = (
    "REACH_TOLERANCE", "REST_SPEED", "REST_SPIN", "HOLD_STEPS", "SUCCESS_BONUS", "STEP_COST", "ACTION_COST",
    "HOLD_VALUE", "REACH_VALUE", "BRAKE_VALUE", "BRAKE_RANGE",
)  # fmt: skip


def make_setup(engine: str, settings: PlannerSettings, threads: int) -> Setup:
    """Setup of a worker for BlockReach at its defaults."""
    task = BlockReach()
    return Setup(
        engine, model_xml(), settings.samples, settings.horizon, task.frame_skip, threads, task.limits[0].tolist(),
        {name: getattr(kernels, name) for name in REWARD},
    )  # fmt: skip


def start_of(state: TaskState) -> np.ndarray:
    """Pose and motion of a block, and its reward so far, as a worker takes them.

    Parameters
    ----------
    state : TaskState
        Of one world of BlockReach.

    Returns
    -------
    (START,) float64
        Place [m], quaternion, linear velocity [m/s], angular velocity in the body frame [rad/s], x and z of the goal
        [m], the potential and the hold of the reward.
    """
    row, record = state.world.arrays[KEPT.index("state")][0], state.arrays["record"][0]
    spin = rotation_matrices(row[at.QUAT : at.QUAT + 4]).T @ row[at.ANGVEL : at.ANGVEL + 3]
    return np.concatenate([
        row[at.POS : at.POS + 3], row[at.QUAT : at.QUAT + 4], row[at.LINVEL : at.LINVEL + 3], spin,
        record[col.GOAL : col.GOAL + 2], record[[col.POTENTIAL, col.HOLD]],
    ])  # fmt: skip


class Worker:
    """A process that rolls out in MuJoCo; leaving ``with`` ends it.

    Parameters
    ----------
    python : path
        Of the interpreter that has the engine.
    setup : Setup

    Attributes
    ----------
    versions : dict of str
        Of the engine's packages.

    Raises
    ------
    ValueError
        This interpreter does not have the engine.
    """

    def __init__(self, python: str | Path, setup: Setup):
        self.setup = setup
        self._folder = tempfile.TemporaryDirectory()  # MuJoCo may leave a log there
        found = self._begin([str(python), "-I", str(Path(planning_worker.__file__).resolve())])
        if "error" in found:
            self.close()
            name = ENGINES[setup.engine]
            raise ValueError(f"the Python for {name} is {python} ({found['error']}); allowed is one that has {name}")
        self.versions = found["versions"]

    def _begin(self, command: list[str]) -> dict:
        """Start the process; returns its versions, or an error."""
        self._process = None
        try:
            self._process = subprocess.Popen(
                command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, cwd=self._folder.name
            )
            return json.loads(self._ask(json.dumps(asdict(self.setup)).encode() + b"\n", None))
        except OSError as error:
            return {"error": str(error)}
        except ValueError:
            return {"error": "it gave no answer"}

    def __call__(self, start: np.ndarray, actions: np.ndarray) -> tuple[float, np.ndarray]:
        """Seconds that a rollout and its rewards took in the worker, and the returns.

        Parameters
        ----------
        start : (START,) float64
        actions : (samples, horizon, 6) float64

        Returns
        -------
        float, (samples,) float64
        """
        shape = (self.setup.samples, self.setup.horizon, NUMBERS)
        if actions.shape != shape:
            raise ValueError(f"actions has shape {actions.shape}; allowed is {shape}")
        size = 8 * (1 + self.setup.samples)
        answer = self._ask(np.concatenate((start, actions.ravel())).tobytes(), size)
        if len(answer) != size:
            raise RuntimeError(f"the worker of {ENGINES[self.setup.engine]} ended; its message stands above")
        numbers = np.frombuffer(answer)
        return float(numbers[0]), numbers[1:]

    def _ask(self, request: bytes, size: int | None) -> bytes:
        """Answer of this size, or a line; empty where the worker ends, or is killed after `PATIENCE`."""
        with killed_after(self._process, PATIENCE):
            try:
                self._process.stdin.write(request)
                self._process.stdin.flush()
            except BrokenPipeError:
                return b""
            return self._process.stdout.readline() if size is None else self._process.stdout.read(size)

    def close(self) -> None:
        """End the process."""
        if self._process is not None:
            with contextlib.suppress(BrokenPipeError):
                self._process.stdin.close()  # no more requests, so it ends
            wait_for_end(self._process)
            self._process.stdout.close()
        self._folder.cleanup()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()


class PeerPlanner(Planner):
    """The planner of BlockReach with a worker's returns.

    Parameters
    ----------
    worker : Worker
    settings : PlannerSettings
    seed : int

    Attributes
    ----------
    on_the_way : float
        Time that requests and answers took to and from the worker, all together [s].
    """

    def __init__(self, worker: Worker, settings: PlannerSettings, seed: int = 0):
        super().__init__(BlockReach, settings, seed, accuracy="fast")
        self.worker, self.on_the_way = worker, 0.0

    def returns(self, state: TaskState, actions: np.ndarray) -> np.ndarray:
        start = start_of(state)
        with Stopwatch() as watch:
            seconds, returns = self.worker(start, actions)
        self.on_the_way += watch.seconds - seconds
        return returns
