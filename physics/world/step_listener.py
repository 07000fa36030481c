"""Interface of listeners to a world's steps, so that a world needs no import of its recorder."""

from __future__ import annotations

from typing import Protocol

import numpy as np


class StepListener(Protocol):
    """Listener to every step of a world, such as `physics.Recorder`."""

    def before(self, wrench: np.ndarray, steps: int, dt: float) -> None:
        """Note that `steps` steps of `dt` [s] are about to be taken with a wrench (worlds, bodies, 6)."""

    def after(self) -> None:
        """Note that the steps have been taken."""

    def undone(self) -> None:
        """Note that the steps were undone: an exception has restored everything."""

    def changed(self, worlds: np.ndarray | slice) -> None:
        """Note that these worlds were changed from outside."""
