"""Cylinders: mass, motion against closed forms and DOP853, rest, energy, queries, files, and what they refuse."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp

import physics
from physics.io.mjcf.files import from_mjcf
from physics.io.mjcf.writer import to_mjcf
from physics.kernels.multibody.stepping.adaptive_substep import MIN_SOLVER_TOLERANCE
from physics.kernels.multibody.stepping.allowed_error import ERROR_PER_TOLERANCE
from physics.mass.inertia import solid_cylinder
from physics.rotations import rotation_matrices
from tests.reference.cylinders import (
    derivative,
    lowest_point,
    motion,
    rotation,
    steady_precession,
    tilted,
)
from tests.reference.edges import GRAVITY, BallOnBall

pytestmark = pytest.mark.interpreted

G = 9.81
FLOOR = physics.HalfSpace((0, 1, 0))
ALONG_Z = (0.5**0.5, 0.5**0.5, 0, 0)  # body y along world z
R0, HEIGHT = 0.1, 0.02  # of the disk in motion [m]


def effects(mu: float = 0.5, gravity=(0, -G, 0)) -> list:
    friction = [physics.Friction(mu)] if mu else []
    return [physics.Gravity(gravity), physics.Contact(), *friction]


def world_of(*bodies, walls=(FLOOR,), laws=None, dt=0.005, accuracy="balanced"):
    return physics.World(physics.Scene(bodies, walls, effects() if laws is None else laws), dt=dt, accuracy=accuracy)


# --- mass ------------------------------------------------------------------------------------------------------------


@given(r=st.floats(0.01, 10), height=st.floats(0.01, 10))
def test_volume_and_inertia_are_those_of_a_pile_of_disks(r, height):
    """A disk at height y has M r²/2 about the axis and M (r²/4 + y²) across it; density 1."""
    across = 2 * quad(lambda y: math.pi * r * r * (r * r / 4 + y * y), 0, 0.5 * height, epsabs=0, epsrel=1e-13)[0]
    body = physics.Cylinder(r, height, density=1.0)
    mass = math.pi * r * r * height
    assert body.volume == pytest.approx(mass, rel=1e-14)
    assert body.inertia == pytest.approx(np.diag([across, mass * r * r / 2, across]), rel=1e-12)
    assert body.inertia == pytest.approx(solid_cylinder(r, height, mass), rel=1e-12)


# --- motion ----------------------------------------------------------------------------------------------------------


def rolled(preset: str, dt: float) -> float:
    """Error of the place of a cylinder that has rolled down a slope for 0.5 s [m]."""
    slope, time = 0.3, 0.5
    up, down = np.array([math.sin(slope), math.cos(slope), 0]), np.array([math.cos(slope), -math.sin(slope), 0])
    cylinder = physics.Cylinder(0.1, 0.6, 1.0, pos=0.1 * up, quat=ALONG_Z)
    world = world_of(cylinder, walls=[physics.HalfSpace(up)], dt=dt, accuracy=preset)
    world.step(steps=round(time / dt))
    return float(np.abs(world.pos[0, 0] - cylinder.pos - G * math.sin(slope) / 3 * time**2 * down).max())


def test_a_cylinder_rolls_down_a_slope_at_two_thirds_of_g_sin():
    """Forces are constant, so that the midpoint rule is exact: the solver's tolerance is left, 1e-9 of g T²/2."""
    assert rolled("balanced", 0.005) < 2e-9
    assert rolled("balanced", 0.01) < 2e-9


@pytest.mark.exhaustive
def test_a_cylinder_rolls_down_a_slope_precisely():
    assert rolled("precise", 0.005) < 1e-9


def leaning(share: float, direction: float, time: float, preset="balanced", dt=0.005) -> physics.World:
    """World after `time` [s] with a cylinder that stands on a slope, whose tangent is `share` times the critical one.

    Gravity leans, towards `direction` [rad] from x to z, and the floor stays level. The critical tangent is r/l: the
    weight then passes through the rim.
    """
    r, half = 0.1, 0.15
    slope = math.atan(share * r / half)
    pull = G * np.array(
        [math.sin(slope) * math.cos(direction), -math.cos(slope), math.sin(slope) * math.sin(direction)]
    )
    cylinder = physics.Cylinder(r, 2 * half, 1.0, pos=(0, half, 0))
    world = world_of(cylinder, laws=effects(1.5, pull), dt=dt, accuracy=preset)
    world.step(steps=round(time / dt))
    return world


@pytest.mark.parametrize("direction", [0.0, 0.39, 2.0])
def test_a_cylinder_stands_below_the_critical_angle(direction):
    """One point of the ring lies where loads would tip it, so that the critical angle is that of each direction."""
    world = leaning(0.999, direction, 0.25)
    assert np.abs(world.pos[0, 0] - (0, 0.15, 0)).max() < 1e-9
    assert np.abs(world.angvel).max() < 1e-7


def tipped(preset: str, dt: float) -> tuple[float, float]:
    """Errors of place [m] and spin [rad/s] of a cylinder that tips over its rim: its slope is 10 % above the critical.

    With the distance R of the centre from the rim, and the moment of inertia I about it, it turns about this
    point by I φ'' = m g R sin(s - c + φ): s is the slope, c the critical one.
    """
    r, half, share, direction, time = 0.1, 0.15, 1.1, 0.39, 0.25
    slope, critical, far = math.atan(share * r / half), math.atan(r / half), math.hypot(r, half)
    about = r * r / 4 + half * half / 3 + far * far
    fall = solve_ivp(
        lambda t, y: [y[1], G * far / about * math.sin(slope - critical + y[0])], (0, time), [0, 0],
        method="DOP853", rtol=1e-13, atol=1e-15,
    ).y[:, -1]  # fmt: skip
    along, up = r + far * math.sin(fall[0] - critical), far * math.cos(fall[0] - critical)
    world = leaning(share, direction, time, preset, dt)
    place = np.array([along * math.cos(direction), up, along * math.sin(direction)])
    turn = fall[1] * np.array([math.sin(direction), 0, -math.cos(direction)])
    return float(np.abs(world.pos[0, 0] - place).max()), float(np.abs(world.angvel[0, 0] - turn).max())


def test_a_cylinder_tips_over_its_rim():
    """The error is of second order in the step."""
    coarse, fine = tipped("balanced", 0.005), tipped("balanced", 0.0025)
    assert coarse[0] < 1e-4
    assert fine[0] < coarse[0] / 3.5


@pytest.mark.exhaustive
def test_a_cylinder_tips_over_its_rim_precisely():
    assert tipped("precise", 0.01)[0] < 1e-9


def disk_start(law: str) -> np.ndarray:
    """State of a tilted disk whose lowest point is on the floor, and does not leave it."""
    if law == "circle":
        return tilted(1.2, steady_precession(1.2, 3.0, R0, HEIGHT), R0, HEIGHT)
    if law == "rolling":
        return tilted(0.4, (1.0, 4.0, -2.0), R0, HEIGHT)
    start = tilted(0.9, (0.0, 6.0, -1.0), R0, HEIGHT, slip=(0.6, 0.0, 0.3))
    if law == "free":
        r, _ = lowest_point(rotation(start[3:7]), start[10:13], R0, HEIGHT)
        start[7:10] = 0.2, -np.cross(start[10:13], r)[1], 0.0
    return start


MU = {"circle": 0.8, "rolling": 3.0, "free": 0.0, "sliding": 0.2}


def disk_error(law: str, preset: str, dt: float, time: float = 0.1) -> float:
    """Error of the place of a disk that rolls, slides, or turns without friction [m]."""
    start, mu = disk_start(law), MU[law]
    true = motion(start, time, R0, HEIGHT, law="rolling" if law == "circle" else law, mu=mu)
    disk = physics.Cylinder(
        R0, HEIGHT, 1.0, pos=start[:3], quat=start[3:7], linvel=start[7:10], angvel=start[10:13]
    )  # fmt: skip
    world = world_of(disk, laws=effects(mu), dt=dt, accuracy=preset)
    world.step(steps=round(time / dt))
    return float(np.abs(world.pos[0, 0] - true[:3]).max())


def test_the_reference_keeps_energy_and_rolls_in_a_circle():
    start, time = disk_start("circle"), 0.4
    end = motion(start, time, R0, HEIGHT)
    middle = np.array([math.cos(3.0 * time), math.sin(3.0 * time)])
    axis, found = rotation(start[3:7])[:, 1], rotation(end[3:7])[:, 1]
    assert found[[2, 0]] == pytest.approx(axis[2] * middle, abs=1e-10)  # z turns towards x about y
    assert end[1] == pytest.approx(start[1], abs=1e-11)
    for law in ("rolling", "free"):
        assert energy(disk_start(law)) == pytest.approx(
            energy(motion(disk_start(law), 0.1, R0, HEIGHT, law=law)), rel=1e-11
        )
    force = derivative(end, R0, HEIGHT, "rolling", 0.0, G)[1]
    assert np.hypot(force[0], force[2]) < MU["circle"] * force[1]


def energy(y) -> float:
    """Energy of the disk per mass in the state y (13,) [J/kg]."""
    local = rotation(y[3:7]).T @ y[10:13]
    across = R0**2 / 4 + HEIGHT**2 / 12
    return float(0.5 * y[7:10] @ y[7:10] + 0.5 * local**2 @ (across, R0**2 / 2, across) + G * y[1])


@pytest.mark.parametrize("law", ["circle", "rolling", "sliding"])
def test_a_tilted_disk_moves_as_the_equations_say(law):
    """The point that touches rolls along the rim; the error is of second order in the step."""
    coarse, fine = disk_error(law, "balanced", 0.005), disk_error(law, "balanced", 0.0025)
    assert coarse < 1e-4
    assert fine < coarse / 3.5


def test_a_disk_without_friction_moves_as_the_equations_say():
    coarse, fine = disk_error("free", "balanced", 0.005), disk_error("free", "balanced", 0.0025)
    assert coarse < 1e-5
    assert fine < coarse / 3.5


@pytest.mark.exhaustive
@pytest.mark.parametrize("law", MU)
def test_a_tilted_disk_moves_precisely(law):
    assert disk_error(law, "precise", 0.005, 0.05) < 1e-9


@pytest.mark.parametrize(("steps", "bound"), [(250, 8e-5), (500, 2e-5)])
@pytest.mark.parametrize("on", ["side", "ball", "rim"])
def test_a_ball_and_a_cylinder_part_as_a_ball_leaves_a_ball(on, steps, bound):
    """A ball slides off the side or rim of a fixed cylinder, or a cylinder on its side off a ball: of second order."""
    true, corner = BallOnBall(), np.zeros(3)
    time, top = true.leaving[0] + 0.3, true.radius * np.array([math.sin(true.start), math.cos(true.start), 0])
    small = true.radius - 1.0
    if on == "side":
        bodies = [physics.Cylinder(1.0, 1.0, fixed=True, quat=ALONG_Z), physics.Sphere(small, 0.7, pos=top)]
    elif on == "ball":
        bodies = [physics.Sphere(1.0, fixed=True), physics.Cylinder(small, 1.0, 0.7, pos=top, quat=ALONG_Z)]
    else:
        corner = np.array([2.0, 0.5, 0.0])
        bodies = [physics.Cylinder(2.0, 1.0, fixed=True), physics.Sphere(true.radius, 0.7, pos=corner + top)]
    world = world_of(*bodies, walls=(), laws=[physics.Gravity((0, -GRAVITY, 0)), physics.Contact()], dt=time / steps)
    world.step(steps=steps)
    np.testing.assert_allclose(world.pos[0, 1] - corner, [*true.place_after_leaving(0.3), 0], atol=bound)


def on_turning_cylinder(dt: float) -> tuple[float, float]:
    """Errors of place [m] and velocity [m/s] of a ball that slides without friction on a roller that turns about y.

    The axis a of the roller turns at Ω: a = (cos Ω t, 0, -sin Ω t). With s = x·a, the distance φ of the ball's centre x
    from the axis stays R, its direction is n = (x - s a)/R, and φ² = x·x - s². So its acceleration g + λ n has
    R λ = -(x'·x' + x·g - s'² - s s''), where s'' without λ is g·a + 2 x'·a' + x·a'' because n·a = 0.
    """
    rate, far, time, g = 1.5, 0.7, 0.3, np.array([0.0, -GRAVITY, 0.0])
    start = np.array([0.2, far * math.cos(0.2), far * math.sin(0.2)])

    def move(t, y):
        x, v = y[:3], y[3:]
        a = np.array([math.cos(rate * t), 0.0, -math.sin(rate * t)])
        turn, bend = rate * np.array([a[2], 0.0, -a[0]]), -rate * rate * a
        s, change = x @ a, v @ a + x @ turn
        force = -(v @ v + x @ g - change**2 - s * (g @ a + 2 * v @ turn + x @ bend)) / far
        return np.concatenate((v, g + force * (x - s * a) / far))

    along = np.array([0.0, math.cos(0.2), math.sin(0.2)])
    speed = rate * np.cross((0, 1, 0), start) @ along * along  # that of the roller along the normal
    true = solve_ivp(move, (0, time), [*start, *speed], method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    roller = physics.Cylinder(
        0.5, 4.0, fixed=True, quat=(0.5**0.5, 0, 0, -(0.5**0.5)), motion=physics.Motion(spin=(0, rate, 0))
    )
    ball = physics.Sphere(0.2, 1.0, pos=start, linvel=speed)
    world = world_of(roller, ball, walls=(), laws=[physics.Gravity(g), physics.Contact()], dt=dt)
    world.step(steps=round(time / dt))
    errors = world.pos[0, 1] - true[:3], world.linvel[0, 1] - true[3:]
    return tuple(float(np.abs(error).max()) for error in errors)


def test_a_ball_slides_on_a_cylinder_that_turns_under_it():
    """The error is of second order in the step."""
    coarse, fine = on_turning_cylinder(0.005), on_turning_cylinder(0.0025)
    assert max(coarse) < 1e-4
    assert fine[0] < coarse[0] / 3.5
    assert fine[1] < coarse[1] / 3.5


# --- rest and energy -------------------------------------------------------------------------------------------------


def test_a_cylinder_that_falls_comes_to_rest_on_its_side_or_face():
    for quat, height in (((1, 0, 0, 0), 0.15), ((0.8, 0, 0, 0.6), None), (ALONG_Z, 0.1)):
        world = world_of(physics.Cylinder(0.1, 0.3, 1.0, pos=(0, 0.4, 0), quat=quat))
        world.step(steps=300)
        at = world.pos[0, 0, 1]
        assert min(abs(at - h) for h in ([height] if height else (0.1, 0.15))) < 1e-5
        assert height is None or np.abs(world.linvel).max() < 1e-5


def test_a_spinning_coin_is_slowed_by_friction_at_its_rim():
    """The ring of points carries the load: the torque is μ m g r, so that ω' = -2 μ g/r.

    Friction opposes the slip at the end of the step, ω h/2 = 0.01 rad after its middle: it is less by 5e-5 of it.
    """
    coin = physics.Cylinder(0.0125, 0.002, 0.005, pos=(0, 0.001, 0), angvel=(0, 20, 0))
    world = world_of(coin, laws=effects(0.2), dt=0.001)
    world.step(steps=30)
    lost = 2 * 0.2 * G * 0.03 / 0.0125
    assert 20 - world.angvel[0, 0, 1] == pytest.approx(lost, rel=1e-4)


@pytest.mark.exhaustive
@pytest.mark.compiled
@pytest.mark.parametrize("preset", ["precise", "reference"])
def test_a_coin_spins_down_precisely(preset):
    """As above, with steps of 10 ms: ω' = -2 μ g/r, until it rests.

    A part may err by `ERROR_PER_TOLERANCE` tolerances of the speed, r ω + √(r g). The errors of smooth parts fall with
    their third power; three parts of that size are allowed for.
    """
    r, mu, spin = 0.0125, 0.2, 20.0
    tolerance = max(physics.PRESETS[preset].tolerance, MIN_SOLVER_TOLERANCE)
    near = 3 * ERROR_PER_TOLERANCE * tolerance * (spin + math.sqrt(G / r))
    slowing = 2 * mu * G / r
    world = world_of(
        physics.Cylinder(r, 0.002, 0.005, pos=(0, 0.001, 0), angvel=(0, spin, 0)),
        laws=effects(mu),
        dt=0.01,
        accuracy=preset,
    )
    world.step(steps=3)
    assert world.angvel[0, 0, 1] == pytest.approx(spin - slowing * world.time, abs=near)
    world.step(steps=7)
    turned = 2 * math.atan2(world.quat[0, 0, 2], world.quat[0, 0, 0])
    assert turned == pytest.approx(spin**2 / (2 * slowing), abs=near * spin / slowing)
    assert np.abs(world.angvel).max() < near * 1e-3


@pytest.mark.parametrize("preset", ["fast", "balanced"])
def test_a_coin_that_falls_from_its_edge_never_gains_energy(preset):
    lean = 1.27
    quat = (math.cos(lean / 2), math.sin(lean / 2), 0, 0)
    place = (0, 0.0125 * math.sin(lean) + 0.001 * math.cos(lean), 0)
    coin = physics.Cylinder(0.0125, 0.002, 0.005, pos=place, quat=quat, angvel=(0, 12, 0))
    world, energies = world_of(coin, laws=effects(0.2), accuracy=preset), []
    for _ in range(60):
        world.step()
        energies.append(physics.diagnose(world).energy[0, 0])
    assert max(np.diff(energies)) < 1e-4 * energies[0]
    assert energies[-1] < 0.3 * energies[0]


# --- queries and files -----------------------------------------------------------------------------------------------


def distance_by_search(point, r, half) -> float:
    """Signed distance of a point from a cylinder along y, from its profile in the plane of the axis."""
    side, end = math.hypot(point[0], point[2]) - r, abs(point[1]) - half
    return math.hypot(max(side, 0), max(end, 0)) + min(max(side, end), 0)


@given(seed=st.integers(0, 2**32 - 1))
def test_the_nearest_point_is_at_the_distance_of_the_profile(seed):
    rng = np.random.default_rng(seed)
    r, height, q = rng.uniform(0.1, 1), rng.uniform(0.1, 2), rng.normal(size=4)
    body = physics.Cylinder(r, height, 1.0, pos=rng.uniform(-1, 1, 3), quat=q / np.linalg.norm(q))
    world, x = world_of(body, walls=()), rng.uniform(-2, 2, 3)
    found = world.nearest_to(None, x)
    local = rotation_matrices(np.array(body.quat)).T @ (x - body.pos)
    assert found.gap[0, 0] == pytest.approx(distance_by_search(local, r, height / 2), abs=1e-13)
    assert found.point[0, 0] == pytest.approx(found.other_point[0, 0] + found.gap[0, 0] * found.normal[0, 0], abs=1e-13)
    assert world.nearest_to(physics.Sphere(0.2, 1.0), x).gap[0, 0] == pytest.approx(found.gap[0, 0] - 0.2, abs=1e-13)


@given(seed=st.integers(0, 2**32 - 1))
def test_a_ray_ends_on_the_surface(seed):
    rng = np.random.default_rng(seed)
    r, height, q = rng.uniform(0.1, 1), rng.uniform(0.1, 2), rng.normal(size=4)
    body = physics.Cylinder(r, height, 1.0, pos=rng.uniform(-1, 1, 3), quat=q / np.linalg.norm(q))
    world, origin = world_of(body, walls=()), rng.uniform(-4, 4, 3)
    way = body.pos + 0.3 * rng.uniform(-1, 1, 3) * min(r, height) - origin
    hit = world.cast_rays(origin, way)
    end = origin + hit.distance[0, 0] * way / np.linalg.norm(way)
    R = rotation_matrices(np.array(body.quat))
    local, normal = R.T @ (end - body.pos), R.T @ hit.normal[0, 0]
    assert distance_by_search(local, r, height / 2) == pytest.approx(0, abs=1e-12)
    ahead = distance_by_search(local + 1e-6 * normal, r, height / 2)
    assert ahead == pytest.approx(1e-6, abs=1e-11)


def scene_of(*bodies, **given):
    return physics.Scene(bodies, [FLOOR], effects(), **given)


def test_scene_files_keep_a_cylinder(tmp_path):
    body = physics.Cylinder(0.3, 0.8, 2.0, pos=(1, 2, 3), quat=(0.8, 0, 0, 0.6), name="can")
    scene = scene_of(body)
    physics.save_scene(scene, tmp_path / "can.toml")
    assert physics.load_scene(tmp_path / "can.toml").bodies == scene.bodies


@pytest.mark.parametrize("is_fixed", [False, True])
def test_mjcf_keeps_a_cylinder(is_fixed):
    body = physics.Cylinder(
        0.3, 0.8, None if is_fixed else 2.0, pos=(1, 2, 3), quat=(0.8, 0, 0, 0.6), name="can", fixed=is_fixed
    )
    other = physics.Sphere(0.1, 1.0, pos=(0, 1, 0), name="ball")
    effects_ = [physics.Gravity((0, -G, 0)), physics.Contact(between_bodies=False), physics.Friction(0.5)]
    text = to_mjcf(physics.Scene([body, other] if is_fixed else [body], [FLOOR], effects_))
    found = from_mjcf(text).bodies[0]
    assert (found.kind, found.fixed) == ("cylinder", is_fixed)
    assert found.dimensions == pytest.approx(body.dimensions, rel=1e-12)
    assert rotation_matrices(np.array(found.quat)) == pytest.approx(rotation_matrices(np.array(body.quat)), abs=1e-12)
    assert is_fixed or found.inertia == pytest.approx(body.inertia, rel=1e-12)


def test_a_cylinder_in_a_compound_moves_as_the_cylinder():
    start = {"pos": (0, 0.3, 0), "quat": (0.9, 0, 0, math.sqrt(0.19)), "angvel": (1, 2, 3)}
    alone = world_of(physics.Cylinder(0.1, 0.3, 1.0, **start))
    whole = world_of(physics.Compound([physics.Cylinder(0.1, 0.3, 1.0)], **start))
    for world in (alone, whole):
        world.step(steps=20)  # one impact, then some rolling
    assert whole.pos == pytest.approx(alone.pos, abs=1e-5)


# --- what it refuses -------------------------------------------------------------------------------------------------


def test_groups_keep_a_cylinder_apart_from_bodies():
    """The ball and the block touch each other, and the cylinder passes through both."""
    can = physics.Cylinder(0.1, 0.2, 1.0, pos=(0, 0.4, 0), group=2, mask=4)
    floor = physics.HalfSpace((0, 1, 0), group=4)
    bodies = [can, physics.Sphere(0.1, 1.0, pos=(0, 0.7, 0)), physics.Block((1, 0.2, 1), 1.0, pos=(0, 0.1, 0))]
    world = physics.World(physics.Scene(bodies, [floor], effects()), dt=0.01)
    world.step(steps=100)
    assert world.pos[0, :, 1] == pytest.approx([0.1, 0.3, 0.1], abs=1e-4)


def test_queries_refuse_a_cylinder_beside_other_shapes_by_name():
    effects_ = [physics.Gravity((0, -G, 0)), physics.Contact(between_bodies=False)]
    bodies = [physics.Cylinder(0.1, 0.3, 1.0, pos=(0, 3, 0)), physics.Block((1, 1, 1), 1.0, pos=(3, 1, 0))]
    world = physics.World(physics.Scene(bodies, [FLOOR], effects_), dt=0.01)
    with pytest.raises(ValueError, match="one of them a cylinder; allowed with it are spheres"):
        world.measure_distances(0, 1)
    with pytest.raises(ValueError, match=r"Scene\.bodies holds a cylinder; allowed with it are spheres"):
        world.nearest_to(physics.Block((1, 1, 1), 1.0), (0, 1, 0))
    with pytest.raises(ValueError, match="allowed are all convex shapes but cylinders"):
        world.nearest_to(physics.Cylinder(0.1, 0.3, 1.0), (0, 1, 0))


def test_sizes_of_a_cylinder_have_two_equal_diameters():
    world = world_of(physics.Cylinder(0.1, 0.3, 1.0, pos=(0, 1, 0)))
    world.set_parameters(size=(0.4, 0.1, 0.4))
    with pytest.raises(ValueError, match="for a cylinder; allowed are diameter, height, the diameter again"):
        world.set_parameters(size=(0.4, 0.1, 0.3))
