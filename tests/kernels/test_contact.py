"""The contact set of a pose against plain NumPy, and what is kept of it from stage to stage."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from physics.compiler.decorators import kernel
from physics.kernels.half_space.contact_set import SIMULTANEOUS_SLOPS, collect_wall_contacts
from physics.kernels.half_space.persistent_contacts import WALL_MEMORY_COUNT, WALL_MEMORY_HEAD
from physics.kernels.math.quaternion import to_matrix
from physics.kernels.state.layout import BLOCK, ELLIPSOID
from physics.kernels.time_stepping.warm_start import load_warm_start, store_warm_start, wall_memory_size
from physics.kernels.time_stepping.workspace import make_workspace
from tests.kernels.contact_problem import FLOOR, SIDE, SIZE

SLOP, H, FEATURES = 1e-3, 0.01, 8
CORNERS = SIZE * (2.0 * (np.arange(FEATURES)[:, None] >> np.arange(3) & 1) - 1.0)


# --- the set -------------------------------------------------------------------------------------------------------


@kernel
def _gather(y, w, h, tilted, memory, scratch):
    return collect_wall_contacts(y, w, h, tilted, memory, scratch[0])


def block_at_walls():
    """A workspace of the block beside two walls."""
    scratch = make_workspace(np.array([FLOOR, SIDE]), FEATURES)
    one = scratch[0]
    one["body"]["shape"], one["body"]["dims"], one["body"]["radius"], one["body"]["slop"] = (
        BLOCK,
        SIZE,
        np.linalg.norm(SIZE),
        SLOP,
    )
    return scratch


NONE = (0.0, 0.0, 0.0)
small = st.floats(-3.0, 3.0)
turns = st.one_of(st.just(0.0), st.floats(-2e-3, 2e-3), st.floats(-1.0, 1.0))


@given(
    turn=st.tuples(turns, turns, turns),
    depth=st.tuples(small, small),
    v=st.tuples(small, small, small),
    w=st.tuples(small, small, small),
)
def test_the_set_is_what_touches_or_arrives(turn, depth, v, w):
    """Compare both walls: slots, gaps, speeds and, of all of them, the deepest, the widest and the fastest."""
    q = tuple(np.array([1.0, *turn]) / np.linalg.norm([1.0, *turn]))
    R = np.reshape(to_matrix(q), (3, 3))
    arms = CORNERS @ R.T
    least = arms.min(axis=0)
    x = np.array([-least[0] + SLOP * depth[0], -least[1] + SLOP * depth[1], 0.3])
    scratch = block_at_walls()
    memory = np.zeros((1, wall_memory_size(2 * FEATURES)))
    count, deepest = _gather((tuple(x), q, v, NONE), w, H, None, memory, scratch)
    gaps = np.concatenate([(x + arms)[:, 1], (x + arms)[:, 0]])
    speeds = np.concatenate([(v + np.cross(w, arms))[:, 1], (v + np.cross(w, arms))[:, 0]])
    clear = 1e-12  # of what is within rounding of a limit either is right
    belongs = (gaps <= SLOP) | ((gaps <= SIMULTANEOUS_SLOPS * SLOP) & (speeds < 0.0))
    unsure = (abs(gaps - SLOP) < clear) | (abs(gaps - SIMULTANEOUS_SLOPS * SLOP) < clear) | (abs(speeds) < clear)
    slots = scratch[0]["contacts"]["slot"][:count]
    assert set(np.flatnonzero(belongs & ~unsure)) <= set(slots) <= set(np.flatnonzero(belongs | unsure))
    assert (np.diff(slots) > 0).all()
    # Sums of three products of size at most 4, and x.
    np.testing.assert_allclose(scratch[0]["contacts"]["gap"][:count], gaps[slots], rtol=0, atol=1e-14)
    np.testing.assert_allclose(scratch[0]["contacts"]["speed"][:count], speeds[slots], rtol=0, atol=1e-13)
    assert deepest == max(0.0, *-scratch[0]["contacts"]["gap"][:count], 0.0)
    assert scratch[0]["contacts"]["widest"] == max(0.0, *scratch[0]["contacts"]["gap"][:count], 0.0)
    assert scratch[0]["contacts"]["approach"] == max(0.0, *-scratch[0]["contacts"]["speed"][:count], 0.0)


G = 10.0


@pytest.mark.parametrize("pushed", [False, True])
@pytest.mark.parametrize("gap", [0.4, 0.6, 1.1])
@pytest.mark.parametrize("speed", [0.0, 0.5])
def test_what_pushed_and_may_be_back_within_the_step_belongs_to_the_set(pushed, gap, speed):
    """A vertex `gap` times G H²/2 above the slop that leaves at `speed` times G H/2; loads of G bring it back."""
    scratch, memory = block_at_walls(), np.zeros((1, wall_memory_size(2 * FEATURES)))
    one, q = scratch[0], (math.cos(0.3), math.sin(0.3), 0.0, 0.0)
    one["body"]["acceleration"] = G
    arms = CORNERS @ np.reshape(to_matrix(q), (3, 3)).T
    lowest = np.flatnonzero(arms[:, 1] < arms[:, 1].min() + 1e-9)
    memory[0, WALL_MEMORY_HEAD + 2 * FEATURES + 3 * lowest] = float(pushed)
    x = (50.0, SLOP + gap * G * H**2 / 2 - arms[:, 1].min(), 0.0)
    count, _ = _gather((x, q, (0.0, speed * G * H / 2, 0.0), NONE), NONE, H, None, memory, scratch)
    assert list(one["contacts"]["slot"][:count]) == (list(lowest) if pushed and gap + speed < 1.0 else [])


@pytest.mark.parametrize("pushed", [False, True])
@pytest.mark.parametrize("loads", [-G, G])
@pytest.mark.parametrize("gap", [0.9, 1.1])
def test_a_round_body_that_pushed_and_is_pressed_still_belongs_to_the_set(pushed, loads, gap):
    """It leaves however fast: loads towards the wall close `gap` times G H²/2 within H, and it has no other cause."""
    scratch, memory = make_workspace(np.array([FLOOR, SIDE]), 1), np.zeros((1, wall_memory_size(2)))
    one = scratch[0]
    one["body"]["shape"], one["body"]["dims"], one["body"]["radius"], one["body"]["slop"] = (
        ELLIPSOID,
        SIZE,
        SIZE.max(),
        SLOP,
    )
    one["body"]["acceleration"], one["body"]["free_acceleration"] = G, (0.0, loads, 0.0)
    memory[0, WALL_MEMORY_HEAD + 2] = float(pushed)
    y = ((50.0, SIZE[1] + SLOP + gap * G * H**2 / 2, 0.0), (1.0, 0.0, 0.0, 0.0), (0.0, 10.0, 0.0), NONE)
    count, _ = _gather(y, NONE, H, None, memory, scratch)
    assert count == (pushed and loads < 0.0 and gap < 1.0)


@pytest.mark.parametrize("share", [0.0, 0.5, 0.99, 1.01])
@pytest.mark.parametrize("high", [0.0, 0.5, 0.99, 1.01])
def test_what_arrives_belongs_where_loads_could_have_made_it_as_fast(share, high):
    """Falling under G from a gap g at speed s it hits at √(s² + 2 G g): up to G H it is no impact."""
    scratch, memory = block_at_walls(), np.zeros((1, wall_memory_size(2 * FEATURES)))
    one, soft = scratch[0], G * H
    one["body"]["acceleration"], one["body"]["slop"] = G, 1e-9
    x = (50.0, SIZE[1] + high * soft**2 / (2 * G) + 4e-9, 0.0)
    v = (0.0, -share * soft, 0.0)
    count, _ = _gather((x, (1.0, 0.0, 0.0, 0.0), v, NONE), NONE, H, None, memory, scratch)
    assert count == (4 if share**2 + high < 0.9999 else 0)


# --- the memory ----------------------------------------------------------------------------------------------------


@kernel
def _store(n, width, memory, h, scratch):
    store_warm_start(n, width, memory, 0, h, scratch[0].contacts)


@kernel
def _load(n, width, memory, h, scratch):
    load_warm_start(n, width, memory, 0, h, scratch[0].contacts)


stages = st.lists(st.sets(st.integers(0, 2 * FEATURES - 1), max_size=5).map(sorted), min_size=1, max_size=8)


@pytest.mark.parametrize("width", [1, 3])
@given(stages=stages)
def test_impulses_are_found_by_the_name_of_their_contact(width, stages):
    """Impulses of the stage before, times the ratio of the lengths; zero for new contacts; no others are kept."""
    scratch, memory = block_at_walls(), np.zeros((1, wall_memory_size(2 * FEATURES)))
    known, length = {}, 0.0
    for k, slots in enumerate(stages + stages[-1:]):
        n, h = len(slots), 0.01 * (k + 1)
        scratch["contacts"]["slot"][0, :n] = slots
        _load(n, width, memory, h, scratch)
        found = scratch["contacts"]["impulse"][0, : n * width].reshape(n, width)
        for slot, impulse in zip(slots, found, strict=True):
            scale = h / length if length > 0.0 else 0.0
            np.testing.assert_array_equal(impulse, scale * known.get(slot, np.zeros(width)))
        impulses = 1.0 + k + np.arange(n * width).reshape(n, width)
        scratch["contacts"]["impulse"][0, : n * width] = impulses.ravel()
        _store(n, width, memory, h, scratch)
        known, length = dict(zip(slots, impulses, strict=True)), h
        kept = memory[0, WALL_MEMORY_HEAD + 2 * FEATURES :].reshape(2 * FEATURES, 3)
        assert memory[0, WALL_MEMORY_COUNT] == n
        np.testing.assert_array_equal(memory[0, WALL_MEMORY_HEAD : WALL_MEMORY_HEAD + n], slots)
        np.testing.assert_array_equal(np.flatnonzero(kept.any(axis=1)), slots)
