"""Confidence intervals: of a success rate, and of a mean over few runs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import stats

CONFIDENCE = 0.95
RESAMPLES = 10_000
TRIMMED = 0.25  # share of the runs that the interquartile mean leaves out at each end


def wilson(successes: int, trials: int) -> tuple[float, float]:
    """Wilson score interval of a binomial proportion at 95 %, by SciPy.

    Unlike the interval of the textbooks (Wald) it stays within [0, 1] and keeps its width at shares of 0 and 1.

    Parameters
    ----------
    successes, trials : int
        0 <= successes <= trials, trials >= 1.

    Returns
    -------
    low, high : float

    Raises
    ------
    ValueError
        On counts out of range.

    References
    ----------
    E. B. Wilson, *Probable inference, the law of succession, and statistical inference*, J. Amer. Stat.
    Assoc. 22, 1927.
    """
    if not (trials >= 1 and 0 <= successes <= trials):
        raise ValueError(f"successes is {successes} of {trials} trials; allowed is 0 to trials, at least 1 trial")
    found = stats.binomtest(successes, trials).proportion_ci(CONFIDENCE, method="wilson")
    return float(found.low), float(found.high)


def interquartile_mean(values: Sequence[float]) -> float:
    """Mean of the middle half of some runs' numbers, on which one lucky or failed run has no hold."""
    return float(stats.trim_mean(values, TRIMMED))


def bootstrap(values: Sequence[float]) -> tuple[float, float]:
    """Bootstrap interval (percentiles, 95 %) of the interquartile mean of some runs' numbers.

    One run says nothing about others: its interval is (nan, nan).
    """
    if len(values) < 2:
        return float("nan"), float("nan")
    found = stats.bootstrap(
        (np.asarray(values, dtype=np.float64),), lambda x, axis: stats.trim_mean(x, TRIMMED, axis=axis),
        n_resamples=RESAMPLES, confidence_level=CONFIDENCE, method="percentile", vectorized=True,
        random_state=np.random.default_rng(0),
    )  # fmt: skip
    return float(found.confidence_interval.low), float(found.confidence_interval.high)
