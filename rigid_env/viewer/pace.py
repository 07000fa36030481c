"""Pace of a run compared with real time, and computing time of its steps."""

from __future__ import annotations

import math

CALL_WEIGHT, STEP_WEIGHT = 0.1, 0.05
"""Weights of the newest call in the mean pace and of the newest step in the mean cost; older ones fade."""

TOLD = 0.9
"""Share of the requested speed below which the user is told that the run cannot keep up."""

ROUNDING = 1e-9
"""Share of a step that may still be missing when the step is taken."""

MICROSECONDS = 1e6


class Pace:
    """Simulated time that a run must still advance to keep up with real time.

    Attributes
    ----------
    speed : float
        Requested simulated seconds per real second.
    due : float
        Simulated time that is due [s].
    """

    def __init__(self):
        self.speed, self.due, self._share = 1.0, 0.0, 1.0

    def owe(self, seconds: float) -> None:
        """Add `seconds` of real time to the time that is due."""
        self.due += seconds * self.speed

    def is_due(self, interval: float) -> bool:
        """True if a step of the length `interval` [s] is due."""
        return self.due >= interval * (1.0 - ROUNDING)

    def leave_out(self, wanted: float) -> None:
        """Drop the time that is still due, out of the time `wanted` [s] that was due before the last steps."""
        self._note(1.0 - self.due / wanted)
        self.due = 0.0

    def keep_up(self) -> None:
        """Note that all due time was simulated."""
        self._note(1.0)

    def _note(self, share: float) -> None:
        self._share += CALL_WEIGHT * (share - self._share)

    def stop(self) -> None:
        """Set the due time to 0, and forget earlier delays."""
        self.due, self._share = 0.0, 1.0

    @property
    def message(self) -> str:
        """Text with the speed that is reached; empty if it is nearly the requested one."""
        if self._share >= TOLD:
            return ""
        return f"cannot keep up: speed {self._share * self.speed:.2g} instead of {self.speed:g}"


class Cost:
    """Computing time per simulated second, as a mean with larger weights for later steps.

    The first step is left out, since it also binds the kernel.

    Attributes
    ----------
    value : float
        [µs/s]; NaN before the second step.
    """

    def __init__(self):
        self.value, self._steps = math.nan, 0

    def add(self, seconds: float, interval: float) -> None:
        """Add a step of `interval` simulated seconds that took `seconds` of computing time."""
        self._steps += 1
        if self._steps == 1:
            return
        weight = max(STEP_WEIGHT, 1.0 / (self._steps - 1))
        now = MICROSECONDS * seconds / interval
        self.value = now if self._steps == 2 else self.value + weight * (now - self.value)
