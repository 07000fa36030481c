"""Rays: closed forms, a search along the line, symmetry, and the same bits in every batch."""

from __future__ import annotations

import copy
import math
import pickle
import threading

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import physics
from physics.rotations import rotation_matrices
from tests.reference.rays import first_hit, gauge

pytestmark = pytest.mark.filterwarnings("ignore:Scene.walls are given, but no effect")  # rays meet them all the same

EPS = np.finfo(float).eps
NOTHING = -(2**31)
POINTS = [(0, 0, 0), (1, 0, 0), (0, 0.8, 0), (0, 0, 0.6), (0.7, 0.5, 0.4)]
EXTENT = 6.0  # of the scenes and of the origins of rays [m]
REACH = 40.0  # beyond any body from any origin [m]

# Rounding of a hit. Coordinates up to L = 10 m enter with errors of EPS L; about ten operations on each (rotation into
# the frame of the body, division by half edges of at least 0.2 m and back) may add up. Along the ray an error across
# the surface counts by 1/|n·d|.
ROUNDING = 100 * EPS * 10


def quaternion(rng):
    q = rng.standard_normal(4)
    return q / np.linalg.norm(q)


def bodies_of(rng, count: int) -> list[physics.Body]:
    """Bodies of all shapes at random places."""
    made = []
    for k in range(count):
        pose = {"pos": rng.uniform(-EXTENT, EXTENT, 3), "quat": quaternion(rng)}
        size = rng.uniform(0.2, 1.0, 3)
        made.append(
            (
                lambda: physics.Block(2 * size, 1.0, **pose),  # noqa: B023 (called at once)
                lambda: physics.Sphere(size[0], 1.0, **pose),  # noqa: B023
                lambda: physics.Ellipsoid(size, 1.0, **pose),  # noqa: B023
                lambda: physics.Hull(POINTS, 1.0, **pose),  # noqa: B023
                lambda: physics.Block(2 * size, 1.0, center=(0.3, -0.2, 0.1), inertia_body=(1, 1, 1), **pose),  # noqa: B023
            )[k % 5]()
        )
    return made


def scene_of(rng, count: int) -> physics.Scene:
    walls = [physics.HalfSpace((0, 1, 0), -9.0), physics.HalfSpace((-0.6, 0, 0.8), -9.0)]
    return physics.Scene(bodies_of(rng, count), walls)


def rays_of(rng, count: int, bodies=()) -> tuple[np.ndarray, np.ndarray]:
    """Origins and directions; every second ray is aimed at or near a body."""
    origins, directions = rng.uniform(-EXTENT, EXTENT, (count, 3)), rng.standard_normal((count, 3))
    for r in range(0, count, 2):
        if len(bodies):
            target = bodies[r // 2 % len(bodies)].pos
            directions[r] = target + 0.4 * rng.standard_normal(3) - origins[r]
    return origins, directions


def one(body, origin, direction, walls=(), **options):
    """Distance, code and normal of one ray."""
    world = physics.World(physics.Scene([body], walls))
    hits = world.cast_rays(origin, direction, **options)
    return hits.distance[0, 0], hits.hit[0, 0], hits.normal[0, 0]


# --- closed forms ----------------------------------------------------------------------------------------------------


@pytest.mark.interpreted
@pytest.mark.parametrize(
    ("body", "origin", "direction", "distance", "normal"),
    [
        (physics.Sphere(0.5, 1.0), (-2, 0.3, 0), (1, 0, 0), 2 - 0.4, (-0.8, 0.6, 0)),
        (physics.Sphere(0.5, 1.0), (-2, 0.3, 0), (7, 0, 0), 2 - 0.4, (-0.8, 0.6, 0)),
        (physics.Block((2, 4, 6), 1.0), (0.5, 9, 0.5), (0, -1, 0), 7, (0, 1, 0)),
        (physics.Block((2, 4, 6), 1.0), (0, 0, -9), (0.0, 0.0, 3.0), 6, (0, 0, -1)),
        (physics.Block((2, 4, 6), 1.0), (-3, 1, 0), (1, -0.5, 0), 2 * math.sqrt(1.25), (-1, 0, 0)),
        # x²/4 + y² = 1 at y = 0.6: x = -1.6, and the normal is along (x/4, y).
        (physics.Ellipsoid((2, 1, 1), 1.0), (-9, 0.6, 0), (1, 0, 0), 7.4, (-0.4, 0.6, 0)),
        # The face x + y + z = 1 of a tetrahedron, whose centroid is at (1, 1, 1)/4.
        (
            physics.Hull([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], 1.0, pos=(0.25, 0.25, 0.25)),
            (1, 1, 1), (-1, -1, -1), 2 / math.sqrt(3), (1, 1, 1),
        ),
    ],
)  # fmt: skip
def test_a_ray_meets_a_surface_at_the_closed_form(body, origin, direction, distance, normal):
    t, code, n = one(body, origin, direction)
    assert code == 0
    assert t == pytest.approx(distance, rel=4 * EPS)
    assert n == pytest.approx(np.array(normal) / np.linalg.norm(normal), abs=4 * EPS)


@pytest.mark.interpreted
def test_a_wall_is_met_from_its_free_side_only():
    far = physics.Sphere(0.5, 1.0, pos=(0, 50, 0))
    walls = [physics.HalfSpace((1, 0, 0), -5.0), physics.HalfSpace((0, 1, 0), -1.0)]
    t, code, n = one(far, (0, 2, 0), (3, -4, 0), walls)
    assert (t, code, n.tolist()) == (pytest.approx(3 / 0.8), -2, [0, 1, 0])
    assert one(far, (0, 2, 0), (-1, 0, 0), walls)[:2] == (5.0, -1)
    for direction in ((1, 0, 0), (0, -1, 0)):  # parallel to the second and away from the first; from behind
        t, code, n = one(far, (0, -2, 0), direction, walls)
        assert (t, code, n.tolist()) == (math.inf, NOTHING, [0, 0, 0])


@pytest.mark.interpreted
@pytest.mark.parametrize(
    "body", [physics.Sphere(1, 1.0), physics.Block((2, 2, 2), 1.0), physics.Ellipsoid((1, 1, 1), 1.0)]
)
def test_a_ray_from_inside_meets_the_surface_where_it_leaves(body):
    t, code, n = one(body, (0.25, 0, 0), (1, 0, 0))
    assert (t, code) == (pytest.approx(0.75, abs=4 * EPS), 0)
    assert n == pytest.approx((1, 0, 0), abs=4 * EPS)
    assert one(body, (2.0, 0, 0), (1, 0, 0))[:2] == (math.inf, NOTHING)  # behind the origin


@pytest.mark.interpreted
def test_a_ray_in_the_plane_of_a_face_meets_the_block_and_one_beside_it_does_not():
    block = physics.Block((2, 1, 2), 1.0)
    assert one(block, (-3, 0.5, 0), (1, 0, 0))[:2] == (2.0, 0)
    assert one(block, (-3, np.nextafter(0.5, 1), 0), (1, 0, 0))[:2] == (math.inf, NOTHING)
    assert one(block, (-3, 0.5, 1.0), (1, 0, 0))[:2] == (2.0, 0)  # along an edge


@pytest.mark.parametrize("height", [1 - 1e-12, 1 + 1e-12])
@pytest.mark.parametrize("body", [physics.Sphere(1, 1.0), physics.Ellipsoid((1, 1, 3), 1.0)])
def test_a_grazing_ray_meets_a_round_body_within_its_radius_only(body, height):
    """At a height 1 - e the chord is half √(2 e) long, to the first order in e."""
    t, code, _ = one(body, (-3, height, 0), (1, 0, 0))
    if height > 1:
        assert (t, code) == (math.inf, NOTHING)
    else:
        assert code == 0
        assert t == pytest.approx(3 - math.sqrt(2e-12), abs=1e-9)  # e is rounded to EPS: √ changes by EPS/√(2 e)


def test_the_first_of_bodies_at_equal_distances_counts_and_a_body_before_a_wall():
    twins = [physics.Sphere(0.5, 1.0, pos=(5, 0, 0)), *(physics.Sphere(1.0, 1.0, pos=(3, 0, 0)) for _ in range(6))]
    world = physics.World(physics.Scene(twins, [physics.HalfSpace((-1, 0, 0), -2.0)]))
    assert world.cast_rays((0, 0, 0), (1, 0, 0)).hit[0, 0] == 1
    assert world.cast_rays((0, 0, 0), (1, 0, 0), exclude=1).hit[0, 0] == 2


def test_rays_end_at_their_largest_distance():
    ball = physics.Sphere(1.0, 1.0, pos=(3, 0, 0))
    assert one(ball, (0, 0, 0), (1, 0, 0), max_distance=2.0)[:2] == (2.0, 0)
    assert one(ball, (0, 0, 0), (1, 0, 0), max_distance=np.nextafter(2.0, 0))[:2] == (math.inf, NOTHING)
    walls = [physics.HalfSpace((-1, 0, 0), -1.5)]
    assert one(ball, (0, 0, 0), (1, 0, 0), walls, max_distance=1.5)[:2] == (1.5, -1)
    assert one(ball, (0, 0, 0), (1, 0, 0), walls, max_distance=1.4)[:2] == (math.inf, NOTHING)


@pytest.mark.parametrize("size", [1e-300, 1e-160, 1e160, 1e300])
def test_directions_may_have_any_length(size):
    assert one(physics.Sphere(1.0, 1.0, pos=(3, 4, 0)), (0, 0, 0), (3 * size, 4 * size, 0))[0] == pytest.approx(4.0)


# --- against a search along the line ---------------------------------------------------------------------------------


@pytest.mark.parametrize("seed", range(3))
def test_rays_agree_with_a_search_along_the_line(seed):
    rng = np.random.default_rng(seed)
    world = physics.World(scene_of(rng, 10))
    origins, directions = rays_of(rng, 80, world.scene.bodies)
    hits = world.cast_rays(origins, directions)
    kinds = set()
    for r, (o, d) in enumerate(zip(origins, directions / np.linalg.norm(directions, axis=1)[:, None])):
        expected, code, grazed = first_hit(world.scene, world.pos[0], world.quat[0], o, d, REACH)
        assert grazed > 1e-9  # no case hangs on rounding
        if code is None:
            assert hits.hit[0, r] == NOTHING
            continue
        assert hits.hit[0, r] == code
        assert abs(hits.distance[0, r] - expected) <= ROUNDING / abs(hits.normal[0, r] @ d)
        kinds.add(code if code < 0 else world.scene.bodies[code].kind)
    assert len(kinds) == 6  # each shape and both walls


@given(st.integers(0, 2**32 - 1))
def test_the_point_hit_is_on_the_surface_and_no_point_before_it_is_inside(seed):
    rng = np.random.default_rng(seed)
    world = physics.World(scene_of(rng, 7))
    origins, directions = rays_of(rng, 12, world.scene.bodies)
    hits = world.cast_rays(origins, directions)
    gauges = [gauge(body, x, q) for body, x, q in zip(world.scene.bodies, world.pos[0], world.quat[0])]
    for r, (o, d) in enumerate(zip(origins, directions / np.linalg.norm(directions, axis=1)[:, None])):
        t, code, n = hits.distance[0, r], hits.hit[0, r], hits.normal[0, r]
        if code >= 0:
            assert abs(gauges[code](o + t * d)) <= ROUNDING / 0.2  # gauges of round bodies are in semi-axes
            assert abs(n @ n - 1) <= 8 * EPS
            assert gauges[code](o + t * d + 1e-6 * n) > 0  # out of the body
            assert (gauges[code](o) <= 0) == (n @ d > 0)  # from inside the ray leaves, from outside it enters
        if code == NOTHING:
            assert t == math.inf
            assert not n.any()
        started = [inside(o) <= 0 for inside in gauges]
        for s in np.linspace(0, min(t, REACH), 50)[1:-1]:
            assert [inside(o + s * d) <= ROUNDING for inside in gauges] == [
                is_in or (inside(o + s * d) <= ROUNDING and s > t - 1e-9) for is_in, inside in zip(started, gauges)
            ]


@given(st.integers(0, 2**32 - 1))
def test_turning_scene_and_rays_together_changes_no_distance(seed):
    rng = np.random.default_rng(seed)
    bodies, shift = bodies_of(rng, 8), rng.uniform(-2, 2, 3)
    turn = quaternion(rng)
    R = rotation_matrices(turn)
    wall = physics.HalfSpace((0.6, 0, 0.8), -9.0)
    normal = R @ wall.normal
    world = physics.World(physics.Scene(bodies, [wall]))
    there = physics.World(
        physics.Scene(bodies, [physics.HalfSpace(normal / np.linalg.norm(normal), -9.0 + normal @ shift)])
    )
    quat = np.array([_product(turn, body.quat) for body in bodies])
    there.set_state(pos=world.pos[0] @ R.T + shift, quat=quat)
    origins, directions = rays_of(rng, 30, bodies)
    here = world.cast_rays(origins, directions)
    then = there.cast_rays(origins @ R.T + shift, directions @ R.T)
    cosine = np.abs(np.einsum("ri,ri->r", here.normal[0], directions / np.linalg.norm(directions, axis=1)[:, None]))
    sure = cosine > 1e-4  # a grazing hit may become a miss
    both = np.isfinite(here.distance[0]) & sure
    assert (np.isfinite(then.distance[0])[both]).all()
    assert (np.abs(here.distance[0, both] - then.distance[0, both]) <= 4 * ROUNDING / cosine[both]).all()
    assert (here.hit == then.hit)[0, both].all()
    assert np.abs(then.normal[0, both] - here.normal[0, both] @ R.T).max(initial=0) <= 4 * ROUNDING / 1e-4


def _product(a, b):
    (w, x), (v, y) = (a[0], np.asarray(a[1:])), (b[0], np.asarray(b[1:]))
    return np.array([w * v - x @ y, *(w * y + v * x + np.cross(x, y))])


# --- the tree of boxes ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [1, 4, 5, 16, 17, 65, 300])
def test_the_tree_of_boxes_leaves_no_body_out(count):
    """The hit of a scene is the nearest of the hits of its bodies, each alone in a world, to the last bit."""
    rng = np.random.default_rng(count)
    bodies = bodies_of(rng, count)
    bodies[count // 2] = physics.Block((9, 0.1, 9), 1.0)
    origins, directions = rays_of(rng, 80, bodies)
    directions[:20][rng.random((20, 3)) < 0.4] = 0.0  # in planes and along axes
    directions[~directions.any(axis=1)] = (0, 0, -1)
    origins[20:30] *= 1e5
    directions[20:30] = rng.uniform(-6, 6, (10, 3)) - origins[20:30]
    together = physics.World(physics.Scene(bodies)).cast_rays(origins, directions)
    alone = [physics.World(physics.Scene([body])).cast_rays(origins, directions) for body in bodies]
    distances = np.array([each.distance[0] for each in alone])
    np.testing.assert_array_equal(together.distance[0], distances.min(axis=0))
    hit = np.isfinite(together.distance[0])
    assert hit.sum() >= 10 or count < 16
    np.testing.assert_array_equal(together.hit[0], np.where(hit, distances.argmin(axis=0), NOTHING))
    for r in np.flatnonzero(hit):
        np.testing.assert_array_equal(together.normal[0, r], alone[together.hit[0, r]].normal[0, r])


def test_bodies_in_one_place_are_all_found():
    bodies = [physics.Sphere(0.1 * (k + 1), 1.0) for k in range(40)]
    world = physics.World(physics.Scene(bodies))
    assert world.cast_rays((9, 0, 0), (-1, 0, 0)).hit[0, 0] == 39
    assert world.cast_rays((0, 0, 0), (-1, 0, 0)).hit[0, 0] == 0


# --- batches ----------------------------------------------------------------------------------------------------------


def batch_of(threads: int = 1) -> physics.World:
    rng = np.random.default_rng(7)
    world = physics.World(scene_of(rng, 12), worlds=9, threads=threads)
    world.set_state(pos=world.pos + rng.uniform(-1, 1, (9, 12, 3)))
    return world


def same(a, b) -> None:
    for left, right in zip(a, b):
        np.testing.assert_array_equal(left, right)


@pytest.mark.parametrize("threads", [1, 2])
def test_bits_depend_neither_on_batch_nor_threads_nor_other_rays(threads, rng):
    world, alone = batch_of(threads), physics.World(batch_of().scene)
    origins, directions = rng.uniform(-6, 6, (9, 40, 3)), rng.standard_normal((9, 40, 3))
    hits = world.cast_rays(origins, directions)
    same(hits, batch_of().cast_rays(origins, directions))
    for k in range(9):
        alone.set_state(pos=world.pos[k], quat=world.quat[k])
        same(alone.cast_rays(origins[k], directions[k]), [part[k : k + 1] for part in hits])
        single = alone.cast_rays(origins[k, 5], directions[k, 5])
        same(single, [part[k : k + 1, 5:6] for part in hits])
    order = [8, 0, 3, 3]
    same(world.cast_rays(origins[order], directions[order], worlds=order), [part[order] for part in hits])
    mask = np.arange(9) % 2 == 0
    same(world.cast_rays(origins[mask], directions[mask], worlds=mask), [part[mask] for part in hits])
    assert world.cast_rays(origins[:0], directions[:0], worlds=[]).distance.shape == (0, 40)


def test_shapes_of_rays_are_spread_over_worlds_and_rays(rng):
    world = batch_of()
    origins, directions = rng.uniform(-6, 6, (9, 1, 3)), rng.standard_normal((20, 3))
    every = np.broadcast_to(directions, (9, 20, 3))
    expected = world.cast_rays(np.broadcast_to(origins, (9, 20, 3)), every)
    same(world.cast_rays(origins, directions), expected)
    same(world.cast_rays(origins, every), expected)
    same(world.cast_rays((1, 2, 3), directions), world.cast_rays(np.tile((1.0, 2, 3), (9, 20, 1)), every))
    same(world.cast_rays(directions, (1, 2, 3)), world.cast_rays(directions, np.tile((1.0, 2, 3), (20, 1))))
    assert world.cast_rays((0, 0, 0), (1, 2, 3)).normal.shape == (9, 1, 3)


def test_a_result_is_overwritten_and_follows_the_state(rng):
    world = batch_of()
    origins, directions = rays_of(rng, 30)
    out = world.cast_rays(origins, directions)
    before = copy.deepcopy(out)
    world.set_state(pos=world.pos + 0.5)
    again = world.cast_rays(origins, directions, out=out)
    assert again is out
    fresh = world.cast_rays(origins, directions)
    same(out, fresh)
    assert (out.distance != before.distance).any()
    directions *= -1.0  # the same array with other numbers
    same(world.cast_rays(origins, directions, out=out), batch_at(world).cast_rays(origins, directions.copy()))
    frozen = origins.copy()
    frozen.flags.writeable = False
    same(world.cast_rays(frozen, directions), out)


def batch_at(world: physics.World) -> physics.World:
    made = batch_of()
    made.set_state(pos=world.pos, quat=world.quat)
    return made


def test_sizes_of_each_world_count(rng):
    world = physics.World(physics.Scene([physics.Sphere(1.0, 1.0)]), worlds=2)
    world.set_parameters(size=[[2, 2, 2], [1, 1, 1]])
    assert world.cast_rays((-5, 0, 0), (1, 0, 0)).distance.ravel().tolist() == [4.0, 4.5]


def test_rays_of_a_carrier_turn_with_it_and_pass_through_it(rng):
    """Directions are normalised before they turn, so that rounding is that of a rotation."""
    world = batch_of()
    origins, directions = rays_of(rng, 30)
    body = 4
    R, x = rotation_matrices(world.quat[:, body]), world.pos[:, body]
    turned = x[:, None] + np.einsum("wij,rj->wri", R, 0.1 * origins), np.einsum("wij,rj->wri", R, directions)
    expected = world.cast_rays(*turned, exclude=body)
    hits = world.cast_rays(0.1 * origins, directions, carrier=body)
    assert (hits.hit == expected.hit).mean() > 0.99
    alike = hits.hit == expected.hit
    n, d = expected.normal[alike], turned[1][alike] / np.linalg.norm(turned[1][alike], axis=1)[:, None]
    cosine = np.abs(np.einsum("ri,ri->r", n, d))
    gone = expected.hit[alike] == NOTHING
    off = np.abs(np.where(gone, 0, hits.distance[alike]) - np.where(gone, 0, expected.distance[alike]))
    assert (off * cosine <= 4 * ROUNDING).all()
    assert not (hits.hit == body).any()
    other = world.cast_rays(0.1 * origins, directions, carrier=body, exclude=0)
    assert (other.hit == body).any()
    assert not (other.hit == 0).any()


def test_a_copied_world_answers_alike(rng):
    world = batch_of(2)
    origins, directions = rays_of(rng, 10)
    hits = world.cast_rays(origins, directions)
    same(pickle.loads(pickle.dumps(world)).cast_rays(origins, directions), hits)


def test_a_world_that_another_thread_uses_is_refused():
    world, refused = batch_of(), []

    def ask():
        try:
            world.cast_rays((0, 0, 0), (1, 0, 0))
        except RuntimeError as error:
            refused.append(str(error))

    world.is_free = False
    thread = threading.Thread(target=ask)
    thread.start()
    thread.join()
    world.is_free = True
    assert "another thread" in refused[0]


# --- refused ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"directions": [(1, 0, 0), (0, 0, 0)]}, r"directions\[1\] is \[0., 0., 0.\]; allowed are finite numbers that"),
        ({"directions": [(1, 0, 0), (0, np.nan, 1)]}, r"directions\[1\] is \[ 0., nan, 1.\]; allowed are finite"),
        ({"directions": [[(1, 0, 0)], [(0, -np.inf, 1)]]}, r"directions\[1, 0\] is"),
        ({"directions": (0, 0, 0)}, r"directions is \[0., 0., 0.\]; allowed"),
        ({"origins": [(1, 0, 0), (0, np.nan, 1)]}, r"origins\[1\] is .*; allowed are finite numbers"),
        ({"origins": [(1, 0)]}, r"origins has shape \(1, 2\); allowed is shape \(2, rays, 3\), \(rays, 3\) or \(3,\)"),
        ({"origins": np.zeros((3, 2, 3))}, r"origins has shape \(3, 2, 3\); allowed is shape \(2, rays, 3\)"),
        ({"origins": np.zeros((3, 3))}, r"directions has 2 rays; allowed are 3, as in the other argument, and 1"),
        ({"origins": "here"}, r"origins is 'here'; allowed are numbers in shape \(2, rays, 3\)"),
        ({"max_distance": -1}, r"max_distance is -1.0; allowed are numbers of at least 0, and inf"),
        ({"max_distance": np.nan}, r"max_distance is nan; allowed are numbers of at least 0, and inf"),
        ({"exclude": 1}, r"exclude is 1; allowed are indices from 0 to 0"),
        ({"carrier": -1}, r"carrier is -1; allowed are indices from 0 to 0"),
        ({"worlds": [2]}, r"worlds is \[2\]; allowed are indices from 0 to 1"),
        ({"out": 3}, r"out is 3; allowed is None or RayHits of an earlier call"),
    ],
)  # fmt: skip
def test_mistakes_are_named(change, message):
    world = physics.World(physics.Scene([physics.Sphere(1.0, 1.0)]), worlds=2)
    with pytest.raises(ValueError, match=message):
        world.cast_rays(**{"origins": np.ones((2, 3)), "directions": [(1, 0, 0), (0, 1, 0)], **change})


def test_a_result_of_another_size_is_refused():
    world = physics.World(physics.Scene([physics.Sphere(1.0, 1.0)]), worlds=2)
    hits = world.cast_rays((0, 0, 0), (1, 0, 0))
    with pytest.raises(ValueError, match=r"out.distance is .*; allowed is a contiguous array of float64 in shape"):
        world.cast_rays(np.zeros((2, 3)), (1, 0, 0), out=hits)
    with pytest.raises(ValueError, match=r"out.hit is .*; allowed is a contiguous array of int64 in shape \(2, 1\)"):
        world.cast_rays((0, 0, 0), (1, 0, 0), out=hits._replace(hit=hits.distance))
    hits.normal.flags.writeable = False
    with pytest.raises(ValueError, match=r"out\.normal"):
        world.cast_rays((0, 0, 0), (1, 0, 0), out=hits)


@pytest.mark.exhaustive
def test_scenes_of_other_shapes_have_kernels_of_their_own():
    """A kernel that knows no capsules, or no compounds, is not called for a scene that has them."""
    rod = physics.Capsule(0.2, 1.0, 1.0)
    for body in (physics.Sphere(0.7, 1.0), rod, physics.Compound([rod])):
        world = physics.World(physics.Scene([body]))
        hits = world.cast_rays([(0, 0.6, -5)], [(0, 0, 1)])
        assert hits.hit.tolist() == [[0]], body
