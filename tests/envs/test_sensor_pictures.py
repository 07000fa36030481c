"""Sensors in pictures: translucent, where they are, and gone with the scene's sensors."""

from __future__ import annotations

import numpy as np
import pytest

import physics
from physics.rotations import rotation_matrices
from rigid_env.rendering import Camera, palette
from rigid_env.rendering.painter import Painter
from rigid_env.rendering.picture import world_frame
from rigid_env.rendering.staging import Stage

pytestmark = pytest.mark.interpreted

pytest.importorskip("pygame")

CAMERA = Camera(eye=(0, 2, 9), target=(0, 2, 0))
FLOOR = physics.HalfSpace((0, 1, 0))
TURN = (0.8, 0.0, 0.6, 0.0)
HULL = physics.Hull([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], fixed=True)


def world_of(*sensors) -> physics.World:
    ball = physics.Sphere(0.5, 1.0, pos=(-1, 2, 0), quat=TURN, name="ball")
    return physics.World(physics.Scene([ball], [FLOOR], [physics.Gravity(), physics.Contact()], sensors=sensors))


def painted(world: physics.World) -> np.ndarray:
    """Picture (200, 320, 3) of a world."""
    painter, out = Painter((320, 200), CAMERA), np.zeros((200, 320, 3), np.uint8)
    painter.paint(world_frame(world))
    painter.copy_to(out)
    return out.astype(int)


def pixel(point) -> tuple[int, int]:
    """Row and column of a point of the world."""
    (column, row), _ = (array[0] for array in CAMERA.project(np.array([point], dtype=float), (320, 200)))
    return round(row), round(column)


def test_a_region_tints_what_is_behind_it_and_nothing_else():
    region = physics.Sensor(physics.Block((4, 2, 0.1), fixed=True, pos=(0, 2, 1)))
    without, seen = painted(world_of()), painted(world_of(region))
    for point in ((-1, 2, 1), (1, 2, 1)):  # before the ball, and before the background
        before, after = without[pixel(point)], seen[pixel(point)]
        towards = np.sign(np.array(palette.SENSOR) - before)
        assert (towards * (after - before) >= 0).all()
        assert 10 < np.abs(after - before).sum() < np.abs(np.array(palette.SENSOR) - before).sum() / 2
    aside = pixel((-2.5, 2, 1))
    assert (without[aside] == seen[aside]).all()
    assert (painted(world_of()) == without).all()


@pytest.mark.parametrize("shape", [HULL, physics.Capsule(0.3, 1.0, fixed=True), physics.Compound([HULL], fixed=True)])
def test_a_region_is_drawn_where_it_is_and_goes_with_its_carrier(shape):
    place = np.array((0.5, 0.25, 1.0))
    carried = physics.Sensor(type(shape)(**{**_fields(shape), "pos": place}), "ball")
    world = world_of(carried)
    (view,) = world_frame(world).sensors
    R = rotation_matrices(np.array(TURN))
    np.testing.assert_allclose(view.pos, (-1, 2, 0) + R @ place, atol=1e-12)
    np.testing.assert_allclose(rotation_matrices(view.quat), R, atol=1e-12)
    row, column = pixel(view.pos)
    assert (painted(world) != painted(world_of()))[row, column].any()


def _fields(body: physics.Body) -> dict:
    names = [name for name in body.__dataclass_fields__ if name not in ("mass", "density", "pos")]
    return {name: getattr(body, name) for name in names}


def test_one_that_reaches_behind_the_camera_is_left_out():
    around = physics.Sensor(physics.Sphere(30.0, fixed=True))
    assert (painted(world_of(around)) == painted(world_of())).all()


def test_the_stage_places_sensors_as_it_places_bodies():
    sensor = physics.Sensor(physics.Sphere(0.5, fixed=True), 0)
    world = world_of(sensor)
    frame = world_frame(world)
    for path in (world.pos, np.array([[(0, 0, 0)], [(1e4, 0, 0)]])):
        staged = Stage(world.scene, frame, path).place(frame)
        np.testing.assert_allclose(staged.sensors[0].pos, staged.bodies[0].pos, atol=1e-12)
        np.testing.assert_allclose(staged.sensors[0].dimensions, staged.bodies[0].dimensions)
