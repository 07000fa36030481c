"""A motion before the camera: upright, large enough, and in sight."""

import numpy as np
import pytest

import physics
from rigid_env.rendering import Renderer
from rigid_env.rendering.geometry import rotation_matrix
from rigid_env.rendering.picture import world_frame
from rigid_env.rendering.staging import DRAWN_SIZE, MOST_ARROWS, Stage

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


def test_what_goes_far_is_followed_without_walls():
    path = np.linspace((0.0, 5.0, 0.0), (900.0, 5.0, 0.0), 5)[:, None]
    stage, frame = staged([physics.Sphere(0.5, 1.0, pos=(0, 5, 0))], [physics.HalfSpace((0, 1, 0))], path=path)
    assert stage.bounds is None
    assert frame.walls == ()
    assert frame.bodies[0].pos.tolist() == [0.0, 0.0, 0.0]


def test_a_crowd_has_no_arrows():
    blocks = [physics.Block((1, 1, 1), 1.0, pos=(2.0 * k, 0.5, 0.0)) for k in range(MOST_ARROWS // 4 + 1)]
    scene = physics.Scene(blocks, [physics.HalfSpace((0, 1, 0))], [physics.Gravity(), physics.Contact()])
    world = physics.World(scene)
    world.step()
    frame = world_frame(world)
    assert len(frame.contact_points) > MOST_ARROWS
    assert len(Stage(scene, frame, world.pos).place(frame).contact_points) == 0
