"""BallKick: flights in closed form, with effects on and off, and the post that hides the ring."""

from __future__ import annotations

from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import physics
import rigid_env  # noqa: F401 (registers)
from rigid_env.rendering.camera_argument import as_camera
from rigid_env.rendering.view import frame_of
from rigid_env.suite import ball_kick
from rigid_env.suite.ball_kick import BRUSH, LENGTHS, MASS, RADIUS, SPEED, TURN, BallKick, G, controller, least_distance

ENV = "rigid_env/BallKick-v0"
CALM = {"wind": (0.0, 0.0)}
NO_AIR = (physics.Drag(0.0), physics.Magnus(0.0))
OPTIONS = {"ring": (20.0, 1.0, 3.0), "side": 0.2}
KICK, STROKE = np.array((0.7, 0.6, 0.6)), np.array((0.2, -0.5))  # shares of the limits


def kicked(wind=None, **settings) -> BallKick:
    """A task 0.6 s after a kick whose ball does not come near the post; `wind` fixes what is drawn."""
    task = BallKick(dt=0.001, frame_skip=200, **settings)
    task.seed(0, 0)
    task.start(np.zeros(1, dtype=np.int64), OPTIONS if wind is None else {**OPTIONS, "wind": wind})
    for _ in range(3):
        task.step([[*KICK, *STROKE]])
    return task


def launch() -> tuple[np.ndarray, np.ndarray]:
    """Velocity and spin of the kick: an impulse J at the arm r of a uniform sphere leaves J/m and r x J/(0.4 m R²)."""
    stroke = BRUSH * np.array((0.0, *STROKE))
    return (SPEED, TURN, TURN) * KICK + stroke, np.cross((-RADIUS, 0.0, 0.0), stroke) / (0.4 * RADIUS**2)


def flown(time: float, drag: float, lift: float, wind) -> np.ndarray:
    """Place of the ball by DOP853. The kick acts evenly over the first 1 ms, so that time is lost on half of it."""
    velocity, spin = launch()
    shadow = 0.5 * 1.225 * np.pi * RADIUS**2

    def motion(t, y):
        air = y[3:] - wind
        force = -shadow * drag * np.linalg.norm(air) * air + shadow * lift * RADIUS * np.cross(spin, air)
        return np.concatenate([y[3:], force / MASS - np.array((0.0, G, 0.0))])

    start = [0.0, RADIUS, 0.0, *velocity]
    return solve_ivp(motion, (0.0, time - 5e-4), start, method="DOP853", rtol=1e-10, atol=1e-10).y[:3, -1]


@pytest.mark.parametrize(
    ("settings", "drag", "lift", "wind"),
    [
        ({"effects": NO_AIR, "wind": (4.0, 5.0)}, 0.0, 0.0, (0.0, 0.0)),
        ({"effects": NO_AIR[:1], "wind": (0.0, 0.0)}, 0.0, 1.0, (0.0, 0.0)),
        ({"effects": NO_AIR[1:], "wind": (0.0, 0.0)}, 0.25, 0.0, (0.0, 0.0)),
        ({"wind": (0.0, 0.0)}, 0.25, 1.0, (0.0, 0.0)),
        ({"wind": (-4.0, 5.0)}, 0.25, 1.0, (-4.0, 5.0)),
        ({"effects": [physics.Wind((-4.0, 0.0, 5.0))], "draws": CALM}, 0.25, 1.0, (-4.0, 5.0)),
    ],
)
def test_the_flight_is_that_of_its_effects(settings, drag, lift, wind):
    """During the 1 ms of the kick loads differ by at most 20 m/s²: 0.02 m/s, and 12 mm after 0.6 s; half of it here."""
    task = kicked(**settings)
    assert task.world.angvel[0, 0] == pytest.approx(launch()[1], abs=1e-6)
    assert task.world.pos[0, 0] == pytest.approx(flown(0.6, drag, lift, (wind[0], 0.0, wind[1])), abs=6e-3)


def test_a_wind_of_the_user_needs_a_wind_that_is_not_drawn():
    with pytest.raises(ValueError, match="wind is drawn from a range"):
        gym.make(ENV, effects=[physics.Wind((1.0, 0.0, 0.0))])


def test_each_world_is_told_the_wind_that_blows_there():
    task = kicked(effects=[physics.Wind((1.0, 0.0, -2.0))], draws=CALM)
    assert task.obs[0, 11:13] * ball_kick.WIND == pytest.approx((1.0, -2.0))
    envs = gym.make_vec(ENV, num_envs=8)
    observations, infos = envs.reset(seed=0)
    assert observations[:, 11:13] * ball_kick.WIND == pytest.approx(infos["wind"], abs=1e-6)
    assert np.ptp(infos["wind"], axis=0).min() > 1.0


def rate(act, worlds: int = 64) -> float:
    """Share of first episodes in which the ball goes through the ring, for actions held."""
    envs = gym.make_vec(ENV, num_envs=worlds, autoreset_mode="SameStep")
    observations, _ = envs.reset(seed=0)
    actions, is_won, is_over = act(observations), np.zeros(worlds, bool), np.zeros(worlds, bool)
    for _ in range(ball_kick.FLIGHT):
        _, _, terminated, truncated, infos = envs.step(actions)
        ended = (terminated | truncated) & ~is_over
        if ended.any():
            is_won |= ended & infos["final_info"]["is_success"]
        is_over |= ended
    assert is_over.all()
    return is_won.mean()


def without_spin(observations):
    """Kicks that fly straight to the ring, but for gravity and wind."""
    ring, wind = LENGTHS * observations[:, :3].astype(float), np.zeros((len(observations), 3))
    wind[:, ::2] = ball_kick.WIND * observations[:, 11:13]
    velocity, _ = ball_kick.aim(ring, np.zeros_like(ring), wind)
    return np.column_stack([velocity / (SPEED, TURN, TURN), np.zeros((len(ring), 2))])


def test_the_post_is_in_the_way_of_a_kick_without_spin():
    assert rate(without_spin) == 0.0
    assert rate(lambda seen: np.zeros((len(seen), 5))) == 0.0
    assert rate(controller) == 1.0


@pytest.mark.parametrize("wind", [-5.0, 0.0, 5.0])
def test_only_topspin_brings_a_ball_over_the_post_in_time(wind):
    """Kicks of a grid, straight ahead, at rings near and high, near and low, and far, by the model of the flight."""
    ahead, up = (each.ravel() for each in np.meshgrid(np.linspace(8.0, 30.0, 45), np.linspace(0.0, 14.0, 57)))
    velocity = np.stack([ahead, up, np.zeros_like(up)], axis=1)
    for distance, height in ((16.0, 2.2), (16.0, 0.6), (22.0, 0.6)):
        for spin in (0.0, -80.0):
            vectors = (np.tile(each, (len(up), 1)) for each in ((0.0, 0.0, spin), (wind, 0.0, 0.0)))
            places, duration = ball_kick.fly(velocity, *vectors, np.full(len(up), distance))
            heights = places[:, :, 1] + RADIUS
            is_over = heights[round(ball_kick.POST_SHARE * ball_kick.PARTS)] > ball_kick.POST[1] + RADIUS
            is_hit = is_over & (np.abs(heights[-1] - height) < ball_kick.RING) & (duration < 1.2)
            if spin == 0.0:
                assert not is_hit.any()
            elif (distance, height) == (16.0, 2.2):
                assert is_hit.any()


def flights(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Places (k, 3) of the ball on the controller's kicks to `count` random rings, and the centres of these rings."""
    rng, ring_draw = np.random.default_rng(0), BallKick.draws["ring"]
    rings, wind = rng.uniform(ring_draw.low, ring_draw.high, (count, 3)), np.zeros((count, 3))
    wind[:, ::2] = rng.uniform(-5.0, 5.0, (count, 2))
    centre = np.array((0.0, RADIUS, 0.0))
    spins = (np.tile((0.0, turn, 0.0), (count, 1)) for turn in (-ball_kick.AIMING_SPIN, ball_kick.AIMING_SPIN))
    return np.concatenate(
        [ball_kick.aim(rings - centre, spin, wind)[1].reshape(-1, 3) for spin in spins]
    ) + centre, rings


def test_its_pictures_show_ball_post_and_ring_over_the_whole_flight():
    """The ring's lowest point and its highest are at most its radius from the centre."""
    width, height = size = (480, 300)
    ball, rings = flights(200)
    around = ball_kick.RING * np.concatenate([np.eye(3), -np.eye(3)])[:, None]
    post = BallKick.scene.bodies[1]
    corners = np.array(post.pos) + 0.5 * np.array(post.size) * np.array(np.meshgrid(*3 * [(-1, 1)])).reshape(3, -1).T
    pixels, depths = as_camera(BallKick.camera).project(np.concatenate([ball, *(rings + around), corners]), size)
    assert (depths > 0.0).all()
    assert (pixels > 0.0).all()
    assert (pixels < (width, height)).all()


@pytest.mark.interpreted
def test_its_ring_is_where_it_is_drawn():
    """Pixels of the ring's rim have another colour than without a goal, and the disc on the floor is not there."""
    pytest.importorskip("pygame")
    env = gym.make(ENV, render_mode="rgb_array", width=480, height=300).unwrapped
    _, info = env.reset(seed=0)
    task = env.task
    camera = as_camera(task.camera)
    with_ring, without = env.render().astype(int), env._view.draw_frame(task, replace(frame_of(task), goal=None))
    is_other = np.abs(with_ring - without).sum(axis=2) > 30
    turns = np.linspace(0.0, 2.0 * np.pi, 13)
    rim = info["ring"] + ball_kick.RING * np.stack([0 * turns, np.cos(turns), np.sin(turns)], axis=1)
    pixels = camera.project(rim, (480, 300))[0].astype(int)
    assert all(is_other[y - 1 : y + 2, x - 1 : x + 2].any() for x, y in pixels)
    foot = np.array((info["ring"][0], 0.0, info["ring"][2]))
    across = np.array((0.0, 0.0, ball_kick.RING))
    edge = camera.project(np.stack([foot - across, foot + across]), (480, 300))[0].astype(int)
    assert not any(is_other[y, x] for x, y in edge)


def test_later_actions_have_no_effect():
    envs = [gym.make(ENV).unwrapped for _ in range(2)]
    for env in envs:
        env.reset(seed=3)
        env.step(np.array([0.5, 0.2, 0.3, 0.1, 0.1]))
    for later in (np.ones(5), -np.ones(5)):
        seen = [env.step(action)[0] for env, action in zip(envs, (np.zeros(5), later))]
        assert np.array_equal(*seen)


def test_the_least_distance_of_a_parabola():
    """x = 20 t, y = 5 t - g t²/2: parts of 10 ms are straight, g 0.01²/8 = 0.12 mm off; the least of 10⁵ places."""
    velocity = np.array([20.0, 5.0, 0.0])
    end = np.array([4.0, 1.0 - 0.02 * G, 0.0])
    point = np.array([2.3, 0.9, 0.4])
    found = least_distance(
        (np.zeros((1, 3)), end[None]), (velocity[None], (velocity - (0.0, 0.2 * G, 0.0))[None]), 0.2, point[None]
    )
    t = np.linspace(0.0, 0.2, 100_001)[:, None]
    way = t * velocity - 0.5 * G * t**2 * (0.0, 1.0, 0.0)
    assert found[0] == pytest.approx(np.linalg.norm(way - point, axis=1).min(), abs=1.3e-4)
