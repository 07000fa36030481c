"""MuJoCo twins: same observations, draws, rewards and success as ours, and a motion that agrees where it must."""

import json

import gymnasium as gym
import numpy as np
import pytest
import typer
from typer.testing import CliRunner

import physics
from physics.kernels.state import layout as at
from physics.parallel.team import listed
from rigid_env.envs.controllers import load_controller
from rigid_env.suite.block_stack import BASE, MASS, STACKED
from rigid_env.tasks import layout as col

pytest.importorskip("mujoco")
pytest.importorskip("stable_baselines3")

from benchmarks import judge_elsewhere, twins

GRAVITY, STEP, FRAME_SKIP = 9.81, 0.005, 5
LIFT = 0.5  # share of the largest force, which is 0.9 m g
REST = 40  # control steps, 1 s

# Depth r at which a resting block sinks in: a contact with impedance d, whose reference acceleration is k r, carries
# gravity g at d k r = (1 - d) g ("Computation", MuJoCo's documentation). By default d is at least 0.9 and
# k = 1/(0.95 · 0.02 s)²; at `best` d is 0.9999 and k = 0.03/h².
DEEPEST = {"default": 0.1 / 0.9 * GRAVITY * (0.95 * 0.02) ** 2, "best": 1e-4 / 0.9999 * GRAVITY * STEP**2 / 0.03}


def pair(env, **arguments):
    """Ours and its twin, for single worlds."""
    return gym.make(env), gym.make(twins.twin_id(env), **arguments)


@pytest.mark.parametrize("env", twins.ORIGINALS)
def test_a_reset_is_ours_bit_for_bit(env):
    ours, twin = pair(env)
    for seed in (3, 4):
        (obs, info), (twin_obs, twin_info) = ours.reset(seed=seed), twin.reset(seed=seed)
        np.testing.assert_array_equal(obs, twin_obs)
        np.testing.assert_equal(info, twin_info)


def test_free_flight_agrees_to_the_error_of_eulers_method():
    """MuJoCo's semi-implicit Euler is g h t / 2 below the parabola after the time t; ours follows the parabola."""
    action, steps = np.array([0.0, LIFT, 0.0, 0.0, 0.0, 0.0]), 8
    tasks = [env.unwrapped.task for env in pair("rigid_env/BlockReach-v0")]
    for task in tasks:
        task.seed(0, 1)
        task.start(np.zeros(1, dtype=np.int64))
        task.world.set_state(pos=[[[0.0, 6.0, 0.0]]], linvel=[[[0.5, 0.0, 0.2]]], angvel=[[[0.0, 1.0, 0.0]]])
        for _ in range(steps):
            task.step(action[None])
    ours, twin = (task.world for task in tasks)
    acceleration = GRAVITY * (1.0 - 0.9 * LIFT)
    late = np.array([0.0, 0.5 * acceleration * STEP * steps * FRAME_SKIP * STEP, 0.0])
    np.testing.assert_allclose(twin.pos[0, 0], ours.pos[0, 0] - late, rtol=0.0, atol=1e-9)
    np.testing.assert_allclose(twin.state[:, at.QUAT :], ours.state[:, at.QUAT :], rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("setting", twins.SETTINGS)
def test_a_resting_block_rests_as_deep_as_the_softness_of_contacts_allows(setting):
    ours, twin = pair("rigid_env/BlockReach-v0", setting=setting)
    for env in (ours, twin):
        env.reset(seed=2)
        for _ in range(REST):
            *_, info = env.step(np.zeros(6))
    (start,), (end,) = ours.unwrapped.task.world.pos[0], twin.unwrapped.task.world.pos[0]
    assert 0.0 < start[1] - end[1] < 1.01 * DEEPEST[setting]
    np.testing.assert_allclose(end[[0, 2]], start[[0, 2]], rtol=0.0, atol=DEEPEST[setting])
    assert info["speed"] < 1e-3
    assert info["physics_status"] == physics.Status.OK


@pytest.mark.parametrize("env", ["rigid_env/BlockReach-v0", "rigid_env/BlockReorient-v0"])  # compiled tasks
def test_rewards_and_success_are_the_tasks_function_of_the_state(env):
    """Each step of the twin, until the controller succeeds, is observed once more by the task of ours."""
    policy = load_controller(env)
    ours, twin = (each.unwrapped.task for each in pair(env, setting="best"))
    observe = ours.observer(listed(np.zeros(1, dtype=np.int64)))
    twin.seed(0, 7)
    twin.start(np.zeros(1, dtype=np.int64))
    for _ in range(300):
        ours.record[...] = twin.record
        twin.step(policy(twin.obs))
        ours.world.state[...], ours.action[...] = twin.world.state, twin.action
        observe()
        np.testing.assert_array_equal(ours.obs, twin.obs)
        np.testing.assert_array_equal(ours.outcome, twin.outcome)
        if twin.outcome[0, col.SUCCESS]:
            return
    pytest.fail("the controller has not succeeded in 300 control steps")


def test_a_batch_is_its_single_worlds_and_forgets_earlier_episodes():
    env, actions = "twins/BlockReach-v0", np.random.default_rng(0).uniform(-1.0, 1.0, (30, 6))
    batch = gym.make_vec(env, num_envs=2, vectorization_mode="vector_entry_point", autoreset_mode="Disabled")
    single = gym.make(env)
    batch.reset(seed=[5, 6])
    seen = [batch.step(np.repeat(action[None], 2, axis=0))[0] for action in actions]
    for _ in range(2):  # the second episode starts after a first one
        for world, seed in enumerate((5, 6)):
            single.reset(seed=seed)
            for action, obs in zip(actions, seen):
                np.testing.assert_array_equal(single.step(action)[0], obs[world])


def stack_of(*ratios, setting):
    """A batch of twins of BlockStack whose cube has been let down onto the block, with these ratios of the masses."""
    envs = gym.make_vec("twins/BlockStack-v0", num_envs=len(ratios), setting=setting)
    envs.reset(seed=0, options={"mass[1]": MASS / np.array(ratios)})
    world = envs.unwrapped.task.world
    pos = world.pos.copy()
    pos[:, 0] = 0.0, 0.5 * BASE[1] + STACKED, 0.0
    world.set_state(pos=pos, quat=np.tile([1.0, 0.0, 0.0, 0.0], (len(ratios), 2, 1)))
    return envs


def test_drawn_masses_are_mujocos_and_the_next_episode_has_its_own():
    """Moments of a block of mass m: m (b² + c²)/12, which MuJoCo sorts. Masses of different worlds do not mix."""
    envs = stack_of(1.0, 100.0, setting="default")
    x, y, z = BASE
    moments = np.array([y * y + z * z, x * x + z * z, x * x + y * y]) / 12.0
    for masses in ([20.0, 0.2], [2.0, 20.0]):
        envs.reset(seed=1, options={"mass[1]": masses})
        envs.step(np.zeros((2, 6)))
        for place, mass in zip(envs.unwrapped.task._advance._places, masses):
            np.testing.assert_allclose(place.model.body_mass, [0.0, MASS, mass], rtol=1e-12)
            np.testing.assert_allclose(np.sort(place.model.body_inertia[2]), mass * np.sort(moments), rtol=1e-12)


@pytest.mark.parametrize("setting", twins.SETTINGS)
def test_a_pile_carries_its_weights(setting):
    """At rest the contacts of A carry m g upwards. Those of B carry M g: up from the floor, down from A.

    After 2 s the rest of the motion is below 1e-3 of g.
    """
    ratios = np.array([1.0, 10.0])
    envs = stack_of(*ratios, setting=setting)
    for _ in range(39):
        terminated = envs.step(np.zeros((2, 6)))[2]
        assert not terminated.any()
    force, impulse = envs.unwrapped.task.world.read_contact_sums()
    weights = GRAVITY * np.stack([[MASS, MASS], MASS / ratios])  # by body and world
    np.testing.assert_allclose(force[:, :, 1], weights.T, atol=1e-3 * GRAVITY * MASS)
    np.testing.assert_allclose(force[:, :, ::2], 0.0, atol=1e-3 * GRAVITY * MASS)
    np.testing.assert_allclose(impulse, 0.01 * force)
    np.testing.assert_array_equal(envs.unwrapped.task.world.read_contact_sums([1])[0], force[1:])
    envs.reset(seed=2)
    assert not envs.unwrapped.task.world.read_contact_sums()[0].any()  # nothing has touched yet


def test_a_twin_refuses_what_mujoco_would_not_get():
    env = "twins/BlockReach-v0"
    with pytest.raises(ValueError, match="setting is 'good'; allowed are default, best"):
        gym.make(env, setting="good")
    with pytest.raises(ValueError, match="effects of BlockReach contain Drag; allowed"):
        gym.make(env, effects=(physics.Drag(),))
    drawn = gym.make(env, friction=(0.3, 0.7))
    drawn.reset(seed=0)
    with pytest.raises(ValueError, match=r"friction.*differs from the scene's; allowed"):
        drawn.step(np.zeros(6))
    larger = gym.make(env)
    larger.reset(seed=0, options={"size": (5.0, 3.0, 2.5)})
    with pytest.raises(ValueError, match=r"size.*differs from the scene's; allowed"):
        larger.step(np.zeros(6))
    with pytest.raises(ValueError, match="env is 'rigid_env/BlockCurl-v0', without a twin; allowed are rigid_env/B"):
        twins.twin_id("rigid_env/BlockCurl-v0")


@pytest.mark.exhaustive
def test_the_program_judges_a_controller(tmp_path):
    app, file = typer.Typer(), tmp_path / "twins.json"
    app.command()(judge_elsewhere.main)
    found = CliRunner().invoke(app, ["--episodes", "4", "--env", "rigid_env/BlockReach-v0", "--json", str(file)])
    assert found.exit_code == 0, found.output
    (row,) = json.loads(file.read_text())["rows"]
    assert set(row["judged"]) == {"ours", *twins.SETTINGS}
    for setting, lost in row["lost"].items():
        rates = (row["judged"][name]["success_rate"] for name in ("ours", setting))
        assert lost == np.subtract(*rates)
    assert CliRunner().invoke(app, ["--env", "rigid_env/BlockCurl-v0"]).exit_code != 0
    missing = f"rigid_env/BlockReach-v0={tmp_path / 'nothing.npz'}"
    assert CliRunner().invoke(app, ["--episodes", "1", "--policy", missing]).exit_code != 0


def test_policies_follow_the_controller_of_their_environment():
    reach, reorient, _ = twins.ORIGINALS
    given = [f"{reorient}=b.npz", f"{reach}=a.npz"]
    found = judge_elsewhere.chosen([reach, reorient], given)
    assert found == [(reach, "controller"), (reach, "a.npz"), (reorient, "controller"), (reorient, "b.npz")]
    for wrong in ("a.npz", f"{reorient}=b.npz", f"{reach}="):
        with pytest.raises(ValueError, match=f"policy is '{wrong}'; allowed is ID=FILE"):
            judge_elsewhere.chosen([reach], [wrong])
