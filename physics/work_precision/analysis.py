"""Front, order and floor of a ladder of errors and times. Pure functions of numbers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

# Two points always lie on a line.
LEAST_POINTS = 3

# Errors that a power of the step explains by less than this share of their variance have no order.
LEAST_FIT = 0.95

# An error lies on a line through others when it is off by less than this factor.
NEAR = 2.0

# Below this observed order a smaller step does not pay any more: half of the lowest order a convergent scheme has.
FLAT_ORDER = 0.5


def front(errors: Sequence[float], costs: Sequence[float], floor: float = 0.0) -> list[int]:
    """Indices of the points that no other point beats, quickest first.

    A point is on the front if every quicker one has a larger error. Errors at or below `floor`, the truth's own error,
    cannot be told apart and count as equal to it: the quickest of them is on the front. Points that are not finite
    never are.
    """
    found, best = [], math.inf
    order = sorted(range(len(errors)), key=lambda i: (costs[i], errors[i]))
    for i in order:
        seen = max(errors[i], floor)
        if seen < best:  # false for what is not finite
            found.append(i)
            best = seen
    return found


def flat_tail(steps: Sequence[float], errors: Sequence[float]) -> list[int]:
    """Indices of the smallest steps over which the error no longer falls, finest first; empty while it still falls.

    The tail grows from the finest step towards coarser ones, while the coarser one's error is at most the finer one's
    times the `FLAT_ORDER`-th power of the ratio of the steps. A single step is no tail. A lucky value in the middle is
    none either: the finer steps after it fall again.
    """
    order = [i for i in np.argsort(steps, kind="stable") if math.isfinite(errors[i])]
    tail = order[:1]
    for finer, coarser in pairwise(order):
        if errors[coarser] > errors[finer] * (steps[coarser] / steps[finer]) ** FLAT_ORDER:
            break
        tail.append(coarser)
    return tail if len(tail) > 1 else []


def plateau(steps: Sequence[float], errors: Sequence[float]) -> float | None:
    """Smallest error of the `flat_tail`, which smaller steps do not improve. None while the error still falls."""
    tail = flat_tail(steps, errors)
    return min(errors[i] for i in tail) if tail else None


def observed_order(steps: Sequence[float], errors: Sequence[float], floor: float = 0.0) -> float | None:
    """Slope of log error over log step by least squares, where the error falls as a power of the step.

    Left out are, at the fine end, errors at the truth's own `floor` and the `flat_tail` but for its coarsest point, at
    which the fall ends; at the coarse end, steps too large for the power to show: the fewest such that the rest lie
    within a factor `NEAR` of their line, at most a quarter of those that fall: more would find a power in noise. None
    where fewer than `LEAST_POINTS` steps are left, or no rising line explains them (`LEAST_FIT`). Errors that are not
    finite count as absent.
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
    """Line through points by least squares: slope, share of the variance that it explains, farthest point from it."""
    x, y = x - x.mean(), y - y.mean()
    slope = float(x @ y / (x @ x))
    rest = y - slope * x
    return slope, 1.0 - float(rest @ rest) / float(y @ y) if y.any() else 0.0, float(np.abs(rest).max())


def lost_from(steps: Sequence[float], is_lost: Sequence[bool]) -> float | None:
    """Smallest step from which on every larger one is lost; None if the largest is not lost."""
    found = None
    for i in sorted(range(len(steps)), key=lambda i: -steps[i]):
        if not is_lost[i]:
            break
        found = steps[i]
    return found
