"""Workloads of our engine as callables: each call does the work once and returns steps per second.

`mujoco_scene` has the same work under the same names for MuJoCo.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import physics
from physics import scenes
from rigid_env.lab.measure.timing import Stopwatch

STEP = 0.005  # step of both engines [s]
HOLD = 25  # steps that a shove lasts
FLIGHT_STEPS = 2000  # steps of one flight; in longer ones MuJoCo's Euler integrator gains too much energy
FORCE = 0.9 * scenes.MASS * scenes.GRAVITY  # largest force along each axis, with which the block cannot fly [N]
TORQUE = 60.0  # largest torque about each axis [N m]
DROP_HEIGHTS = (3.2, 5.0)  # range of heights of the blocks' centres in the batch; corners are 3.08 m from them [m]
DROP_WIDTH = 6.0  # the batch's blocks start at |x| and |z| below this [m]
LANDING_STEPS = 400  # steps before the batch is timed: two seconds


@dataclass(frozen=True)
class Sizes:
    """Size of the work in one run.

    Attributes
    ----------
    flights : int
        Flights of `FLIGHT_STEPS` steps.
    rest_steps : int
        Steps at rest.
    shoves : int
        Random wrenches, held for `HOLD` steps each.
    worlds, batch_steps, threads : int
        Worlds, steps and threads of the batch.
    """

    flights: int = 20
    rest_steps: int = 40_000
    shoves: int = 400
    worlds: int = 1024
    batch_steps: int = 100
    threads: int = 2


FULL = Sizes()
QUICK = Sizes(flights=1, rest_steps=1000, shoves=20, worlds=32, batch_steps=5)


def random_wrenches(count: int, worlds: int = 1, seed: int = 2) -> np.ndarray:
    """Draw wrenches (count, worlds, 1, 6) [N, N m], uniform up to `FORCE` and `TORQUE` along each axis."""
    limits = np.array([FORCE] * 3 + [TORQUE] * 3)
    return np.random.default_rng(seed).uniform(-limits, limits, (count, worlds, 1, 6))


def random_poses(worlds: int, seed: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """Draw positions (worlds, 1, 3) [m] above the floor, and uniform unit quaternions (worlds, 1, 4)."""
    rng = np.random.default_rng(seed)
    pos = rng.uniform(-DROP_WIDTH, DROP_WIDTH, (worlds, 1, 3))
    pos[:, :, 1] = rng.uniform(*DROP_HEIGHTS, (worlds, 1))
    quat = rng.standard_normal((worlds, 1, 4))
    return pos, quat / np.linalg.norm(quat, axis=-1, keepdims=True)


class Steps:
    """Work of any world: a number of steps from its start."""

    def __init__(self, world: physics.World, steps: int):
        self.world, self.steps, self.start = world, steps, world.snapshot()

    def __call__(self) -> float:
        self.world.restore(self.start)
        with Stopwatch() as watch:
            self.world.step(steps=self.steps)
        return self.steps / watch.seconds


class Flight:
    """Work of the block in free flight: it tumbles high above the floor, `FLIGHT_STEPS` steps at a time."""

    def __init__(self, accuracy, sizes: Sizes = FULL):
        self.world = physics.World(scenes.flight(), dt=STEP, accuracy=accuracy)
        self.start, self.flights = self.world.snapshot(), sizes.flights

    def __call__(self) -> float:
        watch = Stopwatch()
        for _ in range(self.flights):
            self.world.restore(self.start)
            with watch:
                self.world.step(steps=FLIGHT_STEPS)
        return self.flights * FLIGHT_STEPS / watch.seconds


class Rest:
    """Workload for timing: the 5 x 3 x 2 block at rest on a face, with four contacts."""

    def __init__(self, accuracy, sizes: Sizes = FULL):
        self.world = physics.World(scenes.rest(), dt=STEP, accuracy=accuracy)
        self.steps = sizes.rest_steps
        self.report = self.world.step()

    def __call__(self) -> float:
        with Stopwatch() as watch:
            self.report = self.world.step(steps=self.steps)
        return self.steps / watch.seconds

    def notes(self) -> dict:
        """Number of contacts, their total force over the weight, and residual, solver and status of the last run."""
        points, forces = self.world.contacts()
        return {
            "contacts": len(points),
            "force_over_weight": float(forces.sum(axis=0)[1] / (scenes.MASS * scenes.GRAVITY)),
            "residual": float(self.report.residual[0]),
            "solver": physics.Solver(int(self.report.solver[0])).name.lower(),
            "status": physics.Status(int(self.report.status[0])).name.lower(),
        }


class Shove:
    """Work of the block under random wrenches, each held for `HOLD` steps; every run starts from the same state."""

    def __init__(self, accuracy, sizes: Sizes = FULL):
        self.world = physics.World(scenes.shove(), dt=STEP, accuracy=accuracy)
        self.start, self.wrenches = self.world.snapshot(), random_wrenches(sizes.shoves)
        self.stepper = physics.Stepper(self.world, steps=HOLD)

    def __call__(self) -> float:
        self.world.restore(self.start)
        with Stopwatch() as watch:
            for wrench in self.wrenches:
                self.stepper.wrench[:] = wrench
                self.stepper()
        return len(self.wrenches) * HOLD / watch.seconds

    def notes(self) -> dict:
        """Shares of wrenches after which the block touches a wall, and of steps not converged, with worst residual.

        They are measured in a further run.
        """
        self.world.restore(self.start)
        touching, unconverged, worst = 0, 0, 0.0
        for wrench in self.wrenches:
            report = self.world.step(wrench, steps=HOLD)
            touching += bool(self.world.touching())
            unconverged += int(report.unconverged[0])
            worst = max(worst, float(report.residual[0]))
        steps = len(self.wrenches) * HOLD
        return {
            "share_in_contact": touching / len(self.wrenches),
            "share_unconverged": unconverged / steps,
            "residual": worst,
        }


class Batch:
    """Work of many blocks that have fallen from random poses; each gets a new random wrench in every step."""

    def __init__(self, accuracy, sizes: Sizes = FULL):
        self.world = physics.World(
            scenes.shove(), worlds=sizes.worlds, dt=STEP, accuracy=accuracy, threads=sizes.threads
        )
        pos, quat = random_poses(sizes.worlds)
        self.world.set_state(pos=pos, quat=quat)
        self.world.step(steps=LANDING_STEPS)
        self.start = self.world.snapshot()
        self.wrenches = random_wrenches(sizes.batch_steps, sizes.worlds)

    def __call__(self) -> float:
        self.world.restore(self.start)
        with Stopwatch() as watch:
            for wrench in self.wrenches:
                self.world.step(wrench)
        return self.wrenches.shape[0] * self.wrenches.shape[1] / watch.seconds
