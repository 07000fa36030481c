"""Subject: anything that can be played, behind one interface, and its looks; `rigid_env.viewer.subject` makes one."""

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
    """Everything that the viewer draws at a moment. World frame, SI units.

    Parameters
    ----------
    frame : Frame
        Bodies, walls, goal, contacts and the applied wrench.
    time : float
        [s].
    linvel, angvel : (bodies, 3) float
        [m/s] and [rad/s].
    is_asleep : (bodies,) bool
    radius : (bodies,) float
        Of a sphere round `BodyView.pos` that holds the body [m].
    drag : pair of (3,) float or None
        Ends of the spring by which the mouse drags a body: on the body, and at the mouse [m].
    ghost : Frame or None
        The same scene at the accuracy ``reference``.
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

    def look(self) -> Look:
        """Everything to draw of now, but for the hand and the ghost."""
        raise NotImplementedError

    def measure(self) -> dict[str, float]:
        """Columns of `history.Samples`, of now and of the last step."""
        raise NotImplementedError

    def events(self) -> list[Event]:
        """Events of the last step."""
        return []

    def settings(self) -> dict[str, float]:
        """Present values of the sliders that it allows: gravity [m/s²], friction, restitution of body 0."""
        return {}

    def rehearsal(self) -> Callable[[], None] | None:
        """Work that compiles what a step needs, which another thread may do; None: nothing has to be compiled."""
        return None
