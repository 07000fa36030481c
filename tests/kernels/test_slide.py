"""Contacts of one wall that slide, turn about one that holds, or open: which are solved directly, and how."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from physics.compiler.decorators import kernel
from physics.compiler.simd import Lanes
from physics.kernels.contact_solver.one_contact import (
    CONTACT_OPENS,
    CONTACT_SLIDES,
    CONTACT_STICKS,
    CONTACT_UNSOLVED,
    MIN_SQUARED_NORM,
    delassus_block,
    diagonal_delassus_block,
    friction_direction,
    inverse_root,
    solve_contact_block,
)
from physics.kernels.contact_solver.sliding_patch import TRY_MIXED, TRY_SLIDING, TRY_STICKING
from physics.kernels.state.layout import METHOD_DIRECT
from tests.kernels.contact_problem import FACE, MASS, Problem
from tests.kernels.test_direct import FALL, assert_solved, floor, law_defect

TOLERANCE = 1e-9


def pivoting(held, sense, mu=0.5):
    """A face that turns about contact `held` after the impulses returned: equal normals, half of μ p_n at the pivot.

    The free motion is the one that these impulses lead there from.
    """
    problem = Problem(floor(FACE), (0, 0, 0), (0, 0, 0), mu, tolerance=TOLERANCE)
    arms, axes = (
        np.array(problem.one["contacts"]["arm"][:4]),
        np.array(problem.one["scene"]["walls"][0][:9]).reshape(3, 3),
    )
    w = np.array([0, 0.05 * sense, 0])
    v = -np.cross(w, arms[held])
    push = -FALL * MASS / 4
    p = np.zeros((4, 3))
    for i, arm in enumerate(arms):
        slip = axes @ (v + np.cross(w, arm))
        d = np.array([0.3, 0.4]) if i == held else slip[1:] / np.hypot(*slip[1:])
        p[i] = push * np.array([1, *(-mu * d)])
    world = p @ axes
    w_free = w - np.linalg.solve(problem.inertia, np.cross(arms, world).sum(axis=0))
    problem = Problem(floor(FACE), v - world.sum(axis=0) / MASS, w_free, mu, tolerance=TOLERANCE)
    return problem, p


@pytest.mark.parametrize("held", range(4))
@pytest.mark.parametrize("sense", [-1, 1])
def test_a_face_turns_about_a_vertex(held, sense):
    """Friction holds one vertex, the other three slide about it: without sweeps."""
    problem, expected = pivoting(held, sense)
    p, (_, _, residual, _, method) = problem.solve()
    assert method == METHOD_DIRECT
    assert residual <= TOLERANCE
    assert problem.one["stage"]["mode"] == TRY_MIXED
    np.testing.assert_allclose(p, expected, atol=impulse_error(problem))


def impulse_error(problem):
    """Bound of the error of impulses solved to TOLERANCE of the largest free contact speed [N s].

    Four contacts of a face fix the planar motion and the normals, six of twelve impulses; pushes of least norm and
    directions of sliding fix the rest. A velocity off by ε makes impulses off by at most a dozen m ε here.
    """
    return 12 * MASS * TOLERANCE * np.abs(problem.matrices()[1]).max()


def test_the_impulses_of_the_last_step_are_the_start_where_some_contacts_held():
    """From them a solution is one: not a round is made, and nothing changes but by rounding."""
    problem, _ = pivoting(2, 1)
    p, _ = problem.solve()
    again, (_, _, residual, _, method) = problem.solve(TRY_MIXED, warm=p)
    assert method == METHOD_DIRECT
    assert residual <= TOLERANCE
    # Slopes and quotients of impulses come out of linear systems of 2 unknowns of condition < 100.
    np.testing.assert_allclose(again, p, atol=1e-13 * p.max())


@pytest.mark.parametrize("tolerance", [1e-6, 1e-10])
@pytest.mark.parametrize(("speed", "spin"), [(0.03, 0.01), (0.015, 0.015)])
def test_random_shoves_of_a_face_are_solved_directly(tolerance, speed, spin):
    """A face at rest or nearly so, pushed at random, is hardly ever left for sweeps.

    None of these 1,600 was when this was written, and 12 were where contacts that might hold were tried one by one: an
    error in one of the direct solvers costs many.
    """
    rng = np.random.default_rng(5)
    direct = 0
    for _ in range(400):
        v = np.add(rng.normal(0, speed, 3), (0, FALL, 0))
        problem = Problem(floor(FACE), v, rng.normal(0, spin, 3), 0.5, tolerance=tolerance)
        p, (_, _, residual, _, method) = problem.solve(TRY_SLIDING)
        assert residual <= tolerance
        # What is reported bounds what is: both are sums of a dozen products, a few dozen roundings of their largest.
        assert problem.residual(p) <= residual + 64 * np.finfo(float).eps
        direct += method == METHOD_DIRECT
    assert direct >= 399


def test_a_face_that_tips_is_solved_directly_though_its_targets_differ():
    """Two or three contacts open, the targets of the four are off those of a rigid motion by about the goal.

    All of these were solved directly when this was written. A contact that opened closes again by what the targets
    differ: where that ended a search, as it did once, it was 75 %.
    """
    rng = np.random.default_rng(5)
    direct = 0
    for _ in range(400):
        v = np.add(rng.normal(0, 0.03, 3), (0, FALL, 0))
        w, target = rng.normal(0, 0.1, 3), np.zeros((4, 3))
        target[:, 0] = -np.abs(rng.normal(0, 1e-6, 4))
        problem = Problem(floor(FACE), v, w, 0.5, tolerance=1e-6, target=target)
        _, (_, _, residual, _, method) = problem.solve(TRY_SLIDING)
        assert residual <= 1e-6
        direct += method == METHOD_DIRECT
    assert direct >= 399


# Vertices, v, w, quaternion and normal targets of blocks in a batch, each under a wrench of its own in each step.
LEFT_FOR_SWEEPS = {
    # Newton's method goes on to where friction pushes a contact along.
    "turns round": (
        (0, 1),
        (0.02159, -0.06175, -0.00417),
        (0.02211, 0.02442, -0.02143),
        (0.9304, -0.2741, 0.2333, 0.0687),
        (-2.77e-06, -5.1e-06),
    ),
    # One holds, one slides: with the latter open it closes, with both sliding it would pull.
    "one holds": (
        (0, 1),
        (0.00677, -0.00466, -0.00897),
        (0.02116, -0.00651, -0.0207),
        (-0.1646, 0.0, 0.9864, 0.0),
        (0.0, 0.0),
    ),
    "two are left": (
        (0, 1, 4, 5),
        (-0.00914, -0.02055, -0.0224),
        (-0.03527, -0.00618, -0.01088),
        (0.9912, 0.0, 0.1322, 0.0),
        (0.0, 0.0, 0.0, 0.0),
    ),
    # Newton's method turns directions round: one contact nearly stops, or holds, or all four do.
    "creeps": (
        (0, 1, 4, 5),
        (-0.01181, -0.04624, -0.02078),
        (-0.0041, -0.0172, 0.02157),
        (-0.5485, 0.0, 0.8361, 0.0),
        (0.0, 0.0, 0.0, 0.0),
    ),
    "turns about one": (
        (0, 1, 2, 3),
        (0.0289, -0.06542, 0.00677),
        (-0.01213, -0.01482, -0.00895),
        (-0.2874, 0.2874, 0.646, 0.646),
        (0.0, 0.0, 0.0, 0.0),
    ),
    "nearly holds": (
        (0, 1, 2, 3),
        (0.0258, -0.06091, 0.01423),
        (0.02239, 0.00391, -0.02076),
        (-0.7035, 0.7035, -0.0714, -0.0714),
        (0.0, 0.0, 0.0, 0.0),
    ),
    # Targets within the goal of a rigid motion: met to the letter by three, the fourth is off by more.
    "uneven": (
        (2, 3, 6, 7),
        (-0.01454, -0.02508, 0.00897),
        (0.01785, -0.00309, -0.01762),
        (0.0, 0.3797, 0.0, 0.9251),
        (-3.6e-07, -4.4e-07, 0.0, 0.0),
    ),
}


@pytest.mark.parametrize("key", LEFT_FOR_SWEEPS)
def test_what_was_left_for_sweeps_is_solved_directly(key):
    vertices, v, w, quat, normal_targets = LEFT_FOR_SWEEPS[key]
    target = np.zeros((len(vertices), 3))
    target[:, 0] = normal_targets
    problem = Problem(floor(vertices), v, w, 0.5, quat=quat, target=target, tolerance=1e-6)
    p, (_, _, residual, _, method) = problem.solve(TRY_SLIDING)
    assert method == METHOD_DIRECT
    assert residual <= 1e-6
    assert law_defect(problem, p) <= 1e-4  # for why a hundred times that: `assert_solved`


def test_two_contacts_that_slid_are_not_asked_to_hold_first():
    """Two contacts that slide are tried as sliding first in the next step, whatever held before."""
    problem = Problem(floor((0, 1)), (0.3, FALL, 0.1), (0, 0, 0), 0.5)
    p, (_, _, _, _, method) = problem.solve(TRY_STICKING)
    assert method == METHOD_DIRECT
    np.testing.assert_allclose(np.hypot(p[:, 1], p[:, 2]), 0.5 * p[:, 0], rtol=1e-12)  # they slide
    assert problem.one["stage"]["mode"] == TRY_SLIDING


@settings(max_examples=300, deadline=None)
@given(
    st.sampled_from([(0, 1), (0, 4), (1, 4), (0, 5)]),
    st.tuples(*[st.floats(-0.2, 0.2).map(lambda s: round(s, 4))] * 6),
    st.sampled_from([0.1, 0.5, 1.0]),
)
def test_two_contacts_obey_the_law_in_every_mixture(vertices, motion, mu):
    problem = Problem(floor(vertices), np.add(motion[:3], (0, FALL, 0)), motion[3:], mu)
    if np.abs(problem.matrices()[1]).max() > 1e-3:
        assert_solved(problem, *problem.solve(TRY_SLIDING))


def one_contact(v, w, mu):
    """Block matrix, free velocity and dense matrices of a vertex on the floor."""
    problem = Problem(floor([0]), v, w, mu)
    W, b = problem.matrices()
    return tuple(W.ravel()), tuple(b), mu, W[1, 1] + W[2, 2], 1e-12 * np.abs(b).max()


def test_one_contact_opens_holds_or_slides():
    assert solve_contact_block(*one_contact((0, 0.1, 0), (0, 0, 0), 0.5), 0.0, 0.0, True)[:2] == (
        CONTACT_OPENS,
        (0.0, 0.0, 0.0),
    )
    W, b, mu, trace, goal = one_contact((0, -1, 0), (0, 0, 0), 5.0)
    what, p, _ = solve_contact_block(W, b, mu, trace, goal, 0.0, 0.0, True)
    assert what == CONTACT_STICKS
    # A 3 x 3 solve of condition < 20: a few dozen roundings of the velocity.
    np.testing.assert_allclose(np.reshape(W, (3, 3)) @ p, -np.array(b), atol=1e-14)
    W, b, mu, trace, goal = one_contact((2, -1, 1), (0, 0, 0), 0.3)
    what, p, miss = solve_contact_block(W, b, mu, trace, goal, 0.0, 0.0, True)
    assert what == CONTACT_SLIDES
    assert miss <= goal
    u = np.reshape(W, (3, 3)) @ p + b
    assert u[0] == pytest.approx(0, abs=1e-14)
    assert np.hypot(p[1], p[2]) == pytest.approx(mu * p[0], rel=1e-14)
    assert np.dot(u[1:], p[1:]) == pytest.approx(-np.hypot(*u[1:]) * mu * p[0], rel=1e-12)


def test_a_contact_that_may_not_hold_and_cannot_slide_is_lost():
    """No direction of sliding is consistent if holding, which is the answer, is ruled out."""
    W, b, _, trace, goal = one_contact((0.01, -1, 0), (0, 0, 0), 5.0)
    assert solve_contact_block(W, b, 5.0, trace, goal, 0.0, 0.0, False)[0] == CONTACT_UNSOLVED


def test_blocks_of_the_wall_frame_are_those_of_the_dense_matrix():
    problem = Problem(floor([0, 5]), (0, 0, 0), (0, 0, 0), 0.5, quat=(0.9, 0.2, -0.3, 0.1))
    W, _ = problem.matrices()
    axes = np.array(problem.one["scene"]["walls"][0][:9]).reshape(3, 3)
    inverse = axes @ np.linalg.inv(problem.inertia) @ axes.T
    K = tuple(inverse[i, j] for i, j in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)))
    r, s = (tuple(axes @ problem.one["contacts"]["arm"][i]) for i in range(2))
    # Sums of products of size 1, a dozen roundings.
    np.testing.assert_allclose(
        np.reshape(delassus_block(r, s, 1 / problem.mass, 1.0, K), (3, 3)), W[:3, 3:], atol=5e-15
    )
    own = np.reshape(diagonal_delassus_block(r, 1 / problem.mass, 1.0, K), (3, 3))
    np.testing.assert_allclose(own, W[:3, :3], atol=5e-15)
    np.testing.assert_array_equal(own, own.T)


@kernel
def _inverse_roots(x, out):
    out[0] = inverse_root(x)
    lanes = inverse_root(Lanes(x, 2.0 * x, 3.0 * x, 4.0 * x))
    for k in range(4):
        out[1 + k] = lanes[k]


@given(st.floats(MIN_SQUARED_NORM, 1e300))
def test_the_inverse_root_is_off_by_two_roundings(x):
    """The product of the root, ½ ulp off and with it 1/x, is rounded once more: 1.5 EPS of it at most."""
    out = np.zeros(5)
    _inverse_roots(x, out)
    squares = np.array([x, x, 2.0 * x, 3.0 * x, 4.0 * x])
    np.testing.assert_allclose(out * np.sqrt(squares), 1.0, rtol=0, atol=3 * np.finfo(float).eps)


def test_a_direction_has_the_length_asked_for_or_there_is_none():
    for x, y in [(3.0, -4.0), (1e-140, 0.0), (-1e120, 1e119)]:
        a, b = friction_direction(x, y, 0.5)
        np.testing.assert_allclose((a, b), -0.5 * np.array([x, y]) / math.hypot(x, y), rtol=4e-16)
    assert friction_direction(1e-150, 1e-160, 0.5) == friction_direction(0.0, 0.0, 0.5) == (0.0, 0.0)
