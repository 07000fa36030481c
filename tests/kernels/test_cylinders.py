"""Contacts of cylinders: the least gap is the largest separation of a slow reference, and sets carry what lies."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import physics
from physics.kernels.multibody.data.allocation import make_bodies_workspace
from physics.kernels.multibody.data.arrays import NUM_CONTACTS
from physics.kernels.multibody.data.cylinders import cylinder_support_arm
from physics.kernels.multibody.narrowphase.dispatch import find_contacts
from physics.kernels.multibody.narrowphase.rim_line import ellipse_normal
from physics.rotations import rotation_matrices
from physics.scene.parts import SHAPE_CODES
from physics.scene.polyhedra import polyhedra
from physics.world import parameters
from tests.kernels.called import called
from tests.reference.support_separation import along, separation

pytestmark = pytest.mark.interpreted

SETTINGS = {"relative_slop": 1e-6, "tolerance": 1e-6, "sweeps": 100, "splits": 8, "rest_share": 0.5}
ALONG_Z = (0.5**0.5, 0.5**0.5, 0, 0)  # body y along world z
KINDS = ("block", "hull", "cylinder", "capsule", "ellipsoid")

# Coordinates of up to 3 m; a direction is found by some tens of operations on them. The search of the reference ends
# within 1e-9 of the best direction.
EXACT, SEARCHED = 1e-13, 1e-9

# Deepest overlap of which the shortest way out is found, in m: the smallest drawn radius.
SHALLOW = 0.05

seeds = st.integers(0, 2**32 - 1)


def contacts(*bodies, h=10.0):
    """(gaps, normals out of the second body, points) of bodies at rest, in their poses.

    Loads of 1 m/s² could bring them together in h [s], so that gaps up to h² [m] count.
    """
    many = make_bodies_workspace(
        len(bodies), parameters.wall_table(()), (), polyhedra(bodies), capsules=True, cylinders=True, **SETTINGS
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
    return many.contacts.gap[:n].copy(), many.contacts.frame[:n, :3].copy(), points


def drawn_pose(rng, reach):
    q = rng.normal(size=4)
    return {"pos": rng.uniform(-reach, reach, 3), "quat": q / np.linalg.norm(q)}


def drawn_cylinder(rng, reach):
    return physics.Cylinder(rng.uniform(0.05, 0.8), rng.uniform(0.1, 2.0), 1.0, **drawn_pose(rng, reach))


def drawn_body(rng, kind):
    pose = drawn_pose(rng, 0.5)
    if kind == "block":
        return physics.Block(rng.uniform(0.2, 2.0, 3), 1.0, **pose)
    if kind == "hull":
        points = rng.normal(size=(rng.integers(4, 12), 3)) * rng.uniform(0.3, 1.0, 3)
        return physics.Hull(points, 1.0, **pose)
    if kind == "capsule":
        return physics.Capsule(rng.uniform(0.05, 0.4), rng.uniform(0.1, 2.0), 1.0, **pose)
    if kind == "ellipsoid":
        return physics.Ellipsoid(rng.uniform(0.1, 1.0, 3), 1.0, **pose)
    return drawn_cylinder(rng, 0.5)


def moved(body, way):
    return physics.Cylinder(body.radius, body.height, 1.0, pos=np.array(body.pos) + way, quat=body.quat)


def look_at_pair(kind, seed, swaps, is_near):
    """Hold the least gap of a pair to the reference: a normal has it as its separation, and no direction more.

    A part that lies nearly flat, or an edge along the side, touches too. It has the normal of the face or of the side,
    which may lean by 11 degrees, and gaps within a slop of the separation.
    """
    rng = np.random.default_rng(seed)
    can, other = drawn_cylinder(rng, 1.5), drawn_body(rng, kind)
    true, n = separation(can, other)
    if is_near:  # 1 mm apart, or 1 mm deep
        can = moved(can, (rng.choice([-1e-3, 1e-3]) - true) * n)
        true, n = separation(can, other)
    if true < -SHALLOW:
        return
    one, two = (other, can) if swaps else (can, other)
    gaps, normals, _ = contacts(one, two, h=rng.choice([0.05, 1.0, 10.0]) if is_near else 10.0)
    low = gaps.min()
    reached = max(along(one, two, normal) for gap, normal in zip(gaps, normals) if gap < low + EXACT)
    if reached < low - 100 * EXACT:
        assert low <= true + SETTINGS["relative_slop"]
        assert max(abs(normal @ n) for gap, normal in zip(gaps, normals) if gap < low + EXACT) >= math.sqrt(1 - 0.2**2)
    else:
        assert low == pytest.approx(reached, abs=100 * EXACT)
    assert true <= low + SEARCHED


@pytest.mark.parametrize("kind", KINDS)
def test_the_least_gap_is_the_largest_separation(kind):
    for seed in range(8):
        look_at_pair(kind, seed, seed % 2 == 1, seed % 3 > 0)


@pytest.mark.exhaustive
@settings(max_examples=150, deadline=None)
@given(seed=seeds, kind=st.sampled_from(KINDS), swaps=st.booleans(), is_near=st.booleans())
@example(seed=386844, kind="hull", swaps=False, is_near=True)  # an edge along the side, the shortest way out at a rim
def test_the_least_gap_is_the_largest_separation_in_many_poses(seed, kind, swaps, is_near):
    look_at_pair(kind, seed, swaps, is_near)


@given(b=st.floats(0, 1), x=st.floats(-3, 3), y=st.floats(-3, 3))
def test_the_normal_at_the_nearest_point_of_an_ellipse(b, x, y):
    """No other of many normals has a larger separation of the point, u x + v y - |(u, b v)|, up to rounding."""
    u, v = ellipse_normal(b, x, y)
    angles = np.linspace(0, 2 * np.pi, 721)
    others = np.cos(angles) * x + np.sin(angles) * y - np.hypot(np.cos(angles), b * np.sin(angles))
    assert math.hypot(u, v) == pytest.approx(1, abs=EXACT)
    assert u * x + v * y - math.hypot(u, b * v) >= others.max() - 100 * EXACT


# --- sets ------------------------------------------------------------------------------------------------------------


def points_of(*bodies):
    """Points of the contacts that touch, rounded."""
    gaps, _, points = contacts(*bodies, h=1e-3)
    assert np.abs(gaps).max() < 1e-12
    return points


@pytest.mark.parametrize("swaps", [False, True])
def test_a_cylinder_over_an_edge_touches_with_the_part_of_its_end_that_is_there(swaps):
    """Expect points of the ring over the block, and both points at which its edge x = 0 crosses the rim."""
    can = physics.Cylinder(0.1, 0.3, 1.0, pos=(0.02, 0.15, 0))
    table = physics.Block((1, 1, 1), 1.0, pos=(-0.5, -0.5, 0))
    points = points_of(*((table, can) if swaps else (can, table)))
    assert points[:, 0].max() == pytest.approx(0, abs=1e-12)
    at_edge = np.sort(points[np.abs(points[:, 0]) < 1e-9, 2])
    assert at_edge == pytest.approx([-math.sqrt(0.01 - 0.0004), math.sqrt(0.01 - 0.0004)], abs=1e-12)
    assert np.hypot(points[:, 0] - 0.02, points[:, 2]) == pytest.approx(0.1, abs=1e-12)


def test_a_small_block_stands_on_an_end_with_its_corners():
    can = physics.Cylinder(0.5, 0.3, 1.0, pos=(0, 0.15, 0))
    points = points_of(can, physics.Block((0.2, 0.1, 0.4), 1.0, pos=(0.1, 0.35, 0)))
    assert sorted(map(tuple, points.round(9))) == [(0, 0.3, -0.2), (0, 0.3, 0.2), (0.2, 0.3, -0.2), (0.2, 0.3, 0.2)]


@pytest.mark.parametrize(("width", "reach"), [(2.0, 0.3), (0.4, 0.2)])
def test_a_cylinder_lies_on_a_block_with_both_ends_of_the_common_line(width, reach):
    can = physics.Cylinder(0.1, 0.6, 1.0, pos=(0, 0.1, 0), quat=ALONG_Z)
    points = points_of(can, physics.Block((1, 1, width), 1.0, pos=(0, -0.5, 0)))
    assert sorted(map(tuple, points.round(9))) == [(0, 0, -reach), (0, 0, reach)]


@pytest.mark.parametrize("width", [2.0, 0.4])
def test_a_cylinder_lies_along_an_edge_with_both_ends_of_the_common_line(width):
    """The edge is the top of a block that stands on an edge."""
    can = physics.Cylinder(0.1, 0.6, 1.0, pos=(0, 0.1, 0), quat=ALONG_Z)
    turned = (math.cos(math.pi / 8), 0, 0, math.sin(math.pi / 8))
    points = points_of(can, physics.Block((1, 1, width), 1.0, pos=(0, -(0.5**0.5), 0), quat=turned))
    reach = min(0.3, width / 2)
    assert sorted(map(tuple, points.round(9))) == [(0, 0, -reach), (0, 0, reach)]


def test_parallel_cylinders_touch_with_both_ends_of_the_common_line():
    one = physics.Cylinder(0.1, 0.6, 1.0, pos=(0, 0.1, 0), quat=ALONG_Z)
    points = points_of(one, physics.Cylinder(0.2, 1.0, 1.0, pos=(0, -0.2, 0.3), quat=ALONG_Z))
    assert sorted(map(tuple, points.round(9))) == [(0, 0, -0.2), (0, 0, 0.3)]


def test_a_capsule_along_a_cylinder_touches_with_both_ends_of_the_common_line():
    capsule = physics.Capsule(0.1, 0.6, 1.0, pos=(0, 0.1, 0), quat=ALONG_Z)
    points = points_of(capsule, physics.Cylinder(0.2, 1.0, 1.0, pos=(0, -0.2, 0.3), quat=ALONG_Z))
    assert sorted(map(tuple, points.round(9))) == [(0, 0, -0.2), (0, 0, 0.3)]


def test_a_capsule_across_an_end_touches_where_it_passes_the_rim():
    capsule = physics.Capsule(0.05, 0.6, 1.0, pos=(0.06, 0.05, 0.1), quat=ALONG_Z)
    points = points_of(capsule, physics.Cylinder(0.1, 0.4, 1.0, pos=(0, -0.2, 0)))
    ends = points[[points[:, 2].argmin(), points[:, 2].argmax()]]  # a point between them does no harm
    assert ends == pytest.approx(np.array([(0.06, 0, -0.08), (0.06, 0, 0.08)]), abs=1e-9)


def test_two_ends_touch_with_points_of_the_lens_that_they_share():
    """Expect points inside both disks, and both crossings of the rims, at x = (d² + 0.1² - 0.2²)/(2 d)."""
    low = physics.Cylinder(0.1, 0.3, 1.0, pos=(0, -0.15, 0))
    points = points_of(low, physics.Cylinder(0.2, 0.4, 1.0, pos=(0.15, 0.2, 0)))
    assert np.hypot(points[:, 0], points[:, 2]).max() <= 0.1 + 1e-9
    assert np.hypot(points[:, 0] - 0.15, points[:, 2]).max() <= 0.2 + 1e-9
    along_x = (0.15**2 + 0.1**2 - 0.2**2) / 0.3
    wide = math.sqrt(0.01 - along_x**2)
    for sign in (-1, 1):
        assert np.abs(points - (along_x, 0, sign * wide)).max(axis=1).min() < 1e-9


@pytest.mark.parametrize("sine", [0.0, 1e-16, 1e-15, 1e-14, 1e-12, 1e-9, 1e-6, 1e-3])
def test_the_point_that_reaches_farthest_is_on_the_cylinder_for_directions_along_its_axis(sine):
    """Rounding leaves 2.2e-16 of the direction in its part across the axis, which may be no longer than that."""
    rng, (r, l) = np.random.default_rng(0), (0.3, 0.1)
    for _ in range(100):
        R = rotation_matrices(drawn_pose(rng, 1.0)["quat"]).ravel()
        axis = R.reshape(3, 3)[:, 1]
        k = rng.choice([-1.0, 1.0]) * rng.uniform(0.01, 2.0) * (axis + sine * rng.normal(size=3))
        arm = np.array(called(cylinder_support_arm, (r, l), tuple(R), tuple(k)))
        along, size = arm @ axis, np.linalg.norm(k)
        assert along == pytest.approx(math.copysign(l, k @ axis), abs=1e-9 * r)
        assert np.linalg.norm(arm - along * axis) <= r * (1 + 1e-9)
        best = l * abs(k @ axis) + r * np.linalg.norm(k - (k @ axis) * axis)
        assert k @ arm == pytest.approx(best, abs=1e-9 * size)


def test_a_ball_meets_the_end_of_a_cylinder_that_turns_far():
    """The ball flies along the axis at 100 m/s, above the end: the direction of the least gap is the axis."""
    rng, worlds = np.random.default_rng(0), 10
    ball, can = physics.Sphere(0.17, 1.6, pos=(0, 1, 0)), physics.Cylinder(0.34, 0.25, 8.0)
    world = physics.World(physics.Scene([ball, can], [], [physics.Contact(0.5)]), worlds=worlds, dt=0.01)
    turned = np.array([drawn_pose(rng, 1.0)["quat"] for _ in range(worlds)])
    R, still = rotation_matrices(turned), np.zeros((worlds, 3))
    world.set_state(
        pos=np.stack([R @ (0.2, 0.125 + 0.17 + 0.03, 0.1), still], axis=1),
        quat=np.stack([np.broadcast_to((1.0, 0, 0, 0), (worlds, 4)), turned], axis=1),
        linvel=np.stack([R @ (0, -100.0, 0), still], axis=1),
        angvel=np.stack([still, R @ (300.0, 0, 0)], axis=1),
    )
    assert world.step().penetration.max() <= 1e-6 * 0.17  # a slop; 0.085 m if it goes in
    assert (world.report.impacts > 0).all()
