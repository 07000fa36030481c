"""Contenders in a measurement of error against time: an engine at one setting and one step."""

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
    """Exception of a contender that takes too long for its measurement; the message says how long."""


class Contender(Protocol):
    """Protocol of an engine at one setting and one step, on one scene.

    Attributes
    ----------
    engine, setting : str
        Names of the engine and of the setting.
    dt : float
        Length of a step [s].
    """

    engine: str
    setting: str
    dt: float

    def watch(self, steps: int) -> Trajectory:
        """Simulate `steps` steps; return samples at the start and after each step.

        Raises
        ------
        TooSlow
            The engine gave up. The measurement then leaves it out, and its result says so.
        """

    def runner(self, steps: int) -> tuple[Callable[[], None], Callable[[], None]]:
        """Make two functions: the first returns to the start; the second, which is timed, makes `steps` steps."""


@dataclass(frozen=True)
class EngineContender:
    """Contender with this package's own engine.

    Parameters
    ----------
    scene : Scene
        Scene to simulate.
    accuracy : Accuracy
        Setting of the engine.
    dt : float
        Length of a step [s].
    """

    scene: Scene
    accuracy: Accuracy
    dt: float
    engine = OURS

    @property
    def setting(self) -> str:
        """Name of the accuracy, from `setting_name`."""
        return setting_name(self.accuracy)

    def watch(self, steps: int) -> Trajectory:
        """Simulate `steps` steps; return samples at the start and after each step."""
        return simulate(self.scene, steps * self.dt, self.accuracy, sample_dt=self.dt)

    def runner(self, steps: int) -> tuple[Callable[[], None], Callable[[], None]]:
        """Make two functions: the first returns to the start; the second makes `steps` steps."""
        world = World(self.scene, dt=self.dt, accuracy=self.accuracy)
        start = world.snapshot()
        return (lambda: world.restore(start)), Stepper(world, steps=steps)


def setting_name(accuracy: Preset | Accuracy) -> str:
    """Name of an accuracy: that of a preset, or the nearest preset with changed fields, as ``balanced(substeps=5)``."""
    knobs = resolve(accuracy)
    changes = {
        name: [f.name for f in fields(knobs) if getattr(knobs, f.name) != getattr(preset, f.name)]
        for name, preset in PRESETS.items()
    }
    name = min(changes, key=lambda key: (len(changes[key]), key != "balanced"))
    if not changes[name]:
        return name
    return f"{name}({', '.join(f'{field}={getattr(knobs, field)!r}' for field in changes[name])})"
