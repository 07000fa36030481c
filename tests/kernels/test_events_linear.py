"""Parts of the event-driven scheme: elimination, the time a gap is good for, contact points and how they move."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from physics.kernels.arms import arm_and_rate
from physics.kernels.events.air import parabola_root, safe_time
from physics.kernels.events.linear import PIVOT_SHARE, eliminate, solve_least
from physics.kernels.layout import BLOCK, ELLIPSOID, SPHERE

EPS = np.finfo(float).eps


def solved(A, b):
    """(rank, x) by the kernel, with room to spare in its arrays."""
    m = len(b)
    system = np.full((m + 2, m + 3), np.nan)
    system[:m, :m], system[:m, m] = A, b
    order, x = np.zeros(m + 2, np.int64), np.full(m + 2, np.nan)
    return eliminate(m, system, order, x)[0], x[:m]


@given(st.integers(1, 12), st.integers(0, 2**32 - 1))
def test_regular_systems_are_solved_as_numpy_does(m, seed):
    """The error is a few m roundings times the condition number, growth of full pivoting below 10."""
    rng = np.random.default_rng(seed)
    A, b = rng.normal(size=(m, m)), rng.normal(size=m)
    condition = np.linalg.cond(A)
    if condition > 1e6:
        return  # its last pivot may count as none
    rank, x = solved(A, b)
    truth = np.linalg.solve(A, b)
    assert rank == m
    assert np.abs(x - truth).max() <= 10 * m * EPS * condition * np.abs(truth).max()


@given(st.integers(2, 12), st.data(), st.integers(0, 2**32 - 1))
def test_singular_consistent_systems_are_solved(m, data, seed):
    """Rows that say the same twice: the rank of numpy, all equations hold, unknowns without a pivot are zero."""
    rng = np.random.default_rng(seed)
    rank = data.draw(st.integers(0, m - 1))
    B = rng.normal(size=(m, rank))
    A = B @ rng.normal(size=(rank, m))
    singular = np.linalg.svd(A, compute_uv=False)
    if rank and singular[rank - 1] < 1e-5 * singular[0]:
        return
    b = A @ rng.normal(size=m)
    found, x = solved(A, b)
    assert found == rank
    assert np.count_nonzero(x) <= rank
    size = max(1.0, np.abs(A).max() * np.abs(x).max()) if rank else 1.0
    # The residual of elimination is a few m roundings of |A| |x|; what is dropped is PIVOT_SHARE of nothing.
    assert np.abs(A @ x - b).max() <= 100 * m * EPS * size


def test_a_pivot_of_less_than_its_share_is_none():
    assert solved(np.diag([1.0, 2 * PIVOT_SHARE]), [1.0, 1.0])[0] == 2
    rank, x = solved(np.diag([1.0, 0.5 * PIVOT_SHARE]), [1.0, 0.0])
    assert rank == 1
    assert x.tolist() == [1.0, 0.0]


@given(st.integers(1, 6), st.integers(0, 12), st.integers(0, 3), st.integers(0, 2**32 - 1))
def test_least_solution_is_that_of_the_pseudoinverse(rank, free, implied, seed):
    """A few m roundings times the condition number; rows that are sums of those before them change nothing."""
    rng = np.random.default_rng(seed)
    m = rank + free
    A = rng.normal(size=(rank, m))
    condition = np.linalg.cond(A)
    if condition > 1e6:
        return
    truth = np.linalg.pinv(A) @ (b := rng.normal(size=rank))
    extra = rng.integers(-2, 3, size=(min(implied, free), rank)).astype(float)
    rows = rank + len(extra)
    system, x = np.full((rows, m + 1), np.nan), np.full(m, np.nan)
    system[:, :m], system[:, m] = np.vstack([A, extra @ A]), np.concatenate([b, extra @ b])
    solve_least(rows, m, system, x)
    assert np.abs(x - truth).max() <= 100 * m * EPS * condition**2 * np.linalg.norm(b)


# --- how long a gap is good for ------------------------------------------------------------------------------------


def none_or_some(most):
    """Numbers up to `most` that are zero or not so small that a root is beyond the largest number."""
    return st.floats(-most, most).filter(lambda a: a == 0 or abs(a) > 1e-6)


GAP, RATE, BEND = st.floats(1e-6, 10), none_or_some(10), none_or_some(30)


@given(GAP, RATE, BEND)
def test_parabola_root_is_the_first_zero(g, r, b):
    t = parabola_root(g, r, b)
    if t == math.inf:
        # Never below zero: at its lowest place, rounding of r² aside.
        lowest = g - r * r / (2 * b) if b > 0 and r < 0 else g
        assert lowest >= -8 * EPS * g
        assert b > 0 or (b == 0 and r >= 0)
        return
    # Zero to the rounding of its terms, and positive before it (it is the smaller of the positive roots).
    size = g + abs(r) * t + abs(b) * t * t
    assert abs(g + r * t + b * t * t / 2) <= 16 * EPS * size
    for share in np.linspace(0, 1 - 1e-6, 20):
        s = share * t
        assert g + r * s + b * s * s / 2 >= -16 * EPS * size


@given(GAP, RATE, BEND, st.floats(0, 50), st.floats(1e-3, 10), st.lists(st.floats(-1, 1), min_size=3))
def test_safe_time_is_never_beyond_the_first_zero(g, r, b, third, horizon, shares):
    """Any gap whose third derivative stays within the bound, its worst case too, is not used up by then."""
    t = safe_time(g, r, b, third, horizon)
    assert 0 < t <= horizon
    scale = g + abs(r) * t + abs(b) * t * t + third * t**3
    # A constant third derivative -third is the worst; then piecewise constant ones, each sampled.
    for s in np.linspace(0, t, 100):
        assert g + r * s + b * s * s / 2 - third * s**3 / 6 >= -1e-13 * scale
    y, h = [g, r, b], t / len(shares)
    for share in shares:
        c = share * third
        for s in np.linspace(0, h, 8):
            assert y[0] + y[1] * s + y[2] * s * s / 2 + c * s**3 / 6 >= -1e-13 * scale
        y = [y[0] + y[1] * h + y[2] * h * h / 2 + c * h**3 / 6, y[1] + y[2] * h + c * h * h / 2, y[2] + c * h]


@pytest.mark.parametrize("b", [-9.81, 0.0, 4.0])
def test_safe_time_without_a_third_derivative_is_the_zero_itself(b):
    assert safe_time(1.0, -4.0, b, 0.0, 10.0) == parabola_root(1.0, -4.0, b)


def test_safe_time_of_a_contact_that_is_about_to_leave():
    """From no gap and no speed at all: b t²/2 - C t³/6 is zero at 3 b / C."""
    assert safe_time(0.0, 0.0, 4.0, 6.0, 10.0) == pytest.approx(2.0, rel=4 * EPS)
    assert safe_time(0.0, 0.0, 4.0, 6.0, 1.0) == 1.0


# --- contact points ------------------------------------------------------------------------------------------------


def unit(rng, size):
    """A random unit vector."""
    v = rng.normal(size=size)
    return v / np.linalg.norm(v)


def arm(shape, dims, R, w, n, feature=0):
    """Arm and rate as arrays."""
    r, rate = arm_and_rate(shape, tuple(dims), tuple(R.ravel()), tuple(w), tuple(n), feature, None, None)
    return np.array(r), np.array(rate)


@pytest.mark.parametrize("shape", [BLOCK, SPHERE, ELLIPSOID])
def test_contact_point_is_the_support_and_moves_as_its_difference_quotient_says(shape, rng):
    """Central differences over ±h err by h²/6 of the third derivative and by rounding, EPS ρ / h.

    The third derivative is below ρ Ω³, of an ellipsoid below 3 κ² more often (`events.air`), and once more κ for
    the point itself in place of the gap.
    """
    h = 1e-4
    for _ in range(20):
        dims = rng.uniform(0.5, 2.0, size=3) if shape != SPHERE else np.full(3, 1.3)
        n, w = unit(rng, 3), rng.normal(size=3)
        R = expm(cross_matrix(rng.normal(size=3)))
        ahead, behind = (expm(cross_matrix(s * h * w)) @ R for s in (1, -1))
        turn, kappa = np.linalg.norm(w), dims.max() / dims.min()
        bound = np.linalg.norm(dims) * turn**3 * (1 if shape != ELLIPSOID else 3 * kappa**3)
        tolerance = bound * h * h / 6 + 8 * EPS * np.linalg.norm(dims) / h
        heights = []
        for feature in range(8 if shape == BLOCK else 1):
            r, rate = arm(shape, dims, R, w, n, feature)
            quotient = (arm(shape, dims, ahead, w, n, feature)[0] - arm(shape, dims, behind, w, n, feature)[0]) / (
                2 * h
            )
            assert rate == pytest.approx(quotient, abs=tolerance)
            heights.append(n @ r)
        e = dims * (R.T @ n)
        support = np.abs(e).sum() if shape == BLOCK else np.linalg.norm(e)
        # The lowest point is as deep as the support function says.
        assert min(heights) == pytest.approx(-support, rel=1e-14)


def cross_matrix(w):
    """[w]x."""
    return np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
