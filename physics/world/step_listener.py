"""Interface of those whom a world tells of its steps, so that a world knows no recorder."""

from __future__ import annotations

from typing import Protocol

import numpy as np


class StepListener(Protocol):
    """Object that is told of every step of a world, as `physics.Recorder` is."""

    def before(self, wrench: np.ndarray, steps: int, dt: float) -> None:
        """`steps` steps of `dt` [s] are about to be taken with a wrench (worlds, bodies, 6)."""

    def after(self) -> None:
        """They have been taken."""

    def undone(self) -> None:
        """They are none: an exception has put everything back."""

    def changed(self, worlds: np.ndarray | slice) -> None:
        """These worlds were changed from outside."""
