"""Geometry behind the stage: rays, placements, springs, marks and triangles, each by its law."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import physics
from rigid_env.rendering import BodyView, Frame
from rigid_env.rendering.geometry import rotation_matrix
from rigid_env.rendering.meshes import body_mesh
from rigid_env.viewer.arrows import SHAFT, spring
from rigid_env.viewer.layers import Forces, torque_arc
from rigid_env.viewer.marks import field_marks, spring_ends
from rigid_env.viewer.scenery import place, turn_to_normal, vivid
from rigid_env.viewer.shapes import body_point, hit, leave, octants, parts, shape_key, world_point
from tests.viewer.looks import BLOCK, crowd, look_of

seeds = st.integers(0, 10_000)
numbers = st.floats(-50.0, 50.0)
points = arrays(float, 3, elements=numbers)


def one_body(seed: int, kind: int):
    return crowd(6, np.random.default_rng(seed))[kind]


def depth(body, point) -> float:
    """Distance from the faces of a body's mesh, and of a round body share from its surface; 0 on the surface."""
    local = body_point(body, point)
    if body.kind in ("sphere", "ellipsoid"):
        return float(np.linalg.norm(local / body.dimensions)) - 1.0
    if body.kind == "capsule":
        radius, half = body.dimensions[0], body.dimensions[1] - body.dimensions[0]
        return float(np.linalg.norm(local - (0.0, np.clip(local[1], -half, half), 0.0))) - radius
    if body.kind == "cylinder":
        return max(float(np.hypot(local[0], local[2])) - body.dimensions[0], abs(local[1]) - body.dimensions[1])
    mesh = body_mesh(body)
    return float((np.sum(mesh.normals * (local - mesh.vertices[mesh.faces[:, 0]]), axis=1)).max())


def compound(seed: int) -> BodyView:
    """Two of the shapes of `crowd` beside each other, and a body that holds both."""
    rng = np.random.default_rng(seed)
    one, other = rng.choice(6, 2)
    parts = [
        replace(body, pos=(x, 0.0, 0.0)) for body, x in zip(np.array(crowd(6, rng), object)[[one, other]], (-2, 2))
    ]
    return BodyView("compound", (4.0, 2.0, 2.0), (1.0, 2.0, 3.0), (0.6, 0.0, 0.8, 0.0), parts=parts)


@given(seeds, points)
def test_a_ray_meets_the_nearest_part_of_a_compound(seed, origin):
    body = compound(seed)
    way = body.solids[seed % 2].pos - origin
    found = [point for solid in body.solids if (point := hit(solid, origin, way)) is not None]
    nearest = min(found, key=lambda point: np.linalg.norm(point - origin))
    np.testing.assert_array_equal(hit(body, origin, way), nearest)


def test_an_arrow_starts_where_it_leaves_the_last_part_of_a_compound():
    body = compound(0)
    along = world_point(body, (1.0, 0.0, 0.0)) - body.pos
    np.testing.assert_allclose(leave(body, along), leave(body.solids[1], along), atol=1e-12)
    np.testing.assert_array_equal(leave(body, np.zeros(3)), body.pos)


@given(seeds, st.integers(0, 4), points)
def test_a_ray_at_the_middle_meets_the_surface_on_its_side(seed, kind, origin):
    body = one_body(seed, kind)
    point = hit(body, origin, body.pos - origin)
    assert abs(depth(body, point)) < 1e-6
    if depth(body, origin) > 0.0:
        assert (point - origin) @ (body.pos - point) > 0.0


@given(seeds, st.integers(0, 4), points)
def test_a_ray_that_starts_inside_leaves_through_the_surface(seed, kind, direction):
    body = one_body(seed, kind)
    point = leave(body, direction)
    if not np.any(direction):
        np.testing.assert_array_equal(point, body.pos)
    elif np.linalg.norm(direction) > 1e-6:
        assert abs(depth(body, point)) < 1e-6
        assert (point - body.pos) @ direction > 0.0


@given(seeds, st.integers(0, 4), points)
def test_a_ray_that_turns_its_back_misses(seed, kind, direction):
    body = one_body(seed, kind)
    if np.linalg.norm(direction) > 1e-3:
        away = direction / np.linalg.norm(direction)
        assert hit(body, body.pos + 3.0 * away, away) is None


@given(seeds, points)
def test_points_go_to_a_body_and_back(seed, point):
    body = one_body(seed, 0)
    np.testing.assert_allclose(world_point(body, body_point(body, point)), point, atol=1e-12)


@given(seeds, points)
def test_points_are_drawn_and_found_again(seed, point):
    placement = place(look_of(crowd(6, np.random.default_rng(seed))))
    np.testing.assert_allclose(placement.world(placement.drawn(point)), point, atol=1e-4)


def test_bounds_are_in_sight():
    lower, upper = np.array((-30.0, 0.0, -4.0)), np.array((50.0, 12.0, 4.0))
    near, far = place(look_of()), place(look_of(), (lower, upper))
    assert (far.room.lower <= lower).all()
    assert (far.room.upper >= upper).all()
    assert far.scale < near.scale


@given(points.filter(lambda n: np.linalg.norm(n) > 1e-3 and abs(n[0]) < 0.99 * np.linalg.norm(n)))
def test_a_turn_takes_y_to_a_normal(vector):
    normal = vector / np.linalg.norm(vector)
    quat = turn_to_normal(normal)
    matrix = rotation_matrix(quat)
    assert np.linalg.norm(quat) == pytest.approx(1.0)
    np.testing.assert_allclose(matrix[:, 1], normal, atol=1e-9)
    assert np.linalg.det(matrix) == pytest.approx(1.0)


@given(points, points)
def test_a_spring_goes_from_end_to_end(start, end):
    coil = spring(start, end, 1.0)
    if np.linalg.norm(end - start) == 0.0:
        assert len(coil) == 0
        return
    np.testing.assert_allclose(coil[0, 0], start, atol=1e-9)
    np.testing.assert_allclose(coil[-1, 1], end, atol=1e-9)
    np.testing.assert_array_equal(coil[1:, 0], coil[:-1, 1])


@pytest.mark.parametrize("torque", [(0.0, 9.0, 0.0), (3.0, -8.0, 5.0)])
def test_an_arc_goes_round_the_torque_as_a_right_hand_does(torque):
    arc = torque_arc(BLOCK, np.array(torque))
    arms = arc - BLOCK.pos
    turns = np.cross(arms[:-1], arms[1:])
    assert (turns @ torque > 0.0).all()
    np.testing.assert_allclose(arms @ torque, 0.0, atol=1e-9)
    assert np.linalg.norm(np.diff(arc, axis=0), axis=1).sum() == pytest.approx(np.linalg.norm(torque), rel=0.01)


def test_a_small_or_boundless_torque_has_no_arc():
    assert len(torque_arc(BLOCK, np.zeros(3))) == 0
    assert len(torque_arc(BLOCK, np.array((np.inf, 0.0, 0.0)))) == 0


def area(part) -> float:
    a, b, c = (part.vertices[part.faces[:, k]].astype(float) for k in range(3))
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()


def test_octants_are_halves_of_a_sphere():
    even, odd = octants()
    assert area(even) == pytest.approx(area(odd))
    assert area(even) + area(odd) == pytest.approx(4.0 * np.pi, rel=0.02)


@pytest.mark.parametrize("kind", [0, 3])
def test_a_rim_lies_on_its_body_and_all_faces_look_outwards(kind):
    body = one_body(1, kind)
    solid, rim = parts(shape_key(body))
    assert area(rim) < 0.2 * area(solid)
    for part in (solid, rim):
        a, b, c = (part.vertices[part.faces[:, k]].astype(float) for k in range(3))
        assert (np.sum(np.cross(b - a, c - a) * (a + b + c), axis=1) > 0.0).all()


def test_bodies_of_one_shape_have_one_key():
    bodies = crowd(12, np.random.default_rng(0))
    assert shape_key(bodies[0]) == shape_key(bodies[6])
    assert shape_key(bodies[1]) == shape_key(bodies[2])
    assert shape_key(bodies[3]) == shape_key(bodies[9])
    assert shape_key(bodies[4]) == shape_key(bodies[10])
    assert shape_key(bodies[5]) == shape_key(bodies[11]) != shape_key(bodies[4])
    assert shape_key(bodies[4]) != shape_key(replace(bodies[4], dimensions=(0.4, 2.0, 0.4)))
    assert shape_key(bodies[3]) != shape_key(replace(bodies[3], corners=2.0 * bodies[3].corners))


@given(arrays(np.uint8, 3))
def test_a_richer_colour_is_as_bright_and_no_paler(colour):
    rich = vivid(colour).astype(int)
    assert rich.max() == colour.max()
    assert (rich <= colour).all()
    assert np.ptp(rich) >= np.ptp(colour.astype(int))


def test_marks_name_the_fields_of_a_scene():
    block = physics.Block((1.0, 1.0, 1.0), 2.0, pos=(0.0, 5.0, 0.0))
    link = physics.Spring(anchor=(0.0, 9.0, 0.0), point=(0.5, 0.0, 0.0), stiffness=40.0)
    effects = [physics.Gravity(), physics.Drag(), physics.Wind((3.0, 4.0, 0.0)), physics.Buoyancy(offset=1.0), link]
    scene = physics.Scene([block], [], effects)
    wind, fluid, spring_mark = field_marks(scene)
    assert wind.label == "wind 5 m/s"
    assert fluid.surface == ((0.0, 1.0, 0.0), 1.0)
    body = replace(BLOCK, pos=(0.0, 5.0, 0.0), quat=(1.0, 0.0, 0.0, 0.0))
    start, end = spring_ends(spring_mark.spring, scene, [body])
    np.testing.assert_allclose(start, (0.5, 5.0, 0.0))
    np.testing.assert_allclose(end, (0.0, 9.0, 0.0))


def test_the_end_of_a_spring_is_told_from_the_centre_of_mass():
    inertia = np.eye(3)
    heavy = physics.Block((2.0, 1.0, 1.0), 2.0, pos=(0.0, 5.0, 0.0), center=(-0.25, 0.0, 0.0), inertia_body=inertia)
    light = physics.Block((1.0, 1.0, 1.0), 2.0, pos=(4.0, 5.0, 0.0))
    link = physics.Spring(point=(0.5, 0.0, 0.0), anchor=(-0.5, 0.0, 0.0), body=0, other=1)
    scene = physics.Scene([heavy, light], [], [link])
    upright = {"quat": (1.0, 0.0, 0.0, 0.0)}
    drawn = [replace(BLOCK, pos=(-0.25, 5.0, 0.0), **upright), replace(BLOCK, pos=(4.0, 5.0, 0.0), **upright)]
    start, end = spring_ends(link, scene, drawn)
    np.testing.assert_allclose(start, (0.5, 5.0, 0.0))
    np.testing.assert_allclose(end, (3.5, 5.0, 0.0))


def test_contact_arrows_are_as_large_as_the_smallest_body_asks_for():
    """A pebble on a block: arrows in units of the block would hide it."""
    made = []
    scene = SimpleNamespace(add_arrows=lambda *given, **sizes: made.append((given, sizes)))
    placement = SimpleNamespace(unit=5.0, scale=1.0, drawn=np.asarray)
    block = BodyView("block", (5.0, 3.0, 2.0), (0.0, 0.0, 0.0))
    pebble = BodyView("sphere", (0.25, 0.25, 0.25), (0.0, 1.75, 0.0))
    for bodies, unit in (((block,), 5.0), ((block, pebble), 0.5)):
        frame = Frame(bodies, contact_points=[(0, 1.5, 0)], contact_forces=[(0, 10, 0)], force_scale=0.1)
        Forces(scene, placement).show(SimpleNamespace(frame=frame))
        (_, ends, _), sizes = made.pop()
        assert np.ptp(ends, axis=1)[0, 1] == pytest.approx(1.0 * unit / 5.0)
        assert sizes["shaft_radius"] == pytest.approx(SHAFT * unit)
