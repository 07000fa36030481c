"""The confidence interval against its definition and published values."""

from __future__ import annotations

import math

import numpy as np
import pytest

from agents.interval import bootstrap, interquartile_mean, wilson

Z_95 = 1.959963984540054  # 97.5 % quantile of the standard normal distribution


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


def test_the_interquartile_mean_leaves_out_a_quarter_at_each_end():
    assert interquartile_mean([0.0, 0.9, 0.92, 1.0]) == pytest.approx(0.91)
    assert interquartile_mean([0.5]) == 0.5


def test_a_bootstrap_interval_covers_its_mean_as_often_as_it_says():
    """Count it over 100 samples of 20 normal numbers; 95 % less what few numbers cost, which is about 4 %."""
    rng = np.random.default_rng(0)
    covered = 0
    for _ in range(100):
        low, high = bootstrap(rng.normal(size=20))
        covered += low <= 0.0 <= high
    # binomial deviation of 100 at 0.91: 2.9; four of them
    assert 100 * 0.91 - 4 * 2.9 <= covered <= 100


def test_one_run_has_no_interval():
    assert all(math.isnan(end) for end in bootstrap([0.5]))
