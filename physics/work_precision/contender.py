"""Contender in a measurement of error against time: an engine at one setting and one step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import Protocol

from physics.accuracy import PRESETS, Accuracy, resolve
from physics.analysis.simulate import simulate
from physics.analysis.trajectory import Trajectory
from physics.annotations import Preset
from physics.scene.scene import Scene
from physics.world.stepper import Stepper
from physics.world.world import World

OURS = "rigid-env"


class TooSlow(Exception):
    """Error of a contender that takes too long for its measurement; the message says how long."""


class Contender(Protocol):
    """An engine at one setting and one step, on one scene.

    Attributes
    ----------
    engine, setting : str
    dt : float
        [s].
    """

    engine: str
    setting: str
    dt: float

    def watch(self, steps: int) -> Trajectory:
        """Samples at the start and after each of `steps` steps.

        Raises
        ------
        TooSlow
            It gave up; it is left out, and the result says so.
        """

    def runner(self, steps: int) -> tuple[Callable[[], None], Callable[[], None]]:
        """Two functions: the first returns to the start; the second, which is timed, takes `steps` steps from there."""


@dataclass(frozen=True)
class EngineContender:
    """Our own engine.

    Parameters
    ----------
    scene : Scene
    accuracy : Accuracy
    dt : float
        [s].
    """

    scene: Scene
    accuracy: Accuracy
    dt: float
    engine = OURS

    @property
    def setting(self) -> str:
        """Name of the preset, or the differences from ``balanced``."""
        return setting_name(self.accuracy)

    def watch(self, steps: int) -> Trajectory:
        """See `Contender`."""
        return simulate(self.scene, steps * self.dt, self.accuracy, sample_dt=self.dt)

    def runner(self, steps: int) -> tuple[Callable[[], None], Callable[[], None]]:
        """See `Contender`."""
        world = World(self.scene, dt=self.dt, accuracy=self.accuracy)
        start = world.snapshot()
        return (lambda: world.restore(start)), Stepper(world, steps=steps)


def setting_name(accuracy: Preset | Accuracy) -> str:
    """Name of a preset, or of the nearest preset with the settings that differ: ``balanced(substeps=5)``."""
    knobs = resolve(accuracy)
    changes = {
        name: [f.name for f in fields(knobs) if getattr(knobs, f.name) != getattr(preset, f.name)]
        for name, preset in PRESETS.items()
    }
    name = min(changes, key=lambda key: (len(changes[key]), key != "balanced"))
    if not changes[name]:
        return name
    return f"{name}({', '.join(f'{field}={getattr(knobs, field)!r}' for field in changes[name])})"
