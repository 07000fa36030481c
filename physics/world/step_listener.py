"""Interface of objects that a world notifies of its steps; with it a world needs no import of its recorder."""

from __future__ import annotations

from typing import Protocol

import numpy as np


class StepListener(Protocol):
    """Object that a world notifies of every step and change, such as a `physics.Recorder`."""

    def before(self, wrench: np.ndarray, steps: int, dt: float) -> None:
        """Called before `steps` steps of `dt` [s] with a wrench (worlds, bodies, 6)."""

    def after(self) -> None:
        """Called after the steps that `before` announced."""

    def undone(self) -> None:
        """Called after an exception during the steps, when the state before them is restored."""

    def changed(self, worlds: np.ndarray | slice) -> None:
        """Called after a user has changed or restored these worlds (indices or a slice)."""
