"""Pareto front, observed order and plateau of measured errors, steps and times: functions of plain numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

# Least number of points from which an order is computed, since two points always lie on a line.
LEAST_POINTS = 3

# Least share of the variance of the errors that a power of the step must explain; else there is no order.
LEAST_FIT = 0.95

# An error lies on a line through others if it is off by at most this factor.
NEAR = 2.0

# Below this observed order smaller steps do not pay: it is half of the lowest order that a convergent scheme has.
FLAT_ORDER = 0.5


def front(errors: Sequence[float], costs: Sequence[float], floor: float = 0.0) -> list[int]:
    """Indices of the points on the Pareto front of errors and costs, quickest first.

    A point is on the front if every quicker point has a larger error. Errors at or below `floor`, the truth's own
    error, cannot be told apart and count as equal to it, so that only the quickest of them is on the front. Points
    that are not finite are never on it.
    """
    found, best = [], math.inf
    order = sorted(range(len(errors)), key=lambda i: (costs[i], errors[i]))
    for i in order:
        seen = max(errors[i], floor)
        if seen < best:  # false if it is not finite
            found.append(i)
            best = seen
    return found


def flat_tail(steps: Sequence[float], errors: Sequence[float]) -> list[int]:
    """Indices of the finest steps over which the error no longer falls, finest first; empty if it falls to the end.

    The tail grows from the finest step towards coarser ones, as long as the error of the coarser step is at most that
    of the finer one times the `FLAT_ORDER`-th power of the ratio of the steps. A single step is no tail.
    """
    order = [i for i in np.argsort(steps, kind="stable") if math.isfinite(errors[i])]
    tail = order[:1]
    for finer, coarser in pairwise(order):
        if errors[coarser] > errors[finer] * (steps[coarser] / steps[finer]) ** FLAT_ORDER:
            break
        tail.append(coarser)
    return tail if len(tail) > 1 else []


def plateau(steps: Sequence[float], errors: Sequence[float]) -> float | None:
    """Smallest error of the `flat_tail`: smaller steps do not improve it. None if the error falls to the end."""
    tail = flat_tail(steps, errors)
    return min(errors[i] for i in tail) if tail else None


def observed_order(steps: Sequence[float], errors: Sequence[float], floor: float = 0.0) -> float | None:
    """Slope of log error over log step by least squares, where the error falls as a power of the step.

    Some points are left out. At the fine end these are errors at or below `floor`, the truth's own error, and all of
    the `flat_tail` but its coarsest point. At the coarse end they are the largest steps, as few as possible, until the
    rest lies within a factor `NEAR` of its line; at most a quarter, since more would find a power in noise. Errors
    that are not finite are left out, too. None is returned if fewer than `LEAST_POINTS` steps remain, or if no rising
    line explains them (`LEAST_FIT`).
    """
    tail = flat_tail(steps, errors)[:-1]
    falling = [i for i in np.argsort(steps) if math.isfinite(errors[i]) and errors[i] > floor and i not in tail]
    if len({steps[i] for i in falling}) < LEAST_POINTS:
        return None
    x, y = np.log([steps[i] for i in falling]), np.log([errors[i] for i in falling])
    least = max(LEAST_POINTS, len(falling) - len(falling) // 4)
    for count in range(len(falling), least - 1, -1):
        slope, share, off = _line(x[:count], y[:count])
        if off <= math.log(NEAR):
            return slope if slope > 0.0 and share >= LEAST_FIT else None
    return None


def _line(x: np.ndarray, y: np.ndarray) -> tuple[float, float, float]:
    """Fit a line to points by least squares: slope, share of the variance that it explains, largest distance in y."""
    x, y = x - x.mean(), y - y.mean()
    slope = float(x @ y / (x @ x))
    rest = y - slope * x
    return slope, 1.0 - float(rest @ rest) / float(y @ y) if y.any() else 0.0, float(np.abs(rest).max())


def lost_from(steps: Sequence[float], is_lost: Sequence[bool]) -> float | None:
    """Smallest step such that this step and all larger ones are lost; None if the largest step is not lost."""
    found = None
    for i in sorted(range(len(steps)), key=lambda i: -steps[i]):
        if not is_lost[i]:
            break
        found = steps[i]
    return found
