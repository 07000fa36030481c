"""Principal pivoting on contact problems, against enumeration, with redundancy and exact scaling."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from physics.kernels.lcp.dantzig import dantzig, dantzig_sizes
from physics.kernels.lcp.scaling_and_certificate import LCP_BAD_DATA, LCP_PIVOT_LIMIT, LCP_RAY, LCP_SOLVED
from tests.reference.lcp import enumerate_solutions

EPS = np.finfo(float).eps


def solve(M, q, max_pivots=2000):
    M, q = np.array(M, float), np.array(q, float)
    shape, length = dantzig_sizes(len(q))
    z = np.full(len(q), np.nan)
    status, pivots = dantzig(M, q, z, np.full(shape, np.nan), np.full(length, -99), max_pivots)
    return status, pivots, z


def residual(M, q, z):
    return np.abs(np.minimum(z, M @ z + q)).max()


def block_contacts(points, inertia=(6.5, 14.5, 17.0), mass=6.0):
    """Jacobian (n, 6) and Delassus matrix of contacts of one block with a floor, normal +y."""
    J = np.array([[0, 1, 0, *np.cross(r, (0, 1, 0))] for r in points], float)
    return J, J @ np.diag(1 / np.array([mass, mass, mass, *inertia])) @ J.T


CORNERS = [(x, -1.5, z) for x in (-2.5, 2.5) for z in (-1.0, 1.0)]


def test_baraff_1994_block_on_four_coplanar_contacts_carries_its_weight():
    """Rank 3 of 4: any solution has acceleration zero and forces that add up to the weight."""
    J, A = block_contacts(CORNERS)
    weight = 6.0 * 9.81
    status, _, f = solve(A, J @ [0, -9.81, 0, 0, 0, 0])
    assert status == LCP_SOLVED
    # contact forces of order 60, entries of A below 1.2: 1e-13 is ten roundings of A f
    assert np.abs(A @ f + J @ [0, -9.81, 0, 0, 0, 0]).max() < 1e-13
    np.testing.assert_allclose(J.T @ f, [0, weight, 0, 0, 0, 0], atol=1e-12)


@pytest.mark.parametrize("copies", [1, 5, 20])
def test_repeated_contacts_leave_velocities_unchanged(copies):
    J, A = block_contacts(CORNERS[:3] * copies)
    q = J @ [0.3, -1.0, 0.2, 0.4, 0.1, -0.3]
    status, pivots, z = solve(A, q)
    assert status == LCP_SOLVED
    assert np.count_nonzero(z) <= 3
    assert pivots <= 2 * 3
    once = solve(A[:3, :3], q[:3])[2]
    assert np.abs(A @ z + q - np.tile(A[:3, :3] @ once + q[:3], copies)).max() < 1e-14


def test_contacts_in_general_position_have_rank_six():
    rng = np.random.default_rng(3)
    for count in (8, 24, 60):
        J = rng.normal(size=(count, 6))
        A, q = J @ J.T, J @ rng.normal(size=6)
        status, _, z = solve(A, q)
        assert status == LCP_SOLVED
        assert np.count_nonzero(z) <= 6
        assert residual(A, q, z) <= 100 * EPS * np.abs(A).max() * max(1, np.abs(z).max())


def test_a_body_wedged_between_walls_that_close_has_no_solution():
    J = np.array([[1.0], [-1.0]])
    status, _, z = solve(J @ J.T, [-1, -1])
    assert status == LCP_RAY
    assert not z.any()


def test_a_massless_direction_that_must_move_has_no_solution():
    assert solve([[0.0]], [-1.0])[0] == LCP_RAY
    assert solve([[0.0]], [1.0])[0] == LCP_SOLVED


def test_driven_and_blocking_index_at_zero_together_was_reported_as_a_ray():
    """Both rows are the same contact seen from two sides of rounding: w1 and w2 vanish together."""
    for seed in range(400):
        rng = np.random.default_rng(seed)
        G = rng.normal(size=(9, 2))
        M, q = G @ G.T, G @ rng.normal(size=2)
        status, _, z = solve(M, q)
        assert status == LCP_SOLVED, seed
        assert residual(M, q, z) <= 1e-9 * max(1, np.abs(z).max())


@pytest.mark.parametrize("bad", [np.nan, -np.inf])
def test_data_that_are_not_finite_are_refused(bad):
    assert solve([[1, bad], [bad, 1]], [-1, -1])[0] == LCP_BAD_DATA
    assert solve([[1, 0], [0, 1]], [1, bad])[0] == LCP_BAD_DATA


def test_a_negative_diagonal_is_refused():
    assert solve([[-1.0]], [-1.0])[0] == LCP_BAD_DATA


def test_pivot_limit_is_reported_and_leaves_zeros():
    status, pivots, z = solve(np.eye(4), -np.ones(4), max_pivots=3)
    assert (status, pivots) == (LCP_PIVOT_LIMIT, 3)
    assert not z.any()
    assert solve(np.eye(4), -np.ones(4), max_pivots=4)[:2] == (LCP_SOLVED, 4)


@st.composite
def semidefinite(draw):
    n, rank = draw(st.integers(1, 6)), draw(st.integers(1, 4))
    entries = st.integers(-3, 3)
    G = np.array(draw(st.lists(entries, min_size=n * rank, max_size=n * rank)), float).reshape(n, rank)
    return G @ G.T, np.array(draw(st.lists(entries, min_size=n, max_size=n)), float)


@settings(max_examples=300, deadline=None)
@given(semidefinite())
def test_semidefinite_problems_equal_enumeration(problem):
    M, q = problem
    status, _, z = solve(M, q)
    expected = enumerate_solutions(M, q)
    assert status == (LCP_SOLVED if expected else LCP_RAY)
    if expected:
        # integer data below 40, nonsingular blocks have determinants >= 1: z loses at most four digits
        assert residual(M, q, z) <= 1e-11 * max(1, np.abs(z).max())
        assert np.abs(M @ (z - expected[0])).max() <= 1e-11 * max(1, np.abs(z).max())


def test_order_of_contacts_does_not_change_velocities():
    J, A = block_contacts(CORNERS)
    q = J @ [0, -1.0, 0, 0.3, 0, 0.2]
    u = A @ solve(A, q)[2] + q
    for order in itertools.permutations(range(4)):
        k = list(order)
        assert np.abs(A[k] @ solve(A[np.ix_(k, k)], q[k])[2][np.argsort(k)] + q[k] - u[k]).max() < 1e-14


def test_scaling_by_powers_of_two_scales_z_bit_for_bit():
    rng = np.random.default_rng(5)
    for n in (3, 8, 24):
        G = rng.normal(size=(n, max(2, n // 2)))
        M, q = G @ G.T, G @ rng.normal(size=G.shape[1])
        status, pivots, z = solve(M, q)
        assert status == LCP_SOLVED
        assert z.any()
        for m_power, q_power in ((40, 0), (-33, 0), (0, 51), (7, -90)):
            scaled = solve(np.ldexp(M, m_power), np.ldexp(q, q_power))
            assert scaled[:2] == (status, pivots)
            assert np.array_equal(scaled[2], np.ldexp(z, q_power - m_power))


def test_a_feather_and_a_locomotive_in_one_problem():
    """Two blocks apart, masses 1e-6 and 1e6 kg, each on four contacts."""
    J, A = block_contacts(CORNERS)
    zero = np.zeros((4, 4))
    M = np.block([[A * 1e6, zero], [zero, A * 1e-6]])
    q = np.tile(J @ [0, -9.81, 0, 0, 0, 0], 2)
    status, _, f = solve(M, q)
    assert status == LCP_SOLVED
    np.testing.assert_allclose([f[:4].sum(), f[4:].sum()], [6 * 9.81e-6, 6 * 9.81e6], rtol=1e-13)
