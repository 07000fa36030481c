"""Targets of resting contacts: the formulas of `target_velocity`, one contact after the other in plain NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from physics.compiler.decorators import kernel
from physics.kernels.contact_law.target_velocity import (
    GAP_CLOSING_SHARE,
    NEGLIGIBLE_SLOP_SHARE,
    NO_IMPACT,
    RESIDUAL_APPROACH,
    TRUE_IMPACT,
    StageMotion,
    may_have_impact,
    set_impact_targets,
    set_resting_targets,
)
from physics.kernels.half_space.persistent_contacts import WALL_MEMORY_HEAD
from physics.kernels.time_stepping.warm_start import wall_memory_size
from physics.kernels.time_stepping.workspace import make_workspace
from tests.kernels.contact_problem import FLOOR, SIDE

EPS = np.finfo(float).eps
H, SLOP = 0.01, 1e-4
NONE = (0.0, 0.0, 0.0)
EVEN = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)


@kernel
def _aim(n, v, w, alpha, R, h, tilted, scratch):
    set_resting_targets(n, StageMotion(R, v, w, alpha), h, tilted, scratch[0])


def posed(slots, gaps, seed, tolerance=1e-9):
    """A workspace with block contacts at these slots and gaps, arms at random."""
    scratch = make_workspace(np.array([FLOOR, SIDE]), 8, tolerance=tolerance)
    one, n = scratch[0], len(slots)
    one["contacts"]["slot"][:n], one["contacts"]["gap"][:n], one["body"]["slop"], one["body"]["acceleration"] = (
        slots,
        gaps,
        SLOP,
        10.0,
    )
    one["contacts"]["widest"] = max(0.0, *gaps)
    one["contacts"]["arm"][:n] = np.random.default_rng(seed).uniform(-2, 2, (n, 3))
    return scratch


def expected(scratch, n, v, w, alpha):
    """Targets by the formulas of `set_resting_targets` and `gainless`, and the scale of their rounding."""
    one, targets = scratch[0], np.zeros((n, 3))
    for i in range(n):
        wall, r = one["contacts"]["slot"][i] // 8, one["contacts"]["arm"][i]
        axes = one["scene"]["walls"][wall][:9].reshape(3, 3)
        gained = axes @ (-H / 2 * (np.cross(w, np.cross(w, r)) + np.cross(alpha, r)))
        u = axes @ (v + np.cross(w, r))
        most, square = u[1:] @ u[1:], gained[1:] @ gained[1:]
        along = gained[1:] * (most / square if square > most else 1.0)
        targets[i] = min(gained[0], max(-u[0], 0.0)), *along
        same_wall = one["contacts"]["slot"][:n] // 8 == wall
        if (one["contacts"]["gap"][:n][same_wall] > SLOP).any():
            targets[i, 0] -= GAP_CLOSING_SHARE * one["contacts"]["gap"][i] / H
        if np.abs(targets[i]).max() <= max(one["settings"]["tolerance"] * 10.0 * H, NEGLIGIBLE_SLOP_SHARE * SLOP / H):
            targets[i] = 0.0
    return targets


ONE_WALL = [[3], [1, 2], [0, 1, 5], [0, 1, 4, 5], [0, 1, 2, 4, 5], list(range(8))]
TWO_WALLS = [[6, 9], [0, 1, 4, 8, 9], [*range(5), *range(9, 15)]]


@pytest.mark.parametrize("slots", ONE_WALL + TWO_WALLS, ids=len)
@pytest.mark.parametrize("above", [0.0, 3 * SLOP])
def test_each_contact_is_asked_for_what_the_formula_says(slots, above):
    """Contacts of a wall are taken four at a time; which four must not matter, nor where one is still above it."""
    n = len(slots)
    gaps = np.random.default_rng(n).uniform(-SLOP, SLOP, n)
    gaps[n // 2] += above
    scratch = posed(slots, gaps, seed=n)
    v, w, alpha = (0.1, -0.2, 0.3), (0.7, -1.1, 0.4), (2.0, 0.5, -1.0)
    _aim(n, v, w, alpha, EVEN, H, None, scratch)
    # Sums of a dozen products of size at most |v| + |ω| r or h/2 (|ω|² + |α|) r: 5; 1/h times a gap: 0.03.
    np.testing.assert_allclose(
        scratch[0]["contacts"]["target"][:n], expected(scratch, n, v, w, alpha), rtol=0, atol=60 * EPS
    )
    assert not scratch[0]["contacts"]["target"][n:].any()


def test_a_body_at_rest_is_asked_for_nothing():
    scratch = posed([0, 1, 4, 5], np.full(4, -SLOP / 2), seed=0)
    scratch["contacts"]["target"] = 7.0
    none = (0.0, 0.0, 0.0)
    _aim(4, none, none, none, EVEN, H, None, scratch)
    assert not scratch[0]["contacts"]["target"][:4].any()
    assert (scratch[0]["contacts"]["target"][4:] == 7.0).all()


def test_what_is_next_to_nothing_is_not_asked_for():
    """A turn that gains a contact less than `NEGLIGIBLE_SLOP_SHARE` slops in the step."""
    scratch = posed([0, 1, 4, 5], np.zeros(4), seed=1)
    slow = (0.0, 1e-2 * NEGLIGIBLE_SLOP_SHARE * SLOP / H**2, 0.0)
    _aim(4, (0.0, -1.0, 0.0), slow, (0.0, 0.0, 0.0), EVEN, H, None, scratch)
    assert not scratch[0]["contacts"]["target"].any()


# --- impacts -------------------------------------------------------------------------------------------------------


@kernel
def _aim_impact(n, bounce_speed, slop_speed, h, memory, scratch):
    if not may_have_impact(bounce_speed, slop_speed, scratch[0]):
        return NO_IMPACT
    y = (NONE, (1.0, 0.0, 0.0, 0.0), NONE, NONE)
    return set_impact_targets(n, bounce_speed, slop_speed, y, h, None, memory, scratch[0])


speeds = st.sampled_from([-2.0, -0.5, -0.1, -0.011, -0.01, -0.009, 0.0, 0.3])
gaps = st.sampled_from([-SLOP, 0.0, SLOP, 3 * SLOP])


@given(
    contacts=st.lists(st.tuples(speeds, gaps, st.booleans()), min_size=1, max_size=8),
    restitution=st.sampled_from([0.0, 0.1, 0.5, 1.0]),
    bounce_speed=st.sampled_from([0.001, 0.05, 1.0]),
    residue=st.sampled_from([0.0, 0.05, 1.0]),
)
def test_an_impact_is_what_one_contact_of_it_is(contacts, restitution, bounce_speed, residue):
    """Newton's law for each, and whether one of them bounces, or would close by more than a slop within the step.

    One that pushed in the last stage, and is no faster than that may leave it, has hit nothing: it is stopped.
    """
    scratch, n = posed(list(range(len(contacts))), [gap for _, gap, _ in contacts], seed=0), len(contacts)
    scratch["body"]["restitution"], scratch["contacts"]["target"], scratch["body"]["acceleration"] = (
        restitution,
        7.0,
        residue / H,
    )
    scratch["contacts"]["speed"][0, :n] = [speed for speed, _, _ in contacts]
    scratch["contacts"]["approach"] = max(0.0, *(-speed for speed, _, _ in contacts))
    memory = np.zeros((1, wall_memory_size(scratch["contacts"]["slot"].shape[1])))
    memory[0, WALL_MEMORY_HEAD + scratch["contacts"]["slot"].shape[1] :: 3][:n] = [pushed for _, _, pushed in contacts]
    slop_speed, goals, found = SLOP / H, [], NO_IMPACT
    for speed, gap, pushed in contacts:
        is_left_over = pushed and -speed <= residue
        bounces = restitution > 0.0 and -speed > bounce_speed
        goals.append(-restitution * speed if bounces or speed > 0.0 else 0.0)
        if bounces or -speed > slop_speed + max(gap, 0.0) / H:
            found = max(found, RESIDUAL_APPROACH if is_left_over else TRUE_IMPACT)
            goals[-1] *= not is_left_over
    assert _aim_impact(n, bounce_speed, slop_speed, H, memory, scratch) == found
    if found:
        np.testing.assert_array_equal(scratch[0]["contacts"]["target"][:n], [(goal, 0.0, 0.0) for goal in goals])
        assert (scratch[0]["contacts"]["target"][n:] == 7.0).all()
