"""`rigid_env/Scene-v0`: environments of scene files, of canonical scenes and of scenes made in Python."""

from __future__ import annotations

import inspect
import warnings
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

import physics
from physics import scenes
from rigid_env import SceneEnv, SceneVectorEnv, Uniform
from rigid_env.envs.checks import check_task
from rigid_env.tasks.scene_task import BONUS, SceneTask
from tests.envs.test_documentation import SECTIONS, ast_literal, check_rows, section, table
from tests.tiers.sweep import sweep

pytestmark = pytest.mark.interpreted

CART = Path(__file__).parents[2] / "examples" / "cart.toml"
ID = "rigid_env:rigid_env/Scene-v0"
STARTS = ("pos", "quat", "linvel", "angvel")

BALL = physics.Scene(
    [physics.Sphere(0.5, 1.0, pos=(0, 3, 0), linvel=(1, 0, 0), name="ball")],
    [physics.HalfSpace((0, 1, 0))],
    [physics.Gravity(), physics.Contact(0.5), physics.Friction(0.3), physics.Drag()],
)
FREE = physics.Scene([physics.Sphere(0.5, 2.0, quat=(np.sqrt(0.5), 0, 0, np.sqrt(0.5)))])
AIM = {"low": (-1, 1, 0), "high": (1, 2, 0), "tolerance": 0.5}

CHECKED = {
    "file": {"scene": str(CART)},
    "block": {"scene": "drop"},
    "bodies": {"scene": "tower", "driven": [0, 3], "goal": {"body": 3, "pos": (1, 2, 0), "tolerance": 0.5}},
    "drag": {"scene": BALL, "goal": AIM, "start": {"linvel": (1, 1, 1)}, "frame": "body", "length": 2.0},
}


# One that compiles a plan of its own is interpreted.
@pytest.mark.parametrize("name", [pytest.param(n, marks=() if n == "drag" else pytest.mark.compiled) for n in CHECKED])
def test_check_task_finds_nothing(name, is_exhaustive):
    contexts = ("fork", "spawn") if name == "file" and is_exhaustive else ("fork",)  # `test_examples` spawns, too
    check_task(SceneTask, steps=30, contexts=contexts, **CHECKED[name])


@pytest.mark.compiled
@pytest.mark.parametrize("name", sweep(CHECKED, lambda name: name != "drag"))
def test_checkers_find_nothing(name):
    from gymnasium.utils.env_checker import check_env
    from stable_baselines3.common.env_checker import check_env as sb3_check_env

    env = gym.make(ID, **CHECKED[name])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)
        sb3_check_env(env.unwrapped)


# --- the same scene in all ways -------------------------------------------------------------------------------------


def test_a_file_a_name_and_an_object_are_the_same_scene(tmp_path):
    scene = scenes.by_name("drop")
    physics.save_scene(scene, tmp_path / "own.toml")
    seen = [SceneEnv(each).reset(seed=0)[0] for each in ("drop", scene, tmp_path / "own.toml")]
    np.testing.assert_array_equal(seen[1], seen[0])
    np.testing.assert_array_equal(seen[2], seen[0])


def test_without_a_start_bodies_are_where_the_scene_has_them():
    task = SceneEnv("drop").task
    task.seed(0, 0)
    task.start(np.zeros(1, dtype=np.int64))
    (body,) = task.scene.bodies
    for name in STARTS:
        np.testing.assert_array_equal(getattr(task.world, name)[0, 0], getattr(body, name))


def test_an_argument_takes_the_place_of_a_key_of_the_file():
    task = SceneTask(
        1, CART, driven=["crate", 0], force=2.0, torque=0.0, frame="body", length=1.0, frame_skip=2, dt=0.001, start={},
        goal={"pos": (1, 2, 3), "tolerance": 1},
    )  # fmt: skip
    assert [(each.body, each.force, each.torque, each.frame) for each in task.actions] == [
        (1, 2.0, 0.0, "body"), (0, 2.0, 0.0, "body"),
    ]  # fmt: skip
    assert (task.action_size, task.frame_skip, task.world.dt, task.settings.goal.body) == (6, 2, 0.001, 1)
    assert list(task.drawn) == ["goal"]
    assert task.observed.entries[0].scale == task.observed.entries[-1].scale == 1.0
    assert task.max_episode_steps == 300  # of the file


# --- what acts, and what is seen ------------------------------------------------------------------------------------


@pytest.mark.parametrize(("frame", "along"), [("world", 0), ("body", 1)])
def test_a_force_in_weights_gives_that_part_of_g(frame, along):
    """v = f g t without gravity, too; the body is turned by a quarter about z, so that its x points along y."""
    task = SceneTask(1, FREE, force=0.5, frame=frame)
    task.seed(0, 0)
    task.start(np.zeros(1, dtype=np.int64))
    task.step([[1, 0, 0, 0, 0, 0]])
    expected = np.zeros(3)
    expected[along] = 0.5 * 9.81 * task.control_dt
    # Five sums, a turned vector and its scale: some ten roundings of a number near 0.12.
    np.testing.assert_allclose(task.world.linvel[0, 0], expected, rtol=0, atol=10 * np.finfo(float).eps)


def test_the_documented_tables_are_those_of_a_body_with_a_goal():
    env = SceneEnv("drop", goal={"pos": (1, 1.5, 0), "tolerance": 0.5})
    doc = SceneEnv.__doc__
    rows = table(section(doc, "Observation Space"))
    check_rows(rows, env.observation_space)
    entries = [(name, entry.told_unit) for entry in env.task.observation for name in entry.names]
    assert [(row[1], row[4]) for row in rows] == entries
    assert "18 float32 for each body" in doc
    assert SceneEnv("tower", driven=0).observation_space.shape == (18 * 10,)
    rows = table(section(doc, "Action Space"))
    check_rows(rows, env.action_space)
    vectors = env.task.action_vectors
    assert [row[1] for row in rows] == [name for vector in vectors for name in vector.names]
    assert [row[4] for row in rows] == [vector.unit for vector in vectors for _ in vector.axes]


def test_the_documented_arguments_and_sections_are_there():
    doc = SceneEnv.__doc__
    assert [line.strip()[3:] for line in doc.splitlines() if line.strip().startswith("## ")] == SECTIONS
    rows = {row[0].strip("`"): ast_literal(row[1].strip("`")) for row in table(section(doc, "Arguments"))}
    assert rows == {
        name: each.default for name, each in inspect.signature(SceneEnv.__init__).parameters.items() if name != "self"
    }
    env = SceneEnv(CART)
    _, info = env.reset(seed=0)
    assert all(f"`{name}`" in section(doc, "Episode End") for name in info)


# --- rewards and ends ------------------------------------------------------------------------------------------------


@pytest.mark.compiled
def test_the_example_can_be_solved_and_its_rewards_add_up():
    """Gains of closeness add up to the difference of its ends, log((1 + d0 / t) / (1 + d / t)), and the bonus."""
    env = gym.make(ID, scene=str(CART))
    obs, info = env.reset(seed=0, options={"start_pos": np.zeros(6), "goal": (2.0, 0.4, 0.0)})
    assert info["distance"] == pytest.approx(2.0, rel=1e-15)
    total, is_over = 0.0, False
    while not is_over:
        speed, crate, goal = 5 * obs[3], 5 * obs[18], 5 * obs[36]
        wanted = min(1.0, goal - crate)  # push at 1 m/s, and slow down before the goal
        action = np.zeros(6, dtype=np.float32)
        action[0] = 0.45 + wanted - speed
        obs, reward, is_over, is_cut, info = env.step(action)
        assert reward == info["reward_progress"] + info["reward_success"]
        total += reward
        assert not is_cut
    assert info["is_success"]
    assert info["distance"] <= 0.3
    assert info["speed"] <= 0.1
    assert BONUS == 5.0  # as documented
    # Sums of less than 300 numbers below 2.
    gained = np.log((1 + 2.0 / 0.3) / (1 + info["distance"] / 0.3))
    assert total == pytest.approx(gained + BONUS, abs=300 * 4 * np.finfo(float).eps)


def test_closeness_does_not_know_the_scale():
    """A scene of another size, seen as many tolerances away, gains as much by the same share of the way."""
    gains = []
    for scale in (1.0, 100.0):
        scene = physics.Scene([physics.Sphere(0.5, 2.0, linvel=(40 * scale, 0, 0))])
        goal = {"pos": (2 * scale, 0, 0), "tolerance": 0.1 * scale}
        env = SceneEnv(scene, goal=goal, length=5 * scale)
        env.reset(seed=0)
        gains.append(env.step(np.zeros(6))[1])
    assert gains[0] == pytest.approx(np.log((1 + 2 / 0.1) / (1 + 1 / 0.1)), rel=1e-12)  # 1 m in 25 ms
    assert gains[1] == pytest.approx(gains[0], rel=1e-12)


def test_at_the_goal_a_body_must_be_slow():
    goal = {"pos": (0, 0, 0), "tolerance": 1.0, "speed": 0.5}
    for speed, is_reached in ((0.4, True), (0.6, False)):
        env = SceneEnv(physics.Scene([physics.Sphere(0.5, 2.0, linvel=(speed, 0, 0))]), goal=goal)
        env.reset(seed=0)
        assert env.step(np.zeros(6))[2] is is_reached


def test_without_a_goal_the_reward_is_nothing_and_no_end_comes():
    env = SceneEnv(BALL)
    env.reset(seed=0)
    for _ in range(20):
        _, reward, is_over, is_cut, info = env.step(env.action_space.sample())
        assert (reward, is_over, is_cut) == (0.0, False, False)
    assert set(info) == {"is_success", "physics_status"}


def limited(tmp_path, steps):
    path = tmp_path / "limited.toml"
    physics.save_scene(BALL, path)
    path.write_text(path.read_text() + f"\n[environment]\nmax_episode_steps = {steps}\n")
    return path


def length(env):
    env.reset(seed=0)
    for k in range(1, 100):
        if env.step(np.zeros(6, dtype=np.float32))[3]:
            return k
    return None


def test_the_file_limits_episodes(tmp_path):
    path = limited(tmp_path, 7)
    assert length(SceneEnv(path)) == 7
    assert length(gym.make(ID, scene=path)) == 7
    assert length(gym.make(ID, scene=path, max_episode_steps=4)) == 4
    assert gym.make_vec(ID, num_envs=2, scene=path).max_episode_steps == 7
    assert SceneVectorEnv(2, BALL).max_episode_steps is None
    for limit in (-1, None):  # a single environment keeps the file's, too
        with pytest.raises(ValueError, match=f"max_episode_steps is {limit}, and the scene's 7; allowed are at most 7"):
            gym.make_vec(ID, num_envs=2, scene=path, max_episode_steps=limit)
    envs = SceneVectorEnv(2, path)
    for limit in (8, None, -1):
        with pytest.raises(ValueError, match="the scene's 7; allowed are at most 7"):
            envs.set_attr("max_episode_steps", limit)
    envs.set_attr("max_episode_steps", 5)
    assert envs.max_episode_steps == 5
    envs = SceneVectorEnv(2, path)
    envs.reset(seed=0)
    cuts = [envs.step(np.zeros((2, 6)))[3].tolist() for _ in range(7)]
    assert cuts == [[False] * 2] * 6 + [[True] * 2]


@pytest.mark.parametrize("steps", [3, 7, 12])
def test_an_explicit_limit_takes_the_place_of_the_files_in_single_and_batch(steps, tmp_path):
    path = limited(tmp_path, 7)
    assert length(SceneEnv(path, episode_steps=steps)) == steps
    assert length(gym.make(ID, scene=path, episode_steps=steps)) == steps
    assert length(gym.make(ID, scene=path, episode_steps=steps, max_episode_steps=2)) == 2
    for mode in ("vector_entry_point", "sync"):
        envs = gym.make_vec(ID, num_envs=2, scene=path, episode_steps=steps, vectorization_mode=mode)
        envs.reset(seed=0)
        cuts = [envs.step(np.zeros((2, 6), dtype=np.float32))[3].tolist() for _ in range(steps)]
        assert cuts == [[False] * 2] * (steps - 1) + [[True] * 2]
    assert gym.make_vec(ID, num_envs=2, scene=path, episode_steps=steps, max_episode_steps=2).max_episode_steps == 2


@pytest.mark.parametrize("value", [8, None])
def test_a_batch_refuses_a_limit_that_a_single_environment_would_not_reach(value, tmp_path):
    path = limited(tmp_path, 7)
    with pytest.raises(ValueError, match=f"max_episode_steps is {value}, and the scene's 7; allowed are at most 7, or"):
        gym.make_vec(ID, num_envs=2, scene=path, max_episode_steps=value)
    assert gym.make_vec(ID, num_envs=2, scene=BALL, max_episode_steps=value).max_episode_steps == value
    with pytest.raises(ValueError, match="episode_steps is 0; allowed"):
        SceneEnv(path, episode_steps=0)


# --- starts ----------------------------------------------------------------------------------------------------------


def test_starts_lie_within_the_half_widths_and_options_fix_them():
    start = {"pos": (0.3, 0, 0.1), "angvel": (0, 2, 0)}
    task = SceneTask(200, CART, start=start)
    for world in range(200):
        task.seed(world, world)
    task.start(np.arange(200))
    for name, width in start.items():
        off = getattr(task.world, name) - np.array([getattr(body, name) for body in task.scene.bodies])
        assert (np.abs(off) <= np.array(width) + 1e-15).all()  # a sum and a difference near 2 m
        assert (np.abs(off).max(axis=0) >= 0.9 * np.array(width)).all()  # missed by 200 draws once in 1e9
        assert not np.array_equal(off[:, 0], off[:, 1])  # each body its own
    task.start(np.arange(1), {"start_pos": np.zeros(6)})
    np.testing.assert_array_equal(task.world.pos[0], [body.pos for body in task.scene.bodies])


def test_draws_can_be_replaced():
    task = SceneTask(1, CART, draws={"goal": Uniform((0, 1, 0), (0, 1, 0))})
    np.testing.assert_array_equal(task.drawn["goal"], [[0, 1, 0]])


def test_a_goal_is_drawn_in_pictures():
    env = SceneEnv(CART, render_mode="rgb_array", width=64, height=48)
    env.reset(seed=0, options={"goal": (2.0, 0.4, 0.0)})
    mark = env.task.goal_mark(0)
    np.testing.assert_array_equal(mark["pos"], [2.0, 0.4, 0.0])
    assert mark["radius"] == pytest.approx(0.3 + 0.4 * np.sqrt(3), rel=1e-15)
    assert env.render().shape == (48, 64, 3)
