"""Real time of a run: the pace at which it is owed to it, and the cost of its steps."""

from __future__ import annotations

import math

CALL_WEIGHT, STEP_WEIGHT = 0.1, 0.05
"""Weights of the newest call in the pace, and of the newest step in the cost; the earlier ones fade with them."""

TOLD = 0.9
"""Share of the speed below which a run does not keep up."""

ROUNDING = 1e-9
"""Share of a step that may be missing from it."""

MICROSECONDS = 1e6


class Pace:
    """Simulated time that is due.

    Attributes
    ----------
    speed : float
        Simulated seconds per real second.
    due : float
        [s].
    """

    def __init__(self):
        self.speed, self.due, self._share = 1.0, 0.0, 1.0

    def owe(self, seconds: float) -> None:
        """Add real time [s]."""
        self.due += seconds * self.speed

    def is_due(self, interval: float) -> bool:
        """True if a step of this length [s] is to be taken."""
        return self.due >= interval * (1.0 - ROUNDING)

    def leave_out(self, wanted: float) -> None:
        """Drop all that is due still, of the time that was `wanted` [s]."""
        self._note(1.0 - self.due / wanted)
        self.due = 0.0

    def keep_up(self) -> None:
        """Note that nothing was left out."""
        self._note(1.0)

    def _note(self, share: float) -> None:
        self._share += CALL_WEIGHT * (share - self._share)

    def stop(self) -> None:
        """Owe nothing."""
        self.due, self._share = 0.0, 1.0

    @property
    def message(self) -> str:
        """The speed that is reached; empty if that is nearly all."""
        if self._share >= TOLD:
            return ""
        return f"cannot keep up: speed {self._share * self.speed:.2g} instead of {self.speed:g}"


class Cost:
    """Time of computing per simulated second, a mean weighted to the latest steps.

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
        weight = max(STEP_WEIGHT, 1.0 / (self._steps - 1))
        now = MICROSECONDS * seconds / interval
        self.value = now if self._steps == 2 else self.value + weight * (now - self.value)
