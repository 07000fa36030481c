"""The metric on constructed trajectories, exactly."""

import numpy as np
import pytest

from rigid_env.lab.tosses.data import SIDE
from rigid_env.lab.tosses.metric import Summary, angle, compare


def about_x(degrees):
    half = np.radians(np.asarray(degrees, dtype=float)) / 2.0
    return np.stack([np.cos(half), np.sin(half), 0.0 * half, 0.0 * half], axis=-1)


def constructed():
    """Two tosses of 2 and 4 frames: off by 0, 1 and by 0, 2, 4, 6 cube widths along y and tens of degrees about x."""
    steps = np.array([0, 1, 0, 2, 4, 6], dtype=float)
    measured = np.zeros((6, 7))
    measured[:, 3:] = about_x(30.0)
    replayed = measured.copy()
    replayed[:, 1] += SIDE * steps
    replayed[:, 3:] = -about_x(30.0 + 10.0 * steps)  # the sign of a quaternion means nothing
    return measured, replayed, np.array([0, 2, 6])


def test_means_over_frames_then_mean_and_median_over_tosses():
    errors = compare(*constructed())
    position, rotation = errors.per_toss()
    np.testing.assert_allclose(position, [0.5, 3.0], rtol=1e-15)
    np.testing.assert_allclose(rotation, [5.0, 30.0], rtol=1e-13)
    summary = errors.summary()
    assert summary.tosses == 2
    assert summary.position_mean == pytest.approx(1.75, rel=1e-14)
    assert summary.rotation_median == pytest.approx(17.5, rel=1e-12)
    assert errors.summary([1]).position_mean == pytest.approx(3.0, rel=1e-14)


def test_mean_and_median_differ_as_they_should():
    summary = Summary.of(np.array([1.0, 2.0, 9.0]), np.array([0.0, 1.0, 5.0]))
    assert (summary.position_mean, summary.position_median) == (4.0, 2.0)
    assert (summary.rotation_mean, summary.rotation_median) == (2.0, 1.0)


@pytest.mark.parametrize("degrees", [0.0, 1e-6, 1.0, 90.0, 179.999999, 180.0])
def test_angle_is_accurate_at_both_ends(degrees):
    # rounding of a quaternion, 1e-16, is 1e-14 degrees
    assert angle(about_x(20.0), about_x(20.0 + degrees)) == pytest.approx(degrees, abs=1e-13, rel=1e-13)


def test_along_weighs_tosses_alike_whatever_their_length():
    position, rotation = compare(*constructed()).along(2)
    np.testing.assert_allclose(position, [0.5 * (0.0 + 1.0), 0.5 * (1.0 + 5.0)], rtol=1e-14)
    np.testing.assert_allclose(rotation, 10.0 * position, rtol=1e-12)


def test_subset_is_that_of_these_tosses():
    part = compare(*constructed()).subset([1])
    np.testing.assert_array_equal(part.offsets, [0, 4])
    np.testing.assert_allclose(part.position, [0.0, 2.0, 4.0, 6.0], rtol=1e-14)


def test_other_numbers_of_frames_are_refused():
    measured, replayed, offsets = constructed()
    with pytest.raises(ValueError, match="5 frames"):
        compare(measured, replayed[:5], offsets)
