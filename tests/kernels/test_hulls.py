"""Contacts of convex polyhedra, each against a slow reference that knows nothing of faces and edges."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import physics
from physics.kernels.multibody.data.allocation import make_bodies_workspace
from physics.kernels.multibody.data.arrays import NUM_CONTACTS
from physics.kernels.multibody.data.hull_tables import CUBE, make_hulls
from physics.kernels.multibody.narrowphase.dispatch import find_contacts
from physics.scene.parts import SHAPE_CODES
from physics.scene.polyhedra import polyhedra as polyhedra_of
from physics.world import parameters
from tests.kernels.called import called
from tests.reference import polyhedra, separation

pytestmark = pytest.mark.interpreted

SETTINGS = {"relative_slop": 1e-6, "tolerance": 1e-6, "sweeps": 100, "splits": 8, "rest_share": 0.5}
SIGNS = np.array(list(itertools.product((-1.0, 1.0), repeat=3)))

# The margin is the way that the loads could bring bodies in h: gaps up to a m/s² h² = 100 m count.
EVERYTHING = 10.0

seeds = st.integers(0, 2**32 - 1)


def found(bodies, places, rotations, walls=(), h=EVERYTHING):
    """(workspace, number of contacts) of bodies at rest at `places` with these attitudes (n, 3, 3)."""
    walls = parameters.wall_table(walls)
    many = make_bodies_workspace(len(bodies), walls, (), polyhedra_of(bodies), **SETTINGS)
    many.bodies.body["shape"] = [SHAPE_CODES[body.kind] for body in bodies]
    many.bodies.body["dims"] = [body.dimensions for body in bodies]
    many.bodies.body["radius"] = [body.bounding_radius(body.dimensions) for body in bodies]
    many.bodies.body["mass"] = many.bodies.body["acceleration"] = 1.0
    many.bodies.body["slop"] = 1e-6 * many.bodies.body["radius"]
    many.bodies.center[:] = many.bodies.state[:, :3] = places
    many.bodies.rotation[:] = np.reshape(rotations, (-1, 9))
    called(find_contacts, h, True, True, 0, None, many)
    return many, many.counts[NUM_CONTACTS]


def ends(many, side, n) -> np.ndarray:
    """(n, 3) points of the first (0) or second (1) bodies of the first n contacts, world frame."""
    b, anchors = many.contacts.bodies[:n, side], many.contacts.anchor[:n, 3 * side : 3 * side + 3]
    return many.bodies.center[b] + np.einsum("kij,kj->ki", many.bodies.rotation[b].reshape(-1, 3, 3), anchors)


def rock(rng) -> physics.Hull:
    return physics.Hull(rng.normal(size=(rng.integers(4, 16), 3)) * rng.uniform(0.3, 1.0, 3), 1.0)


def corners(body, place, R) -> np.ndarray:
    """World frame."""
    local = body.polyhedron.vertices if body.kind == "hull" else SIGNS * body.dimensions
    return local @ R.T + place


def apart(rng, most):
    """Two places, a random way of up to `most` apart, in random order."""
    way = rng.normal(size=3)
    return np.array([np.zeros(3), rng.uniform(0.2, most) * way / np.linalg.norm(way)])


def test_the_tables_of_a_block_are_those_of_a_cube():
    solid = physics.Hull(CUBE.vertices, 1.0).polyhedron
    ours, theirs = ({tuple(np.round(n, 12)): l for n, l in zip(s.normals.tolist(), s.loops)} for s in (CUBE, solid))
    assert set(ours) == set(theirs)
    for normal, loop in ours.items():
        k = loop.index(min(loop))
        assert (*loop[k:], *loop[:k]) == theirs[normal]
    assert len(CUBE.edges) == 12
    tables = make_hulls([CUBE, None, solid, CUBE])
    assert tables.of.tolist() == [[0, 8, 0, 6, 0, 12], [0] * 6, [8, 16, 6, 12, 12, 24], [0, 8, 0, 6, 0, 12]]


@settings(max_examples=300, deadline=None)
@given(seed=seeds, kinds=st.sampled_from([("hull", "hull"), ("hull", "block"), ("block", "hull")]))
def test_the_normal_of_two_polyhedra_separates_them_most(seed, kinds):
    rng = np.random.default_rng(seed)
    bodies = [rock(rng) if kind == "hull" else physics.Block(rng.uniform(0.4, 2.0, 3), 1.0) for kind in kinds]
    places, R = apart(rng, 3.0), Rotation.random(2, random_state=seed).as_matrix()
    many, n = found(bodies, places, R)
    assert n > 0
    a, b = (corners(*each) for each in zip(bodies, places, R))
    slop, size = many.bodies.body["slop"].max(), np.abs(np.concatenate([a, b])).max()
    true, normal, least = polyhedra.largest_separation(a, b), many.contacts.frame[0, :3], many.contacts.gap[:n].min()
    along = polyhedra.separation_along(-normal, a, b)
    np.testing.assert_allclose(many.contacts.frame[:n, :3], np.tile(normal, (n, 1)), atol=1e-15)
    points = np.moveaxis([ends(many, k, n) for k in range(2)], 0, 1)
    rounding, reach = 1e-9 * size, 4 * slop + 1e-9 * size
    np.testing.assert_allclose((points[:, 0] - points[:, 1]) @ normal, many.contacts.gap[:n], atol=rounding)
    if true >= 0:  # apart: the distance of two corners is along no face and no two edges; but a plane is between them
        assert least > 0
        return
    # Where they overlap a face or two edges separate them most: no contact is deeper than that, but for the preference
    # for faces (a slop each).
    assert least >= true - reach
    across = points[:, 0] - points[:, 1] - many.contacts.gap[:n, None] * normal
    if n == 1:  # two edges, at points inside them, along that direction
        assert along == pytest.approx(true, abs=reach)
        assert least == pytest.approx(true, abs=reach)
        np.testing.assert_allclose(across, 0.0, atol=rounding)
        return
    # Corners of the overlap of two faces, on both bodies; or, where the faces lie flat on each other but edges separate
    # more (within FLAT, 11 degrees), of the one and as far from it as the edges are.
    np.testing.assert_allclose(across, 0.0, atol=rounding)
    is_on_both = all(polyhedra.is_inside(own, p, reach) for pair in points for own, p in zip((a, b), pair))
    assert is_on_both or least == pytest.approx(true, abs=reach)
    assert along == pytest.approx(true, abs=reach) or least == pytest.approx(true, abs=reach)


@settings(max_examples=100, deadline=None)
@given(seed=seeds, distance=st.floats(0.0, 0.5))
def test_contacts_of_disjoint_polyhedra_have_positive_gaps_only(seed, distance):
    """A linear program says whether a plane separates them."""
    rng = np.random.default_rng(seed)
    bodies, R = [rock(rng), rock(rng)], Rotation.random(2, random_state=seed).as_matrix()
    places = apart(rng, 2.0)
    a, b = (corners(*each) for each in zip(bodies, places, R))
    places[1] += (distance - polyhedra.separation_along(places[1] / np.linalg.norm(places[1]), a, b)) * (
        places[1] / np.linalg.norm(places[1])
    )
    a, b = (corners(*each) for each in zip(bodies, places, R))
    many, n = found(bodies, places, R)
    if polyhedra.are_disjoint(a, b):
        assert (many.contacts.gap[:n] > 0).all()
    else:  # the last of what they touch with is 1e-9 of their size at most
        assert many.contacts.gap[:n].min() <= 2 * many.bodies.body["slop"].max()


def test_stones_of_an_arch_touch_with_the_corners_of_their_joint():
    """Two equal wedges that share a face: four contacts at its corners, gaps 0, and the normal is the joint's."""
    angle = np.pi / 15
    outline = [(np.cos(t) * r, np.sin(t) * r) for r, t in ((0.95, 0), (1.05, 0), (1.05, angle), (0.95, angle))]
    stone = physics.Hull(polyhedra.prism(outline, 0.25), 1.0)
    turn = Rotation.from_euler("z", angle).as_matrix()
    places = [np.array(stone.centroid), turn @ stone.centroid]
    many, n = found([stone, stone], places, [np.eye(3), turn], h=1e-3)
    assert n == 4
    np.testing.assert_allclose(
        many.contacts.frame[:4, :3], np.tile((np.sin(angle), -np.cos(angle), 0), (4, 1)), atol=1e-14
    )
    np.testing.assert_allclose(many.contacts.gap[:4], 0.0, atol=1e-14)
    expected = [(r * np.cos(angle), r * np.sin(angle), z) for r in (0.95, 1.05) for z in (-0.125, 0.125)]
    points = sorted(map(tuple, np.round(places[0] + many.contacts.arm[:4, :3], 12)))
    np.testing.assert_allclose(points, sorted(expected), atol=1e-11)


def test_names_do_not_change_with_rounding_and_are_all_different():
    stone = physics.Hull(polyhedra.prism([(0, 0), (1, 0), (1.2, 1), (0, 1)], 1.0), 1.0)
    names = []
    for shift in (0.0, 1e-15, -1e-15):
        many, n = found([stone, stone], [[0, 0, 0], [shift, shift, 1 + shift]], [np.eye(3)] * 2, h=1e-3)
        names.append(sorted(many.contacts.id[:n].tolist()))
    assert len(set(names[0])) == 4
    assert names[0] == names[1] == names[2]


@settings(max_examples=100, deadline=None)
@given(seed=seeds, count=st.integers(3, 32))
def test_prisms_of_many_sides_have_room_for_all_their_contacts(seed, count):
    """Two regular prisms lie on each other, turned: the overlap of their faces has up to 2 n corners."""
    rng = np.random.default_rng(seed)
    turn = np.arange(count) * 2 * np.pi / count
    prism = physics.Hull(polyhedra.prism(np.c_[np.cos(turn), np.sin(turn)], 1.0), 1.0)
    R = Rotation.from_euler("z", rng.uniform(0, 2 * np.pi)).as_matrix()
    shift = rng.uniform(-0.3, 0.3, 2)
    many, n = found([prism, prism], [[0, 0, 0], [*shift, 1.0]], [np.eye(3), R], h=1e-3)
    assert 3 <= n <= 2 * count
    np.testing.assert_allclose(many.contacts.gap[:n], 0.0, atol=1e-12)
    assert len(set(many.contacts.id[:n].tolist())) == n


@settings(max_examples=100, deadline=None)
@given(seed=seeds, hull_first=st.booleans())
def test_a_sphere_touches_the_nearest_point_of_a_hull(seed, hull_first):
    rng = np.random.default_rng(seed)
    hull, radius = rock(rng), 0.3
    places, R = apart(rng, 3.0), Rotation.random(2, random_state=seed).as_matrix()
    order = [0, 1] if hull_first else [1, 0]
    many, n = found([[hull, physics.Sphere(radius, 1.0)][k] for k in order], places[order], R[order])
    assert n == 1
    point, distance = polyhedra.nearest_point(corners(hull, places[0], R[0]), places[1])
    # Non-negative least squares is good to about the root of rounding of the condition of its normal equations.
    assert many.contacts.gap[0] == pytest.approx(distance - radius, abs=1e-8)
    on_hull = ends(many, 0 if hull_first else 1, 1)[0]
    if distance > 1e-3:
        np.testing.assert_allclose(on_hull, point, atol=1e-6)
        outward = -many.contacts.frame[0, :3] if hull_first else many.contacts.frame[0, :3]
        np.testing.assert_allclose(outward, (places[1] - point) / distance, atol=1e-6 / distance)


@settings(max_examples=60, deadline=None)
@given(seed=seeds, gap=st.sampled_from([-0.01, -1e-4, 1e-4, 0.1, 1.0]), hull_first=st.booleans())
def test_an_ellipsoid_is_as_far_from_a_hull_as_any_direction_says(seed, gap, hull_first):
    rng = np.random.default_rng(seed)
    hull, axes = rock(rng), rng.uniform(0.2, 1.0, 3)
    R = Rotation.random(2, random_state=seed).as_matrix()
    V, n = corners(hull, np.zeros(3), R[0]), separation.spread(2000)
    way, size = apart(rng, 1.0)[1], separation.ellipsoid_support(axes, R[1], n) + (n @ V.T).max(axis=1)
    way /= np.linalg.norm(way)
    low, high = 0.0, 100.0
    for _ in range(50):  # where a coarse look says that they are so far apart
        middle = 0.5 * (low + high)
        low, high = (middle, high) if (n @ (middle * way) - size).max() < gap else (low, middle)
    places, order = np.array([np.zeros(3), high * way]), [0, 1] if hull_first else [1, 0]
    many, count = found([[hull, physics.Ellipsoid(axes, 1.0)][k] for k in order], places[order], R[order])
    assert count == 1

    def along(directions):
        size = separation.ellipsoid_support(axes, R[1], directions) + (directions @ V.T).max(axis=1)
        return directions @ places[1] - size

    outward = -many.contacts.frame[0, :3] if hull_first else many.contacts.frame[0, :3]
    assert many.contacts.gap[0] == pytest.approx(along(outward[None])[0], abs=1e-13)  # it is a separation,
    best = separation.largest_separation(
        lambda n: separation.ellipsoid_support(axes, R[1], n), lambda n: (n @ V.T).max(axis=1), places[1], seed
    )
    # and the largest: the oracle never finds more than there is, and may miss some of it.
    assert many.contacts.gap[0] >= best - 1e-12
    points = [ends(many, k, 1)[0] for k in range(2)]
    np.testing.assert_allclose(points[0] - points[1], many.contacts.gap[0] * many.contacts.frame[0, :3], atol=1e-12)


@settings(max_examples=50, deadline=None)
@given(seed=seeds)
def test_a_hull_touches_a_wall_with_the_corners_that_are_near(seed):
    rng = np.random.default_rng(seed)
    hull, R = rock(rng), Rotation.random(random_state=seed).as_matrix()
    wall = physics.HalfSpace(rng.normal(size=3), rng.normal())
    heights = corners(hull, np.zeros(3), R) @ wall.normal
    place = (wall.offset - heights.min()) * np.array(wall.normal)
    heights += place @ wall.normal - wall.offset
    h = 0.5  # margin and reach are a h²/2 = 0.125 m and the slop
    many, n = found([hull], [place], [R], [wall], h)
    near = np.flatnonzero(heights <= 0.125 + 1e-6 * hull.polyhedron.radius)
    assert (many.contacts.id[:n] % 512).tolist() == near.tolist()
    np.testing.assert_allclose(many.contacts.gap[:n], heights[near], atol=1e-13)
    np.testing.assert_allclose(many.contacts.arm[:n, :3], hull.polyhedron.vertices[near] @ R.T, atol=1e-13)


@pytest.mark.parametrize("scale", [2.0**-30, 2.0**30])
def test_contacts_of_a_scene_scaled_by_a_power_of_two_are_scaled_to_the_last_bit(scale):
    """No absolute tolerance: neither in the hull nor in its contacts with hulls, blocks, balls and walls."""
    rng = np.random.default_rng(7)
    points, places = rng.normal(size=(2, 10, 3)), rng.normal(size=(4, 3))
    R = Rotation.random(4, random_state=1).as_matrix()
    sets = []
    for size in (1.0, scale):
        bodies = [physics.Hull(size * each, 1.0) for each in points]
        bodies += [physics.Block(size * np.array([1.0, 0.5, 0.7]), 1.0), physics.Sphere(0.3 * size, 1.0)]
        walls = [physics.HalfSpace((1, 2, 3), -0.5 * size)]
        many, n = found(bodies, size * places, R, walls, EVERYTHING * np.sqrt(size))
        sets.append(
            (many.contacts.id[:n], many.contacts.gap[:n] / size, many.contacts.arm[:n] / size, many.contacts.frame[:n])
        )
    assert len(sets[0][0]) > 10
    for small, large in zip(*sets):
        np.testing.assert_array_equal(small, large)
