"""Look at a moment: a frame to draw, and more about its bodies."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rigid_env.rendering import Frame


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
    drag: tuple[np.ndarray, np.ndarray] | None
    ghost: Frame | None
