"""Contact problems with a number γ more on the diagonal, against the law itself: contacts that give."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from physics.kernels.state.layout import METHOD_PIVOTING
from tests.kernels.contact_problem import FACE, Problem
from tests.kernels.test_direct import FALL, floor, law_defect

pytestmark = pytest.mark.interpreted

TOLERANCE = 1e-10

speeds = st.tuples(*[st.floats(-0.2, 0.2).map(lambda s: round(s, 4))] * 6)
CONTACTS = [[(0, 0)], floor((0, 1)), floor((0, 5)), floor(FACE), [(0, 0), (1, 0)], [*floor(FACE), (1, 0), (1, 4)]]
GIVES = [1e-6, 1e-3, 0.3, 10.0]  # [1/kg]; W_nn of the block is about 0.5


@settings(max_examples=200, deadline=None)
@given(st.sampled_from(CONTACTS), speeds, st.sampled_from([0.1, 0.5, 1.0]), st.sampled_from(GIVES))
def test_impulses_obey_coulombs_law_with_springs(contacts, motion, mu, give):
    """By closed form for one or two contacts of a wall, else by sweeps and Newton's method; tolerance as in
    `test_direct.assert_solved`."""
    problem = Problem(contacts, np.add(motion[:3], (0, FALL, 0)), motion[3:], mu, tolerance=TOLERANCE, give=give)
    p, (_, _, residual, _, method) = problem.solve()
    if method == METHOD_PIVOTING or residual > TOLERANCE:
        return  # reported, never taken for solved
    assert law_defect(problem, p) <= 1e-8


@settings(max_examples=200, deadline=None)
@given(st.sampled_from(CONTACTS), speeds, st.sampled_from(GIVES))
def test_springs_without_friction_are_solved_by_pivots(contacts, motion, give):
    """W + γ is positive definite: one solution, and Dantzig's method finds it to rounding."""
    problem = Problem(contacts, np.add(motion[:3], (0, FALL, 0)), motion[3:], 0.0, give=give)
    p, (_, _, residual, sweeps, _) = problem.solve(friction=False)
    W, b = (matrix[::3, ::3] if matrix.ndim == 2 else matrix[::3] for matrix in problem.matrices())
    u = W @ p[:, 0] + b
    assert sweeps == 0
    assert residual <= 1e-11
    assert np.abs(np.minimum(u, p[:, 0] * np.diag(W))).max() <= 1e-11 * np.abs(b).max()


@pytest.mark.parametrize("give", GIVES)
def test_four_springs_share_a_weight_evenly(give):
    """u = (1/m) Σp + γ p + b = 0: p = -b/(4/m + γ) each, by symmetry."""
    problem = Problem(floor(FACE), (0, FALL, 0), (0, 0, 0), 0.5, give=give)
    p, _ = problem.solve()
    assert p[:, 0] == pytest.approx(-FALL / (4 / problem.mass + give), rel=1e-8)
    assert np.abs(p[:, 1:]).max() <= 1e-8 * p[0, 0]
