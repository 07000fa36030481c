"""Interface of other engines (peers), and a contender that measures one of them beside our engine."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

import physics
from physics.scene.groups import group_table
from physics.work_precision.contender import TooSlow
from physics.work_precision.errors import mechanical_energy

# Longest run of another engine; a slower one would not be on the front of any scene [s].
LIMIT = 10.0

State = tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]


class Unsupported(Exception):
    """Error of an engine that cannot express a scene; the message says why."""


def refuse_meetings(scene: physics.Scene) -> None:
    """Refuse scenes whose bodies may touch each other, for an engine that gets contact with walls only.

    Raises
    ------
    Unsupported
        Bodies of the scene may touch each other.
    """
    contact = scene.effect(physics.Contact)
    if contact is not None and contact.between_bodies and len(scene.bodies) > 1:
        raise Unsupported("contact between bodies is not handed to this engine")
    if any(body.fixed for body in scene.bodies):
        raise Unsupported("fixed bodies are not handed to this engine")


class Run(Protocol):
    """Scene in another engine, at one setting and one step."""

    def restart(self) -> None:
        """Return to the scene's start, and clear the engine's memory of contacts."""

    def advance(self, steps: int) -> None:
        """Take this number of steps in the engine's quickest way."""

    def state(self) -> State:
        """State of all bodies: pos (bodies, 3) [m], quat (bodies, 4), linvel [m/s] and angvel [rad/s] (bodies, 3).

        It follows our conventions: centre of mass, world frame, quaternion (w, x, y, z).
        """


class Engine(Protocol):
    """Interface of another physics engine: its settings, and runs of scenes in it.

    Attributes
    ----------
    name, version : str
    """

    name: str
    version: str

    def settings(self, scene: physics.Scene) -> Mapping[str, Mapping]:
        """Options of each setting, by the name of the setting; the engine's defaults come first."""

    def open(self, scene: physics.Scene, dt: float, **options) -> Run:
        """Build a scene in the engine, with the options of one setting.

        Raises
        ------
        Unsupported
            The engine cannot express the scene.
        """


@dataclass(frozen=True)
class PeerContender:
    """Another engine at one setting and one step: a `physics.work_precision.contender.Contender`.

    Parameters
    ----------
    peer : Engine
    scene : Scene
    setting : str
        Name of the setting.
    options : mapping
        Options of the setting.
    dt : float
        Step [s].
    """

    peer: Engine
    scene: physics.Scene
    setting: str
    options: Mapping = field(repr=False)
    dt: float

    @property
    def engine(self) -> str:
        """Name of the engine."""
        return self.peer.name

    def watch(self, steps: int) -> physics.Trajectory:
        """Simulate `steps` steps, and return the states at the start and after each step, without events and reports.

        Raises
        ------
        TooSlow
            The run takes longer than `LIMIT`.
        """
        run = self._open()
        samples, end = [run.state()], time.monotonic() + LIMIT
        for k in range(steps):
            if time.monotonic() > end:
                raise TooSlow(f"{k * self.dt:.3g} s simulated in {LIMIT:g} s")
            run.advance(1)
            samples.append(run.state())
        pos, quat, linvel, angvel = (np.array(column) for column in zip(*samples))
        with np.errstate(all="ignore"):  # numbers that are not finite show in the errors
            energy = mechanical_energy(self.scene, pos, quat, linvel, angvel)
        t = self.dt * np.arange(steps + 1)
        return physics.Trajectory(t, pos, quat, linvel, angvel, energy=energy, events=(), reports=())

    def runner(self, steps: int) -> tuple[Callable[[], None], Callable[[], None]]:
        """Return two functions: one restarts the scene, the other takes `steps` steps and is timed."""
        run = self._open()
        return run.restart, lambda: run.advance(steps)

    def _open(self) -> Run:
        run = self.peer.open(self.scene, self.dt, **self.options)
        run.restart()
        return run


# --- properties of a scene for other engines -----------------------------------------------------------------------


def restitution(scene: physics.Scene) -> float:
    """Restitution coefficient of the scene; 0 if impacts are plastic or there are no walls or no contact."""
    contact = scene.effect(physics.Contact)
    return float(contact.restitution or 0.0) if contact and scene.walls else 0.0


def friction(scene: physics.Scene) -> float:
    """Friction coefficient of the scene; 0 without friction.

    Raises
    ------
    Unsupported
        The scene has two coefficients.
    """
    effect = scene.effect(physics.Friction)
    if effect and effect.axis is not None:
        raise Unsupported("friction with two coefficients is ours")
    return float(effect.coefficient) if effect and scene.walls else 0.0


def gravity(scene: physics.Scene) -> tuple[float, float, float]:
    """Acceleration of gravity in the scene (3,) [m/s²]; zeros without gravity."""
    effect = scene.effect(physics.Gravity)
    return tuple(effect.acceleration) if effect else (0.0, 0.0, 0.0)


def walls(scene: physics.Scene) -> tuple[physics.HalfSpace, ...]:
    """Walls of the scene; empty without contact.

    Raises
    ------
    Unsupported
        Some bodies or walls have collision groups of their own.
    """
    if group_table(scene) is not None:
        raise Unsupported("collision groups are not handed to this engine")
    return tuple(scene.walls) if scene.effect(physics.Contact) else ()
