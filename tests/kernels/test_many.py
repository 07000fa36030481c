"""Parts of the step of many bodies, each against a slow reference: pairs, contacts of two blocks, the linear system."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

from physics.compiler.decorators import kernel
from physics.kernels.multibody.broadphase.sweep_and_prune import find_pairs
from physics.kernels.multibody.data.allocation import make_bodies_workspace
from physics.kernels.multibody.data.arrays import NUM_BATCHES, NUM_CONTACTS, NUM_DROPPED, NUM_PAIRS
from physics.kernels.multibody.narrowphase.box_sat import FLAT_COSINE
from physics.kernels.multibody.narrowphase.dispatch import find_contacts
from physics.kernels.multibody.solver import block_lu as blocks_of
from physics.kernels.multibody.solver import contact_batches, newton_system, second_order_cone
from physics.kernels.multibody.solver.islands import find_islands
from physics.kernels.multibody.solver.minimum_degree import order_elimination
from physics.kernels.state import layout as at
from tests.kernels.called import called

pytestmark = pytest.mark.interpreted

SETTINGS = {"relative_slop": 1e-6, "tolerance": 1e-6, "sweeps": 100, "splits": 8, "rest_share": 0.5}

ANY = 10**9  # products of blocks: as many as there are


def rotation(rng) -> np.ndarray:
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q if np.linalg.det(q) > 0 else -q


def blocks(places, rotations, halves):
    """Workspace with blocks at rest, placed for the narrow phase."""
    many = make_bodies_workspace(len(places), np.zeros((0, at.WALL_SIZE)), **SETTINGS)
    many.bodies.body["shape"], many.bodies.body["mass"], many.bodies.body["dims"] = at.BLOCK, 1.0, halves
    many.bodies.body["radius"] = np.linalg.norm(halves, axis=-1)
    many.bodies.body["slop"] = 1e-6 * many.bodies.body["radius"]
    many.bodies.center[:] = many.bodies.state[:, :3] = places
    many.bodies.rotation[:] = np.reshape(rotations, (-1, 9))
    return many


# --- broad phase -----------------------------------------------------------------------------------------------


def spread_out(seed, count, ratio, stretch):
    """Workspace with `count` turned blocks in a box stretched along its axes, half edges spread over `ratio`."""
    rng = np.random.default_rng(seed)
    halves = 0.2 * ratio ** rng.uniform(0, 1, (count, 3))
    places = rng.uniform(-1, 1, (count, 3)) * np.array(stretch)
    return blocks(places, [rotation(rng) for _ in range(count)], halves)


def pairs_in_the_order_of_bodies(many):
    """All pairs of bodies whose boxes overlap, compared one by one: a reference for `find_pairs`."""
    R, count = np.abs(many.bodies.rotation.reshape(-1, 3, 3)), len(many.bodies.center)
    extent = np.einsum("bij,bj->bi", R, many.bodies.body["dims"]) + many.bodies.body["slop"][:, None]
    return [
        (a, b)
        for a, b in itertools.combinations(range(count), 2)
        if (np.abs(many.bodies.center[a] - many.bodies.center[b]) <= extent[a] + extent[b]).all()
    ]


@pytest.mark.compiled
@pytest.mark.parametrize("count", [1, 2, 3, 10, 17, 18, 100, 400])  # up to 17 each is compared with each
@pytest.mark.parametrize("ratio", [1.0, 3.0, 1000.0])  # of the largest to the smallest: large ones enter many columns
@pytest.mark.parametrize("stretch", [(3, 3, 3), (30, 1, 2), (1, 40, 40)])
def test_pairs_are_those_whose_boxes_overlap_in_the_order_of_bodies(count, ratio, stretch):
    many = spread_out(count, count, ratio, stretch)
    called(find_pairs, 0.0, many)
    found = [tuple(pair) for pair in many.broadphase.pairs[: many.counts[NUM_PAIRS]].tolist()]
    expected = pairs_in_the_order_of_bodies(many)
    assert found == expected or len(expected) > len(many.broadphase.pairs)
    assert found == sorted(found)
    assert many.counts[NUM_PAIRS] + many.counts[NUM_DROPPED] == len(expected)  # none twice, and none missed


@pytest.mark.parametrize("seed", range(5))
def test_pairs_are_found_within_columns_not_by_comparing_all(seed):
    """The bodies listed in one column are few, however many there are."""
    count = 400
    many = spread_out(seed, count, 1.0, (6, 6, 6))
    called(find_pairs, 0.0, many)
    lengths = np.diff(many.broadphase.first_entry)[many.broadphase.cursor != many.broadphase.first_entry[:-1]]
    # Boxes are 0.4 to 0.7 wide (a cube's 2 x 0.2, turned): strips of at most 1.4 + cuts on 12 are 8 or more a side.
    # 400 bodies that enter at most 4 columns each: 25 or less in each of 64 on average; twice that is never reached.
    assert 0 < lengths.max() <= 50


@pytest.mark.compiled
@pytest.mark.parametrize("value", [np.nan, np.inf, 1e300])
def test_a_box_that_is_not_finite_is_no_reason_to_read_beyond_the_columns(value):
    many = spread_out(0, 50, 1.0, (3, 3, 3))
    many.bodies.center[7, 1] = value
    called(find_pairs, 0.0, many)
    assert 0 <= many.counts[NUM_PAIRS] <= len(many.broadphase.pairs)


# --- two blocks ------------------------------------------------------------------------------------------------


def separation(direction, many) -> float:
    """Signed distance of the two blocks along a unit direction from the first to the second [m]."""
    R = many.bodies.rotation.reshape(2, 3, 3)
    reach = np.abs(np.einsum("bij,i->bj", R, direction)) * many.bodies.body["dims"]
    return direction @ (many.bodies.center[1] - many.bodies.center[0]) - reach.sum()


@settings(max_examples=200, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), distance=st.floats(0.2, 3.0))
@example(seed=1300364, distance=1.8125)  # edges that separate, nearly along a face that is beside the other block
def test_the_normal_of_two_blocks_separates_them_most(seed, distance):
    rng = np.random.default_rng(seed)
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    halves = rng.uniform(0.2, 1.0, (2, 3))
    many = blocks([np.zeros(3), distance * direction], [rotation(rng), rotation(rng)], halves)
    h = 10.0  # the margin is the way that the loads could bring the blocks in h: gaps up to a m/s² h² = 100 m count
    many.bodies.body["acceleration"] = 1.0
    called(find_contacts, h, None, None, 0, None, many)
    n = many.counts[NUM_CONTACTS]
    assert n > 0
    normal = many.contacts.frame[0, :3]
    best = separation(-normal, many)
    least = many.contacts.gap[:n].min()
    # All normals of one pair agree, and no direction separates the blocks by more than the contacts say: all that can
    # are the fifteen axes, so that none of many others may beat them but by the preference for faces, the slop, and
    # rounding. (Where edges separate more than the face whose clip is taken, its contacts are lifted to their gap.)
    np.testing.assert_allclose(many.contacts.frame[:n, :3], np.tile(normal, (n, 1)), atol=1e-15)
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
    # distance along the normal is the gap. Impulses act at one point of both.
    R = many.bodies.rotation.reshape(2, 3, 3)
    for k in range(n):
        points = many.bodies.center + np.einsum("bij,bj->bi", R, many.contacts.anchor[k].reshape(2, 3))
        arms = many.bodies.center + many.contacts.arm[k].reshape(2, 3)
        np.testing.assert_allclose(arms[0], arms[1], rtol=0, atol=1e-14)
        for b in range(2):
            local = many.bodies.rotation[b].reshape(3, 3).T @ (points[b] - many.bodies.center[b])
            if n > 1 or best < 0:  # apart, a lone point may stand for a face that is beside the other one
                assert (np.abs(local) <= halves[b] + lift + 1e-5).all()
        assert normal @ (points[0] - points[1]) == pytest.approx(many.contacts.gap[k], abs=1e-12)


@pytest.mark.parametrize("seed", range(5))
def test_the_speed_of_a_contact_is_that_of_its_two_points(seed):
    rng = np.random.default_rng(seed)
    many = blocks([np.zeros(3), [0.2, 0.9, 0.1]], [rotation(rng), rotation(rng)], np.full((2, 3), 0.5))
    many.bodies.twist[:] = rng.normal(size=(2, 6))
    called(find_contacts, 0.01, None, None, 0, None, many)
    n, twist = many.counts[NUM_CONTACTS], many.bodies.twist
    assert n > 0
    arms = many.contacts.arm[:n].reshape(n, 2, 3)
    points = twist[:, :3] + np.cross(twist[:, 3:], arms)
    speeds = np.einsum("ki,ki->k", many.contacts.frame[:n, :3], points[:, 0] - points[:, 1])
    np.testing.assert_allclose(many.contacts.speed[:n], speeds, rtol=0, atol=1e-14)


@settings(max_examples=100, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    turns=st.tuples(
        st.floats(-math.pi, math.pi), st.floats(math.acos(FLAT_COSINE) + 1e-3, math.asin(FLAT_COSINE) - 1e-3)
    ),
    shift=st.floats(-0.9, 0.9),
)
def test_parallel_edges_that_touch_push_along_the_middle_of_what_both_allow(seed, turns, shift):
    """In the plane across the edges: at a corner between its +x and +y faces, turned by α, a block allows the normals
    from α to α + 90°; one that touches it with the corner of its -x and -y faces, turned by β, allows β to β + 90°,
    turned round. The middle of what both allow, for |α - β| < 90°, is (α + β)/2 + 45°. Within 11° of 0° and of 90° two
    of their faces lie flat on each other.
    """
    rng = np.random.default_rng(seed)
    alpha, beta = turns[0], turns[0] + turns[1] * rng.choice([-1, 1])
    halves, world = rng.uniform(0.3, 1.0, (2, 3)), rotation(rng)
    planar = [
        np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]]) for c, s in ((math.cos(t), math.sin(t)) for t in (alpha, beta))
    ]
    a = -planar[0] @ [halves[0, 0], halves[0, 1], 0.0]
    b = planar[1] @ [halves[1, 0], halves[1, 1], shift * halves[:, 2].sum()]
    if abs(shift) * halves[:, 2].sum() > halves[:, 2].sum() - 0.01:
        return  # beside each other along the edges
    many = blocks([world @ a, world @ b], [world @ R for R in planar], halves)
    called(find_contacts, 0.01, None, None, 0, None, many)
    n = many.counts[NUM_CONTACTS]
    middle = 0.5 * (alpha + beta) + 0.25 * math.pi
    assert n == 2
    # The normal is out of the second block. A turned corner is rounded in the last bits; what is low is judged by slops
    # of 1e-6, which a normal does not see.
    expected = -world @ [math.cos(middle), math.sin(middle), 0.0]
    np.testing.assert_allclose(many.contacts.frame[:n, :3], np.tile(expected, (n, 1)), atol=1e-12)
    np.testing.assert_allclose(many.contacts.gap[:n], 0.0, atol=1e-14)


@settings(max_examples=200, deadline=None)
@given(
    yaw=st.floats(0.1, 1.4),
    shift=st.tuples(st.floats(-0.6, 0.6), st.floats(-0.6, 0.6)),
    tilt=st.floats(1e-7, 3e-5),
    heading=st.floats(-math.pi, math.pi),
)
@example(yaw=0.1, shift=(0.5, 0.0), tilt=3e-5, heading=math.pi / 2)  # low along the rim of the block below
def test_no_contact_is_lost_where_a_face_is_tilted_by_some_slops(yaw, shift, tilt, heading):
    """Faces as good as flat touch at the same points, tilted or not: a block lies on all of them, or could within h.

    Its lowest edge alone would not hold it, and its weight would turn it until the one on the other side is lowest.
    """
    h, acceleration = 0.01, 10.0  # falls 500 slops in h; the rise of a corner at these tilts is 60 of them at most

    def touching_at(angle):
        c, s = math.cos(yaw), math.sin(yaw)
        turned = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
        x, z = math.cos(heading), math.sin(heading)
        cross = np.array([[0, -z, 0], [z, 0, -x], [0, x, 0]])  # of the axis (x, 0, z)
        tipped = (np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross) @ turned
        many = blocks([[0, 0, 0], [shift[0], 1.0, shift[1]]], [np.eye(3), tipped], np.full((2, 3), 0.5))
        many.bodies.body["acceleration"] = acceleration
        called(find_contacts, h, None, None, 0, None, many)
        n = many.counts[NUM_CONTACTS]
        return n, many.contacts.frame[:n, :3]

    flat, _ = touching_at(0.0)
    count, normals = touching_at(tilt)
    assert count == flat >= 3
    # The normal is that of one of the two faces, the last of which is turned by the tilt.
    np.testing.assert_allclose(normals, np.tile([0.0, -1.0, 0.0], (count, 1)), atol=2 * tilt)


def test_names_of_equal_stacked_blocks_do_not_change_with_rounding():
    names = []
    for shift in (0.0, 1e-15, -1e-15):
        many = blocks([[0, 0, 0], [shift, 1, shift]], [np.eye(3), np.eye(3)], np.full((2, 3), 0.5))
        called(find_contacts, 0.01, None, None, 0, None, many)
        names.append(sorted(many.contacts.id[: many.counts[NUM_CONTACTS]].tolist()))
    assert len(names[0]) == 4
    assert names[0] == names[1] == names[2]


@settings(max_examples=100, deadline=None)
@given(yaw=st.floats(-4, 4), shift=st.tuples(st.floats(-3, 3), st.floats(-3, 3)))
@example(yaw=0.2, shift=(1.0, 0.0))  # a side from 0.8 to 1.2 slops outside: its crossing with the rim is beyond its end
def test_faces_that_end_together_touch_all_over(yaw, shift):
    """Equal cubes on each other, sides apart by slops: at the four corners, none of them lost or off the faces."""
    slop = 1e-6 * math.sqrt(0.75)
    c, s = math.cos(yaw * slop), math.sin(yaw * slop)
    turned = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])
    many = blocks([[0, 0, 0], [shift[0] * slop, 1, shift[1] * slop]], [np.eye(3), turned], np.full((2, 3), 0.5))
    called(find_contacts, 0.01, None, None, 0, None, many)
    points = many.contacts.arm[: many.counts[NUM_CONTACTS], :3]
    # A corner is off by the shift, its way by the turn, and what the clip leaves or takes: a slop.
    reach = (3 + 4 * 0.5 + 1 + 1e-6) * slop
    corners = np.array(list(itertools.product((-0.5, 0.5), (0.5,), (-0.5, 0.5))))
    distance = np.abs(points[:, None] - corners).max(axis=-1)
    assert (distance.min(axis=0) <= reach).all()  # every corner is held
    assert (np.abs(points) <= 0.5 + reach).all()  # nothing off the faces


# --- islands and the linear system -----------------------------------------------------------------------------


def numbers_of(block):
    """The numbers of a 6 x 6 block as `block_lu` has them: column by column, one unused after each three."""
    return np.pad(block.T.reshape(6, 2, 3), ((0, 0), (0, 0), (0, 1))).ravel()


def block_of(numbers):
    """The 6 x 6 block of such numbers."""
    return numbers.reshape(6, 2, 4)[:, :, :3].reshape(6, 6).T


def touching(count, pairs, walls=()):
    """Workspace with one contact for each pair of bodies, and for each body in `walls`; how many contacts."""
    many = make_bodies_workspace(count, np.zeros((1, at.WALL_SIZE)), **SETTINGS)
    ends = [*pairs, *((b, -1) for b in walls)]
    many.contacts.bodies[: len(ends)] = np.reshape(ends, (-1, 2))
    return many, len(ends)


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(1, 30), links=st.integers(0, 40))
def test_islands_are_the_connected_components(seed, count, links):
    rng = np.random.default_rng(seed)
    every = list(itertools.combinations(range(count), 2))
    pairs = [every[k] for k in rng.permutation(len(every))[:links]]
    walls = rng.choice(count, rng.integers(1, count + 1), replace=False).tolist()
    many, n = touching(count, pairs, walls)
    found = called(find_islands, n, many)
    graph = csr_array((np.ones(len(pairs)), np.reshape(pairs, (-1, 2)).T.astype(int)), (count, count))
    labels = connected_components(graph, directed=False)[1]
    seen = []
    for i in range(found):
        contacts = many.islands.contacts[many.islands.first_contact[i] : many.islands.first_contact[i + 1]]
        bodies = many.islands.bodies[many.islands.first_body[i] : many.islands.first_body[i + 1]]
        assert (np.diff(contacts) > 0).all()  # in their order
        label = labels[many.contacts.bodies[contacts[0], 0]]
        assert set(labels[many.contacts.bodies[contacts, 0]]) == {label}
        assert sorted(bodies) == np.flatnonzero(labels == label).tolist()
        seen += contacts.tolist()
    assert sorted(seen) == list(range(n))


def island_of_all(count, pairs, most=ANY):
    """Workspace with one island, which `pairs` must connect, ordered for elimination; products that it takes."""
    many, n = touching(count, pairs, [0])
    assert called(find_islands, n, many) == 1
    return many, called(order_elimination, 0, n, 0, count, most, many)


def connected_pairs(rng, count, links):
    """Pairs of a random connected graph: a tree and `links` more."""
    pairs = {(int(rng.integers(0, b)), b) for b in range(1, count)}
    every = [pair for pair in itertools.combinations(range(count), 2) if pair not in pairs]
    more = rng.choice(len(every), min(links, len(every)), replace=False) if every else []
    return sorted(pairs | {every[k] for k in more})


@pytest.mark.parametrize(("count", "links"), [(1, 0), (2, 0), (9, 0), (12, 12), (30, 40)])
def test_the_block_system_is_solved(count, links):
    rng = np.random.default_rng(links)
    pairs = connected_pairs(rng, count, links)
    many, products = island_of_all(count, pairs)
    assert products >= count
    called(blocks_of.clear_system, 0, count, many)
    A = np.zeros((6 * count, 6 * count))
    for a, b in [*pairs, *((b, b) for b in range(count))]:
        for i, j in {(a, b), (b, a)}:
            block = rng.normal(size=(6, 6)) + 6 * np.sqrt(1 + links) * np.eye(6) * (i == j)
            if i == j:
                many.system.diagonal[i] += numbers_of(block)
            elif many.system.rank[i] > many.system.rank[j]:
                many.system.lower[called(blocks_of.find_block_index, j, i, many)] += numbers_of(block)
            else:
                many.system.upper[called(blocks_of.find_block_index, i, j, many)] += numbers_of(block)
            A[6 * i : 6 * i + 6, 6 * j : 6 * j + 6] += block
    right = rng.normal(size=(count, 6))
    x = np.pad(right.reshape(count, 2, 3), ((0, 0), (0, 0), (0, 1))).reshape(count, 8)
    called(blocks_of.factor_system, 0, count, many)
    called(blocks_of.solve_factored, 0, count, x, many)
    x = x.reshape(count, 2, 4)[:, :, :3]
    # Backward error of elimination: rounding times the condition of A times its order.
    bound = 6 * count * np.finfo(float).eps * np.linalg.cond(A) * np.abs(x).max()
    np.testing.assert_allclose(x.ravel(), np.linalg.solve(A, right.ravel()), atol=bound)


def test_elimination_ends_where_it_takes_more_products_than_are_allowed():
    pairs = connected_pairs(np.random.default_rng(0), 20, 30)
    _, products = island_of_all(20, pairs)
    assert products > 20
    assert island_of_all(20, pairs, products)[1] == products
    assert island_of_all(20, pairs, products - 1)[1] == -1


@pytest.mark.parametrize("kind", ["any", "in order", "needs exchanges", "far apart"])
def test_a_block_is_inverted(kind):
    """With pivots on its diagonal or not; entries a million apart are no worse than their condition."""
    rng = np.random.default_rng(0)
    for _ in range(50):
        A = rng.normal(size=(6, 6))
        if kind == "in order":
            A += 20.0 * np.eye(6)
        elif kind == "needs exchanges":
            A = (A + 20.0 * np.eye(6))[rng.permutation(6)]
        elif kind == "far apart":
            A = A @ A.T * 1.0e6 + np.eye(6)
        many = make_bodies_workspace(1, np.zeros((1, at.WALL_SIZE)), **SETTINGS)
        many.system.diagonal[0] = numbers_of(A)
        blocks_of.invert_block(many.system.diagonal, 0, many.system.swaps)
        # Gauss and Jordan: rounding times condition, times what multipliers up to PIVOT_FACTOR add to it in practice.
        error = block_of(many.system.diagonal[0]) - np.linalg.inv(A)
        assert np.linalg.norm(error, 2) <= 1e-13 * np.linalg.cond(A) * np.linalg.norm(np.linalg.inv(A), 2)


@kernel
def add_batches(rho, D, E, F, many):
    """`newton_system.add_batch_to_matrix` of all batches; D, E, F: three numbers of each contact, its matrix."""
    for g in range(many.counts[NUM_BATCHES]):
        x, y, z = (
            contact_batches.gather_batch(g, D, many),
            contact_batches.gather_batch(g, E, many),
            contact_batches.gather_batch(g, F, many),
        )
        newton_system.add_batch_to_matrix(g, (x[0], x[1], x[2], y[0], y[1], y[2], z[0], z[1], z[2]), rho, many)


@pytest.mark.parametrize("contacts", [1, 3, 4, 6])
@pytest.mark.parametrize(("count", "links"), [(1, 0), (2, 0), (9, 12)])
def test_the_matrix_is_that_of_the_contacts(count, links, contacts):
    """1 + M⁻¹ Jᵀ ρ D J, D not symmetric, against dense matrices; contacts of walls among them, several of each pair."""
    rng = np.random.default_rng(links)
    pairs = [pair for pair in connected_pairs(rng, count, links) for _ in range(contacts)]
    many, n = touching(count, pairs, list(range(0, count, 2)))
    called(find_islands, n, many)
    called(order_elimination, 0, n, 0, count, ANY, many)
    many.contacts.frame[:n] = [np.linalg.qr(rng.normal(size=(3, 3)))[0].ravel() for _ in range(n)]
    many.contacts.arm[:n], many.bodies.inv_mass[:] = rng.normal(size=(n, 6)), rng.uniform(0.5, 2, count)
    M, D, rho = np.zeros((6 * count, 6 * count)), rng.normal(size=(n, 9)), 0.7
    for b in range(count):
        K = rng.normal(size=(3, 3))
        K = K @ K.T
        many.bodies.inv_inertia[b] = K[np.triu_indices(3)]
        M[6 * b : 6 * b + 3, 6 * b : 6 * b + 3] = many.bodies.inv_mass[b] * np.eye(3)
        M[6 * b + 3 : 6 * b + 6, 6 * b + 3 : 6 * b + 6] = K
    assert called(contact_batches.batch_contacts, 0, n, many)
    called(blocks_of.clear_system, 0, count, many)
    A, found = np.eye(6 * count), np.zeros((6 * count, 6 * count))
    for k in range(n):
        J = np.zeros((3, 6 * count))
        for end, (b, sign) in enumerate(zip(many.contacts.bodies[k], (1, -1))):
            if b >= 0:
                r = many.contacts.arm[k, 3 * end : 3 * end + 3]
                J[:, 6 * b : 6 * b + 6] = sign * np.hstack([np.eye(3), np.cross(np.eye(3), r).T])  # v + ω x r
        J = many.contacts.frame[k].reshape(3, 3) @ J
        A += M @ J.T @ (rho * D[k].reshape(3, 3)) @ J
    called(add_batches, rho, *(np.ascontiguousarray(D[:, k : k + 3]) for k in (0, 3, 6)), many)
    called(newton_system.complete_matrix, 0, count, many)
    for b in range(count):
        found[6 * b : 6 * b + 6, 6 * b : 6 * b + 6] = block_of(many.system.diagonal[b])
        for k in range(many.system.start[b], many.system.stop[b]):
            c = many.system.column[k]
            found[6 * c : 6 * c + 6, 6 * b : 6 * b + 6] = block_of(many.system.lower[k])
            found[6 * b : 6 * b + 6, 6 * c : 6 * c + 6] = block_of(many.system.upper[k])
    np.testing.assert_allclose(found, A, atol=1e-14 * n * np.abs(A).max())  # rounding of n sums of products


@pytest.mark.parametrize("kind", ["stack", "plate", "tree"])
def test_a_tree_of_bodies_fills_nothing_whatever_their_order(kind):
    rng = np.random.default_rng(0)
    place = rng.permutation(40)
    tree = {
        "stack": [(k, k + 1) for k in range(39)],
        "plate": [(0, k) for k in range(1, 40)],
        "tree": [(int(rng.integers(0, k)), k) for k in range(1, 40)],
    }[kind]
    _, products = island_of_all(40, sorted(sorted((int(place[a]), int(place[b]))) for a, b in tree))
    # Every body but the last has one later neighbour: one block below the diagonal, one product, one inverse.
    assert products == 3 * 39 + 1


@pytest.mark.parametrize(("rows", "columns"), [(4, 4), (10, 3)])
def test_minimum_degree_fills_no_more_than_the_numbers_of_a_grid(rows, columns):
    at_grid = np.arange(rows * columns).reshape(rows, columns)
    pairs = [*zip(at_grid[:, :-1].ravel(), at_grid[:, 1:].ravel()), *zip(at_grid[:-1].ravel(), at_grid[1:].ravel())]
    _, products = island_of_all(rows * columns, sorted((int(a), int(b)) for a, b in pairs))
    band = rows * columns * (1 + columns + columns**2)  # row by row, each body has `columns` later neighbours at most
    assert products <= band


def test_where_there_is_no_room_for_the_blocks_the_island_says_so():
    count = 90  # all touch all: 4005 blocks, and room for 32 a body
    assert island_of_all(count, list(itertools.combinations(range(count), 2)))[1] == -1


# --- cones -----------------------------------------------------------------------------------------------------


def inside(rng):
    """A point inside the Lorentz cone, sometimes near its boundary."""
    tangent = rng.normal(size=2)
    return (np.hypot(*tangent) + 10 ** rng.uniform(-3, 1), *tangent)


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_scaling_takes_p_and_u_to_the_same_point(seed):
    rng = np.random.default_rng(seed)
    p, u, x = inside(rng), inside(rng), tuple(rng.normal(size=3))
    w, own, inverse = second_order_cone.nt_scaling(p, u)
    # Rounding of W and its inverse: they are within the condition of the scaling, (w₀ + |w'|)² (η cancels), of exact.
    bound = 1e-14 * (w[0] + np.hypot(w[1], w[2])) ** 2
    size = np.abs(second_order_cone.apply_scaling(w, p)).max()
    np.testing.assert_allclose(own, second_order_cone.apply_scaling(w, p), atol=10 * bound * size)
    np.testing.assert_allclose(own, second_order_cone.apply_inv_scaling(w, u), atol=10 * bound * size)
    np.testing.assert_allclose(
        inverse**-4, second_order_cone.cone_determinant(p) * second_order_cone.cone_determinant(u)
    )  # det W x = η² det x
    np.testing.assert_allclose(
        second_order_cone.apply_inv_scaling(w, second_order_cone.apply_scaling(w, x)), x, atol=10 * bound
    )
    twice = second_order_cone.apply_inv_scaling(w, second_order_cone.apply_inv_scaling(w, x))
    np.testing.assert_allclose(
        second_order_cone.apply_inv_scaling_twice(w, x), twice, atol=10 * bound * np.abs(twice).max() + 1e-14
    )


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_the_quotient_undoes_the_product_and_the_way_out_ends_at_the_boundary(seed):
    rng = np.random.default_rng(seed)
    a, b = inside(rng), tuple(rng.normal(size=3))
    # The product's matrix has eigenvalues a₀ ± |a'|.
    condition = (a[0] + np.hypot(a[1], a[2])) / (a[0] - np.hypot(a[1], a[2]))
    inverse = 1 / np.sqrt(second_order_cone.cone_determinant(a))
    quotient = second_order_cone.jordan_quotient(second_order_cone.jordan_product(a, b), a, inverse)
    np.testing.assert_allclose(quotient, b, atol=1e-14 * condition * np.abs(b).max())
    rate = second_order_cone.inv_step_to_boundary(a, inverse, b)
    far = np.array(a) * 1e-3 + np.array(b) if rate <= 0 else np.array(a) + np.array(b) / rate
    slack = far[0] - np.hypot(far[1], far[2])
    bound = 1e-12 * condition * (np.abs(a).max() + np.abs(b).max() * max(1, 1 / abs(rate)))
    assert slack >= -bound
    assert rate <= 0 or slack <= bound
