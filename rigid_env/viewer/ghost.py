"""Ghost of a world: the same scene at the accuracy ``reference``, with the same start and the same inputs."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable
from contextlib import nullcontext
from dataclasses import replace

import numpy as np

import physics
from physics import PRESETS
from physics.work_precision.errors import angles_between
from physics.work_precision.truth import LOOSER
from rigid_env.rendering import Frame
from rigid_env.rendering.picture import world_frame
from rigid_env.viewer.copies import fitted, warm, with_parameters
from rigid_env.viewer.listening import Call
from rigid_env.viewer.pace import Cost

REFERENCE = "reference"


class Ghost:
    """World at the accuracy `REFERENCE` that takes the same steps as another world, to show the error of that world.

    Event-driven schemes follow the true motion nearly to rounding. Other schemes, used where bodies touch each other or
    are tied together, bound only the error of each step, so the ghost's error after many steps is unknown. A second
    world with tolerances ten times as large then takes the same steps, as in
    `physics.work_precision.truth.ReferenceTruth`. The distance between the two estimates the ghost's own error.

    Parameters
    ----------
    world : World
        World that the ghost follows, a batch of one.

    Attributes
    ----------
    world : World
        World of the ghost.
    is_estimate : bool
        True if the ghost has an error of its own, so that it is only an estimate of the true motion.
    cost : Cost
        Computing time of `world` alone.
    """

    def __init__(self, world: physics.World):
        best = PRESETS[REFERENCE]
        self.world = physics.World(world.scene, dt=world.dt, accuracy=best)
        scheme = self.world.plan.scheme
        self.is_estimate = not scheme.is_event_driven
        looser = _looser(scheme.acting(best))
        self._looser = physics.World(world.scene, dt=world.dt, accuracy=looser) if self.is_estimate else None
        self.cost = Cost()
        self.start(world.snapshot())

    @property
    def _worlds(self) -> list[physics.World]:
        return [self.world] if self._looser is None else [self.world, self._looser]

    def warm(self) -> None:
        """Compile the kernel by taking a step; `start` then sets the state."""
        warm(self.world)

    def start(self, snapshot: physics.Snapshot) -> None:
        """Continue from the state of another world of the scene."""
        for world in self._worlds:
            world.restore(fitted(snapshot, world))

    def take_parameters(self, world: physics.World) -> None:
        """Copy gravity and the parameters of bodies from another world; the states stay."""
        for own in self._worlds:
            own.restore(with_parameters(own.snapshot(), world))

    def follow(self, calls: Iterable[Call]) -> None:
        """Make the same calls of `World.step` that another world has made.

        Raises
        ------
        ValueError
            A wrench that is not finite.
        """
        for call in calls:
            if call.start is not None:
                self.start(call.start)
            clock = time.perf_counter()
            _take(self.world, call)
            self.cost.add(time.perf_counter() - clock, call.steps * call.dt)
            if self._looser is not None:
                _take(self._looser, call)

    def distance(self, world: physics.World) -> tuple[float, float]:
        """Largest distance of a centre of mass from the ghost's [m], and largest angle between attitudes [rad]."""
        return distance(world, self.world)

    @property
    def own_error(self) -> float:
        """Error of the ghost: largest distance of a centre of mass from the second world [m]; NaN if not estimated."""
        return math.nan if self._looser is None else distance(self._looser, self.world)[0]

    @property
    def label(self) -> str:
        """Name of the ghost; if its motion is an estimate, followed by the largest error of that motion [m]."""
        return f"{REFERENCE}, itself within {self.own_error:.1e} m" if self.is_estimate else REFERENCE

    def snapshot(self) -> tuple[physics.Snapshot, ...]:
        """Copy of everything that decides how the ghost continues."""
        return tuple(world.snapshot() for world in self._worlds)

    def restore(self, snapshots: tuple[physics.Snapshot, ...]) -> None:
        """Continue from a result of `snapshot`."""
        for world, snapshot in zip(self._worlds, snapshots, strict=True):
            world.restore(snapshot)

    def frame(self) -> Frame:
        """Picture of the ghost's bodies, without arrows."""
        return world_frame(self.world, arrows=False)


def _take(world: physics.World, call: Call) -> None:
    """Make a recorded call of `World.step` in a world."""
    with nullcontext() if world.actuation is None else world.actuation.passed_by(call.past):
        world.step(call.wrench, call.steps, call.dt)


def _looser(acting: physics.Accuracy) -> physics.Accuracy:
    """Accuracy with tolerance and slop ten times as large."""
    return replace(acting, tolerance=LOOSER * acting.tolerance, slop=LOOSER * acting.slop)


def distance(one: physics.World, other: physics.World) -> tuple[float, float]:
    """Largest distance between centres of mass in two worlds [m], and largest angle between attitudes [rad]."""
    apart = np.linalg.norm(one.pos[0] - other.pos[0], axis=-1)
    return float(apart.max()), float(angles_between(one.quat[0], other.quat[0]).max())
