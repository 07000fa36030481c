"""Forces of a contact mode whose contacts say the same of the body's motion twice."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from physics.kernels.event_driven.force_system import solve_contact_forces
from physics.kernels.event_driven.workspace import make_motion
from physics.kernels.state.layout import VERTEX_COUNT

EPS = np.finfo(float).eps
BODY = np.dtype([("mass", float), ("J", float, (3,))])
AXES = tuple(np.eye(3).ravel())


def solved(rows, pushes, asked, is_skew):
    """(total force and moment, acceleration) of contacts that push along `pushes`, each row with a target of its own.

    The body has unit mass and unit moments of inertia: its acceleration is the force and the moment.
    """
    body, motion = np.ones(1, BODY), make_motion(3, VERTEX_COUNT, False)
    m = len(asked)
    one = motion.unknowns[0]
    one["row"][:m], one["row_moment"][:m] = rows[:, :3], rows[:, 3:]
    one["column_force"][:m], one["column_moment"][:m] = pushes[:, :3], pushes[:, 3:]
    one["rhs"][:m], one["is_skew"] = asked, is_skew
    force, moment = solve_contact_forces(m, AXES, body[0], one)
    return np.array([*force, *moment]), one["value"][:m].copy()


def problem(seed, count, tilt, skew):
    """`count` random rows, one more that is the sum of two but for `tilt`, pushes that are off them by `skew`."""
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(count + 1, 6))
    rows[count] = rows[0] - rows[1] + tilt * rng.normal(size=6)
    asked = rng.normal(size=count + 1)
    asked[count] = asked[0] - asked[1]
    return rows, rows + skew * rng.normal(size=rows.shape), asked


@given(st.integers(0, 2**32 - 1), st.integers(2, 5), st.sampled_from([0.0, 0.3]), st.floats(1e-16, 1e-9))
def test_a_tilt_that_is_rounding_changes_nothing(seed, count, skew, tilt):
    """Friction gives a row that others nearly imply a pivot of the order of the tilt: it is none all the same.

    A row off by the tilt t of a system with condition number κ changes the forces by t κ of themselves, a few times
    over; were it met, the force that does so would be (the row's rest)/t, of the order of the others, whatever t.
    """
    flat_rows, flat_pushes, asked = problem(seed, count, 0.0, skew)
    condition = np.linalg.cond(flat_rows[:count] @ flat_pushes.T)
    if condition > 1e3:
        return
    flat, shares = solved(flat_rows, flat_pushes, asked, int(skew > 0))
    tilted, shares_then = solved(*problem(seed, count, tilt, skew), int(skew > 0))
    size = np.abs(flat).max()
    tolerance = 1e3 * (tilt + EPS) * condition**2
    assert tilted == pytest.approx(flat, abs=tolerance * size)
    assert shares_then == pytest.approx(shares, abs=tolerance * size)
    # What the rows ask for is there.
    assert flat_rows @ flat == pytest.approx(asked, abs=1e3 * EPS * condition**2 * size)


@given(st.integers(0, 2**32 - 1), st.floats(-1e-12, 1e-12))
def test_shares_do_not_depend_on_which_of_two_pivots_is_larger(seed, change):
    """Two contacts that push alike share what is asked: nothing in it jumps where they change places in size."""
    rng = np.random.default_rng(seed)
    rows = np.repeat(rng.normal(size=(1, 6)), 2, axis=0)
    rows[1] *= 1.0 + change
    asked = rows @ rng.normal(size=6)
    _, shares = solved(rows, rows, asked, 0)
    assert shares[0] == pytest.approx(shares[1], rel=1e3 * EPS + 10 * abs(change))


@given(st.integers(0, 2**32 - 1), st.integers(2, 6))
def test_rows_that_are_independent_are_all_met(seed, count):
    """Six rows at most, none the sum of others: each gets what it asks for, to rounding times the condition number."""
    rng = np.random.default_rng(seed)
    rows = rng.normal(size=(count, 6))
    pushes, asked = rows + 0.3 * rng.normal(size=rows.shape), rng.normal(size=count)
    condition = np.linalg.cond(rows @ pushes.T)
    if condition > 1e4:
        return
    total, _ = solved(rows, pushes, asked, 1)
    assert rows @ total == pytest.approx(asked, abs=1e3 * EPS * condition * np.abs(total).max() + 1e-12)
