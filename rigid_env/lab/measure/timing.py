"""Repeated measurements in turns, with medians and ratios, for comparisons on a machine with other load."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Spread:
    """Samples of one measurement that was repeated.

    Attributes
    ----------
    samples : tuple of float
        Measured values in their order, in the unit of the `Row` that contains them. If one measurement is several
        numbers, a sample is an object with all of them.
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
        """Ratio to another spread that was measured in the same turns, sample by sample."""
        return Spread(tuple(a / b for a, b in zip(self.samples, other.samples, strict=True)))

    def to_dict(self) -> dict:
        """Median, min, max and all samples as a dict for JSON."""
        return {"median": self.median, "min": self.lowest, "max": self.highest, "samples": list(self.samples)}


@dataclass(frozen=True)
class Row:
    """One row of a table of measurements.

    Attributes
    ----------
    key : str
        Name of the row for programs, unique together with `accuracy`.
    what : str
        Name of the row for people.
    unit : str
        Unit of `ours` and `peer`.
    ours : Spread
        Measurement of our engine.
    accuracy : str
        Preset of our engine, or "" if it does not matter.
    peer_name : str
        Name of the compared engine; "" without one.
    peer : Spread or None
        Measurement of the compared engine.
    target : float or None
        Least ratio if `is_ratio`, else largest value of `ours`. None: the row has no target.
    is_ratio : bool
        Whether `target` is a ratio.
    is_valid : bool
        False if the measured run did not do what the row says, for example with too large a residual; then it never
        passes.
    notes : dict
        Further results, for JSON.
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
        """Ratio of our measurement to the compared engine's, sample by sample; None without a compared engine."""
        return None if self.peer is None else self.ours / self.peer

    @property
    def is_passed(self) -> bool | None:
        """True if the target is reached; None without a target, or if a ratio has no compared engine."""
        if self.target is None or (self.is_ratio and self.peer is None):
            return None
        if not self.is_valid:
            return False
        return self.ratio.median >= self.target if self.is_ratio else self.ours.median <= self.target

    def to_dict(self) -> dict:
        """Row as a dict for JSON."""
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
    """Measure contestants in turns, A B, B A, ..., so that a disturbance of the machine affects all of them alike.

    Parameters
    ----------
    contestants : dict of str to callable
        Functions that run once and return their measurement.
    repeats : int
        Repeats of each.
    tick : callable, optional
        Called with a contestant's name before each of its runs.
    is_warm : bool
        False: every contestant runs once before, which does not count.

    Returns
    -------
    dict of str to Spread
        Samples by name; sample k of all contestants was measured in the same turn.
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
    """Timer for parts of a run.

    Use it as ``with watch: ...`` around each part; `seconds` is the sum of their times [s].
    """

    def __init__(self):
        self.seconds = 0.0

    def __enter__(self):
        self._start = time.perf_counter()
        return self

    def __exit__(self, *_):
        self.seconds += time.perf_counter() - self._start
