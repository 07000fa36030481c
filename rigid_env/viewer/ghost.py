"""Ghost: the same scene at the accuracy ``reference``, from the same state and with the same inputs."""

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
    """World at `REFERENCE` beside another one.

    Where bodies touch each other or are tied together, `REFERENCE` bounds the error of each step, and what becomes of
    that is not known. A second world with tolerances ten times as large then goes along, as in
    `physics.work_precision.truth.ReferenceTruth`: the distance of the two is the error that the label states.

    Parameters
    ----------
    world : World
        Of one world, which it goes along with.

    Attributes
    ----------
    world : World
    is_estimate : bool
        `REFERENCE` has an error itself here.
    cost : Cost
        Of `world` alone.
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
        """Compile the kernel; `start` undoes the step that is taken for it."""
        warm(self.world)

    def start(self, snapshot: physics.Snapshot) -> None:
        """Go on from the state of another world of the scene."""
        for world in self._worlds:
            world.restore(fitted(snapshot, world))

    def take_parameters(self, world: physics.World) -> None:
        """Take over gravity and the parameters of bodies; states stay."""
        for own in self._worlds:
            own.restore(with_parameters(own.snapshot(), world))

    def follow(self, calls: Iterable[Call]) -> None:
        """Take the same steps as another world.

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
        """Largest distance of a body's centre of mass from the ghost's [m], and largest angle between the two [rad]."""
        return distance(world, self.world)

    @property
    def own_error(self) -> float:
        """Error of the ghost itself: largest distance of a centre of mass [m]; NaN where it is no estimate."""
        return math.nan if self._looser is None else distance(self._looser, self.world)[0]

    @property
    def label(self) -> str:
        """Name of the ghost, with its own error where it has one."""
        return f"{REFERENCE}, itself within {self.own_error:.1e} m" if self.is_estimate else REFERENCE

    def snapshot(self) -> tuple[physics.Snapshot, ...]:
        """All that decides how it goes on."""
        return tuple(world.snapshot() for world in self._worlds)

    def restore(self, snapshots: tuple[physics.Snapshot, ...]) -> None:
        """Go on from a `snapshot`."""
        for world, snapshot in zip(self._worlds, snapshots, strict=True):
            world.restore(snapshot)

    def frame(self) -> Frame:
        """Picture of it, without arrows."""
        return world_frame(self.world, arrows=False)


def _take(world: physics.World, call: Call) -> None:
    """Take the steps of a call."""
    with nullcontext() if world.actuation is None else world.actuation.passed_by(call.past):
        world.step(call.wrench, call.steps, call.dt)


def _looser(acting: physics.Accuracy) -> physics.Accuracy:
    """Accuracy with tolerances ten times as large."""
    return replace(acting, tolerance=LOOSER * acting.tolerance, slop=LOOSER * acting.slop)


def distance(one: physics.World, other: physics.World) -> tuple[float, float]:
    """Largest distance of two worlds' centres of mass [m], and largest angle between their bodies [rad]."""
    apart = np.linalg.norm(one.pos[0] - other.pos[0], axis=-1)
    return float(apart.max()), float(angles_between(one.quat[0], other.quat[0]).max())
