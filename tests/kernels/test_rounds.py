"""Ellipsoids against ellipsoids and blocks: the direction of the largest separation, against a slow oracle."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from physics.kernels.multibody.narrowphase import ellipsoid_distance
from tests.reference.separation import block_support, ellipsoid_support, largest_separation, spread

lengths = st.tuples(*[st.floats(0.2, 5.0)] * 3)


def pair(seed, a, b, is_block, gap):
    """(A, B, C, d) with the centre of a where a coarse look says that the bodies are `gap` apart, in the frame of b."""
    rng = np.random.default_rng(seed)
    C = Rotation.random(random_state=seed).as_matrix()
    way = rng.standard_normal(3)
    way /= np.linalg.norm(way)
    n = spread(2000)
    size = ellipsoid_support(a, C, n) + (block_support(b, n) if is_block else ellipsoid_support(b, np.eye(3), n))
    low, high = 0.0, 100.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if (n @ (middle * way) - size).max() < gap else (low, middle)
    A = ellipsoid_distance.ellipsoid_matrix(tuple(C.ravel()), tuple(a))
    B = (b[0] ** 2, 0.0, 0.0, b[1] ** 2, 0.0, b[2] ** 2)
    return A, B, C, tuple((high * way).tolist())


def solve(A, B, b, is_block, d):
    start = ellipsoid_distance.nearest_on_block(d, tuple(b))[1] if is_block else ellipsoid_distance.center_direction(d)
    n, apart = ellipsoid_distance.max_separation_direction(A, is_block, B, tuple(b), d, start)
    on_a = np.array(d) - ellipsoid_distance.ellipsoid_support_point(A, n)[1]
    on_b = (
        ellipsoid_distance.block_support_point(tuple(b), n, tuple(on_a))
        if is_block
        else ellipsoid_distance.ellipsoid_support_point(B, n)[1]
    )
    return np.array(n), apart, on_a, np.array(on_b)


@pytest.mark.parametrize("is_block", [False, True], ids=["ellipsoid", "block"])
@pytest.mark.parametrize("gap", [-0.01, -1e-4, 1e-4, 0.1, 3.0])
def test_the_separation_is_the_largest_there_is(is_block, gap):
    for seed in range(8):
        rng = np.random.default_rng(100 + seed)
        a, b = 10 ** rng.uniform(-0.7, 0.7, (2, 3))
        share = gap * min(*a, *b)
        A, B, C, d = pair(seed, a, b, is_block, share)
        n, apart, _, _ = solve(A, B, b, is_block, d)
        second = (lambda m, b=b: block_support(b, m)) if is_block else lambda m, b=b: ellipsoid_support(b, np.eye(3), m)
        expected = largest_separation(lambda m, a=a, C=C: ellipsoid_support(a, C, m), second, np.array(d))
        # Any direction's σ is a lower bound of the largest; the oracle's is 1e-12 of the size off, and so is σ at a
        # direction that is 1e-6 off.
        assert apart == pytest.approx(expected, abs=1e-10 * (np.linalg.norm(d) + 1.0))
        assert np.linalg.norm(n) == pytest.approx(1.0, abs=1e-15)


@given(st.integers(0, 10**6), lengths, lengths, st.booleans(), st.sampled_from([-1e-3, 1e-6, 1e-2, 1.0]))
@settings(max_examples=300, deadline=None)
def test_the_two_points_lie_along_the_normal(seed, a, b, is_block, gap):
    """The condition of the largest separation itself, for any two bodies: p_a - p_b = σ n."""
    A, B, _, d = pair(seed, np.array(a), np.array(b), is_block, gap * min(*a, *b))
    n, apart, on_a, on_b = solve(A, B, b, is_block, d)
    # Directions are found to 1e-10, or to where σ does not grow by rounding any more, √1e-16; points move by that times
    # the largest radius of curvature, 25/0.2.
    np.testing.assert_allclose(on_a - on_b, apart * n, rtol=0, atol=1e-8 * 125)


def test_a_ball_as_an_ellipsoid_is_a_ball():
    A, B = (
        ellipsoid_distance.ellipsoid_matrix((1.0, 0, 0, 0, 1.0, 0, 0, 0, 1.0), (0.5, 0.5, 0.5)),
        (4.0, 0.0, 0.0, 4.0, 0.0, 4.0),
    )
    d = (3.0, 1.0, -2.0)
    n, apart, _, _ = solve(A, B, (2.0, 2.0, 2.0), False, d)
    distance = np.linalg.norm(d)
    np.testing.assert_allclose(n, np.array(d) / distance, rtol=0, atol=1e-15)
    assert apart == pytest.approx(distance - 2.5, abs=1e-15)
