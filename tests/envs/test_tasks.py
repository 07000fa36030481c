"""Starts, goals, limits, observations, rewards and success of the tasks, and the errors they raise."""

from __future__ import annotations

import math
import pickle

import gymnasium as gym
import numpy as np
import pytest

import physics
from rigid_env.envs.block_reach import BlockReachEnv, BlockReachVectorEnv
from rigid_env.envs.block_reorient import BlockReorientEnv, BlockReorientVectorEnv
from rigid_env.tasks import block as base
from rigid_env.tasks import kernels
from rigid_env.tasks import layout as col
from tests.envs.conftest import push, random_actions

pytestmark = pytest.mark.interpreted

FACE_NORMALS = np.array([[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]], dtype=float)


def rotation(quat):
    w, x, y, z = quat
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


@pytest.mark.parametrize("walls", ["three", "corner"])
def test_starts_lie_at_rest_on_a_face_clear_of_the_walls(vector_class, walls):
    envs = vector_class(64, walls=walls)
    obs, _ = envs.reset(seed=0)
    world = envs.task.world
    faces = set()
    for i in range(64):
        R, pos = rotation(world.quat[i, 0]), world.pos[i, 0]
        down = (FACE_NORMALS @ R.T)[:, 1]
        face = int(np.argmin(down))
        faces.add(face)
        assert abs(down[face] + 1.0) < 1e-14  # rounding of a product of two unit quaternions
        corners = pos + (np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, -1).T * (2.5, 1.5, 1.0)) @ R.T
        gaps = [corners @ wall.normal - wall.offset for wall in world.scene.walls]
        assert abs(gaps[0].min()) < 1e-14 * 10
        assert min(gap.min() for gap in gaps[1:]) >= 0.25
        np.testing.assert_allclose(
            obs[i, -4:-1], [gap.min() / kernels.GAP_SCALE for gap in gaps], atol=1e-6, err_msg="observed gaps"
        )
    assert faces == set(range(6))
    assert not world.linvel.any()
    assert not world.angvel.any()


def test_a_start_stays_at_rest(vector_class):
    envs = vector_class(12)
    envs.reset(seed=1)
    before = envs.task.world.pos.copy()
    for _ in range(5):
        envs.step(np.zeros((12, 6)))
    # Eight digits of the block: what a block at rest may settle into its contact slop.
    np.testing.assert_allclose(envs.task.world.pos, before, atol=1e-4)


def test_reorient_never_starts_on_its_target():
    envs = BlockReorientVectorEnv(200)
    _, infos = envs.reset(seed=0)
    assert infos["angle"].min() > math.pi / 2 - 1e-6
    assert set(envs.task.record[:, col.FACE]) == set(range(6))


@pytest.mark.compiled
def test_the_wrench_never_exceeds_its_limits(vector_class, rng, is_exhaustive):
    worlds = 50 if is_exhaustive else 16
    envs = vector_class(worlds, mass=(2.0, 8.0), gravity=(5.0, 10.0))
    envs.reset(seed=0)
    task = envs.task
    for scale in (0.5, 1.0, 100.0):
        actions = scale * random_actions(rng, 1, worlds)[0]
        actions[0] = 1.0
        envs.step(actions)
        force = np.linalg.norm(task.wrench[:, 0, :3], axis=1)
        torque = np.linalg.norm(task.wrench[:, 0, 3:], axis=1)
        weight = -task.world.gravity[:, 1] / task.world.params[:, 0]
        assert (force <= base.FORCE_SHARE * weight * (1 + 1e-15)).all()
        assert (torque <= base.TORQUE_SHARE * weight * 2.5 * (1 + 1e-15)).all()
        assert force[0] == pytest.approx(base.FORCE_SHARE * weight[0], rel=1e-15)
        inside = np.linalg.norm(actions[:, :3], axis=1) <= 1.0
        expected = base.FORCE_SHARE * weight[:, None] * actions[:, :3]
        np.testing.assert_allclose(task.wrench[inside, 0, :3], expected[inside], rtol=1e-6)


@pytest.mark.compiled
def test_numbers_beyond_one_act_as_one(vector_class, rng, is_exhaustive):
    """Each is clipped before a vector is shortened: (2, 1) pushes as (1, 1) does, not half as far aside."""
    worlds = 50 if is_exhaustive else 12
    actions = rng.uniform(-3.0, 3.0, (worlds, 6)).astype(np.float32)
    wrenches = []
    for given in (actions, np.clip(actions, -1.0, 1.0)):
        envs = vector_class(worlds)
        envs.reset(seed=0)
        envs.step(given)
        wrenches.append(envs.task.wrench.copy())
    np.testing.assert_array_equal(*wrenches)


def test_the_block_cannot_fly():
    env = BlockReachEnv()
    env.reset(seed=0, options={"face": 2})
    for _ in range(80):
        env.step(np.array([0.0, 1.0, 0.0, 0.0, 0.0, 0.0]))
    assert env.task.world.pos[0, 0, 1] <= 1.5 + 1e-9


@pytest.mark.compiled
def test_reach_by_a_scripted_controller():
    envs = BlockReachVectorEnv(24, autoreset_mode="SameStep")
    obs, _ = envs.reset(seed=0)
    successes = []
    for _ in range(300):
        obs, _, _, _, infos = envs.step(push(obs))
        if "final_info" in infos:
            successes += infos["final_info"]["is_success"][infos["_final_info"]].tolist()
        if len(successes) >= 24:
            break
    assert len(successes) >= 24
    assert np.mean(successes) >= 0.9


def test_success_takes_the_whole_hold_and_its_reward_follows_the_formula():
    env = BlockReachEnv()
    env.reset(seed=0, options={"place": (1.0, 1.0), "goal": (1.2, 1.0), "face": 2})
    action = np.zeros(6, dtype=np.float32)
    steps = [env.step(action) for _ in range(kernels.HOLD_STEPS)]
    assert [step[2] for step in steps] == [False] * (kernels.HOLD_STEPS - 1) + [True]
    np.testing.assert_allclose([step[0][23] for step in steps], np.arange(1, 11) / 10, rtol=1e-6)
    rewards = np.array([step[1] for step in steps])
    # Nothing moves: the hold's share of the potential, the cost of a step, and the bonus at the end.
    expected = np.full(10, 0.1 - kernels.STEP_COST)
    expected[-1] += kernels.SUCCESS_BONUS
    np.testing.assert_allclose(rewards, expected, atol=1e-4)
    assert steps[-1][4]["is_success"]
    assert steps[-1][4]["distance"] == pytest.approx(0.2, abs=1e-4)


@pytest.mark.parametrize("motion", [{"linvel": (1.0, 0.0, 0.0)}, {"angvel": (0.0, 1.5, 0.0)}], ids=["slides", "spins"])
def test_the_hold_begins_when_the_block_is_at_rest_on_its_goal(motion):
    env = BlockReachEnv()
    env.reset(seed=0, options={"place": (0.0, 0.0), "goal": (0.0, 0.0), "face": 2})
    env.task.world.set_state(**{name: np.reshape(value, (1, 1, 3)) for name, value in motion.items()})
    hold, holds = 0, []
    while hold < 3:
        obs, _, _, _, info = env.step(np.zeros(6))
        assert info["distance"] <= kernels.REACH_TOLERANCE
        is_at_rest = info["speed"] <= kernels.REST_SPEED and info["spin"] <= kernels.REST_SPIN
        hold = hold + 1 if is_at_rest else 0
        holds.append(hold)
        assert obs[23] == pytest.approx(hold / kernels.HOLD_STEPS)
    assert holds[0] == 0


def test_reorient_success_when_the_target_is_down():
    env = BlockReorientEnv()
    env.reset(seed=0, options={"face": 4, "target_face": 4})
    ends = [env.step(np.zeros(6))[2] for _ in range(kernels.HOLD_STEPS)]
    assert ends == [False] * (kernels.HOLD_STEPS - 1) + [True]


@pytest.mark.parametrize("face", range(6))
def test_reorient_observes_the_axes_from_the_target(face):
    env = BlockReorientEnv()
    obs, info = env.reset(seed=0, options={"face": 3, "target_face": face})
    R = rotation(env.task.world.quat[0, 0])
    axis = face // 2
    expected = [R @ FACE_NORMALS[face], R[:, (axis + 1) % 3], R[:, (axis + 2) % 3]]
    np.testing.assert_allclose(obs[:9], np.concatenate(expected), atol=1e-6)
    half = np.roll([2.5, 1.5, 1.0], -axis) / kernels.HEIGHT_SCALE
    np.testing.assert_allclose(obs[9:12], half, rtol=1e-6)
    assert info["angle"] == pytest.approx(math.acos(-(R @ FACE_NORMALS[face])[1]), abs=1e-12)


def test_rewards_add_up_to_the_potential_gained(rng):
    """Over an episode without success: Σ(reward + costs) = Φ(end) - Φ(start)."""
    env = BlockReachEnv()
    obs, info = env.reset(seed=4)
    d0 = info["distance"]
    total = 0.0
    for action in random_actions(rng, 40, 1)[:, 0]:
        obs, reward, terminated, _, info = env.step(action)
        assert not terminated
        total += reward + kernels.STEP_COST + kernels.ACTION_COST * float((action.astype(float) ** 2).sum())
    brake = kernels.BRAKE_VALUE * info["speed"] * math.exp(-info["distance"] / kernels.BRAKE_RANGE)
    gained = kernels.REACH_VALUE * (d0 - info["distance"]) - brake + float(obs[23])
    assert total == pytest.approx(gained, abs=1e-12 * 40)


def test_randomised_parameters_stay_in_their_ranges_and_fill_them(vector_class):
    ranges = {"mass": (4.0, 8.0), "friction": (0.3, 0.7), "restitution": (0.1, 0.4), "gravity": (5.0, 10.0)}
    envs = vector_class(200, size=((2.0, 2.0, 1.0), (5.0, 2.0, 4.0)), **ranges)
    envs.reset(seed=0)
    p, gravity = envs.task.world.params, envs.task.world.gravity
    at = physics.kernels.state.layout
    values = {
        "mass": 1.0 / p[:, at.INV_MASS],
        "friction": p[:, at.FRICTION],
        "restitution": p[:, at.RESTITUTION],
        "gravity": -gravity[:, 1],
    }
    for name, (low, high) in ranges.items():
        assert low <= values[name].min() < low + 0.1 * (high - low), name
        assert high >= values[name].max() > high - 0.1 * (high - low), name
    edges = 2.0 * p[:, at.DIMENSIONS : at.DIMENSIONS + 3]
    assert (edges >= (2.0, 2.0, 1.0)).all()
    assert (edges <= (5.0, 2.0, 4.0)).all()
    np.testing.assert_allclose(envs.task.record[:, col.HALF : col.HALF + 3], edges / 2)
    assert np.ptp(edges, axis=0)[[0, 2]].min() > 2.0
    before = values["mass"].copy()
    envs.reset(options={"reset_mask": np.arange(200) < 100})
    changed = 1.0 / envs.task.world.params[:, at.INV_MASS] != before
    assert changed[:100].all()
    assert not changed[100:].any()


def test_randomising_leaves_starts_and_goals_of_a_seed_alone():
    plain, other = BlockReachEnv(), BlockReachEnv(friction=(0.3, 0.7))
    np.testing.assert_array_equal(plain.reset(seed=9)[0], other.reset(seed=9)[0])


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"walls": "four"}, "walls is 'four'; allowed are 'three', 'corner'"),
        ({"mass": -1.0}, "mass .*-1"),
        ({"mass": "heavy"}, "mass is 'heavy'; allowed is a number"),
        ({"mass": (1.0, 2.0, 3.0)}, "mass is .* pair"),
        ({"friction": (0.7, 0.3)}, "friction is .*low at most high"),
        ({"friction": float("nan")}, "friction is nan"),
        ({"restitution": (0.0, 1.5)}, "restitution .*1.5.*from 0 to 1"),
        ({"size": (5.0, 3.0)}, "size is .*3 numbers"),
        ({"gravity": 0.0}, "gravity is 0.* greater than 0"),
        ({"half_width": 3.0}, "half_width is 3.0; allowed is more than 3.3"),
        ({"frame_skip": 0}, "frame_skip is 0"),
        ({"dt": 0.0}, "dt is 0"),
        ({"accuracy": "perfect"}, "perfect"),
        ({"render_mode": "ascii"}, "render_mode is 'ascii'; allowed are None, 'rgb_array', 'human'"),
        ({"width": 0}, "width is 0"),
    ],
)
def test_errors_name_field_value_and_what_is_allowed(env_class, vector_class, arguments, text):
    with pytest.raises(ValueError, match=text):
        env_class(**arguments)
    with pytest.raises(ValueError, match=text):
        vector_class(2, **arguments)


def test_errors_of_the_vector_environment(vector_class):
    with pytest.raises(ValueError, match="autoreset_mode is 'never'; allowed are 'NextStep'"):
        vector_class(2, autoreset_mode="never")
    for limit in (0, -2, 2.5, True):
        with pytest.raises(ValueError, match=rf"max_episode_steps is {limit}; allowed .* and None for no limit"):
            vector_class(2, max_episode_steps=limit)
    with pytest.raises(ValueError, match="seed has 3 entries"):
        vector_class(2).reset(seed=[1, 2, 3])


MADE = [
    ("rigid_env/BlockReach-v0", {}),
    ("rigid_env/BlockReachGoal-v0", {}),
    ("rigid_env/Scene-v0", {"scene": "drop"}),
]


@pytest.mark.parametrize(("env_id", "settings"), MADE)
def test_a_limit_of_minus_one_is_none_in_environments_and_in_batches(env_id, settings):
    """As `gymnasium.make` spells it, which takes None for the registered limit."""
    assert not isinstance(gym.make(env_id, max_episode_steps=-1, **settings), gym.wrappers.TimeLimit)
    for limit in (-1, None):
        assert gym.make_vec(env_id, num_envs=2, max_episode_steps=limit, **settings).max_episode_steps is None


@pytest.mark.parametrize(("env_id", "settings"), MADE)
def test_all_modes_of_make_vec_take_threads(env_id, settings):
    """With the same number as a batch: a single environment has one world, and as many threads."""
    for mode in (None, "vector_entry_point", "sync"):
        envs = gym.make_vec(env_id, num_envs=2, vectorization_mode=mode, threads=2, **settings)
        envs.close()
        with pytest.raises(ValueError, match="threads is 0; allowed are integers of at least 1"):
            gym.make_vec(env_id, num_envs=2, vectorization_mode=mode, threads=0, **settings)


def test_a_bad_action_changes_nothing(env_class, vector_class):
    env, envs = env_class(), vector_class(2)
    env.reset(seed=0)
    envs.reset(seed=0)
    state = envs.task.world.state.copy()
    bad = np.zeros((2, 6))
    bad[1, 3] = np.nan
    with pytest.raises(ValueError, match=r"action of world 1 is .*nan.* finite"):
        envs.step(bad)
    with pytest.raises(ValueError, match=r"actions has shape \(6,\); allowed is shape \(2, 6\)"):
        envs.step(bad[0])
    with pytest.raises(ValueError, match=r"action has shape \(\) \('left'\); allowed is shape \(6,\)"):
        env.step("left")
    with pytest.raises(ValueError, match=r"action has shape \(5,\); allowed is shape \(6,\)"):
        env.step(np.zeros(5))
    np.testing.assert_array_equal(envs.task.world.state, state)


@pytest.mark.parametrize(
    ("options", "text"),
    [
        ({"yau": 1}, "options has the key 'yau'; allowed are yaw, "),
        ({"face": 6}, "options face is 6; allowed are integers from 0 to 5"),
        ({"face": 1.5}, "options face is 1.5"),
        ({"place": (1.0,)}, "options place"),
        ({"place": (100.0, 0.0)}, r"options place is \(100.0, 0.0\); allowed are places inside the box"),
        ({"place": (9.8, 0.0)}, r"options place, .* inside walls\[2\]"),
        ({"yaw": float("inf")}, "options yaw"),
    ],
)
def test_errors_of_options(env_class, options, text):
    env = env_class()
    env.reset(seed=0)
    with pytest.raises(ValueError, match=text):
        env.reset(options=options)


def test_options_for_all_worlds_or_for_each():
    envs = BlockReachVectorEnv(2)
    envs.reset(seed=0, options={"goal": (1.0, 2.0), "place": [(0.0, 0.0), (3.0, 0.0)], "face": [0, 3]})
    np.testing.assert_array_equal(envs.task.record[:, col.GOAL : col.GOAL + 2], [[1.0, 2.0]] * 2)
    np.testing.assert_array_equal(envs.task.world.pos[:, 0], [[0.0, 2.5, 0.0], [3.0, 1.5, 0.0]])


def test_a_physics_fault_is_told():
    env, envs = BlockReachEnv(), BlockReachVectorEnv(2)
    env.reset(seed=0)
    envs.reset(seed=0)
    still = np.zeros((2, 6))
    assert env.step(still[0])[4]["physics_status"] == physics.Status.OK
    env.task.world.state[0, physics.kernels.state.layout.LINVEL] = np.inf
    envs.task.world.state[1, physics.kernels.state.layout.LINVEL] = np.inf
    assert env.step(still[0])[4]["physics_status"] == physics.Status.FAULT
    assert envs.step(still)[4]["physics_status"].tolist() == [physics.Status.OK, physics.Status.FAULT]
    assert env.reset()[1]["physics_status"] == physics.Status.OK
    mask = np.array([False, True])
    assert envs.reset(options={"reset_mask": mask})[1]["physics_status"].tolist() == [physics.Status.OK] * 2


@pytest.mark.interpreted
def test_effects_are_added_or_take_the_place_of_the_tasks():
    """Through `gymnasium.make`: water drags, half the gravity halves weight and force limit; the rest stays."""
    plain = BlockReachEnv()
    env = gym.make(
        "rigid_env:rigid_env/BlockReach-v0", effects=[physics.Drag(0.0, linear=5.0), physics.Gravity((0, -4, 0))]
    )
    task = env.unwrapped.task
    kinds = [type(effect) for effect in task.world.scene.effects]
    assert kinds == [physics.Contact, physics.Friction, physics.Drag, physics.Gravity]
    assert task.limits[0, 0] == pytest.approx(0.9 * 6.0 * 4.0)
    assert plain.task.limits[0, 0] == pytest.approx(0.9 * 6.0 * 9.81)
    speeds = []
    for effects in ((), (physics.Drag(0.0, linear=5.0),)):
        single = BlockReachEnv(effects=effects, friction=0.0)
        single.reset(seed=3, options={"place": (0.0, 0.0), "face": 2, "yaw": 0.0})
        for _ in range(8):  # 0.2 s, clear of the walls
            single.step(np.array([1.0, 0, 0, 0, 0, 0]))
        speeds.append(single.task.world.linvel[0, 0, 0])
    # m v' = F - c v on the frictionless floor: v = (F/c)(1 - e^(-c t/m)), second order in the step of 5 ms.
    force = 0.9 * 6.0 * 9.81
    assert speeds[0] == pytest.approx(force / 6.0 * 0.2, rel=1e-9)
    assert speeds[1] == pytest.approx(force / 5.0 * (1 - math.exp(-5.0 * 0.2 / 6.0)), rel=1e-5)


@pytest.mark.interpreted
def test_a_task_on_walls_with_a_grain():
    """`Friction` with two coefficients in place of the task's: shoved along z and x the block slows by its own μ g."""
    mu = (0.2, 0.4)
    env = gym.make("rigid_env:rigid_env/BlockReach-v0", effects=[physics.Friction(mu, axis=(0, 0, 1))])
    world = env.unwrapped.task.world
    for k, way in enumerate(((0, 0, 1), (1, 0, 0))):
        env.reset(seed=3, options={"place": (0.0, 0.0), "face": 2, "yaw": 0.0})
        start = world.linvel.copy()
        world.set_state(linvel=start + way)
        world.step(steps=10, dt=0.01)
        # The block lies on a face: one deceleration, exact at any step.
        assert world.linvel[0, 0] @ way == pytest.approx(1 - mu[k] * 9.81 * 0.1, abs=1e-9)


@pytest.mark.interpreted
def test_a_task_in_fields_is_pickled_and_batched_like_any_other(rng):
    effects = [physics.Drag(), physics.Wind(gust=2.0)]
    single, batch = BlockReachEnv(effects=effects), BlockReachVectorEnv(3, effects=effects)
    first, _ = single.reset(seed=7)
    assert np.array_equal(batch.reset(seed=7)[0][0], first)
    again = pickle.loads(pickle.dumps(single))
    for action in random_actions(rng, 5, 1)[:, 0]:
        seen = single.step(action)[0]
        assert np.array_equal(again.step(action)[0], seen)
        assert np.array_equal(batch.step(np.broadcast_to(action, (3, 6)))[0][0], seen)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"effects": 3}, "effects is 3; allowed is a sequence of effects"),
        ({"effects": [1]}, r"Scene.effects\[3\] is 1; allowed"),
        ({"effects": [physics.Friction(0.3)], "friction": (0.2, 0.4)}, "but friction is drawn from a range"),
    ],
)
def test_effects_that_do_not_fit_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        BlockReachEnv(**arguments)
