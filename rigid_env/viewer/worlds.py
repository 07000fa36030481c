"""Subjects that are simulated in a world: their base class, a class in which the user can act, and a bare world."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

import physics
from physics import Event, validation
from physics.analysis.events import Pair
from physics.kernels.state import layout as at
from rigid_env.rendering import Frame
from rigid_env.rendering.picture import world_frame
from rigid_env.viewer.copies import accuracy_name, fitted, warm
from rigid_env.viewer.interface import Can, Look, Subject
from rigid_env.viewer.listening import Listener

DOWN = np.array((0.0, -1.0, 0.0))
"""Direction of gravity in a scene without gravity."""

SLIDERS = {
    "gravity": validation.non_negative, "friction": validation.non_negative, "restitution": validation.share,
}  # fmt: skip
"""Parameters that the user can change, and the function that checks a value of each."""


class Moment(NamedTuple):
    """Everything that decides how a subject continues, accuracy included."""

    accuracy: str
    state: Any
    pushes: dict[Pair, float]


class WorldSubject(Subject):
    """Subject that is simulated in `world`, whose steps `listener` records.

    Parameters
    ----------
    world : World
        Batch of one world, which only this subject uses.
    name : str
        Short name for titles.
    """

    world: physics.World
    listener: Listener
    _shift = 0.0  # time of the subject minus time of the world [s]

    def __init__(self, world: physics.World, name: str):
        self.name = name
        self._worlds: dict[str, tuple[physics.World, Listener]] = {}
        self._use(self._add(world))

    def _add(self, world: physics.World) -> str:
        """Add another world of the same scene, with a listener; returns the name of its accuracy."""
        name = accuracy_name(world.accuracy)
        self._worlds[name] = world, Listener(world)
        return name

    def _use(self, accuracy: str) -> None:
        """Continue in the added world that has the accuracy of this name."""
        self.accuracy = accuracy
        self.world, self.listener = self._worlds[accuracy]

    # --- the present ---------------------------------------------------------------------------------------------

    @property
    def scene(self) -> physics.Scene:
        return self.world.scene

    @property
    def time(self) -> float:
        return self.world.time + self._shift

    @property
    def interval(self) -> float:
        return self.world.dt

    def frame(self) -> Frame:
        return world_frame(self.world)

    def look(self) -> Look:
        world = self.world
        moving = (world.linvel[0], world.angvel[0], world.asleep[0], world.params[:, at.RADIUS])
        return Look(self.frame(), self.time, *map(np.array, moving))

    def measure(self) -> dict[str, float]:
        found = physics.diagnose(self.world)
        kinetic, potential = float(found.kinetic_energy.sum()), float(found.potential_energy.sum())
        return {
            "kinetic_energy": kinetic, "potential_energy": potential, "energy": kinetic + potential,
            "momentum": float(np.linalg.norm(found.momentum.sum(axis=(0, 1)))),
            "penetration": self.listener.penetration, "residual": self.listener.residual,
        }  # fmt: skip

    def events(self) -> list[Event]:
        shift = self._shift
        return [replace(event, t=event.t + shift) for event in self.listener.events]

    # --- back to a moment ----------------------------------------------------------------------------------------

    def snapshot(self) -> Moment:
        return Moment(self.accuracy, self._take(), self.listener.pushes)

    def restore(self, snapshot: Moment) -> None:
        self._use(snapshot.accuracy)
        self._put(snapshot.state)
        self.listener.resume(snapshot.pushes)

    def _take(self) -> Any:
        """State of the world, and of the environment around it."""
        return self.world.snapshot()

    def _put(self, state: Any, is_other: bool = False) -> None:
        """Continue from a `state` that `_take` returned; `is_other` is true for a state of another accuracy."""
        self.world.restore(fitted(state, self.world) if is_other else state)


class LiveSubject(WorldSubject):
    """Subject in which the user can act.

    Parameters
    ----------
    world : World
        Batch of one world, which only this subject uses. Its scene declares the effects that sliders change
        (`copies.copied`).
    name : str
        Short name for titles.
    seed : bool
        Whether different seeds lead to different runs.
    """

    def __init__(self, world: physics.World, name: str, seed: bool = False):
        super().__init__(world, name)
        plan, gravity = world.plan, world.gravity[0]
        flags = (bool(each) for each in (plan.gravity, plan.friction, plan.restitution))
        self.can = Can(True, *flags, accuracy=True, ghost=True, seed=seed)
        strength = np.linalg.norm(gravity)
        self._down = gravity / strength if strength > 0.0 else DOWN

    def settings(self) -> dict[str, float]:
        params = self.world.params[0]
        values = {
            "gravity": float(np.linalg.norm(self.world.gravity[0])), "friction": float(params[at.FRICTION]),
            "restitution": float(params[at.RESTITUTION]),
        }  # fmt: skip
        return {name: value for name, value in values.items() if getattr(self.can, name)}

    def set(self, name: str, value: float) -> None:
        """Change a parameter of `SLIDERS`: the strength of gravity [m/s²], or a coefficient of all bodies."""
        self._hold(name, value)
        self.listener.is_changed = False  # the state is the same

    def _hold(self, name: str, value: float) -> None:
        value = float(SLIDERS[name](value, (), name))
        self.world.set_parameters(**{name: value * self._down if name == "gravity" else value})

    def prepare(self, name: str) -> Callable[[], None]:
        """Make a world for another preset, for `switch`; returns a function that compiles it in any thread."""
        raise NotImplementedError

    def switch(self, name: str) -> None:
        """Continue with another preset, from the same state."""
        pushes, state = self.listener.pushes, self._take()
        self._use(name)
        self._put(state, is_other=True)
        self.listener.resume(pushes)


class LiveWorld(LiveSubject):
    """Subject of a world without an environment."""

    def __init__(self, world: physics.World, name: str):
        super().__init__(world, name)
        self._first = world.snapshot()

    def restart(self, seed: int) -> None:
        self._put(self._first, is_other=True)
        self.listener.resume({})

    def step(self, load=None, record=None):
        self.listener.begin()
        if self.world.actuation is None:
            self.world.step(load)
        else:  # the user's force does not go through the actuator
            with self.world.actuation.passed_by(None if load is None else load[None]):
                self.world.step()

    def rehearsal(self) -> Callable[[], None]:
        world = self._at(self.world.accuracy)
        return lambda: warm(world)

    def prepare(self, name: str) -> Callable[[], None]:
        world = self._at(name)
        self._add(world)
        return lambda: warm(world)

    def _at(self, accuracy: Any) -> physics.World:
        """Make another world of the scene, with another accuracy."""
        return physics.World(self.world.scene, dt=self.world.dt, accuracy=accuracy)
