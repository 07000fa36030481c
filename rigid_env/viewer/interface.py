"""Base class `Subject` of things that the viewer can play, and `Look`, the data of one picture.

`rigid_env.viewer.subject` makes subjects of worlds, environments, recordings and trajectories.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

import physics
from physics import Event
from rigid_env.rendering import Frame
from rigid_env.viewer.listening import Listener


@dataclass(frozen=True, eq=False)
class Look:
    """Everything that the viewer draws of one moment, in the world frame and SI units.

    Parameters
    ----------
    frame : Frame
        Bodies, walls, goal, contacts and the applied wrench.
    time : float
        Simulated time [s].
    linvel, angvel : (bodies, 3) float
        Velocities of centres of mass [m/s], and angular velocities [rad/s].
    is_asleep : (bodies,) bool
        Sleeping bodies.
    radius : (bodies,) float
        Radius of a sphere about `BodyView.pos` that holds the body [m].
    drag : pair of (3,) float or None
        Ends of the spring by which the user drags a body: on the body, and at the mouse [m].
    ghost : Frame or None
        Bodies of the same scene at the accuracy ``reference``.
    """

    frame: Frame
    time: float
    linvel: np.ndarray
    angvel: np.ndarray
    is_asleep: np.ndarray
    radius: np.ndarray
    drag: tuple[np.ndarray, np.ndarray] | None = None
    ghost: Frame | None = None


@dataclass(frozen=True)
class Can:
    """Controls that a subject allows; those that are False are not shown.

    Attributes
    ----------
    drag : bool
        Drag and kick bodies.
    gravity, friction, restitution : bool
        Change this parameter by a slider.
    accuracy : bool
        Change the preset.
    ghost : bool
        Show the same scene at the accuracy ``reference`` beside it.
    seed : bool
        Choose a seed, if different seeds lead to different runs.
    """

    drag: bool = False
    gravity: bool = False
    friction: bool = False
    restitution: bool = False
    accuracy: bool = False
    ghost: bool = False
    seed: bool = False


class Subject:
    """Base class of everything that the viewer can play.

    Attributes
    ----------
    name : str
        Short name for titles.
    can : Can
        Controls that it allows.
    accuracy : str
        Name of the preset, `copies.CUSTOM`, or empty if it is not simulated.
    seed : int
        Seed of the run.
    world : World or None
        World that is simulated; None if the states are read from a trajectory.
    listener : Listener or None
        Listener of the world's steps; None without a world.
    message : str
        Text for the user, often empty.
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
        """Scene with bodies, walls and effects."""
        raise NotImplementedError

    @property
    def time(self) -> float:
        """Simulated time [s]."""
        raise NotImplementedError

    @property
    def interval(self) -> float:
        """Length of the next step [s]."""
        raise NotImplementedError

    @property
    def end(self) -> float | None:
        """Time at which the subject ends [s]; None: it has no end."""
        return None

    @property
    def is_over(self) -> bool:
        """True if no step is left."""
        return False

    def restart(self, seed: int) -> None:
        """Return to the start, with a new seed if the subject uses one.

        The accuracy stays; sliders return to their first values.
        """
        raise NotImplementedError

    def step(self, load: np.ndarray | None = None, record: Any = None) -> Any:
        """Take a step.

        Parameters
        ----------
        load : (bodies, 6) float64, optional
            Additional force [N] and torque [N m] of the user on each body, world frame.
        record : optional
            Return value of an earlier call, to repeat the same step.

        Returns
        -------
        object
            The `record` of this step.
        """
        raise NotImplementedError

    def snapshot(self) -> Any:
        """Copy of everything that decides how the subject continues."""
        raise NotImplementedError

    def restore(self, snapshot: Any) -> None:
        """Continue from a result of `snapshot`, bit for bit."""
        raise NotImplementedError

    def frame(self) -> Frame:
        """Picture of the present state."""
        raise NotImplementedError

    def look(self) -> Look:
        """Everything to draw of the present state, apart from the user's spring and the ghost."""
        raise NotImplementedError

    def measure(self) -> dict[str, float]:
        """Numbers of the present state and the last step, by the names of columns of `history.Samples`."""
        raise NotImplementedError

    def events(self) -> list[Event]:
        """Events of the last step."""
        return []

    def settings(self) -> dict[str, float]:
        """Present values of the sliders that the subject allows: gravity [m/s²], friction and restitution of body 0."""
        return {}

    def rehearsal(self) -> Callable[[], None] | None:
        """Function that compiles the kernels of a step, and may run in another thread; None: nothing to compile."""
        return None
