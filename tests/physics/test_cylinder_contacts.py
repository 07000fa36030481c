"""Cylinders that touch other bodies: motion against closed forms, rest, tipping, impacts."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import physics
from tests.reference.cylinders import motion, tilted

pytestmark = pytest.mark.interpreted

G = 9.81
FLOOR = physics.HalfSpace((0, 1, 0))
ALONG_Z = (0.5**0.5, 0.5**0.5, 0, 0)  # body y along world z
# Residuals of the solver, whose tolerance is 1e-6 of the speed g h = 0.05 m/s that loads give in a step: as a velocity,
# and over the radius of 0.1 m as a spin.
REST, REST_SPIN = 1e-7, 1e-6

TABLE = physics.Block((8, 1, 8), fixed=True, pos=(0, -0.5, 0))


def effects(mu: float = 0.5, gravity=(0, -G, 0)) -> list:
    return [physics.Gravity(gravity), physics.Contact(), physics.Friction(mu)]


def world_of(*bodies, walls=(), laws=None, dt=0.005, accuracy="balanced"):
    return physics.World(physics.Scene(bodies, walls, effects() if laws is None else laws), dt=dt, accuracy=accuracy)


# --- rolling ---------------------------------------------------------------------------------------------------------


def rolled(preset: str, dt: float, width: float) -> float:
    """Error of the place of a cylinder that has rolled down a fixed block of some width for 0.5 s [m]."""
    slope, time = 0.3, 0.5
    up, down = np.array([math.sin(slope), math.cos(slope), 0]), np.array([math.cos(slope), -math.sin(slope), 0])
    cylinder = physics.Cylinder(0.1, 0.6, 1.0, pos=0.1 * up, quat=ALONG_Z)
    quat = (math.cos(slope / 2), 0, 0, -math.sin(slope / 2))
    world = world_of(
        cylinder, physics.Block((8, 1, width), fixed=True, pos=-0.5 * up, quat=quat), dt=dt, accuracy=preset
    )
    world.step(steps=round(time / dt))
    return float(np.abs(world.pos[0, 0] - cylinder.pos - G * math.sin(slope) / 3 * time**2 * down).max())


@pytest.mark.parametrize("width", [8.0, 0.3])
def test_a_cylinder_rolls_down_a_block_at_two_thirds_of_g_sin(width):
    """Forces are constant, so that the midpoint rule is exact: the solver's tolerance is left, 1e-9 of g T²/2.

    The narrow block has the cylinder's line end at its edges.
    """
    assert rolled("balanced", 0.01, width) < 2e-9


@pytest.mark.exhaustive
@pytest.mark.parametrize("width", [8.0, 0.3])
def test_a_cylinder_rolls_down_a_block_precisely(width):
    assert rolled("precise", 0.01, width) < 1e-9


def pivoted(lean: float, rate: float, time: float, across: float) -> np.ndarray:
    """Place relative to a fixed line of a cylinder that rolls about it without slip, a distance `across` from its axis.

    The moment of inertia about the line is (r²/2 + d²) per mass for r = 0.1 m; of rolling on a cylinder of radius R,
    d = R + r and 3/2 d² stands for it. The angle from the vertical has φ'' = g d sin φ/I.
    """
    about = 1.5 * across if across > 0.1 else 1.5 * 0.1
    end = solve_ivp(
        lambda t, y: [y[1], G / about * math.sin(y[0])], (0, time), [lean, rate],
        method="DOP853", rtol=1e-13, atol=1e-15,
    ).y[0, -1]  # fmt: skip
    return across * np.array([math.sin(end), math.cos(end), 0])


def off_table(preset: str, dt: float, width: float = 2.0, time: float = 0.1) -> float:
    """Error of the place of a cylinder that rolls off a table, some time after its axis has passed the edge [m]."""
    r, speed, way = 0.1, 0.3, 0.3 * time
    table = physics.Block((2, 1, width), fixed=True, pos=(-1, -0.5, 0))
    start = {"pos": (-way, r, 0), "quat": ALONG_Z, "linvel": (speed, 0, 0), "angvel": (0, 0, -speed / r)}
    world = world_of(physics.Cylinder(r, 0.6, 1.0, **start), table, laws=effects(3.0), dt=dt, accuracy=preset)
    world.step(steps=round(2 * time / dt))
    return float(np.abs(world.pos[0, 0] - pivoted(0.0, speed / r, time, r)).max())


@pytest.mark.parametrize("width", [2.0, 0.3])
def test_a_cylinder_rolls_off_the_end_of_a_table(width):
    """It turns about the edge, which it touches with its side: of second order in the step."""
    coarse, fine = off_table("balanced", 0.01, width), off_table("balanced", 0.005, width)
    assert coarse < 1e-4
    assert fine < coarse / 3.5


@pytest.mark.exhaustive
def test_a_cylinder_rolls_off_the_end_of_a_table_precisely():
    assert off_table("precise", 0.01, time=0.03) < 1e-9


def on_roller(kind: str, preset: str, dt: float, time: float = 0.2) -> float:
    """Error of the place of a cylinder that rolls from rest at 0.3 rad on top of a fixed cylinder or capsule [m]."""
    R, r, lean = 0.3, 0.1, 0.3
    rest = {"fixed": True, "quat": ALONG_Z}
    roller = physics.Cylinder(R, 0.4, **rest) if kind == "cylinder" else physics.Capsule(R, 1.0, **rest)
    place = (R + r) * np.array([math.sin(lean), math.cos(lean), 0])
    cylinder = physics.Cylinder(r, 0.6, 1.0, pos=place, quat=ALONG_Z)
    world = world_of(cylinder, roller, laws=effects(3.0), dt=dt, accuracy=preset)
    world.step(steps=round(time / dt))
    return float(np.abs(world.pos[0, 0] - pivoted(lean, 0.0, time, R + r)).max())


@pytest.mark.parametrize("kind", ["cylinder", "capsule"])
def test_a_cylinder_rolls_on_a_roller(kind):
    """The normal follows the line from axis to axis: of second order in the step."""
    coarse, fine = on_roller(kind, "balanced", 0.005), on_roller(kind, "balanced", 0.0025)
    assert coarse < 1e-5
    assert fine < coarse / 3.5


@pytest.mark.exhaustive
@pytest.mark.parametrize("kind", ["cylinder", "capsule"])
def test_a_cylinder_rolls_on_a_roller_precisely(kind):
    assert on_roller(kind, "precise", 0.01, 0.04) < 1e-9


def rolled_on_disk(dt: float) -> float:
    """Error of the place of a tilted disk that rolls on the top of a fixed block for 0.1 s [m]."""
    radius, height, time = 0.1, 0.02, 0.1
    start = tilted(0.4, (1.0, 4.0, -2.0), radius, height)
    true = motion(start, time, radius, height)
    disk = physics.Cylinder(
        radius, height, 1.0, pos=start[:3], quat=start[3:7], linvel=start[7:10], angvel=start[10:13]
    )  # fmt: skip
    world = world_of(disk, TABLE, laws=effects(3.0), dt=dt)
    world.step(steps=round(time / dt))
    return float(np.abs(world.pos[0, 0] - true[:3]).max())


def test_a_tilted_disk_rolls_on_a_block_as_the_equations_say():
    """The point that touches rolls along the rim; the error is of second order in the step."""
    coarse, fine = rolled_on_disk(0.005), rolled_on_disk(0.0025)
    assert coarse < 1e-4
    assert fine < coarse / 3.5


def on_turning_table(dt: float) -> float:
    """Error after 0.4 s of the place of a cylinder on a driven block, which turns about z through its centre [m].

    Let s be its place along the top, which leans by Ω t, and r its radius. Without slip it turns at Ω - s'/r. Its
    centre has the acceleration s'' - s Ω² along the top. With the friction F, m (s'' - s Ω²) = F - m g sin Ω t and
    -m r²/2 s''/r = r F, so that s'' = 2/3 (s Ω² - g sin Ω t).
    """
    r, rate, time, half, start = 0.1, 1.2, 0.4, 0.5, 0.6
    s, _ = solve_ivp(
        lambda t, y: [y[1], 2 / 3 * (y[0] * rate**2 - G * math.sin(rate * t))], (0, time), [start, 0.5],
        method="DOP853", rtol=1e-13, atol=1e-15,
    ).y[:, -1]  # fmt: skip
    table = physics.Block((4, 2 * half, 4), fixed=True, motion=physics.Motion(spin=(0, 0, rate)))
    cylinder = physics.Cylinder(
        r, 0.6, 1.0, pos=(start, half + r, 0), quat=ALONG_Z,
        linvel=(0.5 - (half + r) * rate, start * rate, 0), angvel=(0, 0, rate - 0.5 / r),
    )  # fmt: skip
    world = world_of(cylinder, table, laws=effects(3.0), dt=dt)
    world.step(steps=round(time / dt))
    c, d = math.cos(rate * time), math.sin(rate * time)
    return float(np.abs(world.pos[0, 0] - (s * c - (half + r) * d, s * d + (half + r) * c, 0)).max())


def test_a_cylinder_rolls_on_a_table_that_turns_under_it():
    """The rolling points feel how the face turns: the error is of second order in the step."""
    coarse, fine = on_turning_table(0.01), on_turning_table(0.005)
    assert coarse < 1e-4
    assert fine < coarse / 3.5


# --- rest and tipping ------------------------------------------------------------------------------------------------


def test_a_cylinder_stands_and_slides_on_a_fixed_block_as_on_a_wall():
    """A fixed body stands far from the wall, so that both worlds have the same plan.

    Solves leave ε of the speed g h, so a place is off by up to ε g h² n²/2 after n steps: 1.2e-8 m. At the radius
    of 0.1 m this is an angle of 1.2e-7 rad, half of which is in the quaternion.
    """
    far = physics.Block((1, 1, 1), fixed=True, pos=(0, -50, 0))
    for speed in (0.0, 0.4):
        cylinder = physics.Cylinder(0.1, 0.3, 1.0, pos=(0, 0.15, 0), linvel=(speed, 0, 0.2 * speed))
        on_wall, on_block = world_of(cylinder, far, walls=[FLOOR]), world_of(cylinder, TABLE)
        for world in (on_wall, on_block):
            world.step(steps=10)
        assert on_block.pos[0, 0] == pytest.approx(on_wall.pos[0, 0], abs=1.2e-8)
        assert on_block.quat[0, 0] == pytest.approx(on_wall.quat[0, 0], abs=6e-8)


def carried(share: float, direction: float, is_fixed: bool) -> float:
    """Spin after 0.05 s of a block whose centre is at this share of the radius from the axis of the can under it."""
    place = 0.1 * share * np.array([math.cos(direction), 0, math.sin(direction)])
    can = physics.Cylinder(0.1, 0.3, None if is_fixed else 50.0, pos=(0, 0.15, 0), fixed=is_fixed)
    block = physics.Block((0.8, 0.1, 0.8), 1.0, pos=place + np.array([0, 0.35, 0]))
    world = world_of(can, block, walls=[FLOOR])
    world.step(steps=10)
    return float(np.abs(world.angvel[0, 1]).max())


@pytest.mark.parametrize("is_fixed", [True, False])
def test_a_block_stands_on_a_can_while_its_centre_is_over_it(is_fixed):
    """In any direction: one point of the ring lies where loads would tip the block."""
    assert carried(0.99, 0.4, is_fixed) < REST_SPIN
    assert carried(1.02, 0.4, is_fixed) > 1e-3


def over_edge(way: float) -> float:
    """Spin after 0.05 s of a cylinder that stands on a table, with its axis so far beyond the edge [m]."""
    table = physics.Block((2, 1, 2), fixed=True, pos=(-1, -0.5, 0))
    world = world_of(physics.Cylinder(0.1, 0.3, 1.0, pos=(way, 0.15, 0)), table)
    world.step(steps=10)
    return float(np.abs(world.angvel).max())


def test_a_cylinder_stands_on_a_table_while_its_centre_is_over_it():
    assert over_edge(-0.001) < REST_SPIN
    assert over_edge(0.001) > 1e-3


@pytest.mark.parametrize("kind", ["tower", "logs"])
def test_a_pile_of_cylinders_stays_at_rest(kind):
    r, high = 0.1, 0.1 * 3**0.5
    if kind == "tower":
        bodies = [physics.Cylinder(r, 0.2, 1.0, pos=(0.01 * k, 0.1 + 0.2 * k, 0)) for k in range(3)]
    else:
        stops = [physics.Block((0.1, 0.2, 1), fixed=True, pos=(x, 0.1, 0)) for x in (-0.25, 0.25)]
        places = ((-r, r, 0), (r, r, 0), (0, r + high, 0))
        bodies = [*(physics.Cylinder(r, 0.6, 1.0, pos=place, quat=ALONG_Z) for place in places), *stops]
    world = world_of(*bodies, walls=[FLOOR])
    before = world.pos.copy()
    world.step(steps=5)
    assert np.abs(world.linvel).max() < REST
    assert np.abs(world.pos - before).max() < 1e-8


@pytest.mark.parametrize(
    "rider", [physics.Ellipsoid((0.2, 0.1, 0.15), 1.0), physics.Capsule(0.05, 0.1, 1.0, quat=ALONG_Z)]
)
def test_round_bodies_stand_on_a_can(rider):
    """The ellipsoid is flat enough to come back; the capsule lies, with both of its points on the end."""
    high = 0.3 + (0.1 if rider.kind == "ellipsoid" else 0.05)
    fields = {"pos": (0, high, 0), "quat": rider.quat, "mass": 1.0}
    if rider.kind == "ellipsoid":
        body = physics.Ellipsoid(rider.semi_axes, **fields)
    else:
        body = physics.Capsule(rider.radius, rider.length, **fields)
    world = world_of(physics.Cylinder(0.1, 0.3, 1.0, pos=(0, 0.15, 0)), body, walls=[FLOOR])
    world.step(steps=15)
    assert np.abs(world.linvel).max() < REST
    assert world.pos[0, 1] == pytest.approx((0, high, 0), abs=1e-9)


# --- impacts ---------------------------------------------------------------------------------------------------------


def test_two_cylinders_rebound_head_on_along_their_line():
    """Momentum stays, and the relative velocity is reversed times e, as for points: both masses are on one line."""
    e, masses = 0.6, np.array([1.0, 2.0])
    one = physics.Cylinder(0.1, 0.6, masses[0], pos=(-0.11, 0, 0), quat=ALONG_Z, linvel=(2, 0, 0))
    other = physics.Cylinder(0.1, 0.4, masses[1], pos=(0.11, 0, 0.05), quat=ALONG_Z, linvel=(-1, 0, 0))
    world = world_of(one, other, laws=[physics.Contact(e)], dt=0.01)
    world.step(steps=3)
    u, before = world.linvel[0, :, 0], masses @ (2, -1)
    assert masses @ u == pytest.approx(before, abs=1e-12)
    assert np.abs(world.linvel[0, :, 1:]).max() < 1e-12
    # The second one is hit 5 cm off its centre, over the common part: its ends are 0.2 m and 0.1 m from the middle.
    assert u[1] > u[0]


def test_an_impact_between_centres_is_that_of_two_points():
    e, masses = 0.6, np.array([1.0, 2.0])
    bodies = [
        physics.Cylinder(0.1, 0.6, m, pos=(x, 0, 0), quat=ALONG_Z, linvel=(v, 0, 0))
        for m, x, v in zip(masses, (-0.11, 0.11), (2.0, -1.0))
    ]
    world = world_of(*bodies, laws=[physics.Contact(e)], dt=0.01)
    world.step(steps=3)
    u = world.linvel[0, :, 0]
    assert u[1] - u[0] == pytest.approx(3 * e, abs=1e-8)  # the solver's tolerance is 1e-9 of the speeds
    assert masses @ u == pytest.approx(0, abs=1e-12)
    assert np.abs(world.angvel).max() < 1e-9
