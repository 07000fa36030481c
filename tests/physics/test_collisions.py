"""Collisions of several contacts at one moment: at once or in turn, against both laws in plain NumPy."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

import physics
from physics import scenes
from physics.accuracy import PRESETS
from tests.reference import impacts

pytestmark = pytest.mark.interpreted

MASS, RADIUS = 2.0, 0.5
INERTIA = np.diag([6.5, 14.5, 17.0])
LAWS = {"simultaneous": impacts.simultaneous, "sequential": impacts.sequential}
STEP, SLOP = 0.1, 1e-9  # of the row of balls [s, radii]
MOMENT = 1e-6  # that is simulated: all contacts touch at its start [s]


def accuracy(collisions):
    return dataclasses.replace(PRESETS["precise"], collisions=collisions)


def effects(e):
    return [physics.Gravity((0, 0, 0)), physics.Contact(e), physics.Friction(0.0)]


def wedge(angle):
    """Normals of two walls, the angle between them `angle`."""
    half = 0.5 * angle
    return np.array([[math.sin(half), math.cos(half), 0.0], [-math.sin(half), math.cos(half), 0.0]])


def after_wedge(angle, e, linvel, collisions):
    """(velocity, report) after a sphere that touches both walls has hit them."""
    normals = wedge(angle)
    centre = (0.0, RADIUS / normals[0, 1], 0.0)
    scene = physics.Scene(
        [physics.Sphere(RADIUS, MASS, pos=centre, linvel=linvel)], [physics.HalfSpace(tuple(n)) for n in normals],
        effects(e),
    )  # fmt: skip
    world = physics.World(scene, dt=MOMENT, accuracy=accuracy(collisions))
    return world, world.step()


@pytest.mark.parametrize("collisions", LAWS)
@given(
    # Normals that differ by more than 45° and less than 135°: a sequence is then over after a handful of impacts.
    angle=st.floats(0.8, 2.35),
    e=st.floats(0.0, 1.0),
    speed=st.floats(0.1, 5.0),
    heading=st.floats(-math.pi, 0.0),
)
@settings(max_examples=60)
def test_a_sphere_hits_two_walls_by_the_law_asked_for(collisions, angle, e, speed, heading):
    """Reflections one after the other, or the solution of both at once; neither gains energy, e = 1 keeps it."""
    v = speed * np.array([math.cos(heading), math.sin(heading), 0.0])
    normals = wedge(angle)
    if abs(np.diff(normals @ v)[0]) < 1e-6 * speed:
        return  # a tie: rounding says who is first
    world, report = after_wedge(angle, e, v, collisions)
    M = MASS * np.eye(3)
    # Approaches below the scheme's threshold, √(8 slop R g) = 0 without gravity but for rounding, count as none.
    expected = LAWS[collisions](normals, M, v, e, 1e-12)
    assert report.ok
    # The contact problem is solved to the preset's 1e-10 of the speed.
    assert world.linvel[0, 0] == pytest.approx(expected, abs=1e-9 * speed)
    before, after = v @ v, float(world.linvel[0, 0] @ world.linvel[0, 0])
    assert after <= before * (1 + 1e-9)
    if e == 1.0:
        assert after == pytest.approx(before, rel=1e-9)


def test_the_laws_agree_at_right_angles_only():
    """Two walls at right angles are independent; at 120° between normals the second impact undoes part of the first.

    By hand, e = 1, v = (0, -1): at 60° to each normal u = -cos 60° = -1/2 twice. At once u⁺ = 1/2 twice, v⁺ = (0, 1).
    In turn: reflected at n₁, v = n₁ - (0, 1), which meets n₂ at n₁·n₂ - 1/2 = -1, and leaves it as n₁ + 2 n₂ - (0, 1),
    of which n₁·(...) = 1 - 1 - 1/2 < 0: once more reflected, v = 2 n₁ + 2 n₂ - (0, 1) = (0, 1).
    """
    for angle, along in ((math.pi / 2, 0.0), (2 * math.pi / 3, 0.0)):
        for law in LAWS:
            world, _ = after_wedge(angle, 1.0, (along, -1.0, 0.0), law)
            assert world.linvel[0, 0] == pytest.approx([0.0, 1.0, 0.0], abs=1e-9)
    found = [after_wedge(2 * math.pi / 3, 0.5, (0.0, -1.0, 0.0), law)[0].linvel[0, 0] for law in LAWS]
    assert found[0] == pytest.approx([0.0, 0.5, 0.0], abs=1e-9)
    assert not np.allclose(found[0], found[1], atol=1e-2)


BLOCK_HALF = np.array([2.5, 1.5, 1.0])
CORNERS = np.array([[x, -1.0, z] for z in (-1.0, 1.0) for x in (-1.0, 1.0)]) * BLOCK_HALF  # in the order of the slots


@pytest.mark.parametrize("collisions", LAWS)
@given(
    e=st.floats(0.2, 1.0),
    fall=st.floats(0.5, 5.0),
    spin=st.tuples(st.floats(-0.5, 0.5), st.floats(-1.0, 1.0), st.floats(-0.5, 0.5)),
)
@settings(max_examples=60)
def test_a_block_lands_flat_by_the_law_asked_for(collisions, e, fall, spin):
    """All four corners touch and approach. Horizontal momentum, spin about the vertical stay; energy does not grow."""
    v, w = np.array([0.3, -fall, -0.2]), np.array(spin)
    J = impacts.normal_rows(np.tile([0.0, 1.0, 0.0], (4, 1)), CORNERS)
    M = np.zeros((6, 6))
    M[:3, :3], M[3:, 3:] = scenes.MASS * np.eye(3), INERTIA
    start = np.concatenate([v, w])
    rates = np.sort(J @ start)
    if rates[-1] > -0.01 or np.diff(rates).min() < 1e-3:
        return  # one leaves, or a tie, which rounding breaks sooner or later
    body = physics.Block(scenes.SIZE, scenes.MASS, pos=(0, 1.5, 0), linvel=v, angvel=w)
    scene = physics.Scene([body], [physics.HalfSpace((0, 1, 0))], effects(e))
    world = physics.World(scene, dt=MOMENT, accuracy=accuracy(collisions))
    before = physics.diagnose(world)
    assert world.step().ok
    after = physics.diagnose(world)
    expected = LAWS[collisions](J, M, start, e, 1e-12)
    # Impacts in turn add the rounding, and contacts slower than 1e-10 of the speeds may be left as they are.
    assert after.momentum[0, 0] == pytest.approx(scenes.MASS * expected[:3], abs=1e-7)
    assert after.angular_momentum[0, 0] == pytest.approx(INERTIA @ expected[3:], abs=1e-7)
    assert after.momentum[0, 0, ::2] == pytest.approx(before.momentum[0, 0, ::2], abs=1e-12)
    assert after.angular_momentum[0, 0, 1] == pytest.approx(before.angular_momentum[0, 0, 1], abs=1e-12)
    assert after.kinetic_energy[0, 0] <= before.kinetic_energy[0, 0] * (1 + 1e-9)


def test_a_block_that_falls_flat_turns_only_where_its_corners_hit_in_turn():
    """At once: symmetric, not a bit of spin. In turn the lowest slot is first among equals, and leaves it spinning."""
    body = physics.Block(scenes.SIZE, scenes.MASS, pos=(0, 1.5, 0), linvel=(0, -1, 0))
    scene = physics.Scene([body], [physics.HalfSpace((0, 1, 0))], effects(0.5))
    spins = {}
    for law in LAWS:
        world = physics.World(scene, dt=MOMENT, accuracy=accuracy(law))
        assert world.step().ok
        spins[law] = world.angvel[0, 0].copy()
    assert not spins["simultaneous"].any()
    J = impacts.normal_rows(np.tile([0.0, 1.0, 0.0], (4, 1)), CORNERS)
    M = np.diag([*[scenes.MASS] * 3, *np.diag(INERTIA)])
    expected = impacts.sequential(J, M, np.array([0.0, -1.0, 0.0, 0.0, 0.0, 0.0]), 0.5, 1e-12)[3:]
    assert np.linalg.norm(expected) > 0.04
    # The spin precesses for a microsecond by about its square, 2e-3, times that.
    assert spins["sequential"] == pytest.approx(expected, abs=1e-8)


def test_impacts_in_turn_without_an_end_are_reported_and_solved_at_once():
    """Plastic walls whose normals are 0.002 rad off opposite: each round takes cos² of it, 4e-6, of the speed."""
    world, report = after_wedge(math.pi - 0.002, 0.0, (0.0, -1.0, 0.0), "sequential")
    assert report.unconverged[0] >= 1
    assert not report.ok
    assert (wedge(math.pi - 0.002) @ world.linvel[0, 0] >= -1e-9).all()


def test_the_law_is_checked():
    with pytest.raises(ValueError, match=r"Accuracy.collisions is 'both'; allowed are simultaneous, sequential"):
        physics.Accuracy(collisions="both")


def test_one_body_at_walls_collides_in_turn_with_events_only():
    scene = physics.Scene([physics.Sphere(RADIUS, MASS)], [physics.HalfSpace((0, 1, 0), -1.0)], [physics.Contact()])
    with pytest.raises(ValueError, match=r"Accuracy.collisions is 'sequential' with scheme 'exact'; allowed where"):
        physics.World(scene, accuracy=physics.Accuracy(collisions="sequential"))


def in_a_row(places, speeds, masses, e, collisions) -> np.ndarray:
    """Velocities along x of balls in a row after the impacts of one step [m/s]."""
    bodies = [physics.Sphere(RADIUS, m, pos=(x, 0, 0), linvel=(v, 0, 0)) for x, v, m in zip(places, speeds, masses)]
    scene = physics.Scene(bodies, [], [physics.Contact(e)])
    settings = physics.Accuracy(collisions=collisions, impacts=1000, slop=SLOP)
    world = physics.World(scene, dt=STEP, accuracy=settings)
    assert world.step().ok
    return world.linvel[0, :, 0].copy()


@given(
    speeds=st.lists(st.floats(-3, 3), min_size=2, max_size=4),
    masses=st.lists(st.floats(0.2, 5.0), min_size=4, max_size=4),
    e=st.floats(0.0, 1.0),
)
@example(speeds=[0.0, 0.0, -1.0], masses=[1.0, 0.5, 1.0, 1.0], e=0.125)  # all end at -0.4: what is left is rounding
@settings(max_examples=settings().max_examples * 6 // 5)
def test_balls_that_touch_in_a_row_follow_the_law_that_was_asked_for(speeds, masses, e):
    """In a row that touches every velocity of approach is v_i - v_{i+1}: the reference's J, and M the masses."""
    n = len(speeds)
    J = np.eye(n)[1:] - np.eye(n)[:-1]
    M, V = np.diag(masses[:n]), np.array(speeds)
    # What approaches no faster than two hundred slops in a step, 1e-6 m/s, is left to the resting stage, plastic: three
    # such leftovers at most, 2 slow each by a light ball, and what they start along a row whose masses differ by 25.
    slow = 200 * SLOP * RADIUS / STEP
    after = in_a_row([2 * RADIUS * k for k in range(n)], speeds, masses, e, "sequential")
    expected = impacts.sequential(J, M, V, e, slow)
    assert after == pytest.approx(expected, abs=3 * 2 * 25 * slow)
    assert masses[:n] @ after == pytest.approx(masses[:n] @ V, abs=1e-12 * 4 * 3 * 5 * 10)  # momentum, to rounding
    assert masses[:n] @ after**2 <= (masses[:n] @ V**2) * (1 + 1e-9)


@pytest.mark.parametrize(
    ("collisions", "expected"), [("simultaneous", (-1 / 3, 2 / 3, 2 / 3)), ("sequential", (0.0, 0.0, 1.0))]
)
def test_a_cradle_of_three_does_as_it_is_told(collisions, expected):
    after = in_a_row([0.0, 2 * RADIUS, 4 * RADIUS], (1.0, 0.0, 0.0), (MASS,) * 3, 1.0, collisions)
    assert after == pytest.approx(expected, abs=2e-6)  # two contacts, solved to 1e-6 of the speed of 1 m/s


@given(angle=st.floats(0.8, 2.35), e=st.floats(0.0, 1.0), speed=st.floats(0.1, 5.0), heading=st.floats(-math.pi, 0.0))
@settings(max_examples=60)
def test_time_stepping_gains_no_energy_at_two_walls(angle, e, speed, heading):
    linvel = (speed * math.cos(heading), speed * math.sin(heading), 0.0)
    normals = wedge(angle)
    body = physics.Sphere(RADIUS, MASS, pos=(0.0, RADIUS / normals[0, 1], 0.0), linvel=linvel)
    scene = physics.Scene([body], [physics.HalfSpace(tuple(n)) for n in normals], effects(e))
    world = physics.World(scene, dt=MOMENT)
    before = physics.diagnose(world).energy.sum()
    report = world.step()
    # Each solve leaves a residual of 1e-6 of the speed: twice that of the energy, and a few impacts follow each other.
    assert report.status[0] in (physics.Status.OK, physics.Status.UNRESOLVED)
    assert physics.diagnose(world).energy.sum() <= before * (1 + 2e-6 * 10)


def overlapping_in_the_air(spin, speed) -> physics.World:
    """A block that turns, 0.1 m deep in a sphere that goes up; nothing else is near."""
    block = physics.Block((0.8, 0.2, 0.4), 2.0, angvel=spin)
    ball = physics.Sphere(0.2, 2.0, pos=(0.3, 0.2, 0.15), linvel=(0, speed, 0))
    return physics.World(physics.Scene([block, ball], [], [physics.Contact()]), dt=1e-4)


def momenta(world) -> np.ndarray:
    """Total momentum [kg m/s] and angular momentum about the origin [kg m²/s] of a world."""
    found = physics.diagnose(world)
    around = np.cross(world.pos[0], found.momentum[0]) + found.angular_momentum[0]
    return np.concatenate([found.momentum[0].sum(axis=0), around.sum(axis=0)])


@pytest.mark.parametrize("speed", [0.0, 40.0])
@pytest.mark.parametrize("spin", [(0, 100, 0), (-50, 50, 50), (50, -50, 50), (50, 50, 50)])
def test_bodies_that_are_pushed_apart_in_the_air_gain_no_energy(spin, speed):
    """The correction turns the block, and at constant L its energy ½ L·I⁻¹L grows: by 1 to 9 % if nothing pays.

    Not taken are gains up to 1e-5 of the energy of the turn in one correction, 2e-5 in all, since depths halve.
    """
    world = overlapping_in_the_air(spin, speed)
    before, kept = physics.diagnose(world).kinetic_energy.sum(), momenta(world)
    assert world.step().status[0] == physics.Status.OVERLAP
    assert physics.diagnose(world).kinetic_energy.sum() <= before * (1 + 2e-5)
    if speed:  # else the relative motion may have too little, and the motion of both pays
        assert momenta(world) == pytest.approx(kept, abs=1e-12 * np.abs(kept).max())
