"""Convex hulls as polyhedra: mass properties against an independent integral, faces against what is known of solids."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import physics
from physics.mass import inertia
from physics.mass.polyhedron import COPLANAR, MOST_CORNERS, convex_hull
from tests.reference import polyhedra

EPS = np.finfo(float).eps
CUBE = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))


def hull(points) -> physics.Hull:
    return physics.Hull(points, 1.0)


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(4, 40))
def test_mass_properties_are_those_of_the_tetrahedra_it_is_made_of(seed, count):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3)) * rng.uniform(0.2, 1.0, 3) + rng.normal(size=3)
    solid = hull(points).polyhedron
    volume, centroid, second = polyhedra.mass_properties(points)
    # A few hundred terms, each rounded to EPS of the size cubed (volume), of which a thin hull's is a small part.
    size = np.abs(points).max()
    noise = 1000 * EPS * size**3
    assert solid.volume == pytest.approx(volume, abs=noise)
    np.testing.assert_allclose(solid.centroid, centroid, atol=noise * size / volume)
    np.testing.assert_allclose(solid.second_moment, second, atol=noise * size**2 / volume)


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), count=st.integers(4, 40))
def test_faces_are_planes_around_all_corners_and_edges_lie_between_them(seed, count):
    rng = np.random.default_rng(seed)
    solid = hull(rng.normal(size=(count, 3))).polyhedron
    assert len(solid.vertices) + len(solid.loops) == len(solid.edges) + 2  # Euler
    reach = 2 * COPLANAR * solid.radius
    for normal, loop in zip(solid.normals, solid.loops):
        heights = solid.vertices @ normal
        np.testing.assert_allclose(heights[list(loop)], heights.max(), atol=reach)
        r = solid.vertices[list(loop)]
        turns = np.cross(np.roll(r, -1, axis=0) - r, np.roll(r, -2, axis=0) - np.roll(r, -1, axis=0)) @ normal
        assert (turns > 0).all()  # counter-clockwise and convex
    for a, b, left, right in solid.edges:
        along = solid.vertices[b] - solid.vertices[a]
        assert np.cross(solid.normals[left], solid.normals[right]) @ along > 0
        for face, (p, q) in ((left, (a, b)), (right, (b, a))):
            loop = solid.loops[face]
            assert (p, q) in set(zip(loop, (*loop[1:], loop[0])))


@settings(max_examples=50, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_box_has_six_faces_however_it_is_turned_and_whatever_else_lies_in_it(seed):
    rng = np.random.default_rng(seed)
    size = rng.uniform(0.1, 2.0, 3)
    box = CUBE * size
    within = rng.dirichlet(np.ones(8), 10) @ box
    on_faces = np.array([rng.dirichlet(np.ones(4)) @ box[box[:, k] > 0] for k in range(3)])
    on_edge = 0.3 * box[0] + 0.7 * box[1]
    R = Rotation.random(random_state=seed).as_matrix()
    points = np.vstack([box, within, on_faces, on_edge]) @ R.T * 10 ** rng.uniform(-3, 3) + rng.normal(size=3)
    solid = hull(points).polyhedron
    assert (len(solid.vertices), len(solid.loops), len(solid.edges)) == (8, 6, 12)


def test_a_box_of_points_has_the_mass_properties_of_a_block():
    size = np.array([5.0, 3.0, 2.0])
    body = physics.Hull(CUBE * size, 6.0)
    np.testing.assert_allclose(body.inertia, inertia.block(size, 6.0), rtol=16 * EPS)
    assert np.array_equal(body.inertia, np.diag(np.diag(body.inertia)))  # not a rounding off its axes
    assert body.centroid == (0.0, 0.0, 0.0)
    assert tuple(body.dimensions) == (2.5, 1.5, 1.0)


def test_known_solids():
    """Regular tetrahedron of edge a: volume a³/(6√2), moment M a²/20; a wedge's centroid is a third up."""
    a = 2.0
    solid = hull(np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]) * a / np.sqrt(8)).polyhedron
    assert solid.volume == pytest.approx(a**3 / (6 * np.sqrt(2)), rel=32 * EPS)
    np.testing.assert_allclose(solid.inertia(3.0), 3.0 * a**2 / 20 * np.eye(3), atol=64 * EPS)
    wedge = hull(polyhedra.prism([(0, 0), (3, 0), (0, 1.5)], 2.0))
    np.testing.assert_allclose(wedge.centroid, (1.0, 0.5, 0.0), atol=16 * EPS)


def test_scaled_by_a_power_of_two_it_is_the_same_hull_to_the_last_bit():
    rng = np.random.default_rng(1)
    points = rng.normal(size=(20, 3))
    small = hull(points).polyhedron
    for scale in (2.0**-20, 2.0**20):
        large = hull(scale * points).polyhedron
        assert np.array_equal(large.vertices, scale * small.vertices)
        assert np.array_equal(large.normals, small.normals)
        assert large.loops == small.loops
        assert np.array_equal(large.second_moment, scale**2 * small.second_moment)


def test_equal_points_share_one_polyhedron():
    assert hull(CUBE).polyhedron is physics.Hull(CUBE.copy(), 3.0).polyhedron
    assert hull(CUBE) == physics.Hull(CUBE.tolist(), 1)


def on_sphere(count):
    k = np.arange(count) + 0.5
    polar, turn = np.arccos(1 - 2 * k / count), np.pi * (1 + 5**0.5) * k
    return np.c_[np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)]


@pytest.mark.parametrize(
    ("points", "message"),
    [
        (CUBE[:3], "points has 3 of them; allowed are at least 4"),
        ([], r"points has shape \(0,\); allowed are rows of 3 numbers"),
        (CUBE[:4], "points lie in one plane"),
        (np.tile(CUBE[0], (5, 1)), "points lie in one plane"),
        (CUBE * (1, 1, 1e-10), "points lie in one plane"),
        (CUBE * (1, 1e-8, 1e-8), "points lie on one line"),
        (CUBE[:, :2], r"points has shape \(8, 2\)"),
        (np.where(CUBE > 0, np.nan, CUBE), r"points\[1, 2\] is nan; allowed are finite numbers"),
        ([(1, 2, 3), (1, 2)], "points is .*allowed are rows of 3 numbers"),
        ("rock", "points is 'rock'; allowed are rows of 3 numbers"),
        (5, "points is 5.0; allowed are rows of 3 numbers"),
        (on_sphere(MOST_CORNERS + 1), f"points has a hull of 65 corners; allowed are at most {MOST_CORNERS}"),
    ],
)
def test_what_is_no_hull_is_refused(points, message):
    with pytest.raises(ValueError, match=message):
        hull(points)


def test_a_thin_plate_has_the_moments_of_one():
    body = physics.Hull(CUBE * (1, 1, 1e-7), 12.0)
    np.testing.assert_allclose(np.diag(body.inertia), (1.0, 1.0, 2.0), rtol=1e-12)


def test_as_many_corners_as_allowed_are():
    assert len(convex_hull(tuple(map(tuple, on_sphere(MOST_CORNERS).tolist()))).vertices) == MOST_CORNERS


def test_the_mass_must_be_one():
    with pytest.raises(ValueError, match=r"mass is 0\.0; allowed"):
        physics.Hull(CUBE, 0.0)
