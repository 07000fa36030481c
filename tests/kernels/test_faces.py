"""Faces near the verge of holding, and those that lose contacts: what is solved directly since faces are lanes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from physics.compiler.decorators import kernel
from physics.kernels.contact_solver.one_contact import FreeBody
from physics.kernels.contact_solver.patch import gather_patch
from physics.kernels.contact_solver.patch_start import cold_start_motion
from physics.kernels.contact_solver.sliding_patch import TRY_SLIDING, TRY_STICKING
from physics.kernels.math.simd_gather import valid_lanes_mask
from physics.kernels.state.layout import METHOD_DIRECT
from tests.kernels.contact_problem import FACE, MASS, Problem
from tests.kernels.test_direct import FALL, assert_solved, floor, law_defect

MU = 0.5


def loaded(push, slip):
    """A face to which friction gives the share |slip| <= 1 of what it can, along a rigid motion: pushes, directions."""
    problem = Problem(floor(FACE), (0, 0, 0), (0, 0, 0), MU)
    arms, axes = (
        np.array(problem.one["contacts"]["arm"][:4]),
        np.array(problem.one["scene"]["walls"][0][:9]).reshape(3, 3),
    )
    p = push[:, None] * (axes[0] - MU * slip @ axes[1:])
    v = -p.sum(axis=0) / MASS
    w = -np.linalg.solve(problem.inertia, np.cross(arms, p).sum(axis=0))
    return Problem(floor(FACE), v, w, MU)


def motion_of(centre, sense):
    """Unit directions (4, 2) along the tangents z, x in which the vertices go about a centre."""
    arms = np.array(Problem(floor(FACE), (0, 0, 0), (0, 0, 0), MU).one["contacts"]["arm"][:4])
    u = sense * np.stack([-(arms[:, 0] - centre[0]), arms[:, 2] - centre[1]], axis=1)  # ω x r along z and x
    return u / np.linalg.norm(u, axis=1)[:, None]


centres = st.tuples(st.floats(-6, 6), st.floats(-6, 6)).filter(
    lambda c: all(np.hypot(c[0] - x, c[1] - z) > 0.3 for x in (-2.5, 2.5) for z in (-1, 1))
)


@settings(max_examples=200, deadline=None)
@given(centres, st.sampled_from([-1, 1]), st.sampled_from([TRY_STICKING, TRY_SLIDING]))
def test_a_face_holds_up_to_the_verge_of_turning_about_any_point(centre, sense, mode):
    """Friction at 95 % of what it can give along a rigid motion: the body stops, to the last bit but rounding."""
    problem = loaded(np.full(4, -MASS * FALL / 4), 0.95 * motion_of(centre, sense))
    p, (v, L, _, _, method) = problem.solve(mode)
    assert method == METHOD_DIRECT
    assert problem.one["stage"]["mode"] == TRY_STICKING
    # Sums of four products of impulses of 0.07 N s with arms of 3 m.
    assert np.abs(v).max() <= 1e-15
    assert np.abs(L).max() <= 1e-14
    assert law_defect(problem, p) <= 1e-12


@settings(max_examples=200, deadline=None)
@given(centres, st.sampled_from([-1, 1]), st.sampled_from([TRY_STICKING, TRY_SLIDING]))
def test_a_face_slips_beyond_the_verge(centre, sense, mode):
    """A target 5 % beyond friction does not hold, whatever is tried first."""
    problem = loaded(np.full(4, -MASS * FALL / 4), 1.05 * motion_of(centre, sense))
    p, result = problem.solve(mode)
    assert problem.one["stage"]["mode"] != TRY_STICKING
    assert np.abs(result[0]).max() > 1e-4 or np.abs(result[1]).max() > 1e-4
    assert law_defect(problem, p) <= 1e-8


def test_tilting_loads_are_rarely_left_for_sweeps():
    """Moments that lift one, two and three vertices, on the verge of holding or not: contacts open and come back.

    595 of 600 were solved directly when this was written, 584 before a contact that would close pushed again.
    """
    rng, direct = np.random.default_rng(7), 0
    for _ in range(600):
        w = rng.normal(0, 0.01, 3)
        problem = Problem(floor(FACE), np.add(rng.normal(0, 0.03, 3), (0, FALL, 0)), w, MU, tolerance=1e-6)
        _, (_, _, residual, _, method) = problem.solve(TRY_SLIDING)
        assert residual <= 1e-6
        direct += method == METHOD_DIRECT
    assert direct >= 590


@settings(max_examples=200, deadline=None)
@given(
    st.lists(st.floats(-0.2, 0.2), min_size=4, max_size=4).map(lambda t: np.round(t, 3)),
    st.tuples(*[st.floats(-0.5, 0.5).map(lambda s: round(s, 2))] * 3),
)
def test_targets_of_no_rigid_motion_are_met_by_three_contacts(targets, slip):
    """As in an impact where only some bounce: one contact leaves faster than asked."""
    target = np.zeros((4, 3))
    target[:, 0] = targets
    problem = Problem(floor(FACE), (slip[0], -0.5, slip[1]), (0, slip[2], 0), 0.2, target=target)
    p, result = problem.solve(TRY_SLIDING)
    assert_solved(problem, p, result)
    if abs(targets[0] + targets[3] - targets[1] - targets[2]) > 1e-6:  # 0 and 3 are a diagonal of the face
        assert np.count_nonzero(p[:, 0] == 0.0) >= 1


@pytest.mark.parametrize("bounces", range(4))
def test_one_contact_that_bounces_off_takes_another_along(bounces):
    """All except it are asked to stay, which no rigid motion does: one of the two beside it leaves as well."""
    target = np.zeros((4, 3))
    target[bounces, 0] = 0.1
    problem = Problem(floor(FACE), (0.3, -0.5, 0.2), (0, 0.1, 0), 0.2, target=target)
    p, result = problem.solve(TRY_SLIDING)
    assert_solved(problem, p, result)
    assert result[4] == METHOD_DIRECT
    assert np.count_nonzero(p[:, 0] == 0.0) >= 1


@pytest.mark.parametrize("target_error_limit", [0.0, 1e-8])
def test_contacts_hold_that_are_asked_to_move_apart_by_next_to_nothing(target_error_limit):
    """Targets away from the centre of the face are those of no rigid motion; what fits best is none at all."""
    arms = np.array(Problem(floor(FACE), (0, 0, 0), (0, 0, 0), MU).one["contacts"]["arm"][:4])
    target = np.zeros((4, 3))
    target[:, 1], target[:, 2] = 3e-9 * arms[:, 2], 3e-9 * arms[:, 0]  # at most 8e-9 m/s
    problem = Problem(floor(FACE), (0.001, FALL, 0), (0, 0, 0), MU, target=target, tolerance=1e-9)
    problem.one["stage"]["target_error_limit"] = target_error_limit
    _, (v, _, residual, _, _) = problem.solve(TRY_STICKING)
    assert residual <= 1e-9
    assert (problem.one["stage"]["mode"] == TRY_STICKING) == (target_error_limit > 0.0)
    assert np.abs(v).max() <= 1e-15 or not target_error_limit


@pytest.mark.parametrize("mode", [TRY_STICKING, TRY_SLIDING])
def test_eight_contacts_of_one_wall_are_solved_by_sweeps(mode):
    """A plate thinner than the slop touches with both its faces: more than lanes take."""
    problem = Problem(floor(range(8)), (0.3, FALL, 0.1), (0, 0.1, 0), MU)
    problem.one["contacts"]["arm"][:8, 1] = -1.5
    p, result = problem.solve(mode)
    assert_solved(problem, p, result)


@kernel
def begun(n, mu, u, w, inv_mass, K, scratch):
    """Start of a face under new loads (`patch_start.cold_start_motion`), on the wall whose axes are x, y, z."""
    axes = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    body = FreeBody(axes, u, w, K, inv_mass)
    return cold_start_motion(n, gather_patch(n, body, scratch), valid_lanes_mask(n), mu, body)


@pytest.mark.parametrize("n", [3, 4])
def test_a_slip_without_spin_and_a_spin_about_the_centroid_lose_what_friction_takes(n):
    """The ellipsoid is exact along its axes: v0 - μP/m, and I (ω0 - ω) = μPρ with the root mean square ρ of arms."""
    scratch = Problem(floor(FACE), (0, 0, 0), (0, 0, 0), MU).one
    arms = np.array([(-1.5, 2.0, 1.0), (-1.5, -1.0, 0.5), (-1.5, -1.0, -1.5), (-1.5, 0.0, 0.0)])[:n]
    scratch["contacts"]["arm"][:n] = arms
    push, inv_mass, spin = 0.06, 0.25, 3.0
    K = (0.2, 0.0, 0.0, 0.1, 0.0, 0.1)
    va, vb, wn = begun(n, MU, (-push, 0.3, -0.4), (0.0, 0.0, 0.0), inv_mass, K, scratch)
    assert (va, vb, wn) == pytest.approx((0.3 * (1 - MU * push / 0.5), -0.4 * (1 - MU * push / 0.5), 0.0), rel=1e-13)
    centre = arms.mean(axis=0)
    rho = np.sqrt(((arms - centre)[:, 1:] ** 2).sum(axis=1).mean())
    about = (-push, spin * centre[2], -spin * centre[1])  # the centroid is at rest
    va, vb, wn = begun(n, MU, about, (spin, 0.0, 0.0), inv_mass, K, scratch)
    left = spin - MU * push / inv_mass * rho * K[0]
    assert (va, vb, wn) == pytest.approx((left * centre[2], -left * centre[1], left), abs=1e-13)
