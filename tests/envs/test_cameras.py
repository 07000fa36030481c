"""Cameras and the switch for arrows: as arguments of environments, renderers and commands."""

from __future__ import annotations

import pickle
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from PIL import Image
from typer.testing import CliRunner

import physics
import rigid_env
from rigid_env.cli import app
from rigid_env.lab import demo
from rigid_env.rendering import Camera, Renderer, fit_camera
from rigid_env.rendering.camera_argument import as_camera, upwards
from rigid_env.rendering.picture import world_frame
from rigid_env.rendering.pixels import PixelObserver
from rigid_env.rendering.staging import Shot, Stage
from rigid_env.rendering.view import bounds_of, frame_of, room_of

pytest.importorskip("pygame")

CART = Path(__file__).parents[2] / "examples" / "cart.toml"
CORNERS = np.array(np.meshgrid(*3 * [(-1.0, 1.0)])).reshape(3, -1).T
CAMERA = Camera((6.0, 9.0, 12.0), (0.0, 1.0, 0.0), fov_y=40.0)
SIZE = {"render_mode": "rgb_array", "width": 160, "height": 100}
MADE = {
    "block": lambda **more: rigid_env.BlockReachEnv(**SIZE, **more),
    "task": lambda **more: rigid_env.TaskEnv(rigid_env.BlockReorientGoal, **SIZE, **more),
    "scene": lambda **more: rigid_env.SceneEnv("tower", driven=0, **SIZE, **more),
    "id": lambda **more: gym.make("rigid_env/BlockReorient-v0", **SIZE, **more),
    "batch": lambda **more: rigid_env.BlockReorientVectorEnv(2, **SIZE, **more),
    "batch of a task": lambda **more: rigid_env.TaskVectorEnv(2, task=rigid_env.BlockReachGoal, **SIZE, **more),
    "batch of a scene": lambda **more: rigid_env.SceneVectorEnv(2, str(CART), **SIZE, **more),
    "id of a batch": lambda **more: gym.make_vec("rigid_env/BlockReach-v0", num_envs=2, **SIZE, **more),
}
numbers = st.floats(-1e3, 1e3)
points = st.tuples(numbers, numbers, numbers)


def pictures_of(env) -> np.ndarray:
    """(worlds, height, width, 3) after one step of full force."""
    env.reset(seed=3)
    env.step(np.ones(env.action_space.shape, np.float32))
    made = env.render()
    env.close()
    return np.array(made if isinstance(made, tuple) else [made])


@pytest.mark.interpreted
@pytest.mark.parametrize("make", MADE.values(), ids=MADE)
def test_environments_take_a_camera_and_a_switch(make):
    env = make(camera=CAMERA, arrows=False)
    seen = pictures_of(env)
    task = env.unwrapped.task
    renderer = Renderer(160, 100, camera=CAMERA, bounds=bounds_of(task.world.scene))
    expected = [renderer.draw(frame_of(task, world, arrows=False)) for world in range(task.worlds)]
    np.testing.assert_array_equal(seen, expected)
    plain, with_arrows = pictures_of(make()), pictures_of(make(camera={"eye": CAMERA.eye, "target": CAMERA.target}))
    assert (plain != seen).any()
    assert (with_arrows != seen).any()
    np.testing.assert_array_equal(plain, pictures_of(make(camera=None, arrows=True)))


def test_without_arrows_the_contacts_are_not_looked_for(monkeypatch):
    env = MADE["block"](arrows=False)
    env.reset(seed=0)
    monkeypatch.setattr(physics.World, "contacts", lambda *_: 1 / 0)
    env.render()


def test_a_pickled_environment_keeps_its_camera():
    env = MADE["block"](camera=CAMERA, arrows=False)
    env.reset(seed=1)
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(env)).render(), env.render())


def test_observations_keep_their_own_view():
    plain, aimed = (rigid_env.BlockReachEnv(obs="pixels", camera=camera) for camera in (None, CAMERA))
    np.testing.assert_array_equal(plain.reset(seed=1)[0], aimed.reset(seed=1)[0])


def test_a_task_registered_with_a_camera_has_it():
    rigid_env.register_task("test/Aimed-v0", rigid_env.BlockReachGoal, camera={"eye": (0, 9, 20)}, arrows=False)
    try:
        env = gym.make("test/Aimed-v0", **SIZE)
        own = rigid_env.TaskEnv(rigid_env.BlockReachGoal, **SIZE, camera=Camera((0, 9, 20)), arrows=False)
        np.testing.assert_array_equal(pictures_of(env), pictures_of(own))
    finally:
        del gym.registry["test/Aimed-v0"]


@pytest.mark.parametrize(
    ("camera", "words"),
    [
        ("above", ("camera is 'above'", "a Camera, a dict of its parameters, and None")),
        ({}, ("camera is {}", "a dict with eye")),
        ({"eye": (0, 1, 5), "fov": 3}, ("with 'fov'", "eye, target, up, fov_y")),
        (Camera((0, 1)), ("camera.eye is (0, 1)", "three finite numbers")),
        (Camera((0, 1, np.nan)), ("camera.eye", "nan", "three finite numbers")),
        (Camera(("0", "1", "2")), ("camera.eye", "three finite numbers")),
        (Camera(((0, 1), 2, 3)), ("camera.eye", "three finite numbers")),
        (Camera((0, 1, 5), up=None), ("camera.up is None", "three finite numbers")),
        (Camera((0, 1, 5), (0, 1, 5)), ("camera.target is (0.0, 1.0, 5.0)", "two places")),
        (Camera((0, 9, 0)), ("camera.up is (0.0, 1.0, 0.0)", "along the line of sight", "(0, 0, -1)")),
        (Camera((0, 9, 5), up=(0, 0, 0)), ("camera.up is (0.0, 0.0, 0.0)", "another direction")),
        (Camera((0, 1, 5), fov_y=180), ("camera.fov_y is 180", "between 0 and 180")),
        (Camera((0, 1, 5), fov_y="wide"), ("camera.fov_y is 'wide'", "between 0 and 180")),
        (Camera((0, 1, 5), fov_y=np.nan), ("camera.fov_y is nan", "between 0 and 180")),
    ],
)
def test_a_wrong_camera_is_named(camera, words):
    takers = (
        as_camera, lambda camera: Renderer(8, 8, camera=camera), lambda camera: PixelObserver(8, 8, camera),
        lambda camera: rigid_env.BlockReachEnv(camera=camera),
        lambda camera: rigid_env.BlockReachVectorEnv(2, camera=camera),
    )  # fmt: skip
    for take in takers:
        with pytest.raises(ValueError) as caught:  # noqa: PT011 (the words are checked)
            take(camera)
        assert all(word in str(caught.value) for word in words), caught.value


@pytest.mark.parametrize("arrows", [None, 1, "no"])
def test_a_wrong_switch_is_named(arrows):
    takers = (
        lambda: Renderer(8, 8, arrows=arrows), lambda: PixelObserver(8, 8, arrows=arrows),
        lambda: rigid_env.BlockReachEnv(arrows=arrows),
    )  # fmt: skip
    for take in takers:
        with pytest.raises(ValueError, match=f"arrows is {arrows!r}; allowed are True and False"):
            take()


@given(points, points, points, st.floats(1.0, 179.0))
def test_an_accepted_camera_looks_from_eye_to_target(eye, target, up, fov_y):
    try:
        camera = as_camera({"eye": eye, "target": target, "up": up, "fov_y": fov_y})
    except ValueError:
        assume(False)
    np.testing.assert_allclose(camera.basis @ camera.basis.T, np.eye(3), atol=1e-6)
    assert camera.basis[1] @ np.array(up) > 0.0
    pixels, depth = camera.project([target], (160, 100))
    assert depth[0] > 0.0
    np.testing.assert_allclose(pixels, [(80.0, 50.0)], atol=1e-3)
    assert as_camera(camera) == camera


@given(points, points)
def test_some_direction_is_always_up(eye, target):
    assume(np.linalg.norm(np.subtract(eye, target)) > 1e-6)
    as_camera(Camera(eye, target, upwards(eye, target)))


def test_arrays_and_integers_make_the_same_camera():
    assert as_camera({"eye": np.array([0, 8, 20])}) == Camera((0.0, 8.0, 20.0)) == as_camera(Camera([0, 8, 20]))


def test_a_fitted_camera_is_accepted():
    assert as_camera(fit_camera([(0, 0, 0), (1, 2, 3)], (0, -1, -2), (160, 100))) is not None


# a whole motion


def staged(up, pos):
    scene = physics.Scene(
        [physics.Sphere(0.5, 1.0, pos=pos[0])],
        [physics.HalfSpace(up)],
        [physics.Gravity(-9.81 * np.array(up)), physics.Contact()],
    )
    frame = world_frame(physics.World(scene))
    return Stage(scene, frame, np.array(pos)[:, None])


def test_a_shot_is_in_the_frame_of_the_scene():
    """The scene's z is up: the picture's y. Drawn twice as large, since the body is half the drawn size."""
    stage = staged((0.0, 0.0, 1.0), [(0.0, 0.0, 5.0), (2.0, 0.0, 1.0)])
    camera = stage.camera(Shot((3.0, -8.0, 4.0), (1.0, 0.0, 2.0)))
    pixels, _ = camera.project(stage._scale * np.array([(1.0, 0.0, 2.0)]) @ stage._matrix.T, (160, 100))
    np.testing.assert_allclose(pixels, [(80.0, 50.0)], atol=1e-9)
    np.testing.assert_allclose(np.linalg.norm(camera.eye), stage._scale * np.linalg.norm((3.0, -8.0, 4.0)))
    assert camera.eye[1] == pytest.approx(stage._scale * 4.0)
    assert stage.camera(Shot()) is None


def test_a_shot_without_a_target_looks_at_the_middle_of_the_motion():
    stage = staged((0.0, 1.0, 0.0), [(0.0, 5.0, 0.0), (6.0, 1.0, 0.0)])
    np.testing.assert_allclose(stage.camera(Shot((0.0, 4.0, 30.0))).target, 2.0 * np.array((3.0, 3.0, 0.0)))
    assert stage.camera(Shot((3.0, 40.0, 0.0))).up == (0.0, 0.0, -1.0)


# commands


def run(*arguments, code=0):
    result = CliRunner().invoke(app, list(map(str, arguments)))
    assert result.exit_code == code, result.output
    return result.output


def test_commands_draw_from_an_eye_and_without_arrows(tmp_path, monkeypatch, is_exhaustive):
    if not is_exhaustive:
        monkeypatch.setattr(demo, "PICTURE_SIZE", (320, 200))
        monkeypatch.setattr(demo, "GIF_SIZE", (160, 100))
    drawn = {}
    for name, options in {
        "plain": (), "aimed": ("--eye", -9, 6, 14, "--target", 0, 1, 0), "bare": ("--no-arrows",)
    }.items():  # fmt: skip
        path = tmp_path / f"{name}.png"
        run("run", "rest", "--duration", 0.05, "--plot", path, *options)
        drawn[name] = np.array(Image.open(path))
    assert drawn["plain"].shape == drawn["aimed"].shape
    assert (drawn["plain"] != drawn["aimed"]).mean() > 0.2
    assert 0.0 < (drawn["plain"] != drawn["bare"]).mean() < 0.1
    run("demo", "rest", "--duration", 0.05, "--out", tmp_path, "--eye", 0, 20, 0)
    assert (tmp_path / "rest.gif").exists()


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--target", 0, 1, 0), ("--target is (0.0, 1.0, 0.0) without --eye", "--eye alone, or both")),
        (("--eye", 1, 2, 3, "--target", 1, 2, 3), ("(1.0, 2.0, 3.0)", "two places")),
        (("--eye", 1, 2, "nan"), ("camera.eye", "nan", "three finite numbers")),
        (("--eye", 1, 2, "far"), ("'--eye'", "valid number")),
    ],
)
def test_wrong_places_are_refused_before_anything_is_computed(options, words, tmp_path):
    output = run("demo", "rest", "--out", tmp_path / "none", *options, code=2)
    assert all(word in output for word in words), output
    assert not (tmp_path / "none").exists()


def test_all_bodies_of_a_scene_are_in_sight_at_its_start():
    """Also those above the room that their sizes alone would make; in the picture of a batch of pixels, too."""
    env = gym.make("rigid_env/Scene-v0", scene="heap", driven=[99], render_mode="rgb_array")
    env.reset(seed=0)
    env.render()
    inner = env.unwrapped
    frame = frame_of(inner.task)
    corners = frame.poses.pos[:, None] + frame.poses.radius[:, None, None] * CORNERS / np.sqrt(3.0)
    camera = inner._view._renderer.camera(frame)
    pixels, depths = camera.project(corners.reshape(-1, 3), (inner._view.width, inner._view.height))
    assert depths.min() > 0.0
    assert (pixels >= 0.0).all()
    assert (pixels <= (inner._view.width, inner._view.height)).all()
    room = room_of(inner.task)
    assert (frame.poses.pos < room.upper).all()
    env.close()
