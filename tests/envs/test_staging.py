"""A motion before the camera: upright, large enough, and in sight."""

from dataclasses import replace

import numpy as np
import pytest

import physics
from rigid_env.rendering import Renderer
from rigid_env.rendering.geometry import rotation_matrix
from rigid_env.rendering.picture import world_frame
from rigid_env.rendering.staging import DRAWN_SIZE, FLYING_SIZE, MOST_ARROWS, PATH_POINTS, Stage

UPS = [(0, 1, 0), (0, 0, 1), (1, 0, 0), (-1, 0, 0), (0, -1, 0), (0, 0, -1)]


def staged(bodies, walls=(), up=(0.0, 1.0, 0.0), path=None):
    effects = [physics.Gravity(-9.81 * np.array(up)), *([physics.Contact()] if walls else [])]
    scene = physics.Scene(bodies, walls, effects)
    frame = world_frame(physics.World(scene))
    pos = np.array([[body.pos for body in bodies]], dtype=float) if path is None else np.asarray(path, dtype=float)
    stage = Stage(scene, frame, pos)
    return stage, stage.place(frame)


@pytest.mark.parametrize("up", UPS)
def test_up_is_up_in_the_picture(up):
    up = np.array(up, dtype=float)
    high = physics.Block((3.0, 2.0, 1.0), 1.0, pos=5.0 * up, quat=(0.5, 0.5, 0.5, 0.5))
    _, frame = staged([high], [physics.HalfSpace(up)], up)
    (body,) = frame.bodies
    np.testing.assert_allclose(body.pos, (0.0, 5.0, 0.0), atol=1e-12)
    np.testing.assert_allclose(frame.walls[0].normal, (0.0, 1.0, 0.0), atol=1e-12)
    # the body axis that pointed up still does
    before = rotation_matrix((0.5, 0.5, 0.5, 0.5)).T @ up
    np.testing.assert_allclose(rotation_matrix(body.quat) @ before, (0.0, 1.0, 0.0), atol=1e-12)


def test_a_small_scene_is_drawn_large_and_a_large_one_as_it_is():
    _, frame = staged([physics.Sphere(0.01, 1.0, pos=(0.0, 0.05, 0.0))], [physics.HalfSpace((0, 1, 0), 0.02)])
    assert 2.0 * frame.bodies[0].dimensions.max() == pytest.approx(DRAWN_SIZE)
    scale = frame.bodies[0].dimensions.max() / 0.01
    assert frame.bodies[0].pos[1] == pytest.approx(0.05 * scale)
    assert frame.walls[0].offset == pytest.approx(0.02 * scale)
    _, frame = staged([physics.Sphere(4.0, 1.0)])
    assert frame.bodies[0].dimensions.max() == 4.0


def test_all_of_the_motion_is_in_sight():
    pytest.importorskip("pygame")
    path = np.linspace((-3.0, 0.5, 8.0), (12.0, 14.0, -6.0), 9)[:, None]
    stage, frame = staged([physics.Sphere(0.5, 1.0, pos=(0, 5, 0))], [physics.HalfSpace((0, 1, 0))], path=path)
    renderer = Renderer(640, 400, bounds=stage.bounds)
    pixels, depth = renderer.camera(frame).project(2.0 * path[:, 0], (640, 400))  # drawn twice as large
    renderer.close()
    assert (depth > 0).all()
    assert (pixels >= 0).all()
    assert (pixels <= (640, 400)).all()


@pytest.mark.parametrize(("up", "has_floor"), [((0, 1, 0), False), ((0, 0, 1), True)])
def test_a_flight_of_one_body_is_in_sight_with_its_path_and_the_floor_if_there_is_one(up, has_floor):
    pytest.importorskip("pygame")
    up = np.array(up, dtype=float)
    t = np.linspace(0.0, 1.0, 2001)[:, None, None]
    side = np.roll(up, 1)
    path = 1000.0 * side + t * (80.0 * side + 60.0 * up) - t * t * 60.0 * up + up
    walls = [physics.HalfSpace(up)] if has_floor else []
    stage, frame = staged([physics.Sphere(0.11, 0.4, pos=path[0, 0])], walls, up, path)
    assert 2.0 * frame.bodies[0].dimensions.max() == pytest.approx(FLYING_SIZE)
    scale = "grid 10 m" if has_floor else "flight 80 m across"
    assert stage.notes == (f"{scale}, body drawn 15 times as large",)
    assert len(frame.walls) == has_floor
    for ground in frame.walls:
        assert ground.normal == pytest.approx((0.0, 1.0, 0.0), abs=1e-12)
        assert (frame.path[:, 1] > ground.offset).all()
    assert len(frame.path) <= PATH_POINTS
    assert np.ptp(frame.path, axis=0).max() == pytest.approx(80.0 / 2.0)  # a cell of 10 m is drawn 5 m long
    assert frame.path[0] == pytest.approx(frame.bodies[0].pos, abs=1e-9)
    half = stage.place(world_frame(physics.World(physics.Scene([physics.Sphere(0.11, 0.4)]))), 0.5).path
    assert half[-1] == pytest.approx(frame.path[len(frame.path) // 2], abs=0.1)
    renderer = Renderer(640, 400, bounds=stage.bounds)
    pixels, depth = renderer.camera(frame).project(frame.path, (640, 400))
    with_path, without = renderer.draw(frame), renderer.draw(replace(frame, path=()))
    renderer.close()
    assert (depth > 0).all()
    assert (pixels >= 0).all()
    assert (pixels <= (640, 400)).all()
    x, y = pixels[len(pixels) // 4].astype(int)
    assert (with_path[y, x] != without[y, x]).any()


def test_a_wall_that_is_far_from_a_flight_is_left_out():
    path = np.linspace((0.0, 1000.0, 0.0), (80.0, 1000.0, 0.0), 5)[:, None]
    stage, frame = staged([physics.Sphere(0.11, 0.4, pos=path[0, 0])], [physics.HalfSpace((0, 1, 0))], path=path)
    assert frame.walls == ()
    assert stage.notes[0].startswith("flight 80 m across")


def test_several_bodies_that_go_far_are_followed_without_walls():
    path = np.linspace((0.0, 5.0, 0.0), (900.0, 5.0, 0.0), 5)[:, None] + ((0, 0, 0), (3, 0, 0))
    balls = [physics.Sphere(0.5, 1.0, pos=(x, 5, 0)) for x in (0, 3)]
    stage, frame = staged(balls, [physics.HalfSpace((0, 1, 0))], path=path)
    assert stage.bounds is None
    assert frame.walls == ()
    assert frame.bodies[0].pos.tolist() == [0.0, 0.0, 0.0]


@pytest.mark.interpreted
def test_a_crowd_has_no_arrows():
    blocks = [physics.Block((1, 1, 1), 1.0, pos=(2.0 * k, 0.5, 0.0)) for k in range(MOST_ARROWS // 4 + 1)]
    scene = physics.Scene(blocks, [physics.HalfSpace((0, 1, 0))], [physics.Gravity(), physics.Contact()])
    world = physics.World(scene)
    world.step()
    frame = world_frame(world)
    assert len(frame.contact_points) > MOST_ARROWS
    assert len(Stage(scene, frame, world.pos).place(frame).contact_points) == 0
