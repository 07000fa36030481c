"""Repeats, medians and ratios: compare two things on a machine that others use, too."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Spread:
    """Some repeats of one measurement.

    Attributes
    ----------
    samples : tuple of float
        In the order in which they were measured, in the unit of the row that holds them. A contestant of `interleave`
        whose measurement is several numbers has samples that hold them all.
    """

    samples: tuple[float, ...]

    @property
    def median(self) -> float:
        """Middle of the samples."""
        return statistics.median(self.samples)

    @property
    def lowest(self) -> float:
        """Smallest sample."""
        return min(self.samples)

    @property
    def highest(self) -> float:
        """Largest sample."""
        return max(self.samples)

    def __truediv__(self, other: Spread) -> Spread:
        """Ratio to another one that was measured in the same turns, turn by turn."""
        return Spread(tuple(a / b for a, b in zip(self.samples, other.samples, strict=True)))

    def to_dict(self) -> dict:
        """For JSON: median, min, max and all samples."""
        return {"median": self.median, "min": self.lowest, "max": self.highest, "samples": list(self.samples)}


@dataclass(frozen=True)
class Row:
    """One line of a table of measurements.

    Attributes
    ----------
    key : str
        Name of the row for programs, unique together with `accuracy`.
    what : str
        Name of the row for people.
    unit : str
        Of `ours` and `peer`.
    ours : Spread
    accuracy : str
        Preset of our engine, or "" where it plays no part.
    peer_name : str
        "" without peer.
    peer : Spread or None
    target : float or None
        What must be reached: a ratio where `is_ratio`, else an upper limit of `ours`. None: only shown.
    is_ratio : bool
        Whether `target` is a least ratio.
    is_valid : bool
        Whether what was measured is what the row claims (a residual small enough, say); else it never passes.
    notes : dict
        What else was seen, JSON-able.
    """

    key: str
    what: str
    unit: str
    ours: Spread
    accuracy: str = ""
    peer_name: str = ""
    peer: Spread | None = None
    target: float | None = None
    is_ratio: bool = True
    is_valid: bool = True
    notes: dict = field(default_factory=dict)

    @property
    def ratio(self) -> Spread | None:
        """Ours over the peer's, repeat by repeat; None without peer."""
        return None if self.peer is None else self.ours / self.peer

    @property
    def is_passed(self) -> bool | None:
        """True if the target is reached; None without a target or a peer."""
        if self.target is None or (self.is_ratio and self.peer is None):
            return None
        if not self.is_valid:
            return False
        return self.ratio.median >= self.target if self.is_ratio else self.ours.median <= self.target

    def to_dict(self) -> dict:
        """For JSON."""
        ratio = self.ratio
        return {
            "key": self.key, "what": self.what, "accuracy": self.accuracy, "unit": self.unit,
            "ours": self.ours.to_dict(), "peer_name": self.peer_name,
            "peer": self.peer.to_dict() if self.peer else None, "ratio": ratio.to_dict() if ratio else None,
            "target": self.target, "is_ratio": self.is_ratio, "pass": self.is_passed, "notes": self.notes,
        }  # fmt: skip


def interleave(
    contestants: dict[str, Callable[[], float]],
    repeats: int,
    tick: Callable[[str], None] | None = None,
    *,
    is_warm: bool = False,
) -> dict[str, Spread]:
    """Measure contestants in turns, A B, B A, ..., so that a disturbance of the machine disturbs them alike.

    Parameters
    ----------
    contestants : dict of callables
        Each runs once and returns its measurement.
    repeats : int
        Of each.
    tick : callable, optional
        Told a contestant's name before each of its runs.
    is_warm : bool
        Whether the first runs count; else all run once before.

    Returns
    -------
    dict of Spread
        Under the same names; sample k of all was measured in the same turn.
    """
    samples: dict[str, list[float]] = {name: [] for name in contestants}
    for turn in range(0 if is_warm else -1, repeats):
        for name in list(contestants) if turn % 2 == 0 or turn < 0 else reversed(contestants):
            if tick is not None:
                tick(name)
            value = contestants[name]()
            if turn >= 0:
                samples[name].append(value)
    return {name: Spread(tuple(values)) for name, values in samples.items()}


def fastest(spreads: dict[str, Spread], names: Sequence[str]) -> str:
    """Name with the highest median among `names`."""
    return max(names, key=lambda name: spreads[name].median)


class Stopwatch:
    """Sum of the times of the parts of a run that count.

    Use it as ``with watch: ...`` around each part; `seconds` is their sum [s].
    """

    def __init__(self):
        self.seconds = 0.0

    def __enter__(self):
        self._start = time.perf_counter()
        return self

    def __exit__(self, *_):
        self.seconds += time.perf_counter() - self._start
