"""Rendering: projection and clipping in closed form, meshes, and where bodies appear in the picture."""

import os
import subprocess
import sys
from dataclasses import replace
from math import radians, tan

import gymnasium
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

import physics
from rigid_env.rendering import BodyView, Camera, Frame, GoalView, Renderer, WallView, palette
from rigid_env.rendering.camera import NEAR, fit_camera
from rigid_env.rendering.canvas import Canvas
from rigid_env.rendering.geometry import (
    clip_polygon,
    convex_hull,
    perpendiculars,
    plane_axes,
    point_lists,
    rotation_matrices,
    rotation_matrix,
)
from rigid_env.rendering.layout import faces_point, make_room
from rigid_env.rendering.meshes import block_mesh, body_mesh, ellipsoid_mesh, unit_mesh
from rigid_env.rendering.overlays import hidden_points
from rigid_env.rendering.painter import Painter, import_pygame
from rigid_env.rendering.picture import without_bodies, world_frame
from rigid_env.rendering.shadows import SUN_SAMPLES, fall, outlines
from rigid_env.rendering.solids import pose
from rigid_env.rendering.view import frame_of
from rigid_env.tasks import Wrench
from tests.tasks.conftest import started

pytestmark = pytest.mark.interpreted

pytest.importorskip("pygame")

SIZE = (320, 200)
THREE_WALLS = (WallView((0, 1, 0), 0.0), WallView((1, 0, 0), -10.0), WallView((-1, 0, 0), -10.0))
CORNER = (WallView((1, 0, 0)), WallView((0, 1, 0)), WallView((0, 0, 1)))
TILTED = np.array([0.8, 0.3, -0.4, np.sqrt(1.0 - 0.8**2 - 0.3**2 - 0.4**2)])
ROUNDING = 1e-12  # a few operations on numbers of order 1 to 100 at 2.2e-16 each


@pytest.fixture
def renderer():
    made = Renderer(*SIZE)
    yield made
    made.close()


def block_frame(pos=(0.0, 4.0, 0.0), quat=(1.0, 0.0, 0.0, 0.0), walls=THREE_WALLS, **more):
    return Frame(bodies=(BodyView("block", (5, 3, 2), pos, quat),), walls=walls, **more)


def body_pixels(picture, without):
    """(n, 2) x, y of the middles of the pixels in which two pictures differ."""
    changed = np.any(picture != without, axis=2)
    return np.argwhere(changed)[:, ::-1] + 0.5


# camera


def test_projection_in_closed_form():
    camera = Camera(eye=(0, 0, 10), target=(0, 0, 0), fov_y=40.0)
    pixels, depth = camera.project([(0, 0, 0), (2, 0, 0), (0, 2, 0), (2, -1, 5)], SIZE)
    focal = 100.0 / tan(radians(20.0))
    expected = [
        (160, 100),
        (160 + focal * 0.2, 100),
        (160, 100 - focal * 0.2),
        (160 + focal * 0.4, 100 + focal * 0.2),
    ]
    np.testing.assert_allclose(pixels, expected, rtol=ROUNDING)
    np.testing.assert_allclose(depth, [10, 10, 10, 5], rtol=ROUNDING)


def test_edge_of_the_field_of_view_is_the_edge_of_the_picture():
    camera = Camera(eye=(1, 2, 3), target=(4, -1, 2), fov_y=50.0)
    right, up, forward = camera.basis
    top = np.array(camera.eye) + 7.0 * (forward + tan(radians(25.0)) * up)
    corner = top + 7.0 * tan(radians(25.0)) * 1.6 * right
    pixels, _ = camera.project([top, corner], SIZE)
    np.testing.assert_allclose(pixels, [(160, 0), (320, 0)], atol=1e-11)


def test_ray_of_a_pixel_projects_back_onto_its_middle():
    camera = Camera(eye=(3, 8, 20), target=(0, 2, 0))
    rays = camera.rays(SIZE)
    points = np.array(camera.eye) + 12.5 * rays[[0, 40, 199], [0, 170, 319]].astype(np.float64)
    pixels, depth = camera.project(points, SIZE)
    # float32 rays: 2**-24 relative, times a focal length of 373 pixels
    np.testing.assert_allclose(pixels, [(0.5, 0.5), (170.5, 40.5), (319.5, 199.5)], atol=2e-4)
    np.testing.assert_allclose(depth, 12.5, rtol=1e-6)


def test_fitted_camera_touches_the_margin_and_sees_all_points():
    points = np.random.default_rng(3).uniform(-5.0, 5.0, (40, 3))
    camera = fit_camera(points, (-0.3, -0.5, -1.0), SIZE, fov_y=30.0, margin=0.1)
    pixels, depth = camera.project(points, SIZE)
    assert depth.min() > 0.0
    low, high = pixels.min(axis=0) / SIZE, pixels.max(axis=0) / SIZE
    assert np.all(low >= 0.1 - 1e-12)
    assert np.all(high <= 0.9 + 1e-12)
    np.testing.assert_allclose((low + high)[np.argmax(high - low)], 1.0, atol=1e-12)
    np.testing.assert_allclose(np.max(high - low), 0.8, atol=1e-12)


@pytest.mark.parametrize("walls", [THREE_WALLS, CORNER], ids=["three walls", "corner"])
def test_default_camera_sees_the_whole_room_from_inside_its_walls(renderer, walls):
    frame = block_frame(pos=(4, 4, 4), walls=walls)
    camera = renderer.camera(frame)
    pixels, _ = camera.project(make_room(walls, frame.bodies).corners(), SIZE)
    assert np.all((pixels >= 0.0) & (pixels <= SIZE))
    assert all(faces_point(wall, camera.eye) for wall in walls)
    assert camera.basis[2, 1] < -0.3  # looks down


# clipping


def test_clipping_a_square_halves_it():
    square = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]])
    np.testing.assert_array_equal(clip_polygon(square, (1, 0), 1.0), [[1, 0], [2, 0], [2, 2], [1, 2]])
    np.testing.assert_array_equal(clip_polygon(square, (1, 1), 3.0), [[2, 1], [2, 2], [1, 2]])
    assert len(clip_polygon(square, (1, 0), 2.5)) == 0
    np.testing.assert_array_equal(clip_polygon(square, (1, 0), -1.0), square)


def test_clipping_a_segment_keeps_two_ends():
    segment = np.array([[0.0, 0.0, -1.0], [0.0, 0.0, 3.0]])
    np.testing.assert_array_equal(clip_polygon(segment, (0, 0, 1), 0.0), [[0, 0, 0], [0, 0, 3]])
    np.testing.assert_array_equal(clip_polygon(segment, (0, 0, -1), -1.0), [[0, 0, -1], [0, 0, 1]])


def test_floor_reaching_behind_the_camera_is_clipped_to_its_visible_part():
    camera = Camera(eye=(0, 1, 0), target=(0, 1, -1), fov_y=60.0)
    floor = np.array([[-50.0, 0.0, 50.0], [50.0, 0.0, 50.0], [50.0, 0.0, -50.0], [-50.0, 0.0, -50.0]])
    pixels = camera.project_polygon(floor, SIZE)
    focal = 100.0 / tan(radians(30.0))
    assert len(pixels) >= 3
    np.testing.assert_allclose(pixels[:, 1].min(), 100.0 + focal / 50.0, rtol=ROUNDING)  # its far edge
    assert pixels[:, 1].max() > SIZE[1]
    assert np.all(np.abs(pixels) < 32767)


def test_polygon_behind_the_camera_disappears():
    camera = Camera(eye=(0, 0, 5), target=(0, 0, 0))
    triangle = np.array([[0.0, 0.0, 6.0], [1.0, 0.0, 6.0], [0.0, 1.0, 5.0 - 0.5 * NEAR]])
    assert len(camera.project_polygon(triangle, SIZE)) == 0
    ahead_but_too_near = np.array([[0.0, 0.0, 5.0], [1e-3, 0.0, 5.0], [0.0, 1e-3, 5.0]]) - (0, 0, 0.9 * NEAR)
    assert len(camera.project_polygon(ahead_but_too_near, SIZE)) == 0


def test_convex_hull_of_a_square_and_its_inside():
    hull = convex_hull([[0, 0], [1, 0], [1, 1], [0, 1], [0.5, 0.5], [0.5, 0.0]])
    np.testing.assert_array_equal(hull, [[0, 0], [1, 0], [1, 1], [0, 1]])


# geometry and meshes


def test_rotation_matrix_turns_x_to_y_about_z():
    half = np.sqrt(0.5)
    np.testing.assert_allclose(rotation_matrix((half, 0, 0, half)) @ (1, 0, 0), (0, 1, 0), atol=ROUNDING)
    R = rotation_matrix(2.0 * TILTED)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=ROUNDING)


def test_rotation_matrices_are_those_of_the_single_quaternions():
    quats = np.random.default_rng(5).normal(size=(7, 4))
    np.testing.assert_allclose(rotation_matrices(quats), [rotation_matrix(q) for q in quats], atol=ROUNDING)


def test_perpendiculars_are_right_handed():
    axes = np.array([(0.0, 0.0, -2.0), (3.0, 0.1, 0.0), (1.0, -1.0, 1.0)])
    u, v = perpendiculars(axes)
    np.testing.assert_allclose(np.cross(u, v), axes / np.linalg.norm(axes, axis=1)[:, None], atol=ROUNDING)
    for a, b, value in ((u, u, 1.0), (v, v, 1.0), (u, v, 0.0), (u, axes, 0.0)):
        np.testing.assert_allclose(np.sum(a * b, axis=1), value, atol=ROUNDING)


def test_point_lists_are_the_rows():
    polygons = np.arange(24).reshape(3, 4, 2)
    assert [list(map(list, polygon)) for polygon in point_lists(polygons)] == polygons.tolist()


@pytest.mark.parametrize("normal", [(0, 1, 0), (1, 0, 0), (0.6, 0.0, -0.8)])
def test_plane_axes_are_right_handed(normal):
    u, v = plane_axes(normal)
    np.testing.assert_allclose(np.cross(u, v), normal, atol=ROUNDING)
    np.testing.assert_allclose([u @ u, v @ v, u @ v], [1, 1, 0], atol=ROUNDING)


MESHES = {
    "block": block_mesh((5, 3, 2)),
    "sphere": body_mesh(BodyView("sphere", (1.5, 1.5, 1.5), (0, 0, 0))),
    "ellipsoid": ellipsoid_mesh((2.5, 1.5, 1.0), subdivisions=5),
    "capsule": body_mesh(BodyView("capsule", (0.5, 1.75, 0.5), (0, 0, 0))),
    "cylinder": body_mesh(BodyView("cylinder", (0.5, 0.2, 0.5), (0, 0, 0))),
}
WEDGE = physics.Hull([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)], 1.0, pos=(0, 2, 0))


@pytest.mark.parametrize("mesh", MESHES.values(), ids=MESHES)
def test_mesh_is_closed_and_convex_with_outward_normals(mesh):
    assert len(mesh.vertices) - len(mesh.edges) + len(mesh.faces) == 2  # Euler: V - E + F
    assert 2 * len(mesh.edges) == mesh.faces.size  # every edge between two faces
    heights = mesh.normals @ mesh.vertices.T
    on_face = np.take_along_axis(heights, mesh.faces, axis=1)
    assert np.all(on_face > 0.0)  # the centre is inside
    assert np.all(heights <= on_face[:, :1] + 1e-12)  # no vertex beyond a face


@pytest.mark.parametrize("subdivisions", [1, 2, 5])
def test_patched_sphere_is_closed_and_covers_the_triangles(subdivisions):
    mesh, fine = unit_mesh("sphere", subdivisions), ellipsoid_mesh((1, 1, 1), subdivisions)
    assert len(mesh.vertices) - len(mesh.edges) + len(mesh.faces) == 2  # Euler: V - E + F
    assert np.all(np.sum(mesh.normals * mesh.centres, axis=1) > 0.0)  # outwards
    faces, triangles = ([frozenset(map(tuple, m.vertices[face].tolist())) for face in m.faces] for m in (mesh, fine))
    left = set(triangles)
    for face in faces:
        held = {triangle for triangle in left if triangle <= face}
        assert len(held) == len(face) - 2
        left -= held
    assert not left


def test_a_hull_is_drawn_with_its_corners_and_without_the_diagonals_of_its_faces():
    solid = WEDGE.polyhedron
    view = BodyView("hull", WEDGE.dimensions, WEDGE.pos, corners=solid.vertices, faces=solid.loops)
    mesh = body_mesh(view)
    assert mesh is body_mesh(view)
    assert len(mesh.faces) == 2 + 3 * 2  # two triangles, three quadrangles of two
    assert sorted(map(tuple, mesh.edges[:, :2].tolist())) == sorted(map(tuple, solid.edges[:, :2].tolist()))
    for a, b, left, right in mesh.edges:
        for face in (left, right):
            assert {a, b} <= set(mesh.faces[face])
        assert mesh.normals[left] @ mesh.normals[right] < 0.99
    heights = mesh.normals @ mesh.vertices.T
    assert np.all(heights <= heights[np.arange(len(mesh.faces)), mesh.faces[:, 0]][:, None] + 1e-12)
    for wrong in ({"faces": ()}, {"kind": "block"}):
        with pytest.raises(ValueError, match="faces must be those of a hull"):
            replace(view, **wrong)


@pytest.mark.filterwarnings("ignore::physics.SceneWarning")
def test_a_world_of_hulls_is_drawn_where_they_are(renderer):
    world = physics.World(physics.Scene([WEDGE], [physics.HalfSpace((0, 1, 0))], [physics.Gravity()]))
    frame = world_frame(world)
    np.testing.assert_array_equal(frame.bodies[0].corners, WEDGE.polyhedron.vertices)
    camera = renderer.camera(frame)
    picture = renderer.draw(frame).copy()
    changed = body_pixels(picture, renderer.draw(without_bodies(frame, camera)))
    corners, _ = camera.project(WEDGE.polyhedron.vertices + WEDGE.pos, SIZE)
    # Its outline and its shadow on the floor are all that changes; the body itself is within the outline's box.
    middle = corners.mean(axis=0)
    assert np.abs(changed - middle).sum(axis=1).min() < 1.0
    above = changed[changed[:, 1] < corners[:, 1].max()]
    assert (above.min(axis=0) >= corners.min(axis=0) - 2.0).all()


def test_the_parts_of_a_compound_are_drawn_where_they_are_in_its_colour(renderer):
    parts = [physics.Sphere(0.5, 1.0, pos=(x, 0, 0)) for x in (-1.5, 1.5)]
    body = physics.Compound(parts, pos=(0, 2, 0), quat=(0.5**0.5, 0, 0, 0.5**0.5))
    frame = world_frame(physics.World(physics.Scene([body])))
    assert frame.solids is not frame
    assert frame.owners.tolist() == [0, 0]
    np.testing.assert_allclose([solid.pos for solid in frame.bodies[0].solids], [(0, 0.5, 0), (0, 3.5, 0)], atol=1e-12)
    camera = renderer.camera(frame)
    picture, empty = renderer.draw(frame).copy(), renderer.draw(without_bodies(frame, camera)).copy()
    middles, _ = camera.project(np.array([solid.pos for solid in frame.bodies[0].solids]), SIZE)
    changed = np.abs(picture.astype(int) - empty).max(axis=2) > 40
    for x, y in middles.round().astype(int):
        assert changed[y, x]
    x, y = middles.mean(axis=0).round().astype(int)
    assert not changed[y, x]
    assert {solid.colour for solid in frame.solids.bodies} == {palette.BODIES[0]}


def test_a_compound_needs_parts_and_no_other_shape_has_them():
    ball = BodyView("sphere", (1, 1, 1), (0, 0, 0))
    for wrong in (lambda: BodyView("compound", (1, 1, 1), (0, 0, 0)), lambda: replace(ball, parts=(ball,))):
        with pytest.raises(ValueError, match="a compound alone must have parts"):
            wrong()


def test_block_faces_are_in_the_promised_order():
    signed_axes = np.array([[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]])
    np.testing.assert_array_equal(MESHES["block"].normals, signed_axes)
    centres = MESHES["block"].vertices[MESHES["block"].faces].mean(axis=1)
    np.testing.assert_array_equal(centres, signed_axes * (2.5, 1.5, 1.0))


def test_ellipsoid_vertices_lie_on_the_ellipsoid():
    scaled = MESHES["ellipsoid"].vertices / (2.5, 1.5, 1.0)
    np.testing.assert_allclose(np.linalg.norm(scaled, axis=1), 1.0, rtol=ROUNDING)


def off_axis(points, dimensions):
    """Vectors (n, 3) from the axis of a capsule to points (n, 3), in its frame."""
    half = dimensions[1] - dimensions[0]
    return points - np.clip(points[:, 1:2], -half, half) * (0.0, 1.0, 0.0)


def test_capsule_vertices_lie_on_the_capsule_and_no_triangle_crosses_an_octant():
    mesh = MESHES["capsule"]
    np.testing.assert_allclose(np.linalg.norm(off_axis(mesh.vertices, (0.5, 1.75)), axis=1), 0.5, rtol=ROUNDING)
    corners = mesh.vertices[mesh.faces]
    assert ((corners >= 0.0).all(axis=1) | (corners <= 0.0).all(axis=1)).all()


def test_cylinder_vertices_lie_on_the_cylinder_and_no_triangle_crosses_an_octant():
    mesh = MESHES["cylinder"]
    ring = mesh.vertices[:-2]
    np.testing.assert_allclose(np.hypot(ring[:, 0], ring[:, 2]), 0.5, rtol=ROUNDING)
    assert set(mesh.vertices[:, 1].tolist()) == {-0.2, 0.0, 0.2}
    corners = np.where(abs(mesh.vertices) < ROUNDING, 0.0, mesh.vertices)[mesh.faces]
    assert ((corners >= 0.0).all(axis=1) | (corners <= 0.0).all(axis=1)).all()


@given(
    quat=arrays(float, 4, elements=st.floats(-1.0, 1.0)).filter(lambda q: q @ q > 0.1),
    axes=st.tuples(*[st.floats(0.3, 3.0)] * 3),
)
def test_outline_of_an_ellipsoid_is_where_lines_of_sight_graze_it(quat, axes):
    camera = Camera(eye=(3.0, 8.0, 20.0), target=(0.0, 2.0, 0.0), fov_y=40.0)
    pygame = import_pygame()
    canvas = Canvas(pygame.Surface((640, 400), 0, 32), camera, pygame)
    body = BodyView("ellipsoid", axes, (1.0, 2.0, 3.0), quat)
    ((solid,), _) = pose(canvas, Frame((body,)), np.array([[200.0, 60.0, 40.0]]), rim_width=0.0)
    across = (solid.rim - 0.5 * np.array(canvas.size)) * (1.0, -1.0) / camera.focal(400)
    rays = np.column_stack([across, np.ones(len(across))]) @ camera.basis
    R = rotation_matrix(quat)
    eye, rays = (np.array(camera.eye) - body.pos) @ R / axes, rays @ R / axes
    # |eye + s ray| = 1 has one root s: the discriminant is zero
    product, square = np.sum(eye * rays, axis=1), np.sum(rays * rays, axis=1)
    # rounding of a pixel's place, 1e-13 of 640 px, times the slope of the discriminant, of the size of product²
    np.testing.assert_allclose((product**2 - square * (eye @ eye - 1.0)) / product**2, 0.0, atol=1e-10)


# shadows and hidden points


def test_shadow_of_a_point_falls_along_the_light():
    fallen = fall(np.array([[1.0, 3.0, 2.0]]), THREE_WALLS[0], np.array([[0.6, 0.8, 0.0]]))
    np.testing.assert_allclose(fallen[0, 0], (1.0 - 3.0 * 0.75, 0.0, 2.0), atol=ROUNDING)


def test_shadow_outline_of_an_ellipsoid_is_where_light_grazes():
    body = BodyView("ellipsoid", (2.5, 1.5, 1.0), (1, 2, 3), TILTED)
    ((members, points),) = outlines(Frame((body,)))
    assert members == [0]
    local = (points[0, 0] - body.pos) @ rotation_matrix(body.quat)
    gradient = local / body.dimensions**2
    np.testing.assert_allclose(np.sum((local / body.dimensions) ** 2, axis=1), 1.0, rtol=ROUNDING)
    np.testing.assert_allclose(gradient @ rotation_matrix(TILTED).T @ palette.LIGHT, 0.0, atol=ROUNDING)


@pytest.mark.parametrize("quat", [TILTED, (1.0, 0.0, 0.0, 0.0), None])
def test_shadow_outline_of_a_capsule_is_where_light_grazes(quat):
    """Also of one that points towards the light, whose shadow is a circle."""
    quat = _towards(palette.LIGHT) if quat is None else quat
    body = BodyView("capsule", (0.5, 2.0, 0.5), (1, 2, 3), quat)
    ((_, points),) = outlines(Frame((body,)))
    away = off_axis((points[0, 0] - body.pos) @ rotation_matrix(body.quat), body.dimensions)
    np.testing.assert_allclose(np.linalg.norm(away, axis=1), 0.5, rtol=ROUNDING)
    np.testing.assert_allclose(away @ rotation_matrix(body.quat).T @ palette.LIGHT, 0.0, atol=1e-12)


def _towards(light):
    """Quaternion that turns body y to the direction of the light."""
    q = np.array([1.0 + light[1], light[2], 0.0, -light[0]])
    return q / np.linalg.norm(q)


@pytest.mark.parametrize("kind", ["block", "hull"])
@given(quat=arrays(float, 4, elements=st.floats(-1.0, 1.0)).filter(lambda q: q @ q > 0.1))
def test_shadow_outline_is_the_hull_of_the_corners_along_every_light(kind, quat):
    solid = WEDGE.polyhedron
    shape = {"corners": solid.vertices, "faces": solid.loops} if kind == "hull" else {}
    body = BodyView(kind, (3.0, 2.0, 1.0), (1.0, 5.0, 2.0), quat, **shape)
    ((_, loops),) = outlines(Frame((body,)))
    corners = body.pos + body_mesh(body).vertices @ rotation_matrix(quat).T
    for light, loop in zip(SUN_SAMPLES, loops[0]):
        flat = np.stack(plane_axes(light), axis=1)
        expected, found = area(convex_hull(corners @ flat)), area(loop @ flat)
        # the loop goes round once, without a detour: so it is the hull where it is as large
        assert abs(found) == pytest.approx(expected, rel=1e-9)
        assert area(convex_hull(loop @ flat)) == pytest.approx(expected, rel=1e-9)


def area(loop):
    (x, y), (u, v) = loop.T, np.roll(loop, -1, axis=0).T
    return 0.5 * np.sum(x * v - u * y)


def test_shadows_that_cover_each_other_are_no_darker_than_one(renderer):
    low, high = np.array([0.0, 2.0, 0.0]), np.array([0.0, 2.0, 0.0]) + 3.0 * palette.LIGHT
    near, far = BodyView("sphere", (1, 1, 1), low), BodyView("sphere", (0.9, 0.9, 0.9), high)
    away = replace(far, pos=(0.0, 500.0, 0.0))
    one, both = (renderer.draw(Frame((near, body), THREE_WALLS)).astype(int) for body in (away, far))
    foot = fall(low[None], THREE_WALLS[0], palette.LIGHT[None])[0]
    (pixel,), _ = renderer.camera(Frame((near, far), THREE_WALLS)).project(foot, SIZE)
    column, row = np.floor(pixel).astype(int)
    np.testing.assert_array_equal(one[row, column], both[row, column])
    assert one[row, column].max() < 200  # it is in the shadow


def test_points_behind_a_block_are_hidden():
    bodies = (BodyView("block", (2, 2, 2), (0, 0, 0)),)
    points = np.array([(0, 0, -3.0), (0, 0, 1.0), (0, 0, -1.0), (4, 0, -3.0), (0, 0, 5.0), (1, 1, 1.0)])
    np.testing.assert_array_equal(hidden_points(points, bodies, (0, 0, 10)), [1, 0, 1, 0, 0, 0])


# pictures


HALF_TURN = (0.0, 0.0, 1.0, 0.0)


@pytest.mark.parametrize("quat", [(1.0, 0.0, 0.0, 0.0), HALF_TURN], ids=["as it is", "half a turn"])
@pytest.mark.parametrize("kind", ["block", "sphere", "ellipsoid", "capsule", "cylinder"])
def test_middle_of_the_body_has_the_colour_of_the_lit_face_in_front(renderer, kind, quat):
    body = BodyView(kind, (4, 4, 4), (1, 5, 0), quat, colour=(200, 60, 40))
    frame = Frame((body,), THREE_WALLS)
    camera = renderer.camera(frame)
    (pixel,), _ = camera.project([body.pos], SIZE)
    column, row = np.floor(pixel).astype(int)
    colour = renderer.draw(frame)[row, column].astype(float)
    if kind == "block":
        to_eye = np.array(camera.eye) - (body.pos + np.array([0.0, 0.0, 2.0]))
        lit = palette.shade((200, 60, 40), np.array([[0.0, 0.0, 1.0]]), to_eye[None] / np.linalg.norm(to_eye))
        np.testing.assert_array_equal(colour, lit[0])
    assert colour[0] > 1.5 * colour[1] > 0.0  # red stays red
    assert colour[1] > colour[2]


def test_moving_the_body_moves_its_pixels_by_the_projected_amount(renderer):
    camera = renderer.camera(block_frame())
    empty = renderer.draw(block_frame(pos=(0.0, -500.0, 0.0)))
    for pos in ((-4.0, 5.0, 1.0), (4.0, 4.0, -2.0)):
        quat = np.array([1.0, 0.2, 0.1, 0.3])
        frame = block_frame(pos, quat)
        vertices = pos + block_mesh((5, 3, 2)).vertices @ rotation_matrix(quat).T
        pixels, _ = camera.project(vertices, SIZE)
        drawn = body_pixels(renderer.draw(frame), empty)
        # The shadow lies below and to the left: the body alone makes the top and the right. One pixel for the
        # outline, half a pixel for the middles.
        assert drawn[:, 1].min() == pytest.approx(pixels[:, 1].min(), abs=1.5)
        assert drawn[:, 0].max() == pytest.approx(pixels[:, 0].max(), abs=1.5)


def test_floor_is_darker_in_the_shadow(renderer):
    frame, away = block_frame(pos=(0, 5, 0)), block_frame(pos=(0, 500, 0))
    foot = fall(np.array([[0.0, 5.0, 0.0]]), THREE_WALLS[0], palette.LIGHT[None])[0]
    (pixel,), _ = renderer.camera(frame).project(foot, SIZE)
    column, row = np.floor(pixel).astype(int)
    shaded = renderer.draw(frame)[row, column].astype(int)
    lit = renderer.draw(away)[row, column].astype(int)
    assert np.all(shaded < lit - 40)


def test_nearer_body_covers_farther_in_any_order(renderer):
    red, blue = (210, 20, 20), (20, 20, 210)
    camera = renderer.camera(block_frame())
    forward = camera.basis[2]
    near, far = np.array([0.0, 4.0, 0.0]), np.array([0.0, 4.0, 0.0]) + 6.0 * forward
    bodies = [
        BodyView("sphere", (1, 1, 1), far, colour=blue),
        BodyView("sphere", (1, 1, 1), near, colour=red),
    ]
    for order in (bodies, bodies[::-1]):
        frame = Frame(tuple(order), THREE_WALLS)
        (pixel,), _ = renderer.camera(frame).project([near], SIZE)
        column, row = np.floor(pixel).astype(int)
        colour = renderer.draw(frame)[row, column]
        assert colour[0] > colour[2]


def test_wall_between_camera_and_body_does_not_hide_it():
    body = BodyView("block", (5, 3, 2), (0, 4, 0), colour=(200, 60, 40))
    camera = Camera(eye=(0, 5, 25), target=(0, 4, 0))
    pane = WallView((0, 0, -1), -6.0)
    pictures = []
    for walls in (THREE_WALLS, (*THREE_WALLS, pane)):
        renderer = Renderer(*SIZE, camera=camera)
        pictures.append(renderer.draw(Frame((body,), walls))[100, 160].astype(int))
        renderer.close()
    assert np.any(pictures[0] != pictures[1])  # it is there
    assert np.all(np.abs(pictures[0] - pictures[1]) <= 16)  # at most 12/255 of it


def test_camera_inside_the_scene_draws_without_error():
    camera = Camera(eye=(0.0, 4.0, 1.2), target=(0.5, 3.0, 0.0), fov_y=70.0)
    renderer = Renderer(*SIZE, camera=camera)
    goal = GoalView((0, 1, 2), 3.0, goal_face=5)
    picture = renderer.draw(block_frame(goal=goal, applied_force=(50, 0, 60), applied_torque=(9, 9, 9)))
    assert picture.std() > 5.0
    renderer.close()


def test_forces_torque_contacts_goal_and_text_each_leave_their_mark(renderer):
    plain = renderer.draw(block_frame())
    marks = {
        palette.CONTACT: {"contact_points": [(-6.0, 0.0, 2.0)], "contact_forces": [(0.0, 30.0, 0.0)]},
        palette.APPLIED_FORCE: {"applied_force": (60.0, 0.0, 0.0)},
        palette.TORQUE: {"applied_torque": (0.0, 0.0, 60.0)},
        palette.GOAL: {"goal": GoalView((-5, 0, 2), 1.5)},
        palette.GOAL_REACHED: {"goal": GoalView((-5, 0, 2), 1.5, reached=True)},
    }
    for colour, more in marks.items():
        picture = renderer.draw(block_frame(**more))
        changed = picture[np.any(picture != plain, axis=2)].astype(int)
        assert np.abs(changed - colour).max(axis=1).min() < 30, more
    with_text = renderer.draw(block_frame(text=("t = 1.0 s",)))
    assert np.any(with_text[:40, :120] != plain[:40, :120])


def test_the_wrench_on_each_body_is_drawn_at_its_centre(renderer):
    """The arrows of two bodies together change the pixels that those of each body alone change."""
    bodies = tuple(BodyView("block", (2, 1, 1), (x, 4, 0)) for x in (-5.0, 5.0))
    wrenches = np.array([[(30.0, 0.0, 0.0), (0.0, 0.0, 20.0)], [(0.0, 40.0, 0.0), (0.0, 15.0, 0.0)]])
    plain = Frame(bodies, THREE_WALLS)
    still = renderer.draw(plain)

    def changed(on):
        force, torque = (wrenches[:, k] * np.array(on)[:, None] for k in (0, 1))
        return np.any(renderer.draw(replace(plain, applied_force=force, applied_torque=torque)) != still, axis=2)

    first, second, both = changed((1, 0)), changed((0, 1)), changed((1, 1))
    assert first.any()
    assert second.any()
    np.testing.assert_array_equal(both, first | second)
    pixels, _ = renderer.camera(plain).project([body.pos for body in bodies], SIZE)
    for mark, here, there in ((first, 0, 1), (second, 1, 0)):
        middle = np.argwhere(mark)[:, ::-1].mean(axis=0)
        assert np.hypot(*(middle - pixels[here])) < np.hypot(*(middle - pixels[there]))


def test_wrenches_of_more_bodies_than_there_are_are_refused():
    with pytest.raises(ValueError, match="applied_force has 2 rows; allowed are at most 1"):
        block_frame(applied_force=np.ones((2, 3)))
    with pytest.raises(ValueError, match=r"applied_torque must have shape \(-1, 3\)"):
        block_frame(applied_torque=(1.0, 2.0))


def test_the_frame_of_a_task_has_the_wrench_on_each_body():
    from examples.two_blocks import TwoBlocks

    class BothDriven(TwoBlocks):
        actions = (Wrench(0), Wrench(1, frame="body"))

    task = started(BothDriven(1))
    task.step(np.linspace(0.2, 1.0, task.action_size)[None])
    frame = frame_of(task)
    np.testing.assert_array_equal(frame.applied_force, task.wrench[0, :, :3])
    np.testing.assert_array_equal(frame.applied_torque, task.wrench[0, :, 3:])
    assert np.any(frame.applied_force[1])


def test_force_arrow_has_the_length_of_the_scaled_force(renderer):
    point, force, scale = np.array([-6.0, 1.0, 3.0]), np.array([0.0, 40.0, 0.0]), 0.1
    frame = block_frame(pos=(5, 4, 0), contact_points=[point], contact_forces=[force], force_scale=scale)
    drawn = body_pixels(renderer.draw(frame), renderer.draw(block_frame(pos=(5, 4, 0))))
    pixels, _ = renderer.camera(frame).project([point, point + scale * force], SIZE)
    assert drawn[:, 1].min() == pytest.approx(pixels[1, 1], abs=2.0)  # the halo round the tip
    assert drawn[:, 1].max() == pytest.approx(pixels[0, 1] + 0.55 * 5.5, abs=1.5)  # disc and halo


def test_goal_face_is_highlighted_only_on_its_face(renderer):
    plain = renderer.draw(block_frame())
    drawn = body_pixels(renderer.draw(block_frame(goal=GoalView(goal_face=5))), plain)
    front = np.array([(x, 4 + y, 1.0) for x in (-2.5, 2.5) for y in (-1.5, 1.5)])
    pixels, _ = renderer.camera(block_frame()).project(front, SIZE)
    assert np.all(drawn > pixels.min(axis=0) - 1.5)
    assert np.all(drawn < pixels.max(axis=0) + 1.5)
    assert len(drawn) > 0.8 * np.prod(np.ptp(pixels, axis=0))


def test_same_frame_gives_same_bytes_whatever_was_drawn_before(renderer):
    frame = block_frame((1, 5, 2), TILTED, goal=GoalView((3, 0, 0)), applied_force=(30, 5, 0), text=("t",))
    first = renderer.draw(frame)
    corner = renderer.draw(block_frame((4, 3, 4), walls=CORNER))
    again = renderer.draw(frame)
    other = Renderer(*SIZE)
    assert corner.tobytes() == other.draw(block_frame((4, 3, 4), walls=CORNER)).tobytes()
    assert first.tobytes() == again.tobytes() == other.draw(frame).tobytes()
    other.close()


@given(pos=st.tuples(*[st.floats(-9.0, 9.0)] * 3), kind=st.sampled_from(["block", "sphere", "ellipsoid"]))
def test_only_the_part_with_the_bodies_is_redrawn_and_nothing_is_missing(pos, kind):
    camera = Camera(eye=(0.0, 6.0, 14.0), target=(0.0, 3.0, 0.0), fov_y=50.0)
    body = BodyView(kind, (3.0, 3.0, 3.0) if kind == "sphere" else (4.0, 1.0, 0.5), pos, TILTED)
    frame = Frame((body, replace(body, pos=(2.0, 3.0, -1.0))), THREE_WALLS, GoalView(goal_face=2))
    painter = Painter(SIZE, camera)
    pictures = np.zeros((2, SIZE[1], SIZE[0], 3), dtype=np.uint8)
    painter.paint(frame)
    painter.copy_to(pictures[0])
    painter._box = lambda frame, camera: painter.picture.get_rect()
    painter.paint(frame)
    painter.copy_to(pictures[1])
    np.testing.assert_array_equal(*pictures)


@pytest.mark.parametrize(("switch", "left"), [("arrows", {"text"}), ("text", {"arrows"})])
def test_arrows_and_text_can_be_left_out(switch, left):
    arrows = {"contact_points": [(1, 0, 1)], "contact_forces": [(0, 20, 0)], "applied_force": (30, 0, 0)}
    marks = {"arrows": arrows, "text": {"text": ("t",)}}
    whole, bare = block_frame(**arrows, text=("t",)), block_frame(**{k: v for m in left for k, v in marks[m].items()})
    plain, without = Renderer(*SIZE), Renderer(*SIZE, **{switch: False})
    np.testing.assert_array_equal(without.draw(whole), plain.draw(bare))
    assert np.any(plain.draw(whole) != without.draw(whole))


def test_backdrops_are_kept_within_bounds(monkeypatch):
    monkeypatch.setattr("rigid_env.rendering.painter.KEPT_PIXELS", 3 * SIZE[0] * SIZE[1])
    painter = Painter(SIZE)
    frames = [block_frame(goal=GoalView((x, 0.0, 0.0))) for x in range(5)]
    kept = [painter.setting(frame) for frame in frames]
    assert [painter.setting(frame) is setting for frame, setting in zip(frames[2:], kept[2:])] == [True] * 3
    assert painter.setting(frames[0]) is not kept[0]


def test_picture_is_a_writable_array_of_its_own(renderer):
    picture = renderer.draw(block_frame())
    assert picture.shape == (200, 320, 3)
    assert picture.dtype == np.uint8
    kept = picture.copy()
    renderer.draw(block_frame((3, 3, 3)))
    np.testing.assert_array_equal(picture, kept)
    picture[:] = 0


# windows, errors, dependencies

DRAW_ONE = """
import sys
from rigid_env.rendering import BodyView, Frame, Renderer, WallView
assert "pygame" not in sys.modules
renderer = Renderer(160, 100)
frame = Frame((BodyView("sphere", (1, 1, 1), (0, 2, 0)),), (WallView((0, 1, 0), 0.0),), text=("t = 0",))
assert renderer.draw(frame).std() > 1.0
import pygame
assert not pygame.display.get_init()
renderer.close()
"""


def test_works_without_any_display():
    hidden = ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER")
    environment = {k: v for k, v in os.environ.items() if k not in hidden}
    done = subprocess.run([sys.executable, "-c", DRAW_ONE], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


def test_window_shows_keeps_pace_and_survives_being_closed(monkeypatch):
    import pygame

    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    renderer = Renderer(160, 100, mode="human", fps=50, title="a test")
    picture = renderer.draw(block_frame())
    assert renderer.is_open
    assert pygame.display.get_caption()[0] == "a test"
    shown = pygame.surfarray.array3d(pygame.display.get_surface()).swapaxes(0, 1)
    np.testing.assert_array_equal(shown, picture)
    start = pygame.time.get_ticks()
    for _ in range(5):
        renderer.draw(block_frame())
    assert pygame.time.get_ticks() - start >= 5 * 20 - 20  # the clock counts whole milliseconds
    pygame.event.post(pygame.event.Event(pygame.QUIT))
    renderer.draw(block_frame())
    assert not renderer.is_open
    np.testing.assert_array_equal(renderer.draw(block_frame()), picture)
    assert not renderer.is_open
    renderer.close()
    renderer.close()


def test_closing_twice_is_fine_and_drawing_afterwards_says_so():
    renderer = Renderer(64, 40)
    renderer.close()
    renderer.close()
    with pytest.raises(RuntimeError, match="closed"):
        renderer.draw(Frame())


def test_missing_pygame_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(gymnasium.error.DependencyNotInstalled, match=r'pip install "rigid-env\[render\]"'):
        Renderer()


def test_empty_frame_is_only_background(renderer):
    picture = renderer.draw(Frame())
    np.testing.assert_array_equal(picture[0, 0], palette.BACKGROUND_TOP)
    np.testing.assert_array_equal(picture[-1, -1], palette.BACKGROUND_BOTTOM)


@pytest.mark.parametrize(
    ("make", "match"),
    [
        (lambda: BodyView("cube", (1, 1, 1), (0, 0, 0)), "kind"),
        (lambda: BodyView("block", (1, 1), (0, 0, 0)), "dimensions"),
        (lambda: BodyView("block", (1, 0, 1), (0, 0, 0)), "positive"),
        (lambda: WallView((0, 0, 0)), "zero"),
        (lambda: GoalView(goal_face=6), "goal_face"),
        (lambda: Frame(contact_points=np.zeros((2, 3))), "contact_forces"),
        (lambda: Renderer(mode="ansi"), "mode"),
        (lambda: Renderer(width=0), "positive"),
    ],
)
def test_wrong_input_is_named(make, match):
    with pytest.raises(ValueError, match=match):
        make()
