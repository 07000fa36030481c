"""Subject: anything that can be played, behind one interface; `rigid_env.viewer.subject` makes one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import physics
from physics import Event
from physics.kernels.state import layout as at
from rigid_env.rendering import Frame
from rigid_env.rendering.picture import world_frame
from rigid_env.viewer.copies import accuracy_name
from rigid_env.viewer.listening import Listener


@dataclass(frozen=True)
class Can:
    """Controls that a subject allows.

    Attributes
    ----------
    drag : bool
        Drag and kick bodies.
    gravity, friction, restitution : bool
        Change them.
    accuracy : bool
        Change the preset.
    ghost : bool
        Show `reference` beside it.
    seed : bool
        Another seed makes another run.
    """

    drag: bool = False
    gravity: bool = False
    friction: bool = False
    restitution: bool = False
    accuracy: bool = False
    ghost: bool = False
    seed: bool = False


class Motion:
    """Velocities and more of all bodies at a moment, copied.

    Attributes
    ----------
    linvel, angvel : (bodies, 3) float64
        World frame [m/s], [rad/s].
    is_asleep : (bodies,) bool
    radius : (bodies,) float64
        Of a bounding sphere [m].
    """

    def __init__(self, linvel: np.ndarray, angvel: np.ndarray, is_asleep: np.ndarray, radius: np.ndarray):
        self.linvel, self.angvel, self.is_asleep, self.radius = (
            np.array(each) for each in (linvel, angvel, is_asleep, radius)
        )


class Subject:
    """Base of all subjects.

    Attributes
    ----------
    name : str
        Short, for titles.
    can : Can
    accuracy : str
        Name of the preset, `copies.CUSTOM`, or empty where nothing is simulated.
    seed : int
    world : World or None
        Simulated; None where the states are known.
    message : str
        Something that the user should know; often empty.
    """

    name = ""
    can = Can()
    accuracy = ""
    seed = 0
    world: physics.World | None = None
    listener: Listener | None = None
    message = ""

    @property
    def scene(self) -> physics.Scene:
        """Bodies, walls and effects."""
        raise NotImplementedError

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        raise NotImplementedError

    @property
    def interval(self) -> float:
        """Time that the next step takes [s]."""
        raise NotImplementedError

    @property
    def end(self) -> float | None:
        """Time at which it ends [s]; None: it goes on."""
        return None

    @property
    def is_over(self) -> bool:
        """No step is left."""
        return False

    def restart(self, seed: int) -> None:
        """Go back to the start, with another seed where that matters; the accuracy stays, sliders do not."""
        raise NotImplementedError

    def step(self, load: np.ndarray | None = None, record: Any = None) -> Any:
        """Take a step.

        Parameters
        ----------
        load : (bodies, 6) float64, optional
            Force [N] and torque [N m] besides, world frame.
        record : optional
            An earlier step returned it, and the same step is taken again.

        Returns
        -------
        object
            The `record` of this step.
        """
        raise NotImplementedError

    def snapshot(self) -> Any:
        """All that decides how it goes on."""
        raise NotImplementedError

    def restore(self, snapshot: Any) -> None:
        """Go on from a `snapshot`, bit for bit."""
        raise NotImplementedError

    def frame(self) -> Frame:
        """Picture of now."""
        raise NotImplementedError

    def motion(self) -> Motion:
        """Velocities and more of now."""
        raise NotImplementedError

    def measure(self) -> dict[str, float]:
        """Columns of `samples.Samples`, of now and of the last step."""
        raise NotImplementedError

    def events(self) -> list[Event]:
        """Events of the last step."""
        return []

    def rehearsal(self) -> Callable[[], None] | None:
        """Work that compiles what a step needs, which another thread may do; None: nothing has to be compiled."""
        return None


class WorldSubject(Subject):
    """A subject that is simulated in `world`, to which `listener` listens."""

    world: physics.World
    listener: Listener

    def _set_world(self, world: physics.World, listener: Listener) -> None:
        self.world, self.listener = world, listener
        self.accuracy = accuracy_name(world.accuracy)

    @property
    def scene(self) -> physics.Scene:
        return self.world.scene

    @property
    def time(self) -> float:
        return self.world.time

    @property
    def interval(self) -> float:
        return self.world.dt

    def frame(self) -> Frame:
        return world_frame(self.world)

    def motion(self) -> Motion:
        world = self.world
        return Motion(world.linvel[0], world.angvel[0], world.asleep[0], world.params[:, at.RADIUS])

    def measure(self) -> dict[str, float]:
        found = physics.diagnose(self.world)
        kinetic, potential = float(found.kinetic_energy.sum()), float(found.potential_energy.sum())
        return {
            "kinetic_energy": kinetic, "potential_energy": potential, "energy": kinetic + potential,
            "momentum": float(np.linalg.norm(found.momentum.sum(axis=(0, 1)))),
            "penetration": self.listener.penetration, "residual": self.listener.residual,
        }  # fmt: skip

    def events(self) -> list[Event]:
        return self.listener.events

    def settings(self) -> dict[str, float]:
        """Values of sliders: gravity [m/s²], friction and restitution of body 0."""
        params = self.world.params[0]
        strength = float(np.linalg.norm(self.world.gravity[0]))
        return {
            "gravity": strength, "friction": float(params[at.FRICTION]), "restitution": float(params[at.RESTITUTION]),
        }  # fmt: skip

    # --- what live subjects add ------------------------------------------------------------------------------

    def set_gravity(self, strength: float) -> None:
        """Change the strength of gravity, at least 0 [m/s²]; its direction stays."""
        raise NotImplementedError

    def set_friction(self, coefficient: float) -> None:
        """Change the coefficient of friction of all bodies."""
        raise NotImplementedError

    def set_restitution(self, coefficient: float) -> None:
        """Change the coefficient of restitution of all bodies."""
        raise NotImplementedError

    def prepare(self, name: str) -> Callable[[], None]:
        """Make another preset ready for `switch`; returns the rest of the work, which another thread may do."""
        raise NotImplementedError

    def switch(self, name: str) -> None:
        """Go on at another preset, from the same state."""
        raise NotImplementedError


def allowed_of(world: physics.World, seed: bool = False) -> Can:
    """Controls of a world that is simulated live."""
    plan = world.plan
    flags = (bool(each) for each in (plan.gravity, plan.friction, plan.restitution))
    return Can(True, *flags, accuracy=True, ghost=True, seed=seed)
