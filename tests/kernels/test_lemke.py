"""Lemke's method on textbook problems, against enumeration, and under exact scaling."""

import os
import subprocess
import sys

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import linprog

from physics.kernels.lcp.lemke import lemke, lemke_sizes
from physics.kernels.lcp.scaling_and_certificate import LCP_BAD_DATA, LCP_PIVOT_LIMIT, LCP_RAY, LCP_SOLVED
from tests.reference.lcp import enumerate_solutions


def solve(M, q, max_pivots=2000):
    M, q = np.array(M, float), np.array(q, float)
    shape, length = lemke_sizes(len(q))
    z = np.full(len(q), np.nan)
    scratch = np.full(shape, np.nan), np.full(length, -99)
    status, pivots = lemke(M, q, z, *scratch, max_pivots)
    return status, pivots, z


def rounding(M, q, z):
    # The answer is refined: what remains is the rounding of one product M z, n terms
    # of at most max|M| max|z| each, twice for the products in the solver and in here.
    terms = np.abs(M).max() * np.abs(z).max() + np.abs(q).max()
    return 4 * len(q) * np.finfo(float).eps * terms


def assert_solves(M, q, z):
    M, q = np.asarray(M, float), np.asarray(q, float)
    assert np.abs(np.minimum(z, M @ z + q)).max() <= rounding(M, q, z)


def test_murty_example_2_8():
    M, q = np.array([[1.0, -1, -1, -1], [-1, 1, -1, -1], [1, 1, 2, 0], [1, 1, 0, 2]]), np.array([3.0, 5, -9, -5])
    status, _, z = solve(M, q)
    assert status == LCP_SOLVED
    # Every z is positive, so M z = -q: z is as far from the solution as M⁻¹ takes what M z + q is rounded by.
    assert np.abs(z - [2, 1, 3, 1]).max() <= np.linalg.norm(np.linalg.inv(M), np.inf) * rounding(M, q, z)


def test_murty_example_2_9_ends_in_a_ray():
    status, pivots, z = solve([[-1, 0, -3], [1, -2, -5], [-2, -1, -2]], [-3, -2, -1])
    assert status == LCP_RAY
    assert pivots > 0
    assert not z.any()


def test_kostreva_1979_example_1_cycles_without_a_tie_rule():
    M = [[1, 2, 0], [0, 1, 2], [2, 0, 1]]
    status, pivots, z = solve(M, [-1, -1, -1])
    assert status == LCP_SOLVED
    assert pivots <= 8  # 2^n complementary bases: no basis twice
    np.testing.assert_allclose(z, 1 / 3, rtol=4e-16)


def test_kostreva_1979_example_2_is_infeasible_in_its_third_row():
    assert solve([[1, -1, 3], [2, -1, 3], [-1, -2, 0]], [-1, -1, -1])[0] == LCP_RAY


@pytest.mark.parametrize("n", [2, 3, 4, 5, 6])
def test_murty_1978_exponential_example_takes_all_2_to_the_n_pivots(n):
    """Murty's triangular matrix with the covering column of ones.

    The solver's covering column is one over the row scales. One more unknown, whose w stays
    basic, gives all rows the same largest entry and so the covering column of the book.
    """
    M = np.full((n + 1, n + 1), 8.0)
    M[:n, :n] = np.eye(n) + 2 * np.tril(np.ones((n, n)), -1)
    M[n, :n] = 0.0
    q = [-sum(2.0 ** (n - k) for k in range(1, i + 1)) for i in range(1, n + 1)] + [1.0]
    status, pivots, z = solve(M, q)
    assert (status, pivots) == (LCP_SOLVED, 2**n)
    assert np.array_equal(z, [2.0 ** (n - 1)] + [0.0] * n)
    assert solve(M, q, max_pivots=2**n - 1)[:2] == (LCP_PIVOT_LIMIT, 2**n - 1)


def test_a_ray_proves_nothing_for_a_bimatrix_game():
    """[[0, A], [Bᵀ, 0]] with positive A, B is copositive but not copositive-plus.

    That is why Lemke and Howson gave such games a start of their own; the equilibrium exists.
    """
    A, B = np.array([[2.0, 1.0], [1.0, 2.0]]), np.array([[1.0, 2.0], [2.0, 1.0]])
    M = np.block([[np.zeros((2, 2)), A], [B.T, np.zeros((2, 2))]])
    assert solve(M, -np.ones(4))[0] == LCP_RAY
    assert any(np.allclose(z, 1 / 3) for z in enumerate_solutions(M, -np.ones(4)))


@pytest.mark.parametrize("q", [[0.0, 0.0], [1.0, 0.0]])
def test_nonnegative_q_is_solved_by_zero_without_pivots(q):
    status, pivots, z = solve([[-1, 0], [0, -1]], q)
    assert (status, pivots) == (LCP_SOLVED, 0)
    assert not z.any()


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_data_that_are_not_finite_are_refused(bad):
    assert solve([[1, bad], [0, 1]], [-1, -1])[0] == LCP_BAD_DATA
    assert solve([[1, 0], [0, 1]], [1, bad])[0] == LCP_BAD_DATA


integers = st.integers(-3, 3)


def matrices(rows, columns, elements=integers):
    return st.lists(st.lists(elements, min_size=columns, max_size=columns), min_size=rows, max_size=rows).map(
        lambda rows: np.array(rows, float)
    )


@st.composite
def definite(draw):
    n = draw(st.integers(1, 5))
    G, S = draw(matrices(n, n)), draw(matrices(n, n))
    return G @ G.T + np.eye(n) + (S - S.T), draw(matrices(1, n))[0]


@st.composite
def semidefinite(draw):
    n, rank = draw(st.integers(1, 5)), draw(st.integers(1, 3))
    G = draw(matrices(n, rank))
    return G @ G.T, draw(matrices(1, n))[0]


@st.composite
def copositive(draw):
    """Semidefinite plus a nonnegative matrix with positive diagonal: strictly copositive."""
    M, q = draw(semidefinite())
    n = len(q)
    return M + draw(matrices(n, n, st.integers(0, 3))) + np.eye(n), q


@settings(max_examples=150, deadline=None)
@given(definite())
def test_definite_problems_have_the_one_solution_of_enumeration(problem):
    M, q = problem
    status, _, z = solve(M, q)
    assert status == LCP_SOLVED
    assert_solves(M, q, z)
    # |z - z*| <= |M⁻¹| x residual; the smallest eigenvalue of the symmetric part is >= 1
    # and integers bound |M| by 5 x 9 + 6, so 1e-12 leaves three digits of room.
    expected = enumerate_solutions(M, q)
    assert expected
    assert all(np.abs(z - e).max() <= 1e-12 * max(1, np.abs(e).max()) for e in expected)


@settings(max_examples=150, deadline=None)
@given(semidefinite())
def test_semidefinite_problems_are_solved_or_have_no_solution(problem):
    M, q = problem
    status, _, z = solve(M, q)
    expected = enumerate_solutions(M, q)
    assert status == (LCP_SOLVED if expected else LCP_RAY)
    if expected:
        assert_solves(M, q, z)
        # w is the same for all solutions
        assert np.abs(M @ (z - expected[0])).max() <= 1e-11 * max(1, np.abs(z).max())


@settings(max_examples=100, deadline=None)
@given(semidefinite())
def test_a_ray_of_a_semidefinite_problem_means_infeasible(problem):
    M, q = problem
    is_feasible = linprog(np.zeros(len(q)), A_ub=-M, b_ub=q).status == 0
    assert (solve(M, q)[0] == LCP_SOLVED) == is_feasible


@settings(max_examples=150, deadline=None)
@given(copositive())
def test_strictly_copositive_problems_are_always_solved(problem):
    M, q = problem
    status, _, z = solve(M, q)
    assert status == LCP_SOLVED
    assert_solves(M, q, z)


@pytest.mark.parametrize("n", [24, 60, 120])
def test_random_definite_problems_of_contact_size(n):
    rng = np.random.default_rng(n)
    G = rng.normal(size=(n, n))
    M, q = G @ G.T + np.eye(n), rng.normal(size=n)
    status, pivots, z = solve(M, q)
    assert status == LCP_SOLVED
    assert pivots < 5 * n
    assert_solves(M, q, z)


def test_scaling_by_powers_of_two_scales_z_bit_for_bit():
    rng = np.random.default_rng(5)
    for n in (3, 8, 20):
        G = rng.normal(size=(n, max(2, n // 2)))
        M, q = G @ G.T, G @ rng.normal(size=G.shape[1])
        status, pivots, z = solve(M, q)
        assert status == LCP_SOLVED
        assert z.any()
        for m_power, q_power in ((40, 0), (-33, 0), (0, 51), (7, -90)):
            scaled = solve(np.ldexp(M, m_power), np.ldexp(q, q_power))
            assert scaled[:2] == (status, pivots)
            assert np.array_equal(scaled[2], np.ldexp(z, q_power - m_power))


def test_units_of_any_size_stand_side_by_side():
    """A change of units D M D, D q gives z in the new units, over 24 decades."""
    rng = np.random.default_rng(6)
    G = rng.normal(size=(6, 6))
    M, q = G @ G.T + np.eye(6), rng.normal(size=6)
    D = 10.0 ** np.arange(-12, 12, 4)
    status, _, z = solve(D[:, None] * M * D, D * q)
    assert status == LCP_SOLVED
    # cond(M) < 1e2, so ten roundings of the data and the solution stay below 1e-12
    np.testing.assert_allclose(D * z, solve(M, q)[2], rtol=1e-12, atol=1e-14)


def test_interpreted_kernel_gives_the_bits_of_the_compiled_one():
    code = (
        "import numpy as np; from physics.kernels.lcp.lemke import lemke, lemke_sizes;"
        "M, q, z = np.array([[1.0, 2, 0], [0, 1, 2], [2, 0, 1]]), np.array([-1, -1.5, -1]), np.zeros(3);"
        "shape, length = lemke_sizes(3);"
        "lemke(M, q, z, np.zeros(shape), np.zeros(length, int), 100);"
        "print([float(x).hex() for x in z])"
    )
    printed = [
        subprocess.run(
            [sys.executable, "-c", code],
            env={**os.environ, "NUMBA_DISABLE_JIT": flag},
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for flag in ("0", "1")
    ]
    assert "0x1" in printed[0]
    assert printed[0] == printed[1]
