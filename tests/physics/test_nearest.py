"""Nearest points and overlap: closed forms, all features of polyhedra, all directions of round bodies, equal bits."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import physics
from physics.rotations import rotation_matrices
from physics.world.query_calls import MOST_SOLIDS
from tests.physics.test_rays import batch_of, bodies_of, quaternion, same
from tests.reference.polyhedra_distance import distance_apart, posed, separation
from tests.reference.rays import gauge
from tests.reference.separation import ellipsoid_support, largest_separation

pytestmark = pytest.mark.filterwarnings("ignore:Scene.walls are given, but no effect")  # they are there all the same

EPS = np.finfo(float).eps
NOTHING = -(2**31)
CUBE = physics.Block((2, 2, 2), 1.0)
HULL_CUBE = physics.Hull([(x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], 1.0)
DIAGONAL = (math.cos(math.pi / 8), 0, 0, math.sin(math.pi / 8))  # 45 degrees about z
TETRAHEDRON = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]

# Bodies of about 1 m at up to 4 m: some tens of roundings of such coordinates.
EXACT = 100 * EPS * 4


def world_of(*bodies, walls=()):
    return physics.World(physics.Scene(list(bodies), list(walls)))


def at(body, pos, quat=(1, 0, 0, 0)):
    """The same shape in another pose."""
    given = {"block": lambda: {"size": body.size, "center": body.center}, "sphere": lambda: {"radius": body.radius},
             "ellipsoid": lambda: {"semi_axes": body.semi_axes}, "hull": lambda: {"points": body.points}}  # fmt: skip
    extra = {"inertia_body": body.inertia_body} if body.inertia_body is not None else {}
    return type(body)(**given[body.kind](), mass=1.0, pos=pos, quat=quat, **extra)


def gap_of(a, b):
    return world_of(a, b).measure_distances(0, 1)


# --- closed forms ----------------------------------------------------------------------------------------------------


@pytest.mark.interpreted
@pytest.mark.parametrize(
    ("a", "b", "gap", "normal"),
    [
        (at(CUBE, (5, 0.3, 0)), CUBE, 3.0, (1, 0, 0)),  # faces
        (at(CUBE, (5, 5, 0)), CUBE, 3 * math.sqrt(2), (math.sqrt(0.5), math.sqrt(0.5), 0)),  # edges, parallel
        (at(CUBE, (4, 5, 8)), CUBE, 7.0, (2 / 7, 3 / 7, 6 / 7)),  # vertices
        (at(CUBE, (4, 0, 0), DIAGONAL), CUBE, 3 - math.sqrt(2), (1, 0, 0)),  # an edge and a face
        (at(CUBE, (1.5, 0.3, 0)), CUBE, -0.5, (1, 0, 0)),  # faces, overlapping
        (physics.Sphere(0.5, 1.0, pos=(0, 3, 0)), CUBE, 1.5, (0, 1, 0)),
        (physics.Sphere(0.5, 1.0, pos=(2, 3, 3)), CUBE, 3 - 0.5, (1 / 3, 2 / 3, 2 / 3)),
        (physics.Sphere(0.5, 1.0, pos=(0, 0.8, 0)), CUBE, -0.7, (0, 1, 0)),
        (physics.Sphere(0.5, 1.0, pos=(0, 3, 4)), physics.Sphere(1.0, 1.0), 3.5, (0, 0.6, 0.8)),
        (physics.Ellipsoid((1, 2, 3), 1.0, pos=(0, 5, 0)), CUBE, 2.0, (0, 1, 0)),
        (physics.Ellipsoid((1, 2, 3), 1.0, pos=(0, 0, 5)), physics.Ellipsoid((1, 1, 0.5), 1.0), 1.5, (0, 0, 1)),
        (physics.Ellipsoid((1, 2, 3), 1.0, pos=(0, 5, 0)), physics.Sphere(1.0, 1.0), 2.0, (0, 1, 0)),
        (physics.Ellipsoid((1, 1, 1), 1.0, pos=(3, 3, 0.2)), HULL_CUBE, 8**0.5 - 1, (0.5**0.5, 0.5**0.5, 0)),  # edge
        (physics.Ellipsoid((1, 1, 1), 1.0, pos=(2, 3, 3)), HULL_CUBE, 2.0, (1 / 3, 2 / 3, 2 / 3)),  # vertex
        (physics.Ellipsoid((1, 2, 3), 1.0, pos=(0, 5, 0)), HULL_CUBE, 2.0, (0, 1, 0)),  # face
        # From (1, 1, 1) to the plane x + y + z = 1.
        (physics.Sphere(0.1, 1.0, pos=(1, 1, 1)), physics.Hull(TETRAHEDRON, 1.0, pos=(0.25, 0.25, 0.25)),
         2 / math.sqrt(3) - 0.1, (3**-0.5,) * 3),
    ],
)  # fmt: skip
def test_gaps_and_normals_are_closed_forms_in_either_order(a, b, gap, normal):
    for first, second, sign in ((a, b, 1), (b, a, -1)):
        found = gap_of(first, second)
        assert found.gap[0, 0] == pytest.approx(gap, abs=EXACT)
        assert found.normal[0, 0] == pytest.approx(sign * np.array(normal), abs=1e-9)
        p, q = found.point[0, 0], found.other_point[0, 0]
        assert p == pytest.approx(q + found.gap[0, 0] * found.normal[0, 0], abs=1e-9)
        assert found.other[0, 0] == 1


@pytest.mark.interpreted
def test_edges_that_cross_are_nearest_between_their_ends():
    """Edges along x + y and x - y, above each other at a distance of 1 m: the upper cube stands on an edge."""
    lower = at(CUBE, (0, -math.sqrt(2), 0), (math.cos(math.pi / 8), math.sin(math.pi / 8), 0, 0))  # edge along x on top
    upper = at(CUBE, (0.3, 1 + math.sqrt(2), 0.2), DIAGONAL)  # edge along z below
    found = gap_of(upper, lower)
    assert found.gap[0, 0] == pytest.approx(1.0, abs=EXACT)
    assert found.point[0, 0] == pytest.approx((0.3, 1, 0), abs=EXACT)
    assert found.other_point[0, 0] == pytest.approx((0.3, 0, 0), abs=EXACT)


@pytest.mark.interpreted
def test_walls_are_reached_by_the_lowest_point():
    hull = physics.Hull(TETRAHEDRON, 1.0, pos=(0.25, 2.25, 0.25))
    world = world_of(
        at(CUBE, (0, 5, 0), DIAGONAL), hull, physics.Ellipsoid((1, 2, 3), 1.0, pos=(9, 3, 0)),
        walls=[physics.HalfSpace((1, 0, 0), -9.0), physics.HalfSpace((0, 1, 0), 0.5)],
    )  # fmt: skip
    found = world.measure_distances([0, 1, 2, 2], [-2, -2, -2, -1])
    assert found.gap[0] == pytest.approx((4.5 - math.sqrt(2), 1.5, 0.5, 17.0), abs=EXACT)
    assert found.other[0].tolist() == [-2, -2, -2, -1]
    assert found.normal[0].tolist() == [[0, 1, 0]] * 3 + [[1, 0, 0]]
    assert found.other_point[0, 2] == pytest.approx((9, 0.5, 0), abs=EXACT)


def test_bodies_and_walls_are_named_or_numbered():
    balls = [physics.Sphere(0.5, 1.0, pos=(3.0 * k, 1.0, 0), name=name) for k, name in enumerate(("red", "blue"))]
    floor = physics.HalfSpace((0, 1, 0), name="floor")
    world = physics.World(physics.Scene(balls, [floor], [physics.Contact()]))
    named = world.measure_distances(["red", "blue", 1], ["blue", "floor", -1])
    assert named.gap.tolist() == world.measure_distances([0, 1, 1], [1, -1, -1]).gap.tolist()
    assert world.measure_distances("red", "blue").gap.tolist() == [[2.0]]
    assert world.nearest_to(None, (0, 1, 0), exclude="red").other.tolist() == [[-1]]
    rays = {"origins": (0, 0, 0), "directions": (1, 0, 0)}
    assert world.cast_rays(**rays, carrier="red").distance.tolist() == [[2.5]]
    assert world.cast_rays(**rays, carrier="red", exclude="blue").hit.tolist() == (
        world.cast_rays(**rays, carrier=0, exclude=1).hit.tolist()
    )
    assert world.read_contacts(body="red").count.tolist() == [0]
    with pytest.raises(ValueError, match="carrier is 'rad'; allowed are red, blue, or indices from 0 to 1"):
        world.cast_rays(**rays, carrier="rad")
    with pytest.raises(ValueError, match="second holds the end 'flor'; allowed are floor, red, blue, indices from -1"):
        world.measure_distances("red", "flor")


def test_a_point_and_a_shape_find_the_nearest_of_all():
    world = world_of(
        CUBE, at(CUBE, (6, 0, 0)), physics.Sphere(1.0, 1.0, pos=(0, 6, 0)), walls=[physics.HalfSpace((0, 1, 0), -3.0)]
    )
    poses = [(3.2, 0, 0), (2.8, 0, 0), (0, 4, 0), (0, -2.5, 0), (0.5, 0, 0)]
    found = world.nearest_to(None, poses)
    assert found.other[0].tolist() == [1, 0, 2, -1, 0]
    assert found.gap[0] == pytest.approx((1.8, 1.8, 1.0, 0.5, -0.5), abs=EXACT)
    assert found.point[0].tolist() == [list(map(float, pose)) for pose in poses]
    ball = world.nearest_to(physics.Sphere(0.25, 1.0), poses)
    assert ball.gap[0] == pytest.approx(found.gap[0] - 0.25, abs=EXACT)
    assert world.overlaps(physics.Sphere(0.55, 1.0), poses)[0].tolist() == [False, False, False, True, True]
    assert world.overlaps(physics.Sphere(0.55, 1.0), poses, margin=0.5)[0].tolist() == [False, False, True, True, True]
    assert world.overlaps(None, (0.5, 0, 0), exclude=0)[0].tolist() == [False]


def test_the_pose_of_a_shape_is_that_of_its_centre_of_mass():
    uneven = physics.Block((2, 2, 2), 1.0, center=(0.5, 0, 0), inertia_body=(1, 1, 1))
    world = world_of(at(CUBE, (5, 0, 0)))
    quarter = (math.sqrt(0.5), 0, math.sqrt(0.5), 0)  # body x along world -z
    found = world.nearest_to(uneven, (0, 0, 0), [(1, 0, 0, 0), quarter])
    assert found.gap[0] == pytest.approx((4 - 1.5, 4 - 1.0), abs=EXACT)


def test_what_is_farther_than_the_largest_distance_is_left_out():
    world = world_of(CUBE, walls=[physics.HalfSpace((0, 1, 0), -9.0)])
    found = world.nearest_to(None, [(3, 0, 0), (3.5, 0, 0)], max_distance=2.0)
    assert found.gap[0].tolist() == [2.0, math.inf]
    assert found.other[0].tolist() == [0, NOTHING]
    assert not found.normal[0, 1].any()
    assert not found.point[0, 1].any()


# --- against slow oracles --------------------------------------------------------------------------------------------


def polyhedron(rng):
    if rng.random() < 0.5:
        return physics.Block(2 * rng.uniform(0.2, 1.0, 3), 1.0)
    return physics.Hull(rng.uniform(-1, 1, (rng.integers(4, 12), 3)), 1.0)


@given(st.integers(0, 2**32 - 1), st.floats(-7.0, 0.5))
def test_distances_of_polyhedra_are_those_of_all_their_features(seed, log_gap):
    """Bodies are put about 10^log_gap apart, along the direction that separated them before."""
    rng = np.random.default_rng(seed)
    a, b = (
        at(polyhedron(rng), 4 * rng.standard_normal(3), quaternion(rng)),
        at(polyhedron(rng), (0, 0, 0), quaternion(rng)),
    )
    first = gap_of(a, b)
    if first.gap[0, 0] <= 0:
        return
    a = at(a, np.array(a.pos) + (10**log_gap - first.gap[0, 0]) * first.normal[0, 0], a.quat)
    found = gap_of(a, b)
    one, other = posed(a, a.pos, a.quat), posed(b, b.pos, b.quat)
    expected = distance_apart(one, other)
    assert found.gap[0, 0] == pytest.approx(expected, abs=EXACT)
    p, q, n = found.point[0, 0], found.other_point[0, 0], found.normal[0, 0]
    assert np.linalg.norm(p - q) == pytest.approx(expected, abs=EXACT)
    assert n == pytest.approx((p - q) / expected, abs=4 * EXACT / expected)
    assert abs(gauge(a, a.pos, a.quat)(p)) <= EXACT
    assert abs(gauge(b, b.pos, b.quat)(q)) <= EXACT
    swapped = gap_of(b, a)
    assert swapped.gap[0, 0] == pytest.approx(expected, abs=EXACT)


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.7))
def test_overlapping_polyhedra_separate_by_the_shortest_way(seed, distance):
    rng = np.random.default_rng(seed)
    way = rng.standard_normal(3)
    a = at(polyhedron(rng), distance * way / np.linalg.norm(way), quaternion(rng))
    b = at(polyhedron(rng), (0, 0, 0), quaternion(rng))
    expected = separation(posed(a, a.pos, a.quat), posed(b, b.pos, b.quat))
    found = gap_of(a, b)
    if expected > 0:
        return
    gap, n = found.gap[0, 0], found.normal[0, 0]
    assert gap == pytest.approx(expected, abs=EXACT)
    moved = at(a, np.array(a.pos) + (1e-6 - gap) * n, a.quat)
    assert gap_of(moved, b).gap[0, 0] > 0  # apart after that way


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize("distance", [0.7, 2.5])
def test_round_bodies_are_apart_by_the_best_of_all_directions(seed, distance):
    """No direction separates them better, and the normal separates them by the gap; at 0.7 m they overlap."""
    rng = np.random.default_rng(seed)
    first = physics.Ellipsoid(rng.uniform(0.3, 1.0, 3), 1.0)
    second = (physics.Ellipsoid(rng.uniform(0.3, 1.0, 3), 1.0), physics.Sphere(0.6, 1.0), polyhedron(rng))[seed % 3]
    way = rng.standard_normal(3)
    a = at(first, distance * way / np.linalg.norm(way), quaternion(rng))
    b = at(second, (0, 0, 0), quaternion(rng))

    def support(body, sign):
        R = rotation_matrices(np.array(body.quat))
        if body.kind in ("sphere", "ellipsoid"):
            return lambda n: ellipsoid_support(body.dimensions, R, n)
        corners = posed(body, (0, 0, 0), body.quat).corners
        return lambda n: (sign * n @ corners.T).max(axis=1)

    found = gap_of(a, b)
    gap, n, p, q = found.gap[0, 0], found.normal[0, 0], found.point[0, 0], found.other_point[0, 0]
    assert gap >= largest_separation(support(a, -1), support(b, 1), np.array(a.pos)) - 1e-9
    assert gap == pytest.approx(n @ a.pos - support(a, -1)(n[None])[0] - support(b, 1)(n[None])[0], abs=EXACT)
    assert abs(gauge(a, a.pos, a.quat)(p)) <= EXACT
    assert p == pytest.approx(q + gap * n, abs=EXACT)
    if gap > 0:
        # The separation is flat at its maximum, so that the direction may be off by √EPS, and points beside it by that
        # times radii of up to 1/0.3 m.
        assert abs(gauge(b, b.pos, b.quat)(q)) <= 10 * math.sqrt(EPS)


@given(st.integers(0, 2**32 - 1))
def test_a_shape_finds_what_it_finds_as_a_body(seed):
    """To the last bit, the nearest to a shape is the nearest to a body of that shape in its pose."""
    rng = np.random.default_rng(seed)
    bodies = bodies_of(rng, 9)
    shape, pos, quat = bodies_of(rng, 5)[seed % 5], rng.uniform(-6, 6, 3), quaternion(rng)
    walls = [physics.HalfSpace((0, 1, 0), -7.0)]
    found = world_of(*bodies, walls=walls).nearest_to(shape, pos, quat)
    world = world_of(*bodies, at(shape, pos, quat), walls=walls)
    pairs = world.measure_distances(9, [*range(9), -1])
    k = int(np.argmin(pairs.gap[0]))
    for name in ("gap", "other", "normal", "point", "other_point"):
        np.testing.assert_array_equal(getattr(found, name)[0, 0], getattr(pairs, name)[0, k])


# --- batches ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("threads", [1, 2])
def test_bits_depend_neither_on_batch_nor_threads(threads, rng):
    world, alone = batch_of(threads), physics.World(batch_of().scene)
    first, second = zip(*[(a, b) for a in range(12) for b in (*range(a), -1, -2)])
    pairs = world.measure_distances(first, second)
    shape, pos = physics.Hull(TETRAHEDRON, 1.0), rng.uniform(-6, 6, (9, 20, 3))
    quat = np.array([quaternion(rng) for _ in range(20)])
    near = world.nearest_to(shape, pos, quat)
    for k in range(9):
        alone.set_state(pos=world.pos[k], quat=world.quat[k])
        same(alone.measure_distances(first, second), [part[k : k + 1] for part in pairs])
        same(alone.nearest_to(shape, pos[k], quat), [part[k : k + 1] for part in near])
    order = [8, 0, 3, 3]
    same(world.measure_distances(first, second, worlds=order), [part[order] for part in pairs])
    same(world.nearest_to(shape, pos[order], quat, worlds=order), [part[order] for part in near])
    kept = world.measure_distances(first, second, out=pairs)
    assert kept is pairs
    again = world.nearest_to(shape, pos + 1.0, quat, out=near)
    assert again is near
    same(again, batch_of().nearest_to(shape, pos + 1.0, quat))
    box = world.nearest_to(physics.Block((1, 2, 3), 1.0), pos, quat)  # another shape, with tables of its own
    same(box, batch_of().nearest_to(physics.Block((1, 2, 3), 1.0), pos, quat))


def test_many_different_shapes_are_compared_and_not_all_kept(rng):
    world, shapes = world_of(CUBE), [physics.Hull(rng.uniform(-1, 1, (6, 3)), 1.0) for _ in range(3 * MOST_SOLIDS)]
    for shape in (*shapes, *shapes[:2]):
        found, alone = (each.nearest_to(shape, (0.0, 4, 0)) for each in (world, world_of(CUBE)))
        same(found, alone)
        assert len(world._queries._scratch) <= MOST_SOLIDS
    assert world.cast_rays((0, 4, 0), (0, -1, 0)).distance[0, 0] == 3.0


# --- refused ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"first": 2}, "first is 2; allowed are indices from 0 to 1"),
        ({"first": -1}, "first is -1; allowed are indices from 0 to 1"),
        ({"second": [1, -2]}, r"second is \[1, -2\]; allowed are indices from 0 to 1, and from -1 to -1 for walls"),
        ({"second": 0}, "first and second are both 0; allowed are different bodies"),
        ({"first": [0, 0], "second": [1, 1, 1]}, "first has 2 bodies and second has 3; allowed are as many, or one"),
        ({"first": 0.5}, "first is 0.5; allowed is an index or a name, or a list of them"),
        ({"first": [[0], [0, 1]]}, "first is .*; allowed is an index or a name, or a list of them"),
        ({"worlds": [1]}, r"worlds is \[1\]; allowed are indices from 0 to 0"),
        ({"out": 1}, "out is 1; allowed is None or Nearest of an earlier call"),
    ],
)
def test_mistakes_in_pairs_are_named(change, message):
    world = world_of(CUBE, at(CUBE, (5, 0, 0)), walls=[physics.HalfSpace((0, 1, 0), -3.0)])
    with pytest.raises(ValueError, match=message):
        world.measure_distances(**{"first": 0, "second": 1, **change})


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"shape": 3}, "shape is 3; allowed is a body such as"),
        ({"pos": (0, np.nan, 0)}, r"pos is .*; allowed are finite numbers"),
        ({"pos": (0, 1)}, r"pos has shape \(2,\); allowed is shape \(1, poses, 3\), \(poses, 3\) or \(3,\)"),
        ({"quat": (1, 1, 0, 0)}, "quat is .* of norm 1.41421; allowed are unit quaternions"),
        ({"quat": (1, 0, 0)}, r"quat has shape \(3,\); allowed is shape \(1, poses, 4\)"),
        ({"pos": np.zeros((3, 3)), "quat": np.ones((2, 4)) / 2}, "quat has 2 poses; allowed are 3, as in the other"),
        ({"max_distance": -1.0}, "max_distance is -1.0; allowed are numbers of at least 0"),
        ({"exclude": 5}, "exclude is 5; allowed are indices from 0 to 0"),
    ],
)
def test_mistakes_in_poses_are_named(change, message):
    with pytest.raises(ValueError, match=message):
        world_of(CUBE).nearest_to(**{"shape": None, "pos": (0, 0, 0), **change})
