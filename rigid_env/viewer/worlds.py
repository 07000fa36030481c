"""A scene, or a world, that is simulated live."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

import physics
from physics import validation
from physics.analysis.events import Pair
from rigid_env.viewer.copies import accuracy_name, copied, declared, fitted, warm
from rigid_env.viewer.interface import WorldSubject, allowed_of
from rigid_env.viewer.listening import Listener

DOWN = np.array((0.0, -1.0, 0.0))
"""Direction of gravity in a scene that has none."""


class State(NamedTuple):
    """All that decides how a world goes on, the accuracy included."""

    accuracy: str
    snapshot: physics.Snapshot
    pushes: dict[Pair, float]


class LiveWorld(WorldSubject):
    """World of one scene in which the user acts.

    Parameters
    ----------
    world : World
        Its own: of one world, whose scene declares what sliders change (`copies.copied`).
    name : str
    """

    def __init__(self, world: physics.World, name: str):
        self.name = name
        self._worlds: dict[str, tuple[physics.World, Listener]] = {}
        self._add(accuracy_name(world.accuracy), world)
        self._set_world(*next(iter(self._worlds.values())))
        self.can = allowed_of(world)
        self._down = direction_of(world.gravity[0])
        self._first = world.snapshot()

    def _add(self, name: str, world: physics.World) -> None:
        self._worlds[name] = world, Listener(world)

    def restart(self, seed: int) -> None:
        self.world.restore(fitted(self._first, self.world))
        self.listener.begin()
        self.listener.pushes, self.listener.is_changed = {}, False

    def step(self, load=None, record=None):
        self.listener.begin()
        if self.world.actuation is None:
            self.world.step(load)
        else:  # the user's hand is no command
            with self.world.actuation.passed_by(None if load is None else load[None]):
                self.world.step()
        return None

    def snapshot(self) -> State:
        return State(self.accuracy, self.world.snapshot(), self.listener.pushes)

    def restore(self, snapshot: State) -> None:
        self._set_world(*self._worlds[snapshot.accuracy])
        self.world.restore(snapshot.snapshot)
        self.listener.begin()
        self.listener.pushes, self.listener.is_changed = snapshot.pushes, False

    def rehearsal(self) -> Callable[[], None]:
        world = physics.World(self.world.scene, dt=self.world.dt, accuracy=self.world.accuracy)
        return lambda: warm(world)

    # --- sliders ---------------------------------------------------------------------------------------------

    def set_gravity(self, strength: float) -> None:
        strength = float(validation.non_negative(strength, (), "gravity"))
        self._set(gravity=strength * self._down)

    def set_friction(self, coefficient: float) -> None:
        self._set(friction=float(validation.non_negative(coefficient, (), "friction")))

    def set_restitution(self, coefficient: float) -> None:
        self._set(restitution=float(validation.share(coefficient, (), "restitution")))

    def _set(self, **given) -> None:
        self.world.set_parameters(**given)
        self.listener.is_changed = False  # the state is the same

    # --- accuracy --------------------------------------------------------------------------------------------

    def prepare(self, name: str) -> Callable[[], None]:
        world = physics.World(self.world.scene, dt=self.world.dt, accuracy=name)
        self._add(name, world)
        return lambda: warm(world)

    def switch(self, name: str) -> None:
        pushes, snapshot = self.listener.pushes, self.world.snapshot()
        self._set_world(*self._worlds[name])
        self.world.restore(fitted(snapshot, self.world))
        self.listener.begin()
        self.listener.pushes, self.listener.is_changed = pushes, False


def direction_of(gravity: np.ndarray) -> np.ndarray:
    """(3,) unit vector along gravity; down where there is none."""
    strength = np.linalg.norm(gravity)
    return gravity / strength if strength > 0.0 else DOWN


def live_scene(scene: physics.Scene, name: str, accuracy, dt: float) -> LiveWorld:
    """A scene from its start."""
    return LiveWorld(physics.World(declared(scene), dt=dt, accuracy=accuracy), name)


def live_world(world: physics.World, name: str, accuracy=None, dt: float | None = None) -> LiveWorld:
    """The first world of a batch, from its present state; the batch itself stays as it is."""
    return LiveWorld(copied(world, accuracy, dt), name)
