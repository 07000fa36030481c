"""Pace of a run: real time that is owed to it, and the share of it that cannot be given."""

from __future__ import annotations

SMOOTHING = 0.1
"""Weight of the newest call; the earlier ones fade with it."""

TOLD = 0.9
"""Share of the speed below which a run does not keep up."""

ROUNDING = 1e-9
"""Share of a step that may be missing from it."""


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
        self._share += SMOOTHING * (share - self._share)

    def stop(self) -> None:
        """Owe nothing."""
        self.due, self._share = 0.0, 1.0

    @property
    def message(self) -> str:
        """The speed that is reached; empty if that is nearly all."""
        if self._share >= TOLD:
            return ""
        return f"cannot keep up: speed {self._share * self.speed:.2g} instead of {self.speed:g}"
