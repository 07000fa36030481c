"""Collisions in `info` and in observations: alone, in batches, in each way of starting anew, and at each preset."""

from __future__ import annotations

import pickle

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

import physics
from rigid_env import BlockReachEnv, BlockReachVectorEnv, SceneEnv, SceneVectorEnv, TaskEnv, TaskVectorEnv
from rigid_env.envs.checks import check_task
from rigid_env.envs.contact_infos import IMPACT_KEYS as KEYS
from rigid_env.envs.infos import InfoMaker
from rigid_env.tasks import Impulse, Task, observe
from tests.envs.conftest import random_actions
from tests.tasks.conftest import Slide

pytestmark = pytest.mark.interpreted

MASS, RADIUS, ROWS, EPS = 2.0, 0.5, 2, np.finfo(float).eps
SHAPES = {
    "impact_count": (), "impact_left_out": (), "impact_hits": (ROWS,), "impact_ends": (ROWS, 2),
    "impact_point": (ROWS, 3), "impact_impulse": (ROWS, 3),
}  # fmt: skip


class Bounce(Task):
    """A ball that bounces on a floor between two walls; an action kicks it, in the first physics step."""

    scene = physics.Scene(
        bodies=[physics.Sphere(RADIUS, MASS, pos=(0, 1.0, 0))],
        walls=[
            physics.HalfSpace((0, 1, 0), 0.0),
            physics.HalfSpace((1, 0, 0), -0.6),
            physics.HalfSpace((-1, 0, 0), -0.6),
        ],
        effects=[physics.Gravity((0, -9.81, 0)), physics.Contact(0.9)],
    )
    actions = Impulse(0, strength=0.5, axes="xy")
    observation = (
        observe.impact_impulse(scale=1.0, bound=100.0), observe.impact_impulses(count=1, scale=1.0, bound=100.0),
        observe.linvel(),
    )  # fmt: skip
    draws = {"speed": (1.0, 4.0)}  # noqa: RUF012

    def place(self, drawn):
        linvel = np.zeros((len(drawn["speed"]), 3))
        linvel[:, 0], linvel[:, 1] = drawn["speed"], -drawn["speed"]
        return {"linvel": linvel}

    def measure(self, worlds):
        return {"hits": worlds.impacts.hits.sum(axis=1), "push": worlds.impact_impulse[:, 0, 1]}

    def rewards(self, worlds):
        return {"height": worlds.pos[:, 0, 1]}


def check_equal(ours: dict, theirs: dict, *places) -> None:
    """The collisions of two infos, of which the second is that of a batch at a place, have the same bits."""
    for key in KEYS:
        other = theirs[key][places] if places else theirs[key]
        np.testing.assert_array_equal(ours[key], other, err_msg=key)
        assert np.shape(ours[key]) == SHAPES.get(key, np.shape(ours["impact_total"]))


# --- what a control step tells --------------------------------------------------------------------------------


@pytest.mark.parametrize("accuracy", ["fast", "balanced", "precise"])
def test_a_control_step_tells_its_change_of_momentum(accuracy):
    """m Δv = p of the collisions + m g t + p of the action, over all physics steps: nothing rests in them.

    A physics step adds the weight and at most two collisions to the velocity: four sums, of the largest momentum.
    """
    env = TaskEnv(Bounce, accuracy=accuracy, impacts=ROWS)
    _, info = env.reset(seed=3)
    assert info["impact_count"] == info["hits"] == 0
    task, hits = env.task, 0
    weight = np.array([0.0, -9.81 * MASS * task.control_dt, 0.0])
    for k in range(30):
        before, action = task.world.linvel[0, 0].copy(), np.array([0.4, -0.5]) * (k % 3 == 0)
        obs, _, _, _, info = env.step(action)
        given = np.array([*(0.5 * 9.81 * MASS * action), 0.0])
        change = MASS * (task.world.linvel[0, 0] - before)
        size = MASS * (np.abs(before).max() + np.abs(task.world.linvel).max()) + np.abs(given).max()
        atol = 4 * task.frame_skip * EPS * size
        np.testing.assert_allclose(info["impact_total"][0], change - weight - given, rtol=0, atol=atol)
        np.testing.assert_allclose(info["impact_impulse"].sum(axis=0), info["impact_total"][0], rtol=0, atol=atol)
        np.testing.assert_allclose(
            obs[:3], info["impact_total"][0] / (9.81 * MASS), rtol=np.finfo(np.float32).eps, atol=1e-12
        )
        assert info["hits"] == info["impact_hits"].sum()
        assert info["push"] == info["impact_total"][0, 1]
        hits += info["hits"]
    assert hits > 5


def test_a_collision_in_the_first_of_two_calls_is_told():
    """It collides in the first physics step, which is a call of its own: p = (1 + e) m v, and gravity's part."""
    env = TaskEnv(Bounce, impacts=ROWS)
    env.reset(seed=0)
    env.task.world.set_state(pos=[0, RADIUS + 0.001, 0], linvel=[0, -3.0, 0])
    info = env.step(np.array([0.1, 0.0]))[4]
    assert info["impact_hits"].tolist() == [1, 0]
    assert info["impact_ends"].tolist() == [[0, -1], [0, 0]]
    assert info["impact_impulse"][0, 1] == pytest.approx(1.9 * MASS * np.sqrt(3.0**2 + 2 * 9.81 * 0.001), rel=1e-6)


def test_environments_of_scenes_tell_collisions_of_bodies():
    env, envs = SceneEnv("tower", driven=[0], impacts=16), SceneVectorEnv(2, "tower", driven=[0], impacts=16)
    env.reset(seed=0)
    envs.reset(seed=0)
    for each in (env, envs):
        world = each.task.world
        speed = np.zeros((world.worlds, world.body_count, 3))
        speed[:, -1, 1] = -3.0
        world.set_state(linvel=speed)
    info, infos = env.step(np.zeros(6))[4], envs.step(np.zeros((2, 6)))[4]
    assert (info["impact_ends"][: info["impact_count"], 1] >= 0).any()
    # Bodies push each other with opposite impulses: the floor alone has given them momentum.
    floor = info["impact_impulse"][info["impact_ends"][:, 1] < 0].sum(axis=0)
    np.testing.assert_allclose(info["impact_total"].sum(axis=0), floor, rtol=0, atol=1e-13 * np.abs(floor).max())
    for key in KEYS:
        np.testing.assert_array_equal(info[key], infos[key][0])


# --- the same bits --------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", ["NextStep", "SameStep", "Disabled"])
def test_a_batch_tells_what_single_environments_tell(mode):
    envs = TaskVectorEnv(3, task=Bounce, autoreset_mode=mode, max_episode_steps=6, impacts=ROWS)
    singles = [TaskEnv(Bounce, impacts=ROWS) for _ in range(3)]
    _, infos = envs.reset(seed=2)
    for i, env in enumerate(singles):
        check_equal(env.reset(seed=2 + i)[1], infos, i)
        assert all(infos[f"_{key}"].all() for key in KEYS)
    action, hits = np.zeros((3, 2)), 0
    for k in range(6):
        infos = envs.step(action)[4]
        last = k == 5 and mode == "SameStep"  # what is told then is of the next episode
        told = infos["final_info"] if last else infos
        for i, env in enumerate(singles):
            check_equal(env.step(action[i])[4], told, i)
        hits += told["impact_hits"].sum()
        assert not (last and infos["impact_count"].any())
    assert hits > 3
    if mode == "NextStep":
        assert not envs.step(action)[4]["impact_count"].any()  # episodes begin in this step
    if mode == "Disabled":
        mask = np.array([True, False, False])
        _, infos = envs.reset(options={"reset_mask": mask})
        assert all(not infos[key].any() for key in KEYS)
        np.testing.assert_array_equal(infos["_impact_total"], mask)


def test_gymnasium_and_the_task_check_are_content():
    check_env(TaskEnv(Bounce, impacts=ROWS), skip_render_check=True)
    check_task(Bounce, 24, contexts=(), impacts=ROWS, contacts=3)


def test_episodes_have_the_same_bits_with_and_without(rng):
    told, plain = BlockReachEnv(impacts=ROWS), BlockReachEnv()
    np.testing.assert_array_equal(told.reset(seed=4)[0], plain.reset(seed=4)[0])
    hits = 0
    for action in random_actions(rng, 15, 1):
        ours, theirs = told.step(action[0]), plain.step(action[0])
        np.testing.assert_array_equal(ours[0], theirs[0])
        assert ours[1:4] == theirs[1:4]
        np.testing.assert_equal({key: value for key, value in ours[4].items() if key not in KEYS}, theirs[4])
        hits += ours[4]["impact_hits"].sum()
    assert hits > 0


def test_without_the_argument_nothing_is_kept():
    env, envs = BlockReachEnv(), BlockReachVectorEnv(2)
    assert isinstance(env._info, InfoMaker)  # not the one that adds contacts and impacts
    assert not set(KEYS) & set(env.reset(seed=0)[1])
    assert not set(KEYS) & set(envs.reset(seed=0)[1])
    for world in (env.task.world, envs.task.world):
        assert world.event_log.size == 0
        assert world.impacts is None
        assert world.is_plain
    assert TaskEnv(Slide).task.world.impacts is None
    assert TaskEnv(Bounce).task.world.impacts is not None  # its functions read them


def test_a_copy_tells_its_own_collisions():
    env = TaskEnv(Bounce, impacts=ROWS)
    env.reset(seed=0)
    for _ in range(4):
        env.step(np.zeros(2))
    twin = pickle.loads(pickle.dumps(env))
    for _ in range(6):
        ours, theirs = env.step(np.zeros(2))[4], twin.step(np.zeros(2))[4]
        check_equal(ours, theirs)
    assert twin._info._contacts._readers[0].read.__self__ is twin.task.world


def test_a_restored_state_goes_on_with_the_same_collisions():
    env = TaskEnv(Bounce, impacts=ROWS)
    env.reset(seed=1)
    env.step(np.zeros(2))
    kept = env.get_state()
    first = [env.step(np.zeros(2))[4] for _ in range(5)]
    env.set_state(kept)
    for before in first:
        check_equal(before, env.step(np.zeros(2))[4])


# --- ways to request them --------------------------------------------------------------------------------------


def test_gymnasium_makes_them_with_the_argument():
    env = gym.make("rigid_env/BlockReach-v0", impacts=2)
    assert env.reset(seed=0)[1]["impact_point"].shape == (2, 3)
    envs = gym.make_vec("rigid_env/BlockReorient-v0", num_envs=3, impacts=2)
    assert envs.reset(seed=0)[1]["impact_point"].shape == (3, 2, 3)
    others = gym.make_vec("rigid_env/BlockReach-v0", num_envs=2, vectorization_mode="sync", impacts=2)
    _, infos = others.reset(seed=0)
    assert infos["impact_total"].shape == (2, 1, 3)
    assert infos["_impact_total"].all()


def test_entries_have_names_and_units():
    total, each = observe.impact_impulse(1), observe.impact_impulses(count=1)
    assert total.names == tuple(f"impact impulse of body 1 {axis}" for axis in "xyz")
    assert each.names == ("impact: impulse 0 x", "impact: impulse 0 y", "impact: impulse 0 z")
    assert total.told_unit == each.told_unit == "0.1 m g s"


def test_a_task_that_measures_the_same_key_is_refused():
    class Measuring(Slide):
        def measure(self, worlds):
            return {"impact_count": np.zeros(len(worlds))}

    with pytest.raises(ValueError, match=r"impacts is 1, but Measuring has 'impact_count' in its info; allowed are 0"):
        TaskEnv(Measuring, impacts=1)
    assert TaskEnv(Measuring, contacts=1).reset(seed=0)[1]["impact_count"] == 0.0


def test_a_function_that_reads_them_too_late_is_told_so():
    class Late(Slide):
        def measure(self, worlds):
            return {"push": worlds.impact_impulse[:, 0, 0] if worlds.steps[0] > 0 else np.zeros(len(worlds))}

    env = TaskEnv(Late)
    env.reset(seed=0)
    with pytest.raises(
        ValueError, match=r"keep_impacts\(room=256\) comes after a Stepper .* allowed is to call it before"
    ):
        env.step(np.zeros(1))


def test_stable_baselines_gets_them_at_the_end_of_episodes():
    pytest.importorskip("stable_baselines3")
    from rigid_env import RigidVecEnv

    venv = RigidVecEnv(TaskVectorEnv(2, task=Bounce, autoreset_mode="SameStep", max_episode_steps=6, impacts=ROWS))
    single = TaskEnv(Bounce, impacts=ROWS)
    venv.seed(3)
    venv.reset()
    single.reset(seed=3)
    assert np.shape(venv.reset_infos[0]["impact_point"]) == (ROWS, 3)
    for _ in range(6):
        *_, infos = venv.step(np.zeros((2, 2)))
        info = single.step(np.zeros(2))[4]
    check_equal(info, infos[0])
    assert type(infos[0]["impact_count"]) is int
