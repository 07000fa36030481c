"""Cost of a simulation: time of computing per simulated second, smoothed over the last steps."""

from __future__ import annotations

import math

SMOOTHING = 0.05
"""Weight of the newest step; the earlier ones fade with it."""

MICROSECONDS = 1e6


class Cost:
    """Mean of what steps took, weighted to the latest.

    The first step is left out: it binds the kernel.

    Attributes
    ----------
    value : float
        [µs/s]; NaN before the second step.
    """

    def __init__(self):
        self.value, self._steps = math.nan, 0

    def add(self, seconds: float, interval: float) -> None:
        """Add a step of `interval` simulated seconds that took `seconds`."""
        self._steps += 1
        if self._steps == 1:
            return
        weight = max(SMOOTHING, 1.0 / (self._steps - 1))
        now = MICROSECONDS * seconds / interval
        self.value = now if self._steps == 2 else self.value + weight * (now - self.value)
