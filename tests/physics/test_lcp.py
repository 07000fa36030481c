"""The friendly face of the complementarity solvers."""

import dataclasses

import numpy as np
import pytest

from physics.analysis.lcp import METHODS, LcpStatus, lcp

M = [[2.0, 1.0], [1.0, 2.0]]
Q = [-5.0, -6.0]


@pytest.mark.parametrize("method", METHODS)
def test_two_unknowns_in_closed_form_by_either_method(method):
    """Both constraints active: z = M⁻¹ (5, 6) = (4/3, 7/3)."""
    result = lcp(M, Q, method=method)
    assert result.status is LcpStatus.SOLVED
    np.testing.assert_allclose(result.z, [4 / 3, 7 / 3], rtol=1e-15)
    assert np.array_equal(result.w, np.array(M) @ result.z + Q)
    assert result.residual == np.abs(np.minimum(result.z, result.w)).max() <= 1e-15
    assert result.pivots > 0


@pytest.mark.parametrize("method", METHODS)
def test_lists_integers_and_empty_problems_are_taken(method):
    assert lcp([[1]], [-3], method).z == [3.0]
    empty = lcp(np.zeros((0, 0)), [], method)
    assert (empty.status, empty.residual, empty.z.shape) == (LcpStatus.SOLVED, 0.0, (0,))


@pytest.mark.parametrize("method", METHODS)
def test_arguments_are_not_written_to_and_memory_order_does_not_matter(method):
    rng = np.random.default_rng(0)
    G = rng.normal(size=(5, 5))
    A, q = G @ G.T, rng.normal(size=5)
    A.flags.writeable = q.flags.writeable = False
    assert np.array_equal(lcp(A, q, method).z, lcp(np.asfortranarray(A), q, method).z)


@pytest.mark.parametrize("method", METHODS)
def test_failures_come_as_statuses_that_say_what_to_do(method):
    ray = lcp([[1.0, -1.0], [-1.0, 1.0]], [-1.0, -1.0], method)
    assert ray.status is LcpStatus.RAY
    assert "no z >= 0" in ray.status.message
    assert ray.residual == 1.0
    limit = lcp(np.eye(3), -np.ones(3), method, max_pivots=1)
    assert limit.status is LcpStatus.PIVOT_LIMIT
    assert "raise max_pivots" in limit.status.message


def test_every_status_has_a_message():
    assert len({status.message for status in LcpStatus}) == len(LcpStatus) == 5


def test_results_are_frozen():
    result = lcp(M, Q)
    with pytest.raises(dataclasses.FrozenInstanceError):
        result.pivots = 0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (([[1.0, 2.0]], [1.0, 2.0]), r"M has shape \(1, 2\); allowed: \(2, 2\)"),
        (([1.0], [[1.0]]), r"q has shape \(1, 1\); allowed: \(n,\)"),
        (([[1.0, np.nan], [0.0, 1.0]], [1.0, 1.0]), r"M\[0, 1\] is nan; allowed: finite"),
        (([[1.0]], [np.inf]), r"q\[0\] is inf; allowed: finite"),
        ((M, Q, "newton"), "method is 'newton'; allowed: 'lemke', 'dantzig'"),
        ((M, Q, "lemke", -1), "max_pivots is -1; allowed: 0 or more"),
        (([[1.0, 2.0], [0.0, 1.0]], Q, "dantzig"), "differs from its transpose by 2.*method='lemke'"),
        (([[1.0, 2.0], [2.0, 1.0]], Q, "dantzig"), "has the eigenvalue -1.*method='lemke'"),
    ],
)
def test_wrong_arguments_are_named_with_what_is_allowed(arguments, message):
    with pytest.raises(ValueError, match=message):
        lcp(*arguments)
