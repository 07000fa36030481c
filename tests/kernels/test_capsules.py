"""Contacts of capsules: the least gap is the distance of a slow reference, and what lies has two contacts."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import physics
from physics.kernels.multibody.data.allocation import make_bodies_workspace
from physics.kernels.multibody.data.arrays import NUM_CONTACTS
from physics.kernels.multibody.narrowphase.dispatch import find_contacts
from physics.kernels.multibody.stepping.passing_pairs import _gap_along
from physics.rotations import rotation_matrices
from physics.scene.parts import SHAPE_CODES
from physics.scene.polyhedra import polyhedra
from physics.world import parameters
from tests.kernels.called import called
from tests.reference.capsules import axis_as_polyhedron, axis_of, gap_of_block, gap_of_capsule
from tests.reference.polyhedra_distance import distance_apart, posed, separation

pytestmark = pytest.mark.interpreted

SETTINGS = {"relative_slop": 1e-6, "tolerance": 1e-6, "sweeps": 100, "splits": 8, "rest_share": 0.5}
ALONG_X = (0.5**0.5, 0, 0, -(0.5**0.5))  # body y along world x
ALONG_Z = (0.5**0.5, 0.5**0.5, 0, 0)

# Coordinates of up to 3 m; a nearest point is found by some tens of operations on them.
EXACT = 1e-13

seeds = st.integers(0, 2**32 - 1)


def contacts(*bodies, walls=(), h=10.0):
    """(gaps, normals out of the second body, points of the first one, features) of bodies at rest, in their poses.

    Loads of 1 m/s² could bring them together in h [s], so that gaps up to 100 m count.
    """
    many = make_bodies_workspace(
        len(bodies), parameters.wall_table(walls), (), polyhedra(bodies), capsules=True, **SETTINGS
    )
    many.bodies.body["shape"] = [SHAPE_CODES[body.kind] for body in bodies]
    many.bodies.body["dims"] = [body.dimensions for body in bodies]
    many.bodies.body["radius"] = [body.bounding_radius(body.dimensions) for body in bodies]
    many.bodies.body["mass"] = many.bodies.body["acceleration"] = 1.0
    many.bodies.body["slop"] = 1e-6
    many.bodies.center[:] = many.bodies.state[:, :3] = [body.pos for body in bodies]
    many.bodies.rotation[:] = [rotation_matrices(np.array(body.quat)).ravel() for body in bodies]
    called(find_contacts, h, True, None, 0, None, many)
    n = many.counts[NUM_CONTACTS]
    points = many.bodies.center[many.contacts.bodies[:n, 0]] + many.contacts.arm[:n, :3]
    return many.contacts.gap[:n].copy(), many.contacts.frame[:n, :3].copy(), points, many


def drawn_pose(rng, reach):
    q = rng.normal(size=4)
    return {"pos": rng.uniform(-reach, reach, 3), "quat": q / np.linalg.norm(q)}


def drawn_capsule(rng, reach=1.5):
    return physics.Capsule(rng.uniform(0.05, 0.4), rng.uniform(0.1, 2.0), 1.0, **drawn_pose(rng, reach))


@settings(max_examples=150, deadline=None)
@given(seed=seeds, swaps=st.booleans())
def test_the_least_gap_to_a_block_is_the_distance(seed, swaps):
    """Expect the shortest way out, along a face or an edge, of a capsule whose axis passes through the block."""
    rng = np.random.default_rng(seed)
    capsule, block = drawn_capsule(rng), physics.Block(rng.uniform(0.2, 2.0, 3), 1.0, **drawn_pose(rng, 0.5))
    gaps, normals, _, _ = contacts(*((block, capsule) if swaps else (capsule, block)))
    apart = separation(axis_as_polyhedron(capsule), posed(block, block.pos, block.quat))
    true = gap_of_block(capsule, block) if apart > 0 else apart - capsule.radius
    assert gaps.min() == pytest.approx(true, abs=EXACT)
    towards = np.array(capsule.pos) - block.pos
    if true > 0:
        assert (normals[gaps.argmin()] @ towards > 0) == (not swaps)


@settings(max_examples=60, deadline=None)
@given(seed=seeds)
def test_the_least_gap_to_a_hull_is_the_distance(seed):
    rng = np.random.default_rng(seed)
    capsule = drawn_capsule(rng)
    points = rng.normal(size=(rng.integers(4, 12), 3)) * rng.uniform(0.3, 1.0, 3)
    hull = physics.Hull(points, 1.0, **drawn_pose(rng, 0.5))
    gaps, _, _, _ = contacts(capsule, hull)
    axis, solid = axis_as_polyhedron(capsule), posed(hull, hull.pos, hull.quat)
    apart = separation(axis, solid)
    true = distance_apart(axis, solid) if apart > 0 else apart
    # the oracle and the tables have the hull's corners from different sums
    assert gaps.min() == pytest.approx(true - capsule.radius, abs=100 * EXACT)


@settings(max_examples=150, deadline=None)
@given(seed=seeds)
def test_the_least_gap_of_two_capsules_is_the_distance_of_their_axes(seed):
    rng = np.random.default_rng(seed)
    one, other = drawn_capsule(rng), drawn_capsule(rng)
    gaps, normals, points, _ = contacts(one, other)
    assert gaps.min() == pytest.approx(gap_of_capsule(one, other), abs=EXACT)
    for gap, normal, point in zip(gaps, normals, points):  # halfway between balls about points of both axes
        x, u = axis_of(one)
        away = point + (0.5 * gap + one.radius) * normal - x
        s = np.clip(away @ u / (u @ u), -1, 1)
        assert away == pytest.approx(s * u, abs=10 * EXACT)


def test_a_capsule_that_lies_has_two_contacts():
    lying = physics.Capsule(0.1, 0.6, 1.0, pos=(0, 0.1, 0), quat=ALONG_X)
    ends = [[-0.3, 0, 0], [0.3, 0, 0]]
    for support in (
        {"walls": [physics.HalfSpace((0, 1, 0))]},
        {"on": physics.Block((2, 0.2, 2), 1.0, pos=(0, -0.1, 0))},
        {"on": physics.Capsule(0.1, 1.0, 1.0, pos=(0, -0.1, 0), quat=ALONG_X)},
    ):
        on = [support.pop("on")] if "on" in support else []
        gaps, normals, points, _ = contacts(lying, *on, h=1e-3, **support)
        assert gaps == pytest.approx(np.zeros(2), abs=EXACT)
        assert normals == pytest.approx(np.array([[0, 1, 0]] * 2), abs=EXACT)
        assert sorted(points.tolist()) == pytest.approx(np.array(ends), abs=EXACT)


@pytest.mark.parametrize("tilt", [-1e-9, -1e-15, 0.0, 1e-15, 1e-9])
def test_a_capsule_over_an_edge_touches_it_whatever_rounding_does(tilt):
    """A third of the axis stands out over the edge of a table; a tilt below the slop changes nothing."""
    turn = 0.5 * (math.pi / 2 + tilt)
    capsule = physics.Capsule(0.1, 0.6, 1.0, pos=(0.9, 0.1, 0), quat=(math.cos(turn), 0, 0, -math.sin(turn)))
    table = physics.Block((2, 0.2, 2), 1.0, pos=(0, -0.1, 0))
    gaps, _, points, _ = contacts(capsule, table, h=1e-3)
    near = gaps <= 1e-6
    assert sorted(points[near, 0]) == pytest.approx([0.6, 1.0], abs=1e-6)


def test_a_capsule_along_an_edge_touches_both_ends_of_the_part_they_share():
    """It lies beside the edge x = y = 0 of a block, at 45 degrees; the block ends in the middle of the capsule."""
    half = 0.1 * 0.5**0.5
    capsule = physics.Capsule(0.1, 0.6, 1.0, pos=(half, half, 0.5), quat=ALONG_Z)
    block = physics.Block((1, 1, 1), 1.0, pos=(-0.5, -0.5, 0))
    gaps, normals, points, _ = contacts(capsule, block, h=1e-3)
    assert gaps == pytest.approx(np.zeros(2), abs=EXACT)
    assert normals == pytest.approx(np.tile([0.5**0.5, 0.5**0.5, 0], (2, 1)), abs=EXACT)
    assert sorted(points[:, 2]) == pytest.approx([0.2, 0.5], abs=EXACT)


def test_crossing_capsules_touch_once_where_they_cross():
    lower = physics.Capsule(0.2, 2.0, 1.0, quat=ALONG_X)
    upper = physics.Capsule(0.1, 1.0, 1.0, pos=(0.3, 0.31, 0.2), quat=ALONG_Z)
    gaps, normals, points, _ = contacts(lower, upper, h=0.2)
    assert gaps == pytest.approx([0.01], abs=EXACT)
    assert normals[0] == pytest.approx((0, -1, 0), abs=EXACT)
    assert points[0] == pytest.approx((0.3, 0.205, 0), abs=EXACT)


@pytest.mark.parametrize("length", [0.3, 1.0])
def test_axes_that_meet_are_parted_across_both(length):
    one = physics.Capsule(0.1, length, 1.0, quat=ALONG_X)
    other = physics.Capsule(0.1, length, 1.0, quat=ALONG_Z)
    gaps, normals, _, _ = contacts(one, other, h=1e-3)
    assert gaps.min() == pytest.approx(-0.2)
    assert abs(normals[gaps.argmin()]) == pytest.approx((0, 1, 0))


def test_bodies_that_pass_each_other_keep_the_balls_that_are_near():
    """The farthest point of a capsule along a plane that parts two bodies may be at its other end, half a metre off."""
    lower = physics.Capsule(0.1, 1.0, 1.0, quat=ALONG_X)
    upper = physics.Capsule(0.1, 1.0, 1.0, pos=(0.2, 0.21, 0.3), quat=ALONG_Z)
    _, normals, _, many = contacts(lower, upper, h=0.2)
    turned = normals[0] + (0.1, 0, 0)
    turned /= np.linalg.norm(turned)
    gap, p, q = called(_gap_along, 0, tuple(turned.tolist()), None, many)
    assert p == pytest.approx((0.2, 0, 0) - 0.1 * turned, abs=EXACT)
    assert q == pytest.approx((0.2, 0.21, 0) + 0.1 * turned, abs=EXACT)
    assert gap == pytest.approx((0, -0.21, 0) @ turned - 0.2, abs=EXACT)


def test_a_sphere_touches_the_side_or_an_end():
    capsule = physics.Capsule(0.2, 1.0, 1.0)
    for pos, gap, normal in (
        ((0.5, 0.3, 0), 0.5 - 0.2 - 0.1, (1, 0, 0)),
        ((0.3, 0.9, 0), 0.5 - 0.2 - 0.1, (0.6, 0.8, 0)),
    ):
        for order in (1, -1):
            pair = (physics.Sphere(0.1, 1.0, pos=pos), capsule)[::order]
            gaps, normals, _, _ = contacts(*pair)
            assert gaps == pytest.approx([gap], abs=EXACT)
            assert normals[0] == pytest.approx(order * np.array(normal), abs=EXACT)


def test_an_ellipsoid_touches_the_side_or_an_end():
    capsule = physics.Capsule(0.2, 1.0, 1.0)
    for pos, gap, normal in (((0, 0.3, 1.5), 1.5 - 0.2 - 0.9, (0, 0, 1)), ((0, 2, 0), 2 - 0.5 - 0.2 - 0.5, (0, 1, 0))):
        gaps, normals, _, _ = contacts(physics.Ellipsoid((0.3, 0.5, 0.9), 1.0, pos=pos), capsule)
        assert gaps == pytest.approx([gap], abs=1e-12)
        assert normals[0] == pytest.approx(normal, abs=1e-6)
