"""Compounds: mass, flight, the same motion as one convex body, rest, collisions, queries, and what they refuse."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import physics
from physics.scene.support import support
from tests.reference import rigid_body as ref
from tests.reference.capsules import Tipping
from tests.reference.compounds import mass_properties, taken_apart
from tests.tiers.sweep import sweep

pytestmark = pytest.mark.interpreted

G = 9.81
FLOOR = physics.HalfSpace((0, 1, 0))
PULL = physics.Gravity((0, -G, 0))
WEDGE = np.array([(0, 0, 0), (1, 0, 0), (0, 0.8, 0), (0, 0, 0.9), (1, 0, 0.9), (0, 0.8, 0.9)])

# The solver's tolerance, as a share of the speeds, is then far below the bounds of these tests.
EXACT = physics.Accuracy(tolerance=1e-12)


def effects(mu: float = 0.5, restitution: float | None = None) -> list:
    return [PULL, physics.Contact(restitution=restitution), physics.Friction(mu)]


def world_of(*bodies, walls=(FLOOR,), laws=None, dt=0.01, accuracy=EXACT):
    return physics.World(physics.Scene(bodies, walls, effects() if laws is None else laws), dt=dt, accuracy=accuracy)


def turned(rng) -> np.ndarray:
    q = rng.normal(size=4)
    return q / np.linalg.norm(q)


def each_shape(rng) -> list[physics.Body]:
    """A part of each shape, in drawn poses."""
    shapes = (
        physics.Block((1.0, 0.4, 0.3), 1.0), physics.Sphere(0.3, 2.0), physics.Ellipsoid((0.3, 0.2, 0.5), 0.7),
        physics.Capsule(0.1, 0.7, 0.4), physics.Hull(rng.normal(size=(8, 3)) * 0.3, 1.5),
    )  # fmt: skip
    return [type(s)(**{**vars(s), "pos": rng.uniform(-0.6, 0.6, 3), "quat": turned(rng)}) for s in shapes]


def dumbbell(**given) -> physics.Compound:
    """Two different balls on a rod along x."""
    rod = physics.Capsule(0.05, 0.8, 0.2, quat=(0.5**0.5, 0, 0, 0.5**0.5))
    balls = physics.Sphere(0.25, 1.0, pos=(-0.4, 0, 0)), physics.Sphere(0.2, 1.5, pos=(0.4, 0, 0))
    return physics.Compound([*balls, rod], **given)


def table(**given) -> physics.Compound:
    """A top of 5 kg at y from 0 to 0.1 m, and four legs of 1 kg and 0.8 m below it."""
    legs = [physics.Block((0.1, 0.8, 0.1), 1.0, pos=(x, -0.4, z)) for x in (-0.9, 0.9) for z in (-0.5, 0.5)]
    return physics.Compound([physics.Block((2.0, 0.1, 1.2), 5.0, pos=(0, 0.05, 0)), *legs], **given)


def halves(**given) -> physics.Compound:
    """The block of 5 x 3 x 2 m and 6 kg, glued of two."""
    return physics.Compound([physics.Block((2.5, 3, 2), 3.0, pos=(x, 7, 7)) for x in (-1.25, 1.25)], **given)


# --- mass ------------------------------------------------------------------------------------------------------------


@given(seed=st.integers(0, 2**32 - 1))
def test_mass_centre_and_inertia_are_those_of_a_quadrature(seed):
    """The rules are exact for the second moments of every part, so that rounding of sums is left."""
    compound = physics.Compound(each_shape(np.random.default_rng(seed)))
    mass, centre, inertia = mass_properties(compound)
    assert compound.mass == pytest.approx(mass, rel=1e-13)
    np.testing.assert_allclose(compound.centroid, centre, atol=1e-13)
    np.testing.assert_allclose(compound.inertia, inertia, atol=1e-12 * np.abs(inertia).max())


@pytest.mark.parametrize("compound", [dumbbell(), table()], ids=["dumbbell", "table"])
def test_inertia_of_a_dumbbell_and_a_table(compound):
    mass, centre, inertia = mass_properties(compound)
    np.testing.assert_allclose(compound.inertia, inertia, rtol=0, atol=1e-12 * inertia.max())
    np.testing.assert_allclose(compound.centroid, centre, rtol=0, atol=1e-12)
    assert physics.Compound(compound.parts, 2 * mass).inertia == pytest.approx(2 * inertia, rel=1e-12)


def test_radius_and_half_extents_hold_all_points():
    compound = physics.Compound(each_shape(np.random.default_rng(3)), quat=(1, 0, 0, 0))
    apart = taken_apart(compound)
    world = world_of(*apart, walls=[], laws=[])
    points = world.nearest_to(None, 100.0 * np.random.default_rng(4).normal(size=(200, 3))).other_point[0]
    assert (np.abs(points) <= compound.dimensions + 1e-12).all()
    assert np.linalg.norm(points, axis=1).max() <= compound.bounding_radius(compound.dimensions) + 1e-12


def test_a_dumbbell_in_flight_agrees_with_the_equations_of_motion():
    """DOP853 with rtol 1e-13; the exact flow of free rotation adds rounding of some hundred steps."""
    body = dumbbell(pos=(0, 5, 0), quat=(0.5, 0.5, -0.5, 0.5), linvel=(1, 2, 3), angvel=(0.4, 1.5, -0.7))
    world = physics.World(physics.Scene([body], effects=[PULL]), dt=0.01)
    world.step(steps=100)
    R = ref.rotation_matrix(np.array(body.quat))
    spin = R @ body.inertia @ R.T @ body.angvel
    start = ref.RigidState(np.array(body.pos), np.array(body.quat), body.mass * np.array(body.linvel), spin)
    end = ref.integrate_rigid_body(body.mass, body.inertia, start, 1.0, gravity=(0, -G, 0))
    np.testing.assert_allclose(world.pos[0, 0], end.pos, rtol=1e-12)
    assert ref.orientation_error(world.quat[0, 0], end.quat) < 1e-12


# --- the same motion as one convex body ------------------------------------------------------------------------------

ALONE = {
    "block": physics.Block((1, 0.6, 0.4), 2.0), "sphere": physics.Sphere(0.4, 2.0), "hull": physics.Hull(WEDGE, 2.0),
    "ellipsoid": physics.Ellipsoid((0.5, 0.3, 0.2), 2.0), "capsule": physics.Capsule(0.2, 0.6, 2.0),
}  # fmt: skip


# A second body that moves: alone among fixed ones, a body that is no compound meets its events more exactly.
FAR = physics.Sphere(0.1, 1.0, pos=(0, 50, 80))


@pytest.mark.parametrize("kind", sweep(ALONE, ["block"]))
def test_a_compound_of_one_part_moves_as_that_part_bit_for_bit(kind):
    """Products with the identity are exact, and so are sums with zero; a second body brings both to one scheme."""
    start = {"pos": (0.1, 0.9, 0), "quat": (0.8, 0.6, 0, 0), "linvel": (1, -2, 0.5), "angvel": (1, 2, -3)}
    alone = type(ALONE[kind])(**{**vars(ALONE[kind]), **start})
    other = physics.Block((3, 0.4, 3), fixed=True, pos=(0.3, 0.2, 0.1))
    single = world_of(alone, other, FAR, accuracy="balanced")
    whole = world_of(physics.Compound([ALONE[kind]], **start), other, FAR, accuracy="balanced")
    for world in (single, whole):
        world.step(steps=60 if kind == "block" else 100)
    assert single.report.ok
    np.testing.assert_array_equal(single.state, whole.state)


SLIDE = {"linvel": (1.0, 0, 0.3)}


@pytest.mark.parametrize("ground", sweep(["floor", "table"], ["table"]))
def test_two_glued_halves_fall_slide_and_rest_as_one_block(ground):
    """All points slip alike, so that the motion does not depend on how the points share the load.

    At the tolerance 1e-12 solves are off by 1e-12 of g h a step; at `balanced` they would be off by 1e-6 of it.
    """
    walls = {} if ground == "floor" else {"walls": ()}
    others = [] if ground == "floor" else [physics.Block((40, 1, 40), fixed=True, pos=(0, -0.5, 0)), FAR]
    block = world_of(physics.Block((5, 3, 2), 6.0, pos=(0, 1.6, 0), **SLIDE), *others, **walls)
    glued = world_of(halves(pos=(0, 1.6, 0), **SLIDE), *others, **walls)
    for _ in range(2):
        block.step(steps=20)
        glued.step(steps=20)
        np.testing.assert_allclose(glued.pos[0, 0], block.pos[0, 0], rtol=0, atol=1e-11)
        np.testing.assert_allclose(glued.quat[0, 0], block.quat[0, 0], rtol=0, atol=1e-11)
    assert np.abs(glued.linvel[0, 0]).max() < 1e-9  # it rests


@pytest.mark.exhaustive
def test_a_hull_glued_of_two_falls_slides_and_rests_as_one_hull():
    """A wedge that a plane cuts into two, which lies on its face y = 0; its points are turned by 0.3 rad about y."""
    c, s = np.cos(0.3), np.sin(0.3)
    points = WEDGE @ np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    cut = points[[1, 4]] * 0.5 + points[[0, 3]] * 0.5  # middles of the edges along x
    left = physics.Hull([*points[[0, 3, 2, 5]], *cut], density=1.0)
    right = physics.Hull([*points[[1, 4, 2, 5]], *cut], density=1.0)
    whole = physics.Hull(points, left.mass + right.mass)
    parts = [type(half)(half.points, half.mass, pos=half.centroid) for half in (left, right)]
    floor = physics.Block((40, 1, 40), fixed=True, pos=(0, -0.5, 0))
    height = -whole.polyhedron.vertices[:, 1].min()
    start = {"pos": (0, height + 0.1, 0), **SLIDE}
    one = world_of(physics.Hull(points, whole.mass, **start), floor, FAR, walls=())
    two = world_of(physics.Compound(parts, **start), floor, FAR, walls=())
    for world in (one, two):
        world.step(steps=60)
    np.testing.assert_allclose(two.pos, one.pos, rtol=0, atol=1e-10)
    assert np.abs(two.linvel[0, 0]).max() < 1e-9


def tiles(count: int) -> physics.Compound:
    """A fixed plate of square tiles whose top is y = 0."""
    parts = [physics.Block((2, 1, 8), fixed=True, pos=(2.0 * k, -0.5, 0)) for k in range(count)]
    return physics.Compound(parts, fixed=True, pos=(count - 1.0, -0.5, 0))


OVER_SEAMS = {
    "ball": physics.Sphere(0.3, 1.0, pos=(0.1, 0.3, 0), linvel=(3, 0, 0.2), angvel=(0.2 / 0.3, 0, -10)),
    "bouncing ball": physics.Sphere(0.3, 1.0, pos=(0.3, 0.9, 0), linvel=(2, 0, 0.2), restitution=0.5),
    "ellipsoid": physics.Ellipsoid((0.3, 0.25, 0.4), 1.0, pos=(0.1, 0.25, 0), linvel=(3, 0, 0.1), angvel=(0.4, 0, -12)),
    "capsule": physics.Capsule(
        0.3, 0.8, 1.0, pos=(0.1, 0.3, 0), quat=(0.5**0.5, 0.5**0.5, 0, 0), linvel=(3, 0, 0), angvel=(0, 0, -10)
    ),
    "block": physics.Block((0.5, 0.3, 0.4), 1.0, pos=(0.5, 0.15, 0), linvel=(3, 0, 0.2)),
    "tumbling block": physics.Block((0.5, 0.3, 0.4), 1.0, pos=(0.1, 0.5, 0), linvel=(4, 0, 0.2), angvel=(1, 2, -9)),
}


@pytest.mark.parametrize("name", sweep(OVER_SEAMS, ["bouncing ball", "ellipsoid"]))
def test_seams_between_parts_stop_nothing(name):
    """Bodies roll, slide, bounce and tumble over seams of a compound as over one block."""
    plate = physics.Block((20, 1, 8), fixed=True, pos=(9, -0.5, 0))
    ends = []
    for ground in (plate, tiles(10)):
        world = world_of(OVER_SEAMS[name], ground, FAR, walls=())
        world.step(steps=50)
        ends.append(world.pos[0, 0].copy())
    assert ends[0][0] > 1.01  # past a seam
    np.testing.assert_allclose(ends[1], ends[0], rtol=0, atol=1e-10)


def test_a_concave_corner_is_touched_on_both_sides():
    """A block lies in the corner of a shelf, flush with both parts: it has all corners of both faces as contacts."""
    shelf = physics.Compound(
        [
            physics.Block((6, 1, 6), fixed=True, pos=(0, -0.5, 0)),
            physics.Block((1, 3, 6), fixed=True, pos=(-1.5, 1.5, 0)),
        ],
        fixed=True,
    )
    block = physics.Block((0.6, 0.4, 0.5), 2.0, pos=(-0.7, 0.2, 0))
    world = world_of(block, physics.Compound(shelf.parts, fixed=True, pos=shelf.centroid), walls=())
    push = np.zeros((2, 6))
    push[0, 0] = -50.0
    world.step(push, steps=20)
    np.testing.assert_allclose(world.pos[0, 0], block.pos, rtol=0, atol=1e-9)
    contacts = world.read_contacts()
    assert contacts.count[0] == 8
    np.testing.assert_allclose(contacts.force[0, :8].sum(axis=0), (50.0, 2.0 * G, 0), atol=1e-6)


def slopes(angle: float) -> list[physics.Body]:
    """Two fixed plates that meet in the line x = y = 0, and rise from there by `angle` [rad]."""
    parts = []
    for side in (1, -1):
        turn = side * angle / 2
        down = np.array([-math.sin(side * angle), math.cos(side * angle), 0])
        middle = 2 * np.array([side * math.cos(angle), math.sin(angle), 0]) - 0.5 * down
        parts.append(physics.Block((4, 1, 6), fixed=True, pos=middle, quat=(math.cos(turn), 0, 0, math.sin(turn))))
    return parts


def test_an_edge_stands_in_the_bottom_of_a_valley():
    """Both sides hold it in the line in which they meet, where each of them is within rounding of the other."""
    parts = slopes(0.1)
    whole = physics.Compound(parts, fixed=True)
    block = physics.Block(
        (1, 1, 2), 3.0, pos=(0, 0.5**0.5, 0), quat=(math.cos(math.pi / 8), 0, 0, math.sin(math.pi / 8))
    )
    world = world_of(block, physics.Compound(parts, fixed=True, pos=whole.centroid), walls=())
    world.step()
    np.testing.assert_allclose(world.pos[0, 0], block.pos, rtol=0, atol=1e-8)
    assert world.read_contacts().count[0] == 4


@pytest.mark.parametrize("angle", [0.1, pytest.param(-0.1, marks=pytest.mark.exhaustive)], ids=["valley", "ridge"])
def test_parts_that_meet_at_an_angle_are_touched_as_separate_bodies(angle):
    """No contact of a ball is left out: not at the bottom of a valley, nor on a ridge."""
    parts = slopes(angle)
    whole = physics.Compound(parts, fixed=True)
    height = 0.3 / math.cos(angle) + 0.8 * math.sin(angle)
    ball = physics.Sphere(0.3, 1.0, pos=(-0.8, height, 0), linvel=(1.5, 0, 0))
    apart = world_of(ball, *parts, walls=())
    joined = world_of(ball, physics.Compound(parts, fixed=True, pos=whole.centroid), walls=())
    for world in (apart, joined):
        world.step(steps=60)
    np.testing.assert_allclose(joined.pos[0, 0], apart.pos[0, 0], rtol=0, atol=1e-10)


@pytest.mark.parametrize("start", sweep(["spins", "falls"], ["spins"]))
def test_a_part_far_from_the_centre_passes_through_nothing(start):
    """A dumbbell spins by two radians a step, or falls by four metres a step: a thin plate is to it as a wall."""
    ends = [physics.Sphere(0.05, 1.0, pos=(x, 0, 0)) for x in (-1, 1)]
    motion = {"pos": (0, 3, 0), "linvel": (0, -400, 0), "angvel": (0, 0, 3)}
    if start == "spins":
        motion = {"pos": (0, 0.9, 0), "quat": (math.cos(0.26), 0, 0, math.sin(0.26)), "angvel": (0, 0, 200)}
    plate, wall = physics.Block((20, 0.02, 20), fixed=True), physics.HalfSpace((0, 1, 0), 0.01)
    laws = [physics.Contact(restitution=0.5), physics.Friction(0.3)]
    found = []
    for bodies, walls in (([plate], ()), ([], [wall])):
        world = world_of(physics.Compound(ends, **motion), *bodies, walls=walls, laws=laws)
        world.step(steps=15)
        found.append(world.pos[0, 0].copy())
    assert found[0][1] > 0.5
    np.testing.assert_allclose(found[0], found[1], rtol=0, atol=1e-7)  # of an impact found within 1e-7 of the radius


# --- rest and collisions ---------------------------------------------------------------------------------------------


def test_a_table_rests_on_four_legs_over_a_ball_that_rolls():
    """Forces of the legs add up to the weight, and about each axis their torques vanish; the ball rolls straight."""
    r = 0.2
    stand = table(pos=np.add(table().centroid, (0, 0.8, 0)))
    ball = physics.Sphere(r, 1.0, pos=(-0.4, r, 0.1), linvel=(1, 0, 0), angvel=(0, 0, -1 / r))
    world = world_of(stand, ball)
    world.step(steps=30)
    np.testing.assert_allclose(world.pos[0, 0], stand.pos, rtol=0, atol=1e-9)
    np.testing.assert_allclose(world.pos[0, 1], (-0.1, r, 0.1), rtol=0, atol=1e-9)
    contacts = world.read_contacts()
    of_table = contacts.ends[0, : contacts.count[0], 0] == 0
    points, forces = (array[0, : contacts.count[0]][of_table] for array in (contacts.point, contacts.force))
    assert len(points) == 16
    np.testing.assert_allclose(forces.sum(axis=0), (0, stand.mass * G, 0), atol=1e-8)
    np.testing.assert_allclose(np.cross(points - stand.pos, forces).sum(axis=0), 0, atol=1e-8)


def test_a_ball_under_a_fixed_table_hits_its_leg():
    """It comes back as from a wall: the leg is 0.05 m of half width at x = 0.9 m, and the restitution is 1."""
    stand = table(pos=np.add(table().centroid, (0, 0.8, 0)), fixed=True)
    ball = physics.Sphere(0.2, 1.0, pos=(0.3, 0.2, 0.5), linvel=(1, 0, 0))
    world = world_of(stand, ball, laws=[physics.Contact(restitution=1.0)])
    world.step(steps=50)
    np.testing.assert_allclose(world.linvel[0, 1], (-1, 0, 0), atol=1e-12)
    np.testing.assert_allclose(world.pos[0, 1], (2 * 0.65 - 0.8, 0.2, 0.5), atol=1e-8)
    np.testing.assert_array_equal(world.pos[0, 0], stand.pos)


def tipped(preset: str, dt: float, start: float = 0.3, time: float = 0.3) -> float:
    """Error of place [m] and angle [rad] of a dumbbell that tips over the lower one of two balls, which rolls."""
    r, balls = 0.1, (physics.Sphere(0.1, 1.0, pos=(0, -0.3, 0)), physics.Sphere(0.15, 2.0, pos=(0, 0.4, 0)))
    body = physics.Compound(balls)
    reach = body.centroid[1] + 0.3
    place = (reach * math.sin(start), r + reach * math.cos(start), 0)
    leaning = physics.Compound(balls, pos=place, quat=(math.cos(start / 2), 0, 0, -math.sin(start / 2)))
    world = world_of(leaning, laws=effects(2.0), dt=dt, accuracy=preset)
    world.step(steps=round(time / dt))
    true, angle = Tipping(r, reach, body.mass, body.inertia[2, 2], G).state(start, time)
    turn = -2 * math.atan2(world.quat[0, 0, 3], world.quat[0, 0, 0])
    return max(float(np.abs(world.pos[0, 0, :2] - true).max()), abs(turn - angle))


def test_a_dumbbell_tips_over_about_a_ball():
    """The error is of second order in the step: 3.4e-6 at 5 ms."""
    assert tipped("balanced", 0.005) < 5e-6


@pytest.mark.exhaustive
def test_a_dumbbell_tips_over_precisely():
    """Error control allows 1e-8 of the speed in each part."""
    assert tipped("precise", 0.01) < 1e-7


@pytest.mark.exhaustive
@pytest.mark.parametrize("kind", ["sphere", "ellipsoid", "capsule"])
def test_a_round_part_off_the_centre_of_mass_rocks_without_loss(kind):
    """It rolls to and fro over a ball of lead inside it; the error of the energy, of 1 J, is of second order."""
    shapes = {"sphere": physics.Sphere(0.3, 1.0), "ellipsoid": physics.Ellipsoid((0.3, 0.25, 0.4), 1.0),
              "capsule": physics.Capsule(0.3, 0.4, 1.0, quat=(0.5**0.5, 0.5**0.5, 0, 0))}  # fmt: skip
    quat = np.array([math.cos(0.35), 0, 0, math.sin(0.35)])
    parts = [shapes[kind], physics.Sphere(0.1, 3.0, pos=(0, -0.12, 0.03))]
    height = support(physics.Compound(parts), -ref.rotation_matrix(quat).T[:, 1])
    drifts = []
    for dt in (0.005, 0.0025):
        world = world_of(physics.Compound(parts, pos=(0, height, 0), quat=quat), laws=effects(2.0), dt=dt)
        energies = [float(physics.diagnose(world).energy.sum())]
        for _ in range(10):
            world.step(steps=round(0.05 / dt))
            energies.append(float(physics.diagnose(world).energy.sum()))
        drifts.append(np.ptp(energies))
    assert drifts[0] < 5e-4
    assert drifts[1] < drifts[0] / 2


def totals(world):
    """Momentum, angular momentum about the origin and kinetic energy of all bodies together."""
    found = physics.diagnose(world)
    spin = found.angular_momentum + np.cross(world.pos, found.momentum)
    return found.momentum.sum(axis=1)[0], spin.sum(axis=1)[0], float(found.kinetic_energy.sum())


@pytest.mark.parametrize("restitution", sweep([1.0, 0.5, None], [1.0]))
def test_two_dumbbells_keep_their_momenta_when_they_collide(restitution):
    """No force from outside acts; without friction and with restitution 1 the energy stays, too."""
    one = dumbbell(pos=(-0.6, 0.1, 0), linvel=(2, 0, 0), angvel=(0, 0, 3), quat=(0.9, 0.1, 0.3, 0.3))
    other = dumbbell(pos=(0.6, 0, 0.1), linvel=(-1, 0, 0), angvel=(1, 2, 0))
    world = world_of(one, other, walls=(), laws=[physics.Contact(restitution=restitution)])
    p, L, energy = totals(world)
    world.step(steps=40)
    p_new, L_new, energy_new = totals(world)
    assert np.abs(world.linvel[0, 0] - one.linvel).max() > 0.3  # they have met
    np.testing.assert_allclose(p_new, p, rtol=0, atol=1e-11)
    np.testing.assert_allclose(L_new, L, rtol=0, atol=1e-11)
    if restitution == 1.0:
        assert energy_new == pytest.approx(energy, rel=1e-9)
    else:
        assert energy_new < energy


@pytest.mark.exhaustive
@pytest.mark.parametrize("preset", ["fast", "balanced", "precise"])
def test_compounds_of_all_shapes_come_to_rest_in_a_heap(preset):
    """Nothing is left out, nothing gains energy, and what lies on the floor is carried by it."""
    rng = np.random.default_rng(5)
    drops = [physics.Compound(each_shape(rng), pos=(0.3 * k, 1.2 + 1.6 * k, 0), quat=turned(rng)) for k in range(3)]
    world = world_of(*drops, table(pos=(4, 2, 0), angvel=(1, 0, 2)), accuracy=preset)
    energy = np.inf
    for _ in range(60):
        report = world.step(steps=5)
        now = float(physics.diagnose(world).energy.sum())
        assert not report.left_out.any()
        assert now <= energy + 2e-3
        energy = now
    assert world.pos[0, :, 1].min() > 0.0


def test_groups_and_coefficients_are_those_of_the_whole():
    """A compound without a common group falls through another; a wall of friction 0 lets one of friction 0.9 slide."""
    shelf = physics.Compound([physics.Block((4, 0.2, 4), fixed=True)], fixed=True, pos=(0, 1, 0), group=2, mask=1)
    falling = dumbbell(pos=(0, 1.5, 0), mask=4, group=1)
    world = world_of(shelf, falling, walls=())
    world.step(steps=30)
    assert world.pos[0, 1, 1] == pytest.approx(1.5 - 0.5 * G * 0.3**2, abs=1e-12)


# --- queries ---------------------------------------------------------------------------------------------------------


def test_queries_ask_every_part():
    """Rays and gaps are those of the parts as bodies of their own, to rounding of poses."""
    rng = np.random.default_rng(7)
    compound = physics.Compound(each_shape(rng), pos=(1, 2, 3), quat=turned(rng))
    ball = physics.Sphere(0.2, 1.0, pos=(3, 2, 3))
    whole = world_of(ball, compound, laws=[physics.Contact()])
    apart = world_of(ball, *taken_apart(compound), laws=[physics.Contact(between_bodies=False)])
    origins = rng.normal(size=(100, 3)) * 3 + compound.pos
    ways = rng.normal(size=(100, 3)) * 0.6 + compound.pos - origins
    found, expected = whole.cast_rays(origins, ways), apart.cast_rays(origins, ways)
    assert (np.minimum(expected.hit, 1) == found.hit).all()
    assert (found.hit == 1).sum() > 30
    np.testing.assert_allclose(found.distance, expected.distance, atol=1e-12)
    np.testing.assert_allclose(found.normal, expected.normal, atol=1e-10)
    parts = range(1, len(compound.parts) + 1)
    for other in (0, -1):
        gap = whole.measure_distances([1], [other]).gap[0, 0]
        assert gap == pytest.approx(
            min(apart.measure_distances([part], [other]).gap[0, 0] for part in parts), abs=1e-12
        )
    cube = physics.Block((0.2, 0.3, 0.4), 1.0)
    near, single = (world.nearest_to(cube, origins, (1, 0, 0, 0)) for world in (whole, apart))
    np.testing.assert_allclose(near.gap, single.gap, atol=1e-12)
    assert (near.other == np.minimum(single.other, 1)).all()


def test_a_compound_starts_over_a_floor_by_its_lowest_part():
    with pytest.raises(ValueError, match=r"0\.\d+ m inside walls\[0\]"):
        world_of(table(pos=(0, 0.4, 0)))
    world_of(table(pos=np.add(table().centroid, (0, 0.8, 0))))


# --- refusals --------------------------------------------------------------------------------------------------------


REFUSED = {
    "no parts": (lambda: physics.Compound([]), "parts is empty"),
    "a body": (lambda: physics.Compound(physics.Sphere(1.0, 1.0)), "parts is Sphere"),
    "a compound": (lambda: physics.Compound([dumbbell()]), r"parts\[0\] is Compound"),
    "a velocity": (lambda: physics.Compound([physics.Sphere(1.0, 1.0, linvel=(1, 0, 0))]), r"parts\[0\]\.linvel"),
    "a name": (lambda: physics.Compound([physics.Sphere(1.0, 1.0, name="ball")]), r"parts\[0\]\.name"),
    "friction": (lambda: physics.Compound([physics.Sphere(1.0, 1.0, friction=0.3)]), r"parts\[0\]\.friction"),
    "a fixed part": (lambda: physics.Compound([physics.Sphere(1.0, fixed=True)]), r"parts\[0\]\.fixed is True"),
    "density": (lambda: physics.Compound(dumbbell().parts, density=2.0), "density is 2.0 of a Compound"),
    "lift": (
        lambda: physics.Scene([dumbbell()], effects=[physics.Magnus()]),
        r"Magnus, and Scene.bodies\[0\] is a compo",
    ),
    "size": (
        lambda: world_of(dumbbell(pos=(0, 1, 0))).set_parameters(size=(1, 1, 1)),
        r"Scene.bodies\[0\], a compound, which has its parts in all worlds",
    ),
    "probe": (lambda: world_of(dumbbell(pos=(0, 1, 0))).nearest_to(dumbbell(), (0, 0, 0)), "allowed are convex shapes"),
}


@pytest.mark.parametrize("name", sorted(REFUSED))
def test_what_is_not_supported_is_named(name):
    make, message = REFUSED[name]
    with pytest.raises(ValueError, match=message):
        make()


def test_masses_of_worlds_scale_the_inertia():
    world = world_of(dumbbell(pos=(0, 1, 0)))
    world.set_parameters(mass=5.4)
    start = {"angvel": (0, 3.0, 0)}
    world.set_state(**start)
    spin = physics.diagnose(world).angular_momentum
    np.testing.assert_allclose(np.ravel(spin)[1], 2 * dumbbell().inertia[1, 1] * 3.0, rtol=1e-12)
