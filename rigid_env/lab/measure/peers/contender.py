"""Interface of a peer, and its contender in a measurement beside our own engine."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

import physics
from physics.work_precision.contender import TooSlow
from physics.work_precision.errors import mechanical_energy

# Longest run of a peer: one that takes longer is on no front, and a measurement has to end [s].
LIMIT = 10.0

State = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


class Unsupported(Exception):
    """Error of a peer that cannot express a scene; the message says why."""


def refuse_meetings(scene: physics.Scene) -> None:
    """Refuse scenes whose bodies may meet, for a peer that gets contact with walls only.

    Raises
    ------
    Unsupported
        Bodies of the scene touch each other.
    """
    contact = scene.effect(physics.Contact)
    if contact is not None and contact.between_bodies and len(scene.bodies) > 1:
        raise Unsupported("contact between bodies is not handed to this engine")


class Run(Protocol):
    """A scene in a peer, at one setting and one step."""

    def restart(self) -> None:
        """Return to the scene's start and clear the peer's memory."""

    def advance(self, steps: int) -> None:
        """Take steps in the engine's quickest way."""

    def state(self) -> State:
        """pos (bodies, 3) [m], quat (bodies, 4), linvel (bodies, 3) [m/s], angvel (bodies, 3) [rad/s].

        In our conventions: of the centre of mass, world frame, quaternion (w, x, y, z).
        """


class Engine(Protocol):
    """A peer.

    Attributes
    ----------
    name, version : str
    """

    name: str
    version: str

    def settings(self, scene: physics.Scene) -> Mapping[str, Mapping]:
        """Options by name of the setting, the engine's defaults first."""

    def open(self, scene: physics.Scene, dt: float, **options) -> Run:
        """Build a scene.

        Raises
        ------
        Unsupported
            The engine cannot express it.
        """


@dataclass(frozen=True)
class PeerContender:
    """A peer at one setting and one step: a `physics.work_precision.contender.Contender`.

    Parameters
    ----------
    peer : Engine
    scene : Scene
    setting : str
    options : mapping
    dt : float
        [s].
    """

    peer: Engine
    scene: physics.Scene
    setting: str
    options: Mapping = field(repr=False)
    dt: float

    @property
    def engine(self) -> str:
        """Name of the peer."""
        return self.peer.name

    def watch(self, steps: int) -> physics.Trajectory:
        """Samples at the start and after each step; a peer has neither events nor reports.

        Raises
        ------
        TooSlow
            After `LIMIT`.
        """
        run = self._open()
        samples, end = [run.state()], time.monotonic() + LIMIT
        for k in range(steps):
            if time.monotonic() > end:
                raise TooSlow(f"{k * self.dt:.3g} s simulated in {LIMIT:g} s")
            run.advance(1)
            samples.append(run.state())
        pos, quat, linvel, angvel = (np.array(column) for column in zip(*samples))
        with np.errstate(all="ignore"):  # what has blown up is for the errors to say
            energy = mechanical_energy(self.scene, pos, quat, linvel, angvel)
        t = self.dt * np.arange(steps + 1)
        return physics.Trajectory(t, pos, quat, linvel, angvel, energy=energy, events=(), reports=())

    def runner(self, steps: int) -> tuple[Callable[[], None], Callable[[], None]]:
        """Functions that restart the scene, and take the timed steps."""
        run = self._open()
        return run.restart, lambda: run.advance(steps)

    def _open(self) -> Run:
        run = self.peer.open(self.scene, self.dt, **self.options)
        run.restart()
        return run


# --- what peers ask of a scene -------------------------------------------------------------------------------------


def restitution(scene: physics.Scene) -> float:
    """Coefficient of the scene's impacts; 0 where they are plastic or there are none."""
    contact = scene.effect(physics.Contact)
    return float(contact.restitution or 0.0) if contact and scene.walls else 0.0


def friction(scene: physics.Scene) -> float:
    """Coefficient of friction; 0 without.

    Raises
    ------
    Unsupported
        It has two.
    """
    effect = scene.effect(physics.Friction)
    if effect and effect.axis is not None:
        raise Unsupported("friction with two coefficients is ours")
    return float(effect.coefficient) if effect and scene.walls else 0.0


def gravity(scene: physics.Scene) -> tuple[float, float, float]:
    """Acceleration of gravity [m/s²]; zeros without."""
    effect = scene.effect(physics.Gravity)
    return tuple(effect.acceleration) if effect else (0.0, 0.0, 0.0)


def walls(scene: physics.Scene) -> tuple[physics.HalfSpace, ...]:
    """Walls of the scene; none without contact."""
    return tuple(scene.walls) if scene.effect(physics.Contact) else ()
