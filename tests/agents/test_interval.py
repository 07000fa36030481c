"""The confidence interval against its definition and published values."""

from __future__ import annotations

import pytest

from agents.interval import Z_95, wilson


@pytest.mark.parametrize(
    ("successes", "trials", "low", "high"),
    [(81, 263, 0.2553, 0.3662), (15, 148, 0.0624, 0.1605), (0, 20, 0.0, 0.1611), (1, 29, 0.0061, 0.1718)],
)
def test_newcombe_1998_table_1_method_3(successes, trials, low, high):
    assert wilson(successes, trials) == pytest.approx((low, high), abs=5e-5)  # four published digits


@pytest.mark.parametrize(("successes", "trials"), [(1, 2), (3, 7), (977, 1000), (499, 1000)])
def test_ends_are_z_standard_errors_away(successes, trials):
    share = successes / trials
    for p in wilson(successes, trials):
        # (share - p)² and z² p (1 - p) / n are of order 1e-4 to 1, known to rounding of terms of order 1
        assert (share - p) ** 2 == pytest.approx(Z_95**2 * p * (1 - p) / trials, abs=1e-14)


def test_all_or_nothing_stays_within_zero_and_one():
    assert wilson(0, 50)[0] == 0.0
    assert wilson(50, 50)[1] == 1.0
    assert wilson(50, 50)[0] == pytest.approx(1.0 - wilson(0, 50)[1], abs=1e-15)


@pytest.mark.parametrize(("successes", "trials"), [(0, 0), (-1, 5), (6, 5)])
def test_impossible_counts_are_refused(successes, trials):
    with pytest.raises(ValueError, match="allowed is 0 to trials"):
        wilson(successes, trials)
