"""Pixel observations: the array that is given is written, equal states give equal pixels, and moved bodies others."""

import os
import pickle
import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest

import physics
from physics import scenes
from rigid_env.rendering import BodyView, Camera, Frame, GoalView, Renderer, WallView, make_room
from rigid_env.rendering.picture import world_frame
from rigid_env.rendering.pixels import PixelObserver

pytest.importorskip("pygame")

FLOOR = (WallView((0, 1, 0)),)
STATES = {"pos": [[(0.0, 4.0, 0.0)], [(4.0, 4.0, 2.0)], [(0.0, 4.0, 0.0)]]}


@pytest.fixture
def world():
    made = physics.World(scenes.drop(), worlds=3, dt=0.005, accuracy="fast")
    made.set_state(**{name: np.array(value) for name, value in STATES.items()}, quat=(1.0, 0.0, 0.0, 0.0))
    return made


@pytest.fixture
def observer():
    return PixelObserver(84, 84)


def block(pos=(0.0, 4.0, 0.0), size=(5.0, 3.0, 2.0)):
    return Frame((BodyView("block", size, pos),), FLOOR)


def test_the_given_array_is_written_and_nothing_beside_it(world, observer):
    batch = np.full((3, 84, 84, 3), 7, dtype=np.uint8)
    picture = observer.observe_world(world, 1, batch[1])
    assert np.shares_memory(picture, batch)
    assert np.all(batch[[0, 2]] == 7)
    np.testing.assert_array_equal(batch[1], observer.observe_world(world, 1))
    assert batch[1].std() > 10.0


def test_equal_states_give_equal_pixels_and_moved_bodies_others(world, observer):
    pictures = [observer.observe_world(world, index) for index in range(3)]
    np.testing.assert_array_equal(pictures[0], pictures[2])
    assert np.mean(np.any(pictures[0] != pictures[1], axis=2)) > 0.02
    other = PixelObserver(84, 84)
    for index in (2, 1, 0):  # in another order, by another observer
        np.testing.assert_array_equal(other.observe_world(world, index), pictures[index])


def test_a_step_of_a_hundredth_of_the_block_can_be_seen(observer):
    # 0.05 m are 0.14 px here: far less than a pixel, but pixels on an edge are as bright as they are covered
    camera = Camera(eye=(0.0, 4.0, 40.0), target=(0.0, 4.0, 0.0), fov_y=40.0)
    seen = PixelObserver(84, 84, camera)
    x = np.arange(0.0, 1.0, 0.05)
    pictures = [seen.observe(block((float(place), 4.0, 0.0))).copy() for place in x]
    changes = [np.any(a != b) for a, b in pairwise(pictures)]
    # the canvas has two pixels for one: of seven steps at least one crosses the middle of one, for each edge
    assert sum(changes) >= len(x) // 4


def test_pixels_are_those_of_a_renderer_without_arrows_and_text(world):
    world.set_state(pos=(0.0, 1.5, 0.0), worlds=[0])
    world.step()
    frame = world_frame(world, 0, text=("t",))
    assert len(frame.contact_points) == 4
    renderer = Renderer(84, 84, arrows=False, text=False)
    np.testing.assert_array_equal(PixelObserver(84, 84).observe_world(world, 0), renderer.draw(frame))
    whole = Renderer(84, 84, text=False).draw(frame)
    np.testing.assert_array_equal(PixelObserver(84, 84, arrows=True).observe_world(world, 0), whole)
    assert np.any(whole != renderer.draw(frame))


def test_a_frame_without_arrows_has_all_the_rest(world):
    world.step()
    whole, bare = (world_frame(world, 1, applied=np.ones(6), arrows=arrows) for arrows in (True, False))
    assert not bare.has_arrows
    assert whole.has_arrows
    np.testing.assert_array_equal(bare.bodies[0].pos, whole.bodies[0].pos)
    assert [wall.offset for wall in bare.walls] == [wall.offset for wall in whole.walls]


def test_camera_and_room_say_from_where_worlds_are_seen():
    camera = Camera(eye=(0.0, 5.0, 25.0), target=(0.0, 4.0, 0.0))
    small, large = block(size=(1.0, 1.0, 1.0)), block(size=(5.0, 3.0, 2.0))
    room = make_room(FLOOR, large.bodies)
    free = PixelObserver(84, 84).observe(small)
    fixed = PixelObserver(84, 84, room=room)
    assert np.any(fixed.observe(small) != free)
    np.testing.assert_array_equal(fixed.observe(large), PixelObserver(84, 84).observe(large))
    np.testing.assert_array_equal(
        PixelObserver(84, 84, camera).observe(large), Renderer(84, 84, camera=camera).draw(large)
    )


def test_goal_is_drawn_and_follows_the_frame(observer):
    frames = [Frame(block().bodies, FLOOR, GoalView((x, 0.0, 2.0))) for x in (-2.0, 2.0)]
    first, second = (observer.observe(frame) for frame in frames)
    assert np.any(first != second)
    np.testing.assert_array_equal(observer.observe(frames[0]), first)


def test_pickled_observers_draw_the_same(observer):
    camera = Camera(eye=(0.0, 5.0, 25.0), target=(0.0, 4.0, 0.0))
    for made in (observer, PixelObserver(84, 84, camera)):
        picture = made.observe(block())
        kept = pickle.dumps(made)
        assert len(kept) < 2000  # bytes: no surface and no backdrop
        np.testing.assert_array_equal(pickle.loads(kept).observe(block()), picture)


ONE = """
import sys, numpy as np
from rigid_env.rendering import BodyView, Frame, WallView
from rigid_env.rendering.pixels import PixelObserver
observer = PixelObserver(32, 24)
out = np.zeros((24, 32, 3), np.uint8)
observer.observe(Frame((BodyView("block", (1, 1, 1), (0, 2, 0)),), (WallView((0, 1, 0)),)), out)
import pygame
assert out.std() > 1.0 and not pygame.display.get_init()
"""


def test_needs_no_display():
    hidden = ("DISPLAY", "WAYLAND_DISPLAY", "SDL_VIDEODRIVER")
    environment = {k: v for k, v in os.environ.items() if k not in hidden}
    done = subprocess.run([sys.executable, "-c", ONE], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("out", "match"),
    [
        (np.zeros((84, 84), np.uint8), r"out is uint8 \(84, 84\); allowed is a uint8 array \(84, 84, 3\)"),
        (np.zeros((84, 84, 3)), "out is float64"),
        ([1], "out is list"),
        (np.zeros((84, 84, 6), np.uint8)[..., :3], "contiguous"),
    ],
)
def test_wrong_arrays_are_named_and_not_written(observer, out, match):
    with pytest.raises(ValueError, match=match):
        observer.observe(block(), out)
    assert not np.any(out[:0])


def test_wrong_input_is_named(world, observer):
    for size in ((0, 84), (84, 2.5), (True, 84)):
        with pytest.raises(ValueError, match="allowed are integers of at least 1"):
            PixelObserver(*size)
    with pytest.raises(ValueError, match="index is 3; allowed are indices from 0 to 2"):
        observer.observe_world(world, 3)
    out = np.zeros((84, 84, 3), np.uint8)
    with pytest.raises(ValueError, match="no walls"):
        observer.observe(Frame(block().bodies), out)
    assert not out.any()
