"""Capsules: mass, motion against closed forms, rest, energy, queries, files, and what they refuse."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

import physics
from physics.io.mjcf.files import from_mjcf
from physics.io.mjcf.writer import to_mjcf
from physics.work_precision.errors import deepest_penetration
from tests.reference.capsules import (
    Rocking,
    Tipping,
    axis_as_polyhedron,
    axis_of,
    gap_of_block,
    gap_of_capsule,
    gap_of_ellipsoid,
)
from tests.reference.edges import GRAVITY, BallOnBall
from tests.reference.polyhedra_distance import posed, separation

pytestmark = pytest.mark.interpreted

G = 9.81
FLOOR = physics.HalfSpace((0, 1, 0))
PULL = physics.Gravity((0, -G, 0))
ALONG_X = (0.5**0.5, 0, 0, -(0.5**0.5))  # body y along world x
ALONG_Z = (0.5**0.5, 0.5**0.5, 0, 0)

# Coordinates of up to 5 m; a nearest point is found by some tens of operations on them.
EXACT = 1e-13

seeds = st.integers(0, 2**32 - 1)


def effects(mu: float = 0.5, restitution: float | None = None) -> list:
    return [PULL, physics.Contact(restitution=restitution), physics.Friction(mu)]


def world_of(*bodies, walls=(), laws=None, dt=0.005, accuracy="balanced"):
    return physics.World(physics.Scene(bodies, walls, effects() if laws is None else laws), dt=dt, accuracy=accuracy)


def drawn_pose(rng, reach=1.5):
    q = rng.normal(size=4)
    return {"pos": rng.uniform(-reach, reach, 3), "quat": q / np.linalg.norm(q)}


def drawn_capsule(rng, **given):
    return physics.Capsule(rng.uniform(0.05, 0.4), rng.uniform(0.1, 2.0), 1.0, **drawn_pose(rng), **given)


# --- mass ------------------------------------------------------------------------------------------------------------


@given(r=st.floats(0.01, 10), length=st.floats(0.01, 10))
def test_volume_and_inertia_are_those_of_a_pile_of_disks(r, length):
    """A disk at height y of radius p has M p²/2 about the axis and M (p²/4 + y²) across it; density 1.

    The integrands are polynomials in each part, which the quadrature of 21 points integrates to rounding.
    """
    half = 0.5 * length

    def integral(f):
        cap = quad(lambda z: f(r * r - z * z, half + z), 0, r, epsabs=0, epsrel=1e-13)[0]
        return 2 * (cap + quad(lambda y: f(r * r, y), 0, half, epsabs=0, epsrel=1e-13)[0])

    body = physics.Capsule(r, length, density=1.0)
    along = integral(lambda p, y: math.pi * p * p / 2)
    across = integral(lambda p, y: math.pi * p * (p / 4 + y * y))
    assert body.volume == pytest.approx(integral(lambda p, y: math.pi * p), rel=1e-12)
    assert body.inertia == pytest.approx(np.diag([across, along, across]), rel=1e-12)


def test_a_short_capsule_is_nearly_a_sphere_and_a_thin_one_a_rod():
    assert physics.Capsule(0.3, 1e-12, 2.0).inertia == pytest.approx(physics.Sphere(0.3, 2.0).inertia, rel=1e-11)
    thin = physics.Capsule(1e-9, 3.0, 2.0).inertia
    assert thin[0, 0] == pytest.approx(2.0 * 3.0**2 / 12, rel=1e-8)


# --- motion ----------------------------------------------------------------------------------------------------------


def rolled(preset: str, dt: float, support: str) -> float:
    """Error of the place of a capsule that has rolled down a slope for 0.5 s [m]."""
    slope, r, time = 0.3, 0.1, 0.5
    up, down = np.array([math.sin(slope), math.cos(slope), 0]), np.array([math.cos(slope), -math.sin(slope), 0])
    capsule = physics.Capsule(r, 0.6, 1.0, pos=r * up, quat=ALONG_Z)
    if support == "wall":
        world = world_of(capsule, walls=[physics.HalfSpace(up)], dt=dt, accuracy=preset)
    else:
        quat = (math.cos(slope / 2), 0, 0, -math.sin(slope / 2))
        table = physics.Block((8, 1, 8), fixed=True, pos=-0.5 * up, quat=quat)
        world = world_of(capsule, table, dt=dt, accuracy=preset)
    world.step(steps=round(time / dt))
    acceleration = G * math.sin(slope) / (1 + capsule.inertia[1, 1] / (capsule.mass * r * r))
    return float(np.abs(world.pos[0, 0] - capsule.pos - 0.5 * acceleration * time**2 * down).max())


@pytest.mark.parametrize("support", ["wall", "block"])
def test_a_capsule_rolls_down_a_slope(support):
    """Forces are constant, so that the midpoint rule is exact: the solver's tolerance is left, 1e-9 of g T²/2."""
    assert rolled("balanced", 0.005, support) < 2e-9
    assert rolled("balanced", 0.01, support) < 2e-9


@pytest.mark.exhaustive
@pytest.mark.parametrize("support", ["wall", "block"])
def test_a_capsule_rolls_down_a_slope_precisely(support):
    assert rolled("precise", 0.005, support) < 1e-9


def tipped(preset: str, dt: float, start: float = 0.1, time: float = 0.6) -> tuple[float, float]:
    """Errors of place [m] and angle [rad] of a capsule that tips over its rolling lower end."""
    r, half = 0.1, 0.3
    place = (half * math.sin(start), r + half * math.cos(start), 0)
    capsule = physics.Capsule(r, 2 * half, 1.0, pos=place, quat=(math.cos(start / 2), 0, 0, -math.sin(start / 2)))
    world = world_of(capsule, walls=[FLOOR], laws=effects(1.0), dt=dt, accuracy=preset)
    world.step(steps=round(time / dt))
    true, angle = Tipping(r, half, 1.0, capsule.inertia[0, 0], G).state(start, time)
    turn = -2 * math.atan2(world.quat[0, 0, 3], world.quat[0, 0, 0])
    return float(np.abs(world.pos[0, 0, :2] - true).max()), abs(turn - angle)


def test_a_capsule_tips_over():
    """The error is of second order in the step: 8.8e-6 m at 5 ms."""
    coarse, fine = tipped("balanced", 0.005), tipped("balanced", 0.0025)
    assert coarse[0] < 2e-5
    assert fine[0] < coarse[0] / 3.5


@pytest.mark.exhaustive
def test_a_capsule_tips_over_precisely():
    """Error control allows 1e-8 of the speed in each part."""
    assert max(tipped("precise", 0.01)) < 2e-7


def test_a_capsule_that_stands_upright_stays():
    """Nothing turns it: its weight passes through the contact, exactly."""
    world = world_of(physics.Capsule(0.1, 0.6, 1.0, pos=(0, 0.4, 0)), walls=[FLOOR])
    world.step(steps=200)
    assert world.pos[0, 0].tolist() == pytest.approx([0, 0.4, 0], abs=1e-6)
    assert not world.angvel.any()


def test_a_capsule_on_rails_loads_them_by_the_lever_rule():
    """It lies across two fixed capsules, its centre three times as far from one of them."""
    rails = [physics.Capsule(0.1, 1.0, fixed=True, pos=(x, 0, 0), quat=ALONG_Z) for x in (-0.1, 0.3)]
    world = world_of(physics.Capsule(0.05, 1.0, 2.0, pos=(0, 0.15, 0), quat=ALONG_X), *rails)
    world.step(steps=100)
    points, forces = world.contacts(0)
    order = np.argsort(points[:, 0])
    assert points[order] == pytest.approx(np.array([[-0.1, 0.1, 0], [0.3, 0.1, 0]]), abs=1e-6)
    assert forces[order, 1] == pytest.approx([0.75 * 2 * G, 0.25 * 2 * G], rel=1e-5)
    assert world.pos[0, 0] == pytest.approx((0, 0.15, 0), abs=1e-5)


def rocked(preset: str, dt: float, support: physics.Body, start: float = 0.3, time: float = 0.5) -> float:
    """Error of the place of a capsule that rocks across a fixed round body of radius 0.3 m [m]."""
    capsule = physics.Capsule(0.1, 1.0, 1.0)
    true = Rocking(0.3, 0.1, 1.0, capsule.inertia[0, 0], G)
    turn = -0.5 * (math.pi / 2 + start)
    capsule = replace(capsule, pos=(*true.place(start), 0), quat=(math.cos(turn), 0, 0, math.sin(turn)))
    world = world_of(support, capsule, laws=effects(1.0), dt=dt, accuracy=preset)
    world.step(steps=round(time / dt))
    place = true.place(true.angle(start, time))
    return float(np.abs(world.pos[0, 1] - (*place, 0)).max())


ROUND = [physics.Capsule(0.3, 1.0, fixed=True, quat=ALONG_Z), physics.Sphere(0.3, fixed=True)]


@pytest.mark.parametrize("support", ROUND, ids=["capsule", "sphere"])
def test_a_capsule_rocks_across_a_round_body(support):
    """The error is of second order in the step: 5.1e-6 m at 10 ms, 1.4e-6 m at 5 ms."""
    coarse, fine = rocked("balanced", 0.01, support), rocked("balanced", 0.005, support)
    assert coarse < 1e-5
    assert fine < coarse / 3.5


@pytest.mark.exhaustive
@pytest.mark.parametrize("support", ROUND, ids=["capsule", "sphere"])
def test_a_capsule_rocks_across_a_round_body_precisely(support):
    """Error control allows 1e-8 of the speed in each part."""
    assert rocked("precise", 0.01, support) < 1e-7


@pytest.mark.parametrize(("steps", "bound"), [(183, 1e-4), pytest.param(732, 5e-6, marks=pytest.mark.exhaustive)])
@pytest.mark.parametrize("shapes", ["capsule on capsule", "capsule on sphere", "sphere on capsule"])
def test_a_round_body_leaves_another_one(shapes, steps, bound):
    """As a ball leaves a ball (`test_fixed`), since axes across the motion change nothing."""
    true = BallOnBall()
    time, top = true.leaving[0] + 0.3, true.radius * np.array([math.sin(true.start), math.cos(true.start), 0])
    kinds = {"capsule": (physics.Capsule, {"length": 1.0, "quat": ALONG_Z}), "sphere": (physics.Sphere, {})}
    (one, own), (other, others) = (kinds[shape] for shape in shapes.split(" on "))
    falling = one(radius=true.radius - 1.0, mass=0.7, pos=top, **own)
    laws = [physics.Gravity((0, -GRAVITY, 0)), physics.Contact()]
    world = world_of(other(radius=1.0, fixed=True, **others), falling, laws=laws, dt=time / steps)
    world.step(steps=steps)
    np.testing.assert_allclose(world.pos[0, 1], [*true.place_after_leaving(0.3), 0], atol=bound)


def test_a_capsule_over_the_edge_of_a_table_stays_while_its_centre_is_above_it():
    table = physics.Block((2, 0.2, 2), fixed=True, pos=(0, -0.1, 0))
    for x, stays in ((0.95, True), (1.05, False)):
        world = world_of(physics.Capsule(0.1, 0.6, 1.0, pos=(x, 0.1, 0), quat=ALONG_X), table)
        world.step(steps=60)
        assert (abs(world.pos[0, 0] - (x, 0.1, 0)).max() < 1e-5) == stays
        if stays:  # both ends of the part on the table hold it up, by the lever rule
            points, forces = world.contacts(0)
            ends = np.argsort(points[:, 0])
            assert points[ends, 0] == pytest.approx([0.65, 1.0], abs=1e-5)
            assert forces[ends, 1] == pytest.approx([G / 7, 6 * G / 7], rel=1e-4)
        else:
            assert world.angvel[0, 0, 2] < -0.5


@pytest.mark.parametrize("seed", [0, 1])
def test_capsules_that_collide_keep_their_momenta_and_gain_no_energy(seed):
    """As of rocks (`test_hulls`): a solve with residual r is off by r of the energy.

    Impulses act in pairs, so that the momentum is kept to rounding: 60 steps of 1e-16 of all momenta.
    """
    rng = np.random.default_rng(seed)
    bodies = [
        physics.Capsule(
            rng.uniform(0.1, 0.2), rng.uniform(0.3, 0.9), 1.0, pos=place, quat=drawn_pose(rng)["quat"],
            linvel=-1.5 * np.array(place), angvel=rng.normal(size=3),
        )
        for place in ((-0.6, 0, 0), (0.6, 0.1, 0), (0, 0.7, 0.1), (0, -0.1, 0.7))
    ]  # fmt: skip
    world = world_of(*bodies, laws=[physics.Contact(restitution=0.6)], dt=0.01)
    start, met = physics.diagnose(world), 0
    energy = start.energy.sum()
    for _ in range(60):
        world.step()
        met += len(world.contact_ends())
        now = physics.diagnose(world).energy.sum()
        turn = 20 * world.report.penetration[0]
        assert now <= energy * (1 + 10 * max(1e-6, world.report.residual[0]) + turn)
        energy = now
    assert met > 0
    np.testing.assert_allclose(
        physics.diagnose(world).momentum.sum(axis=1), start.momentum.sum(axis=1), atol=60 * 1e-16 * 4
    )


@pytest.mark.exhaustive
def test_a_heap_of_capsules_gains_no_energy():
    """They slide over each other at 1.5 m/s while others press on them.

    A step may be off by 2e-5 of the energy that its loads and its motion have (`compliance.ENERGY_GAIN_TOLERANCE`).
    """
    quat = np.array([0.7, 0.1, 0.2, 0.6]) / 0.9**0.5
    heap = [
        physics.Capsule(0.1, 0.6, 1.0, pos=(0, 0.6, 0), quat=quat, angvel=(1, 2, 3)),
        physics.Capsule(0.05, 0.5, 1.0, pos=(0.05, 1.0, 0.03), quat=ALONG_X, angvel=(3, -2, 1)),
        physics.Capsule(0.1, 0.6, 1.0, pos=(0, 2.2, 0), quat=quat),
        physics.Block((0.2, 0.3, 0.2), 1.0, pos=(0, 1.6, 0.05)),
    ]
    world = world_of(*heap, walls=[FLOOR])
    energy = physics.diagnose(world).energy.sum()
    for _ in range(400):
        world.step()
        now = physics.diagnose(world).energy.sum()
        assert now <= energy + 1e-4
        energy = now


# --- queries ---------------------------------------------------------------------------------------------------------


def check_points(found, row=0):
    p, q = found.point[0, row], found.other_point[0, row]
    assert p == pytest.approx(q + found.gap[0, row] * found.normal[0, row], abs=1e-12)


@settings(max_examples=60, deadline=None)
@given(seed=seeds)
def test_gaps_are_those_of_slow_references_in_either_order(seed):
    """Blocks and capsules by bounded least squares; where the axis is inside a block, by all features."""
    rng = np.random.default_rng(seed)
    one, other = drawn_capsule(rng), drawn_capsule(rng)
    block = physics.Block(rng.uniform(0.2, 2.0, 3), 1.0, **drawn_pose(rng, 0.5))
    found = world_of(one, block, other).measure_distances([0, 1, 0, 2], [1, 0, 2, 0])
    apart = separation(axis_as_polyhedron(one), posed(block, block.pos, block.quat))
    true = gap_of_block(one, block) if apart > 0 else apart - one.radius
    assert found.gap[0] == pytest.approx([true] * 2 + [gap_of_capsule(one, other)] * 2, abs=EXACT)
    assert found.normal[0, 0] == pytest.approx(-found.normal[0, 1])
    for row in range(4):
        check_points(found, row)


@settings(max_examples=60, deadline=None)
@given(seed=seeds)
def test_the_gap_to_an_ellipsoid_is_the_distance_from_its_axis(seed):
    rng = np.random.default_rng(seed)
    capsule = drawn_capsule(rng)
    ball = physics.Ellipsoid(rng.uniform(0.2, 1.0, 3), 1.0, **drawn_pose(rng))
    found = world_of(capsule, ball).measure_distances([0, 1], [1, 0])
    true = gap_of_ellipsoid(capsule, ball)
    if true > -capsule.radius:  # else the axis meets the ellipsoid, which the reference does not know
        assert found.gap[0] == pytest.approx([true] * 2, abs=1e-12)
    check_points(found)


def test_the_distance_to_a_wall_is_that_of_the_lower_end():
    tilted = physics.Capsule(0.1, 0.6, 1.0, pos=(0, 1, 0), quat=(math.cos(0.25), 0, 0, math.sin(0.25)))
    world = world_of(tilted, walls=[FLOOR])
    assert world.measure_distances(0, -1).gap[0, 0] == pytest.approx(0.9 - 0.3 * math.cos(0.5), abs=EXACT)
    flat = replace(tilted, pos=(0, 0.05, 0), quat=ALONG_X)
    path = np.array(flat.pos)[None, None], np.array(flat.quat)[None, None]
    assert deepest_penetration(physics.Scene(flat, FLOOR, effects()), *path) == pytest.approx(0.05)


@settings(max_examples=100, deadline=None)
@given(seed=seeds, is_inside=st.booleans())
def test_a_ray_meets_the_surface_where_it_enters_or_leaves(seed, is_inside):
    rng = np.random.default_rng(seed)
    capsule = drawn_capsule(rng)
    x, u = axis_of(capsule)
    world = world_of(capsule)
    target = x + rng.uniform(-1, 1) * u + rng.uniform(-0.6, 0.6, 3) * capsule.radius / 3**0.5
    direction = rng.normal(size=3)
    direction /= np.linalg.norm(direction)
    origin = target if is_inside else target - 6.0 * direction
    hits = world.cast_rays(origin, direction)
    point = origin + hits.distance[0, 0] * direction
    away = point - x - np.clip((point - x) @ u / (u @ u), -1, 1) * u
    assert np.linalg.norm(away) == pytest.approx(capsule.radius, abs=EXACT)
    assert hits.normal[0, 0] == pytest.approx(away / np.linalg.norm(away), abs=1e-11)
    assert (hits.normal[0, 0] @ direction > 0) == is_inside
    missing = world.cast_rays(origin, -direction) if not is_inside else hits
    assert np.isinf(missing.distance).all() != is_inside


@pytest.mark.parametrize("direction", [(0, -1, 0), (1, 0, 0), (0, 0, 1)])
def test_rays_along_the_axis_and_across_it(direction):
    world = world_of(physics.Capsule(0.5, 2.0, 1.0))
    origin = -9.0 * np.array(direction)
    reach = 1.5 if direction[1] else 0.5
    assert world.cast_rays(origin, direction).distance[0, 0] == pytest.approx(9 - reach, abs=EXACT)
    aside = np.array([0, 0, 0.6] if direction[2] == 0 else [0.6, 0, 0])
    assert np.isinf(world.cast_rays(origin + aside, direction).distance).all()


def test_a_capsule_is_a_shape_for_queries_of_a_scene_without_one():
    world = world_of(physics.Sphere(1.0, 1.0), walls=[physics.HalfSpace((0, 1, 0), -3.0)])
    probe = physics.Capsule(0.25, 2.0, 1.0)
    found = world.nearest_to(probe, [(2, 0, 0), (0, 3, 0), (0, -2, 5)])
    assert found.gap[0] == pytest.approx([0.75, 0.75, -0.25], abs=EXACT)
    assert found.other[0].tolist() == [0, 0, -1]
    assert world.overlaps(probe, [(1.2, 0, 0), (1.3, 0, 0)])[0].tolist() == [True, False]


# --- sizes, files ----------------------------------------------------------------------------------------------------


def test_a_world_changes_the_size():
    world = physics.World(physics.Scene(physics.Capsule(0.1, 0.6, 1.0, pos=(0, 2, 0)), [FLOOR], effects()), worlds=2)
    world.set_parameters(size=[(0.2, 0.8, 0.2), (0.6, 1.6, 0.6)])
    inertia = physics.Capsule(0.3, 1.0, 1.0).inertia
    moments = 1.0 / world.params[1, 1:4]
    assert moments == pytest.approx(np.diag(inertia))
    with pytest.raises(ValueError, match=r"size is \[0.2, 0.8, 0.3\] for a capsule; allowed are diameter, a larger"):
        world.set_parameters(size=(0.2, 0.8, 0.3))
    with pytest.raises(ValueError, match="for a capsule"):
        world.set_parameters(size=(0.2, 0.2, 0.2))
    assert 1.0 / world.params[1, 1:4] == pytest.approx(np.diag(inertia))


def files_scene() -> physics.Scene:
    start = {"pos": (1, 2, 3), "quat": (0.5, -0.5, 0.5, 0.5), "linvel": (1, 0, 2), "angvel": (3, -1, 0.5)}
    free = physics.Capsule(0.1, 0.6, 2.5, name="rod", **start)
    uneven = physics.Capsule(0.2, 0.5, 1.0, pos=(5, 5, 5), inertia_body=(1, 2, 2.5))
    still = physics.Capsule(0.3, 1.5, fixed=True, pos=(0, -1, 0), quat=ALONG_X)
    return physics.Scene([free, uneven, still], [FLOOR], [physics.Gravity(), physics.Contact(), physics.Friction(0.5)])


def test_a_scene_file_keeps_capsules(tmp_path):
    scene = files_scene()
    physics.save_scene(scene, tmp_path / "scene.toml")
    assert physics.load_scene(tmp_path / "scene.toml") == scene


@pytest.mark.parametrize("reader", ["compiled", "plain"])
def test_mjcf_keeps_capsules(reader, request):
    """MuJoCo's axis is z of the geom; a turn there and back rounds."""
    if reader == "plain":
        request.getfixturevalue("without_mujoco")
    else:
        pytest.importorskip("mujoco")
    scene = files_scene()
    read = from_mjcf(to_mjcf(scene))
    for ours, theirs in zip(scene.bodies, read.bodies, strict=True):
        assert (theirs.kind, theirs.name, theirs.fixed) == (ours.kind, ours.name, ours.fixed)
        for field in ("radius", "length", "pos", "quat", "linvel", "angvel"):
            assert getattr(theirs, field) == pytest.approx(getattr(ours, field), abs=1e-15), field
        if not ours.fixed:
            assert theirs.inertia == pytest.approx(ours.inertia, rel=1e-12, abs=1e-14)
    assert read.bodies[0].inertia_body is None


@pytest.mark.parametrize("reader", ["compiled", "plain"])
def test_mjcf_written_elsewhere_has_its_capsule_along_z(reader, request):
    if reader == "plain":
        request.getfixturevalue("without_mujoco")
    else:
        pytest.importorskip("mujoco")
    (body,) = from_mjcf("""<mujoco><worldbody><body pos="0 0 1"><freejoint/>
      <geom type="capsule" size=".1 .3" density="500"/></body></worldbody></mujoco>""").bodies
    own = physics.Capsule(0.1, 0.6, density=500.0)
    assert (body.radius, body.length, body.mass) == pytest.approx((0.1, 0.6, own.mass), rel=1e-12)
    assert axis_of(body)[1] == pytest.approx((0, 0, 0.3), abs=1e-15)
    assert body.inertia == pytest.approx(own.inertia, rel=1e-9)


def test_mjcf_reads_the_ends_of_a_capsule():
    pytest.importorskip("mujoco")
    (body,) = from_mjcf("""<mujoco><worldbody><body><freejoint/>
      <geom type="capsule" size=".1" fromto="0 0 0 3 4 0"/></body></worldbody></mujoco>""").bodies
    assert (body.radius, body.length) == pytest.approx((0.1, 5.0))
    assert body.pos == pytest.approx((1.5, 2, 0))
    assert abs(axis_of(body)[1]) == pytest.approx((1.5, 2, 0), abs=1e-12)


def test_a_trajectory_file_keeps_capsules(tmp_path):
    path = physics.simulate(physics.Scene(physics.Capsule(0.1, 0.6, 1.0)), 0.02, dt=0.01)
    path.to_npz(tmp_path / "path.npz")
    (body,) = physics.Trajectory.from_npz(tmp_path / "path.npz").scene.bodies
    assert body.kind == "capsule"
    assert (body.radius, body.length) == pytest.approx((0.1, 0.6), abs=1e-15)


# --- refusals --------------------------------------------------------------------------------------------------------


def test_effects_that_capsules_cannot_have_are_refused_by_name():
    capsule = physics.Capsule(0.1, 0.6, 1.0)
    with pytest.raises(ValueError, match=r"holds Magnus, and Scene.bodies\[0\] is a capsule"):
        physics.Scene(capsule, effects=physics.Magnus())


def test_a_plan_says_what_capsules_need():
    plan = physics.make_plan(physics.Scene(physics.Capsule(0.1, 0.6, 1.0), [FLOOR], effects()), "balanced")
    assert plan.capsules is True
    assert "ends of capsules" in plan.explain()
    assert physics.make_plan(physics.Scene(physics.Sphere(0.1, 1.0), [FLOOR], effects()), "balanced").capsules is None
