"""Numbers handed in: copied bit for bit, and every one that is not finite is noticed."""

from __future__ import annotations

import numpy as np
import pytest

from physics.kernels.state.copy_if_finite import copy_if_finite

# Signed zero, the smallest and the largest numbers: all finite, and x - x is 0 for each.
KINDS = np.array([0.0, -0.0, 5e-324, -1.7e308, 1.7e308, 1.0])


@pytest.mark.parametrize("n", range(1, 20))
def test_numbers_are_copied_to_the_bit(n):
    source, target = np.resize(KINDS, (1, n)), np.full((1, n), 7.0)
    assert copy_if_finite(source, target)
    assert target.tobytes() == source.tobytes()


@pytest.mark.parametrize("n", [1, 7, 8, 9, 16, 19])
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_one_that_is_not_finite_is_noticed_wherever_it_stands(n, bad):
    for k in range(n):
        source = np.resize(KINDS, (1, n))
        source[0, k] = bad
        assert not copy_if_finite(source, np.zeros((1, n)))


def test_infinities_do_not_make_up_for_each_other():
    source = np.ones((1, 16))
    source[0, [3, 11]] = np.inf, -np.inf
    assert not copy_if_finite(source, np.zeros((1, 16)))
