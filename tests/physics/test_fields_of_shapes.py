"""Drag, wind and buoyancy of hulls, capsules, cylinders and compounds: shadows, displaced volumes, motions."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.spatial import ConvexHull

import physics
from physics.analysis.diagnostics import look_at
from physics.rotations import rotation_matrices
from tests.tiers.sweep import sweep

pytestmark = pytest.mark.interpreted

R, L = 0.3, 1.0
BOX = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.3, 0.3) for z in (-0.2, 0.2)]
POINTS = np.random.default_rng(5).normal(size=(12, 3)) * (0.5, 0.3, 0.2)
LYING = (math.sqrt(0.5), 0, 0, math.sqrt(0.5))
WATER = physics.Buoyancy(1000.0, gravity=10.0)
LIFT = 1e4  # ρ g [N/m³]


def turned(rng):
    quat = rng.normal(size=4)
    return tuple((quat / np.linalg.norm(quat)).tolist())


def load(body, *effects):
    """(force and torque (6,), potential energy [J]) of fields on a body."""
    wrenches, energies = look_at(physics.World(physics.Scene([body], effects=effects)))
    return wrenches[0], energies[0]


def shadow(points, u):
    """Area of the shadow of the convex hull of points (n, 3) along u."""
    across = np.linalg.svd(u[None] / np.linalg.norm(u))[2][1:]
    return ConvexHull(points @ across.T).volume


def surface(shape, count=400):
    """Points on the rims of a cylinder, or on a capsule, along y."""
    angles = np.linspace(0, 2 * np.pi, count, endpoint=False)
    ring = np.stack([np.cos(angles), 0 * angles, np.sin(angles)], axis=1)
    if shape is physics.Cylinder:
        return np.concatenate([R * ring + (0, y, 0) for y in (-L / 2, L / 2)])
    tilts = np.linspace(0, np.pi / 2, count // 4)
    caps = [R * (math.cos(t) * ring + (0, math.sin(t), 0)) + (0, L / 2, 0) for t in tilts]
    return np.concatenate([*caps, *[each * (1, -1, 1) for each in caps]])


@pytest.mark.parametrize("shape", [physics.Hull, physics.Cylinder, physics.Capsule])
def test_drag_is_that_of_the_shadow(shape):
    """F = -½ ρ C A |u| u. The polygons of 400 points fall short of a circle by (π/400)²/1.5 = 4e-5 of its area, and
    of a capsule by as much along two axes."""
    rng = np.random.default_rng(1)
    for _ in range(4):
        quat, v = turned(rng), rng.normal(size=3)
        start = {"quat": quat, "linvel": tuple(v)}
        body = physics.Hull(POINTS, 2.0, **start) if shape is physics.Hull else shape(R, L, 2.0, **start)
        points = body.polyhedron.vertices if shape is physics.Hull else surface(shape)
        area = shadow(points @ rotation_matrices(np.array(quat)).T, v)
        found = load(body, physics.Drag(1.5, 2.0))[0]
        exact = 1e-12 if shape is physics.Hull else 2e-4
        assert found[:3] == pytest.approx(-1.5 * area * np.linalg.norm(v) * v, rel=exact)
        assert found[3:] == pytest.approx([0, 0, 0], abs=1e-12)


FIELDS = [(physics.Drag(0.5, 1.2, 0.3),), (physics.Drag(0.5), physics.Wind((3, 1, 0))), (WATER,)]


@pytest.mark.parametrize("effects", FIELDS)
@pytest.mark.parametrize("make", [lambda s: physics.Hull(BOX, 2.0, **s), lambda s: physics.Compound(PART, **s)])
def test_a_box_has_the_loads_of_a_block(make, effects):
    start = {"quat": turned(np.random.default_rng(2)), "pos": (0.1, 0.1, 0), "linvel": (1, 2, 3), "angvel": (1, 0, 2)}
    found, expected = load(make(start), *effects), load(physics.Block((1, 0.6, 0.4), 2.0, **start), *effects)
    assert found[0] == pytest.approx(expected[0], rel=1e-12, abs=1e-11)
    assert found[1] == pytest.approx(expected[1], rel=1e-12)


PART = [physics.Block((1, 0.6, 0.4), 2.0)]


def segment(s):
    """Area of the part of a unit disk below a chord, `s` above its centre."""
    s = np.clip(s, -1, 1)
    return math.acos(-s) + s * math.sqrt(1 - s * s)


def wet_by_layers(shape, n_y, height):
    """Volume below the surface of a body with its axis at arccos(n_y) from the vertical, by `quad` over slices.

    It cuts at the kinks, and has an error of 1e-10 of its own.
    """
    flat = math.sqrt(1 - n_y * n_y)
    end = L / 2 + (R if shape is physics.Capsule else 0)

    def area(y):
        beyond = max(abs(y) - L / 2, 0.0)
        rho = math.sqrt(max(R * R - beyond * beyond, 0))
        return rho * rho * segment(-(n_y * y + height) / (rho * flat)) if rho > 0 else 0.0

    kinks = sorted({-end, -L / 2, L / 2, end, *np.linspace(-end, end, 40)})
    return sum(quad(area, a, b, epsabs=1e-13, limit=200)[0] for a, b in pairwise(kinks))


@pytest.mark.parametrize("shape", [physics.Cylinder, physics.Capsule])
@pytest.mark.parametrize("tilt", sweep([0.01, 0.4, 0.9, 1.4, 1.56], [0.4, 1.4]))
def test_a_tilted_round_body_displaces_its_wet_part(shape, tilt):
    for height in (-0.55, -0.2, 0.05, 0.31):
        quat = (math.cos(tilt / 2), 0, 0, math.sin(tilt / 2))
        force = load(shape(R, L, 1.0, quat=quat, pos=(0, height, 0)), WATER)[0]
        expected = wet_by_layers(shape, math.cos(tilt), height)
        assert force[1] / LIFT == pytest.approx(expected, abs=1e-9)


def test_upright_lying_and_drowned():
    """Closed forms: a disk times a depth, a segment times a length, and the whole body without a torque."""
    standing = load(physics.Cylinder(R, L, 1.0, pos=(0, 0.1, 0)), WATER)[0]
    assert standing == pytest.approx([0, LIFT * math.pi * R * R * (L / 2 - 0.1), 0, 0, 0, 0], abs=1e-9)
    lying = load(physics.Cylinder(R, L, 1.0, pos=(0, 0.1, 0), quat=LYING), WATER)[0]
    assert lying[1] == pytest.approx(LIFT * L * R * R * segment(-0.1 / R), rel=1e-12)
    cut = load(physics.Capsule(R, L, 1.0, pos=(0, L / 2 + 0.1, 0)), WATER)[0]  # a cap of the height R - 0.1
    assert cut[1] == pytest.approx(LIFT * math.pi * (R - 0.1) ** 2 * (3 * R - (R - 0.1)) / 3, rel=1e-12)
    rng = np.random.default_rng(3)
    for body in (physics.Cylinder(R, L, 1.0), physics.Capsule(R, L, 1.0), physics.Hull(POINTS, 1.0)):
        for depth, share in ((5.0, 1.0), (0.0, 0.5)):
            if share < 1 and body.kind == "hull":
                continue
            lost = type(body)(**{**vars_of(body), "quat": turned(rng), "pos": (0, -depth, 0)})
            force = load(lost, WATER)[0]
            assert force[:3] == pytest.approx([0, share * LIFT * body.volume, 0], rel=1e-12, abs=1e-9)
            assert share < 1 or force[3:] == pytest.approx([0, 0, 0], abs=1e-9 * LIFT * body.volume)


def vars_of(body):
    if body.kind == "hull":
        return {"points": POINTS, "mass": 1.0}
    return {"radius": R, "mass": 1.0, "length" if body.kind == "capsule" else "height": L}


def test_a_hull_displaces_what_is_below_the_surface():
    """Corners below, and the points where edges cross the surface, have a convex hull of the wet volume."""
    rng = np.random.default_rng(4)
    for height in (-0.2, 0.0, 0.15):
        quat = turned(rng)
        body = physics.Hull(POINTS, 1.0, quat=quat, pos=(0, height, 0))
        corners = body.polyhedron.vertices @ rotation_matrices(np.array(quat)).T + (0, height, 0)
        ends = corners[body.polyhedron.edges[:, :2]]
        crossing = ends[ends[:, 0, 1] * ends[:, 1, 1] < 0]
        s = crossing[:, 0, 1] / (crossing[:, 0, 1] - crossing[:, 1, 1])
        cut = crossing[:, 0] + s[:, None] * (crossing[:, 1] - crossing[:, 0])
        wet = ConvexHull(np.concatenate([corners[corners[:, 1] < 0], cut]))
        assert load(body, WATER)[0][1] == pytest.approx(LIFT * wet.volume, rel=1e-10)


def rolled(quat, axis, angle):
    """Quaternion of an attitude after a turn about a world axis."""
    s, v, q = math.cos(angle / 2), np.eye(3)[axis] * math.sin(angle / 2), np.array(quat)
    return tuple(np.array([s * q[0] - v @ q[1:], *(s * q[1:] + q[0] * v + np.cross(v, q[1:]))]).tolist())


TWO = [physics.Capsule(0.1, 0.4, 1.0, pos=(0.3, 0, 0), quat=LYING), physics.Hull(BOX, 1.0, pos=(-0.3, 0, 0))]
MAKES = [
    lambda s: physics.Cylinder(R, L, 1.0, **s),
    lambda s: physics.Capsule(R, L, 1.0, **s),
    lambda s: physics.Hull(POINTS, 1.0, **s),
    lambda s: physics.Compound(TWO, **s),
]


@pytest.mark.parametrize("make", MAKES)
def test_buoyancy_is_the_slope_of_its_energy(make):
    """Force and torque, by central differences of 1e-4: errors of (1e-4)² of the third derivative, and of kinks."""
    rng, step = np.random.default_rng(6), 1e-4

    def energy(quat, y):
        return load(make({"quat": quat, "pos": (0, y, 0)}), WATER)[1]

    for y in (-0.15, 0.1):
        quat = turned(rng)
        found = load(make({"quat": quat, "pos": (0, y, 0)}), WATER)[0]
        slope = -(energy(quat, y + step) - energy(quat, y - step)) / (2 * step)
        turns = [energy(rolled(quat, k, -step), y) - energy(rolled(quat, k, step), y) for k in range(3)]
        assert found[1] == pytest.approx(slope, rel=1e-5)
        assert found[3:] == pytest.approx(np.array(turns) / (2 * step), abs=1e-5 * LIFT * 0.1)


def test_a_capsule_falls_as_its_shadow_says():
    """Along its axis: v = v_t tanh(g t/v_t), v_t = √(2 m g/(ρ C π r²)); at `precise`, to its tolerance."""
    drag = physics.Drag(0.8, 20.0)
    body = physics.Capsule(R, L, 2.0)
    world = physics.World(physics.Scene([body], effects=[physics.Gravity(), drag]), dt=0.05, accuracy="precise")
    world.step(steps=10)
    terminal = math.sqrt(2 * 2.0 * 9.81 / (20 * 0.8 * math.pi * R * R))
    assert world.linvel[0, 0, 1] == pytest.approx(-terminal * math.tanh(9.81 * 0.5 / terminal), rel=1e-8)


def test_a_dumbbell_spins_down_by_the_drag_of_its_balls():
    """I ω' = -2 k l (ω l)², k = ½ ρ C π r²: ω = ω0/(1 + 2 k l³ ω0 t/I). The balls feel the air where they are."""
    r, arm = 0.1, 0.5
    body = physics.Compound([physics.Sphere(r, 1.0, pos=(x, 0, 0)) for x in (-arm, arm)], angvel=(0, 4, 0))
    world = physics.World(physics.Scene([body], effects=[physics.Drag(0.5, 50.0)]), dt=0.05, accuracy="precise")
    world.step(steps=20)
    k, inertia = 0.5 * 50 * 0.5 * math.pi * r * r, body.inertia[1, 1]
    assert world.angvel[0, 0, 1] == pytest.approx(4 / (1 + 2 * k * arm**3 * 4 / inertia), rel=1e-8)
    assert world.linvel[0, 0] == pytest.approx([0, 0, 0], abs=1e-12)


@pytest.mark.parametrize("preset", ["balanced", "precise"])
def test_a_floating_coin_bobs(preset):
    """A flat cylinder at half its height: heave by √(ρ g π r²/m) about it, linear while its rim is wet.

    `balanced` is leapfrog: its frequency is off by (ω dt)²/24, so its phase of 6 rad by 6 (ω dt)²/24 = 7e-5 here.
    """
    r, h, mass, dt = 0.5, 0.2, 1000 * math.pi * 0.25 * 0.2 / 2, 0.002
    body = physics.Cylinder(r, h, mass, pos=(0, 0.03, 0))
    gravity = physics.Gravity((0, -10.0, 0))
    world = physics.World(physics.Scene([body], effects=[gravity, WATER]), dt=dt, accuracy=preset)
    omega = math.sqrt(LIFT * math.pi * r * r / mass)
    world.step(steps=300)
    error = 0.03 * omega * 0.6 * (omega * dt) ** 2 / 24 if preset == "balanced" else 1e-9
    assert world.pos[0, 0, 1] == pytest.approx(0.03 * math.cos(omega * 0.6), abs=1.5 * error)


def test_stiff_fields_of_shapes_stay_bounded():
    """Drag that stops within a step, on a compound and a hull: it is slowed, never reversed beyond rounding."""
    for body in (physics.Hull(BOX, 0.01, linvel=(30, 0, 0)), physics.Compound(TWO, mass=0.01, linvel=(30, 0, 0))):
        world = physics.World(physics.Scene([body], effects=[physics.Drag(1.0, 100.0)]), dt=0.05)
        before = world.linvel[0, 0, 0]
        for _ in range(10):
            world.step()
            assert -1e-9 <= world.linvel[0, 0, 0] <= before
            before = world.linvel[0, 0, 0]


def test_a_world_may_change_the_numbers_but_not_the_shapes():
    body = physics.Capsule(R, L, 2.0, linvel=(1, 0, 0))
    world = physics.World(physics.Scene([body], effects=[physics.Drag(0.5)]), worlds=2)
    world.set_parameters(effects=[physics.Drag(1.0)], worlds=[1])
    first, second = look_at(world)[0][:, 0]
    assert second == pytest.approx(2 * first, rel=1e-14)


def test_magnus_is_refused_with_its_reason():
    with pytest.raises(ValueError, match=r"holds Magnus, and Scene.bodies\[0\] is a capsule; .* law is that of round"):
        physics.Scene([physics.Capsule(R, L, 2.0)], effects=[physics.Magnus()])
