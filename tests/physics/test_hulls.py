"""Bodies that are convex hulls: blocks by another name, closed forms of rest, sliding and impact, laws, refusals."""

from __future__ import annotations

import functools
import itertools
import pickle

import numpy as np
import pytest

import physics
from physics.analysis.resting_contact import resting_contact
from physics.io.toml import from_toml, to_toml
from physics.rotations import rotation_matrices
from physics.work_precision.errors import deepest_penetration
from physics.world.report import Status
from tests.reference.polyhedra import prism
from tests.tiers.sweep import sweep

pytestmark = pytest.mark.interpreted

G = 9.81
FLOOR = physics.HalfSpace((0, 1, 0))
SIGNS = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
TETRAHEDRON = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]) / np.sqrt(8)  # of edge 1
WEDGE = prism([(0, 0), (1, 0), (0, 0.7)], 0.5)


def box(size, mass, **start) -> physics.Hull:
    """The hull of a block's corners."""
    return physics.Hull(SIGNS * size, mass, **start)


def rock(rng, **start) -> physics.Hull:
    return physics.Hull(rng.normal(size=(10, 3)) * 0.4, 10 ** rng.uniform(-1, 1), **start)


def unit(rng):
    q = rng.normal(size=4)
    return q / np.linalg.norm(q)


def scene(bodies, walls=(FLOOR,), restitution=0.0, friction=0.5, gravity=(0, -G, 0)) -> physics.Scene:
    """All scenes here have the same compiled step: with a tilted hull and an ellipsoid, far away."""
    far = [
        physics.Hull(WEDGE, 1.0, pos=(500, 9e3, 0)),
        physics.Ellipsoid((1, 2, 3), 1.0, pos=(600, 9e3, 0)),
    ]
    laws = [physics.Gravity(gravity), physics.Contact(restitution), physics.Friction(friction)]
    return physics.Scene([*bodies, *far], walls, laws)


def totals(world, count):
    """Momentum, angular momentum about the origin and energy of the first bodies of world 0."""
    about = physics.diagnose(world)
    p, spin = about.momentum[0, :count], about.angular_momentum[0, :count]
    return p.sum(axis=0), (np.cross(world.pos[0, :count], p) + spin).sum(axis=0), about.energy[0, :count].sum()


# --- a block by another name -----------------------------------------------------------------------------------


@functools.cache
def way_of_a_fall(first: str, second: str) -> np.ndarray:
    """Places (steps, 2, 3) of two boxes of which the second falls on the first."""
    q = unit(np.random.default_rng(3))
    make = {"block": physics.Block, "hull": box}
    bodies = [
        make[first]((2, 1, 1.5), 3.0, pos=(0, 0.5, 0)),
        make[second]((1, 0.6, 0.8), 1.0, pos=(0.2, 2.2, 0.1), quat=q, angvel=(1, 0.5, -1)),
    ]
    world = physics.World(scene(bodies), dt=0.01)
    return np.array([world.step() and world.pos[0, :2].copy() for _ in range(200)])


@pytest.mark.parametrize(
    ("first", "second"),
    sweep([("hull", "hull"), ("hull", "block"), ("block", "hull")], [("hull", "block")]),
)
def test_a_box_of_points_moves_as_a_block_does(first, second):
    """It falls on another one, tumbles and comes to rest."""
    ways = way_of_a_fall("block", "block"), way_of_a_fall(first, second)
    apart = np.abs(ways[0] - ways[1]).max(axis=(1, 2))
    # In flight the same but for rounding (for 0.3 s); from then on each solve is off by the tolerance of the free
    # speed, 1e-6 of 5 m/s, and what they are off by at the impact grows with the time after it, 1.5 s, and with every
    # landing of a corner or an edge, of which there are a few.
    assert apart[:30].max() <= 1e-13
    assert apart.max() <= 10 * 1e-6 * 5 * 1.5
    assert np.abs(ways[0][-1] - ways[0][-20]).max() <= 1e-6  # it has come to rest


def test_a_lone_box_of_points_bounces_as_a_block_does():
    """One body and a wall, with rebound: corner by corner."""
    q = unit(np.random.default_rng(5))
    ends = []
    for make in (physics.Block, box):
        bodies = [make((2, 1, 1.5), 3.0, pos=(0, 2.5, 0), quat=q, angvel=(1, 2, 3))]
        world = physics.World(scene(bodies, restitution=0.5), dt=0.01)
        ways = []
        for _ in range(100):
            world.step()
            ways.append(world.pos[0, 0].copy())
        ends.append(np.array(ways))
    # One corner at a time: closed forms, the same but for rounding, which grows with every bounce.
    assert np.abs(ends[0] - ends[1]).max() <= 1e-10


def test_a_tower_of_hulls_and_blocks_carries_its_weight():
    makes = [box, physics.Block, box, box, physics.Block]
    bodies = [make((1, 1, 1), 10.0**k, pos=(0, k + 0.5, 0)) for k, make in enumerate(makes)]
    world = physics.World(scene(bodies), dt=0.01)
    start = world.pos.copy()
    for _ in range(100):
        assert world.step().status[0] == Status.OK
    slop = world.accuracy.slop * np.sqrt(0.75)
    assert np.abs(world.pos - start)[0, :5].max() <= 2 * 5 * slop
    forces, ends = world.contacts()[1], world.contact_ends()
    floor = forces[(ends[:, 0] == 0) & (ends[:, 1] == -1), 1].sum()
    weight = G * sum(body.mass for body in bodies)
    assert floor == pytest.approx(weight, rel=10 * world.accuracy.tolerance)


# --- rest and sliding: closed forms ----------------------------------------------------------------------------


def test_a_tetrahedron_falls_on_a_face_and_rests():
    body = physics.Hull(TETRAHEDRON, 2.0, pos=(0, 1.2, 0), quat=unit(np.random.default_rng(0)))
    world = physics.World(scene([body]), dt=0.01)
    world.step(steps=300)
    before = world.pos.copy()
    assert world.step().status[0] == Status.OK
    # The centre of a regular tetrahedron is at a quarter of its height √(2/3).
    assert world.pos[0, 0, 1] == pytest.approx(np.sqrt(2 / 3) / 4, abs=world.accuracy.slop)
    assert (world.contact_ends()[:, 0] == 0).sum() == 3
    assert np.abs(world.pos - before)[0, 0].max() <= 1e-6 * G * 0.01**2  # the tolerance of the free speed, for a step


@pytest.mark.parametrize("angle", [0.3, 0.6])
def test_a_wedge_on_an_incline_sticks_or_slides(angle):
    """It lies on its lower face: at rest for tanθ < μ = 0.5, else v = g (sinθ - μ cosθ) t."""
    c, s = np.cos(angle), np.sin(angle)
    body = physics.Hull(WEDGE, 2.0)
    # The lower face is y = 0 of the points, the incline is turned about z.
    centre = np.array(body.centroid)
    place = (c * centre[0] - s * centre[1], s * centre[0] + c * centre[1], centre[2])
    body = physics.Hull(WEDGE, 2.0, pos=place, quat=(np.cos(angle / 2), 0, 0, np.sin(angle / 2)))
    world = physics.World(scene([body], [physics.HalfSpace((-s, c, 0))]), dt=0.01)
    world.step(steps=100)
    speed = max(0.0, G * (s - 0.5 * c)) * 1.0
    # Each step is solved to 1e-6 of the free speed g h.
    assert -world.linvel[0, 0] @ (c, s, 0) == pytest.approx(speed, abs=100 * 1e-6 * G * 0.01)
    way = -(world.pos[0, 0] - place) @ (c, s, 0)
    assert way == pytest.approx(speed / 2, abs=1e-6 * G * 0.01 * 100 + world.accuracy.slop)


def test_a_prism_of_many_sides_rolls_down_and_keeps_standing_on_its_end():
    """A regular prism of 32 sides on its end: 32 contacts carry its weight."""
    turn = np.arange(32) * np.pi / 16
    points = prism(np.c_[np.cos(turn), np.sin(turn)], 1.0)[:, [0, 2, 1]]
    world = physics.World(scene([physics.Hull(points, 4.0, pos=(0, 0.5, 0))]), dt=0.01)
    start = world.pos.copy()
    assert world.step(steps=50).status[0] == Status.OK
    own = world.contact_ends()[:, 0] == 0
    assert own.sum() == 32
    assert world.contacts()[1][own, 1].sum() == pytest.approx(4.0 * G, rel=1e-5)
    assert np.abs(world.pos - start)[0, 0].max() <= 2 * world.accuracy.slop


def test_an_ellipsoid_and_a_ball_rest_on_a_hull():
    plate = box((4, 1, 4), 10.0, pos=(0, 0.5, 0))
    egg = physics.Ellipsoid((0.5, 0.3, 0.4), 1.0, pos=(1, 1.3, 0))
    ball = physics.Sphere(0.4, 1.0, pos=(-1, 1.4, 0))
    world = physics.World(scene([plate, egg, ball]), dt=0.01)
    start = world.pos.copy()
    assert world.step(steps=100).status[0] == Status.OK
    assert np.abs(world.pos - start)[0, :3].max() <= 4 * world.accuracy.slop * 3
    ends, forces = world.contact_ends(), world.contacts()[1]
    for b in (1, 2):
        push = np.abs(forces[(ends == b).any(axis=1), 1]).sum()
        assert push == pytest.approx(G, rel=1e-5)


# --- impacts ---------------------------------------------------------------------------------------------------


def test_a_bullet_does_not_pass_through_a_plate():
    plate = box((0.01, 4, 4), 1000.0)
    shot = physics.Hull(TETRAHEDRON * 0.02, 0.01, pos=(-7.3, 0.1, 0.2), linvel=(500, 0, 0))
    world = physics.World(scene([plate, shot], (), 0.0, 0.0, (0, 0, 0)), dt=0.01)
    world.step(steps=3)  # it flies 5 m in a step
    assert world.pos[0, 1, 0] < 0.0


@pytest.mark.parametrize("restitution", [0.0, 0.6])
@pytest.mark.parametrize("seed", sweep(range(10), [0]))
def test_rocks_that_collide_keep_their_momenta_and_gain_no_energy(seed, restitution, is_exhaustive):
    rng = np.random.default_rng(seed)
    bodies = [
        rock(
            rng, pos=place, quat=unit(rng), linvel=-1.5 * np.array(place) + rng.normal(size=3),
            angvel=rng.normal(size=3),
        )
        for place in itertools.product((-1.0, 1.0), repeat=3)
    ]  # fmt: skip
    world = physics.World(scene(bodies, (), restitution, 0.0 if restitution else 0.5, (0, 0, 0)), dt=0.01)
    linear, angular, energy = totals(world, 8)
    size = np.abs(physics.diagnose(world).momentum).sum()
    # The ratio of the moments of a rock's inertia, less one, and the smallest radius: see below.
    ratio = max(np.ptp(np.linalg.eigvalsh(b.inertia)) / np.linalg.eigvalsh(b.inertia)[0] for b in bodies)
    radius = min(b.polyhedron.radius for b in bodies)
    depth, met = 0.0, 0
    for _ in range(150 if is_exhaustive else 70):
        world.step()
        met += len(world.contact_ends())
        now = totals(world, 8)[2]
        # As of blocks (`test_bodies`): a solve with residual r is off by r of the energy, and what overlaps by d is
        # pushed apart, which turns a body by d/radius under its angular momentum: of its energy as much, times the
        # ratio.
        turn = 2 * ratio * max(depth, world.report.penetration[0]) / radius
        assert now <= energy * (1 + 10 * max(1e-6, world.report.residual[0]) + turn)
        energy, depth = now, world.report.penetration[0]
    after, spin, _ = totals(world, 8)
    np.testing.assert_allclose(after, linear, atol=150 * 1e-16 * size)
    # Impulses act in pairs on points that differ by the gap at most: a tenth of a radius where it is speculative.
    assert np.abs(spin - angular).max() <= 0.1 * size
    assert met > 0


# --- independence ----------------------------------------------------------------------------------------------


def heap(worlds, threads=1):
    """Hulls, a block and a ball falling on each other, each world a little different."""
    rng = np.random.default_rng(0)
    bodies = [
        physics.Hull(WEDGE * 2, 2.0, pos=(0, 0.5, 0)),
        physics.Sphere(0.3, 1.0, pos=(0.2, 1.7, 0.1)),
        rock(rng, pos=(-0.2, 2.6, 0), quat=unit(rng)),
        physics.Block((0.7, 0.7, 0.7), 1.0, pos=(0.1, 3.6, 0), quat=unit(rng)),
    ]
    world = physics.World(scene(bodies, restitution=0.2), worlds=worlds, dt=0.01, threads=threads)
    velocity = np.zeros((worlds, 6, 3))
    velocity[:, 2, 0] = 0.1 * np.arange(worlds)
    world.set_state(linvel=velocity)
    return world


def test_same_bits_for_threads_and_batch_sizes(is_exhaustive):
    many, few, steps = (7, 3, 120) if is_exhaustive else (2, 1, 40)
    runs = heap(many), heap(many, threads=2), heap(few)
    for world in runs:
        world.step(steps=steps)
    one, two, part = (world.state for world in runs)
    np.testing.assert_array_equal(one, two)
    np.testing.assert_array_equal(part, one[: len(part)])


def test_a_snapshot_in_contact_and_a_pickled_world_continue_bit_identically(is_exhaustive):
    world = heap(1)
    world.step(steps=50 if is_exhaustive else 20)
    assert len(world.contact_ends(0))
    snapshot, copy = pickle.loads(pickle.dumps(world.snapshot())), pickle.loads(pickle.dumps(world))
    after = 15 if is_exhaustive else 5
    world.step(steps=after)
    other = heap(1)
    other.restore(snapshot)
    for again in (other, copy):
        again.step(steps=after)
        np.testing.assert_array_equal(again.state, world.state)


# --- parameters, files, refusals -------------------------------------------------------------------------------


def test_a_heavier_hull_has_a_larger_inertia_and_the_same_shape():
    body = physics.Hull(WEDGE, 2.0, pos=(0, 5, 0), angvel=(1, 2, 3))
    world = physics.World(scene([body]), worlds=2, dt=0.01)
    before = physics.diagnose(world).angular_momentum[0, 0]
    world.set_parameters(mass=[[6.0, 1.0, 1.0]], worlds=[1])
    np.testing.assert_allclose(physics.diagnose(world).angular_momentum[1, 0], 3 * before, rtol=1e-14)
    np.testing.assert_array_equal(physics.diagnose(world).angular_momentum[0, 0], before)
    size = [2 * other.dimensions for other in world.scene.bodies]
    world.set_parameters(size=[size, size])  # its own size is not refused
    with pytest.raises(ValueError, match=r"size is .* for Scene.bodies\[0\], a hull.*allowed is twice its dimensions"):
        world.set_parameters(size=[np.multiply(size, 2)] * 2)


def test_its_inertia_can_be_given():
    body = physics.Hull(WEDGE, 2.0, inertia_body=(1, 2, 2.5))
    np.testing.assert_array_equal(body.inertia, np.diag([1, 2, 2.5]))


def test_gaps_to_walls_are_those_of_its_corners():
    rng = np.random.default_rng(4)
    body = physics.Hull(WEDGE, 2.0, pos=(0.3, 2.0, 0.1), quat=unit(rng))
    world = physics.World(scene([body], [FLOOR, physics.HalfSpace((-1, 0, 0), -1000)]), worlds=2, dt=0.01)
    R = rotation_matrices(np.array(body.quat))
    lowest = (body.polyhedron.vertices @ R.T)[:, 1].min() + 2.0
    assert physics.diagnose(world).gap[0, 0] == pytest.approx(lowest, abs=1e-14)
    deep = world.pos.copy()
    deep[:, 0, 1] -= lowest + 0.1
    sampled = deepest_penetration(world.scene, deep, world.quat)
    assert sampled == pytest.approx(0.1, abs=1e-13)
    with pytest.raises(ValueError, match=r"of body 0 in world 0 is 0.1 m inside walls\[0\]"):
        world.set_state(pos=deep)


def test_a_scene_of_hulls_comes_back_from_a_file():
    one = scene([physics.Hull(WEDGE, 2.0, pos=(0, 1, 0))])
    assert from_toml(to_toml(one)) == one
    with pytest.raises(ValueError, match=r"line 3: bodies\[0\]: Hull.points lie in one plane"):
        from_toml('[[bodies]]\nkind = "Hull"\npoints = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]\nmass = 1\n')


def test_a_lone_hull_has_the_step_of_many_bodies_and_says_so():
    laws = [physics.Gravity(), physics.Contact(), physics.Friction(0.5)]
    one = physics.Scene([physics.Hull(WEDGE, 1.0, pos=(0, 2, 0))], [FLOOR], laws)
    plan = physics.make_plan(one, physics.Accuracy())
    assert plan.scheme.couples_bodies
    assert plan.hulls
    assert not plan.meeting
    assert "corners of hulls" in plan.explain()
    blocks = physics.Scene([physics.Block((1, 1, 1), 1.0, pos=(0, 2, 0))], [FLOOR], laws)
    assert not physics.make_plan(blocks, physics.Accuracy()).scheme.couples_bodies
    assert "hulls" not in physics.make_plan(blocks, physics.Accuracy()).explain()
    free = physics.make_plan(physics.Scene(one.bodies, [], [physics.Gravity()]), physics.Accuracy())
    assert free.hulls is None


@pytest.mark.filterwarnings("ignore::physics.SceneWarning")
def test_what_is_not_known_of_hulls_is_refused():
    hull, laws = physics.Hull(WEDGE, 1.0, pos=(0, 2, 0)), [physics.Gravity(), physics.Contact(), physics.Friction(0.5)]
    with pytest.raises(ValueError, match=r"Magnus, and Scene.bodies\[1\] is a hull; allowed with"):
        physics.Scene([physics.Sphere(1.0, 1.0), hull], [FLOOR], [*laws, physics.Magnus()])
    with pytest.raises(ValueError, match=r"tangential is 0.5, but Scene.bodies\[0\] is a hull; allowed"):
        physics.World(physics.Scene([hull], [FLOOR], [physics.Contact(tangential=0.5), physics.Friction(0.5)]))
    physics.World(physics.Scene([hull], [FLOOR], [*laws, physics.AngularDrag(0.1)]))  # needs no shape
    with pytest.raises(ValueError, match="body is 0, a hull; allowed are blocks, spheres and ellipsoids"):
        resting_contact(physics.World(physics.Scene([hull], [FLOOR], [physics.Gravity()])))
