"""Parts of the step of many bodies, each against a slow reference: pairs, contacts of two blocks, the linear system."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from physics.kernels import layout as at
from physics.kernels.many import envelope
from physics.kernels.many.arrays import CONTACTS, PAIRS, make_many
from physics.kernels.many.near import find_pairs
from physics.kernels.many.touch import find_contacts

SETTINGS = {"relative_slop": 1e-6, "tolerance": 1e-6, "sweeps": 100, "splits": 8, "rest_share": 0.5}


def rotation(rng) -> np.ndarray:
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def blocks(places, rotations, halves):
    """`Many` with blocks at rest, placed for the narrow phase."""
    many = make_many(len(places), np.zeros((0, at.WALL_SIZE)), **SETTINGS)
    many.bodies["shape"], many.bodies["mass"], many.bodies["dims"] = at.BLOCK, 1.0, halves
    many.bodies["radius"] = np.linalg.norm(halves, axis=-1)
    many.bodies["slop"] = 1e-6 * many.bodies["radius"]
    many.place[:] = many.now[:, :3] = places
    many.rotation[:] = np.reshape(rotations, (-1, 9))
    return many


# --- broad phase -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [1, 2, 3, 10, 100])
def test_pairs_are_those_whose_boxes_overlap(count):
    rng = np.random.default_rng(count)
    halves = rng.uniform(0.1, 1.0, (count, 3))
    many = blocks(rng.uniform(-3, 3, (count, 3)), [rotation(rng) for _ in range(count)], halves)
    find_pairs(0.0, many)
    found = {tuple(pair) for pair in many.pairs[: many.counts[PAIRS]].tolist()}
    extent = np.einsum("bij,bj->bi", np.abs(many.rotation.reshape(-1, 3, 3)), halves) + many.bodies["slop"][:, None]
    expected = {
        (a, b)
        for a, b in itertools.combinations(range(count), 2)
        if (np.abs(many.place[a] - many.place[b]) <= extent[a] + extent[b]).all()
    }
    assert found == expected
    assert many.counts[PAIRS] == len(expected)  # none twice


# --- two blocks ------------------------------------------------------------------------------------------------


def separation(direction, many) -> float:
    """Signed distance of the two blocks along a unit direction from the first to the second [m]."""
    R = many.rotation.reshape(2, 3, 3)
    reach = np.abs(np.einsum("bij,i->bj", R, direction)) * many.bodies["dims"]
    return direction @ (many.place[1] - many.place[0]) - reach.sum()


@settings(max_examples=200, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), distance=st.floats(0.2, 3.0))
def test_the_normal_of_two_blocks_separates_them_most(seed, distance):
    rng = np.random.default_rng(seed)
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    halves = rng.uniform(0.2, 1.0, (2, 3))
    many = blocks([np.zeros(3), distance * direction], [rotation(rng), rotation(rng)], halves)
    h = 10.0  # the margin is the way that the loads could bring the blocks in h: gaps up to a m/s² h² = 100 m count
    many.bodies["acceleration"] = 1.0
    find_contacts(h, many)
    n = many.counts[CONTACTS]
    assert n > 0
    normal = many.frame[0, :3]
    best = separation(-normal, many)
    least = many.gap[:n].min()
    # All normals of one pair agree, and no direction separates the blocks by more than the contacts say: all that can
    # are the fifteen axes, so that none of many others may beat them but by the preference for faces, the slop, and
    # rounding. (Where edges separate more than the face whose clip is taken, its contacts are lifted to their gap.)
    np.testing.assert_allclose(many.frame[:n, :3], np.tile(normal, (n, 1)), atol=1e-15)
    others = rng.normal(size=(500, 3)) + 3 * rng.uniform(size=(500, 1)) * -normal
    others /= np.linalg.norm(others, axis=1)[:, None]
    if best < 0:  # of separated blocks the greatest distance may be along none of the axes: that of two vertices
        assert max(separation(other, many) for other in others) <= max(best, least) + 3e-6
    lift = max(0.0, least - best)
    # No contact is deeper than the blocks overlap along the normal (the lowest vertex may be beside the face and
    # clipped away); blocks that overlap have one that is, blocks that are apart none.
    assert least >= best - 1e-6 - 1e-12
    assert best > 0 or lift > 0 or least <= 1e-6
    assert best <= 0 or least > 0
    # Points lie on the blocks they are points of (up to the slop by which the clipping is generous), and their
    # distance along the normal is the gap.
    for k in range(n):
        points = many.place + many.arm[k].reshape(2, 3)
        for b in range(2):
            local = many.rotation[b].reshape(3, 3).T @ (points[b] - many.place[b])
            if n > 1 or best < 0:  # apart, a lone point may stand for a face that is beside the other one
                assert (np.abs(local) <= halves[b] + lift + 1e-5).all()
        assert normal @ (points[0] - points[1]) == pytest.approx(many.gap[k], abs=1e-12)


def test_names_of_equal_stacked_blocks_do_not_change_with_rounding():
    names = []
    for shift in (0.0, 1e-15, -1e-15):
        many = blocks([[0, 0, 0], [shift, 1, shift]], [np.eye(3), np.eye(3)], np.full((2, 3), 0.5))
        find_contacts(0.01, many)
        names.append(sorted(many.name[: many.counts[CONTACTS]].tolist()))
    assert len(names[0]) == 4
    assert names[0] == names[1] == names[2]


# --- linear system ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("count", "links"), [(1, 0), (2, 1), (9, 8), (12, 20), (30, 60)])
def test_the_block_system_is_solved(count, links):
    rng = np.random.default_rng(links)
    many = make_many(count, np.zeros((0, at.WALL_SIZE)), **SETTINGS)
    every = list(itertools.combinations(range(count), 2))
    chosen = sorted(every[k] for k in rng.choice(len(every), links, replace=False)) if links else []
    ends = [*chosen, *((b, -1) for b in range(count))]  # each body also touches a wall, so that all take part
    many.ends[: len(ends)] = ends
    many.touched[:] = 1
    assert envelope.lay_out(len(ends), many) == count
    envelope.clear(count, many)
    A = np.eye(6 * count)
    for a, b in [*chosen, *((b, b) for b in range(count))]:
        for i, j in {(a, b), (b, a)}:
            block = rng.normal(size=(6, 6)) + 6 * np.sqrt(1 + links) * np.eye(6) * (i == j)
            r, c = many.rank[i], many.rank[j]
            array, place = (many.lower, many.start[r] + c) if r >= c else (many.upper, many.start[c] + r)
            array[place] += block
            A[6 * r : 6 * r + 6, 6 * c : 6 * c + 6] += block
    right = rng.normal(size=(count, 6))
    x = right.copy()
    envelope.factor(count, many)
    envelope.substitute(count, x, many)
    # Backward error of elimination: rounding times the condition of A times its order.
    bound = 6 * count * np.finfo(float).eps * np.linalg.cond(A) * np.abs(x).max()
    np.testing.assert_allclose(x.ravel(), np.linalg.solve(A, right.ravel()), atol=bound)


def test_a_stack_is_tridiagonal_whatever_the_order_of_its_bodies():
    rng = np.random.default_rng(0)
    place = rng.permutation(20)
    many = make_many(20, np.zeros((0, at.WALL_SIZE)), **SETTINGS)
    ends = [tuple(sorted((place[k], place[k + 1]))) for k in range(19)]
    many.ends[:19] = ends
    many.touched[:] = 1
    assert envelope.lay_out(19, many) == 20
    assert (np.arange(20) - many.first <= 1).all()
