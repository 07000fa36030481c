"""Videos of trained policies: in real time, with pictures within long control steps."""

from __future__ import annotations

from itertools import pairwise

import gymnasium as gym
import numpy as np
import pytest
from PIL import Image

import physics
import rigid_env  # noqa: F401 (registers)
from rigid_env.lab.playing import FRAME_TIME, Film, _retaken, picture_steps, write_video
from rigid_env.rendering.view import frame_of

pytest.importorskip("pygame")

pytestmark = pytest.mark.interpreted

KICK = np.array([0.8, 0.2, 0.2, 0.1, 0.3])


@pytest.mark.parametrize(
    ("frame_skip", "dt", "steps"),
    [
        (5, 0.005, 10),  # two control steps of 25 ms
        (10, 0.005, 10),
        (20, 0.005, 10),  # half of 100 ms
        (10, 0.02, 2),  # 40 ms, a fifth of 200 ms: 100 ms would be the next part
        (1, 0.02, 2),
        (3, 0.1, 3),  # no part is short enough
        (4, 0.0125, 4),
        (8, 0.0125, 4),  # 25 ms are no whole number of hundredths, 50 ms are
    ],
)
def test_pictures_are_a_part_or_a_multiple_of_control_steps(frame_skip, dt, steps):
    assert picture_steps(frame_skip, dt) == steps


def test_steps_within_a_control_step_lead_to_its_end_bit_by_bit():
    """A kick: the first physics step has loads of its own."""
    task = gym.make("rigid_env/BallKick-v0").unwrapped
    task.reset(seed=0)
    world, recorder = task.task.world, physics.Recorder(task.task.world)
    task.step(KICK)
    places = [each.pos[0, 0].copy() for each in _retaken(recorder.recording())]
    assert len(places) == task.task.frame_skip
    assert np.array_equal(places[-1], world.pos[0, 0])
    assert (np.diff([place[0] for place in places]) > 0.0).all()


def test_pictures_within_a_control_step_differ_and_keep_its_text():
    env = gym.make("rigid_env/BallKick-v0").unwrapped
    film = Film(env.task, (160, 100))
    env.reset(seed=0)
    before, recorder = frame_of(env.task), physics.Recorder(env.task.world)
    env.step(KICK)
    pictures = [film.picture(before), *film.parts(before, recorder.recording()), film.picture()]
    assert len(pictures) == 1 + env.task.frame_skip // film.steps
    assert all(np.any(one != other) for one, other in pairwise(pictures))


def test_a_video_lasts_as_long_as_its_episode(tmp_path):
    """Its last picture stays for ten more."""
    (told,) = write_video("rigid_env/BallKick-v0", tmp_path / "kick.gif", [0], size=(160, 100))
    seconds = float(told.split()[-2])
    with Image.open(tmp_path / "kick.gif") as gif:
        times = []
        for k in range(gif.n_frames):
            gif.seek(k)
            times.append(gif.info["duration"])
    assert min(times) == pytest.approx(40)
    assert sum(times) == pytest.approx(1000 * seconds + 11 * 40)
    assert min(times) <= 1000 * FRAME_TIME
