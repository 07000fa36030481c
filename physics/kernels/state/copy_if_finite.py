"""Copy numbers that a user gives, and check in the same pass that they are finite."""

from __future__ import annotations

from physics.compiler.decorators import kernel
from physics.compiler.simd import LANE_COUNT, Lanes, lane_sum, load_lanes, store_lanes


@kernel
def copy_if_finite(source, target):
    """Copy `source` (1, n) float64 to `target` (1, n) float64; return whether all numbers are finite.

    A number x is finite if and only if x - x = 0.
    """
    n, k, odd = source.shape[1], 0, 0.0
    first = second = Lanes(0.0, 0.0, 0.0, 0.0)  # two sums side by side: neither waits for the other
    while k + 2 * LANE_COUNT <= n:
        x, y = load_lanes(source, 0, k), load_lanes(source, 0, k + LANE_COUNT)
        store_lanes(target, 0, k, x)
        store_lanes(target, 0, k + LANE_COUNT, y)
        first, second, k = first + (x - x), second + (y - y), k + 2 * LANE_COUNT
    while k < n:
        target[0, k] = source[0, k]
        odd, k = odd + (source[0, k] - source[0, k]), k + 1
    return lane_sum(first + second) + odd == 0.0
