"""Confidence interval of a success rate."""

from __future__ import annotations

import math

Z_95 = 1.959963984540054  # 97.5 % quantile of the standard normal distribution


def wilson(successes: int, trials: int, z: float = Z_95) -> tuple[float, float]:
    """Wilson score interval of a binomial proportion.

    It is the set of p whose distance from the observed share is at most z standard errors *under p*:
    ``(share - p)² <= z² p (1 - p) / trials``. Unlike the interval of the textbooks (Wald) it stays within
    [0, 1] and keeps its width at shares of 0 and 1.

    Parameters
    ----------
    successes, trials : int
        0 <= successes <= trials, trials >= 1.
    z : float
        Quantile of the normal distribution; the default makes a 95 % interval.

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
    share, weight = successes / trials, z * z / trials
    centre = (share + weight / 2) / (1 + weight)
    half_width = math.sqrt(weight * (share * (1 - share) + weight / 4)) / (1 + weight)
    low = 0.0 if successes == 0 else centre - half_width
    high = 1.0 if successes == trials else centre + half_width
    return low, high
