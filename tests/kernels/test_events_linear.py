"""Parts of the event-driven scheme: elimination, contact points and how they move."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from physics.kernels.half_space.contact_point import contact_arm_and_rate
from physics.kernels.math.full_pivot_solve import PIVOT_SHARE, solve_full_pivot, solve_least_norm
from physics.kernels.state.layout import BLOCK, ELLIPSOID, SPHERE

EPS = np.finfo(float).eps


def solved(A, b):
    """(rank, x) by the kernel, with room to spare in its arrays."""
    m = len(b)
    system = np.full((m + 2, m + 3), np.nan)
    system[:m, :m], system[:m, m] = A, b
    order, x = np.zeros(m + 2, np.int64), np.full(m + 2, np.nan)
    return solve_full_pivot(m, system, order, x)[0], x[:m]


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
    solve_least_norm(rows, m, system, x)
    assert np.abs(x - truth).max() <= 100 * m * EPS * condition**2 * np.linalg.norm(b)


# --- contact points ------------------------------------------------------------------------------------------------


def unit(rng, size):
    """A random unit vector."""
    v = rng.normal(size=size)
    return v / np.linalg.norm(v)


def arm(shape, dims, R, w, n, feature=0):
    """Arm and rate as arrays."""
    r, rate = contact_arm_and_rate(shape, tuple(dims), tuple(R.ravel()), tuple(w), tuple(n), feature, None, None)
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
