"""A user's program: checked by mypy and pyright as it stands, and with mistakes planted (`test_user_program`).

It is never run. `MISTAKES` of the test are replacements in its lines.
"""

from collections.abc import Mapping
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from typing_extensions import assert_type

import physics
import rigid_env

AXIS = np.array([1.0, 0.0, 0.0])


def run_engine() -> None:
    """Make a scene of lists, arrays and tuples, step it, and look at it."""
    block = physics.Block(size=[5, 3, 2], mass=6.0, pos=np.array([0.0, 6.0, 0.0]))
    ball = physics.Sphere(1.0, density=500.0, pos=(4, 6, 0), name="ball")
    bodies: list[physics.Body] = [block, ball, physics.Hull(np.eye(4, 3), mass=1.0), physics.Ellipsoid([1, 2, 3], 1.0)]
    walls = physics.three_walls(half_width=10.0)
    effects = [
        physics.Gravity([0, -9.81, 0]),
        physics.Contact(restitution=0.3),
        physics.Friction((0.5, 0.3), [1, 0, 0]),
    ]
    scene = physics.Scene(bodies, [*walls, physics.HalfSpace(normal=[0, 0, 1])], [*effects, physics.Wind([1, 0, 0])])
    assert_type(block.size, tuple[float, float, float])
    assert_type(block.mass, float)
    assert_type(scene.bodies, tuple[physics.Body, ...])
    assert_type(scene.bodies[0].inertia, NDArray[np.float64])
    assert_type(scene.effect(physics.Gravity), physics.Gravity | None)
    world = physics.World(scene, worlds=8, dt=0.01, accuracy="balanced", threads=2)
    report = world.step([[0.0] * 6] * 4, steps=2)
    assert_type(report, physics.StepReport)
    assert_type(report.status, NDArray[np.int64])
    assert_type(world.pos, NDArray[np.float64])
    world.set_state(pos=np.zeros((4, 3)), worlds=[0, 1])
    assert_type(world.snapshot(), physics.Snapshot)
    path = physics.simulate(scene, 2.0, accuracy=physics.Accuracy(scheme="events"), sample_dt=0.01)
    assert_type(path, physics.Trajectory)
    assert_type(path.energy, NDArray[np.float64])
    assert_type(path.events, tuple[physics.Event, ...])


class Lift(rigid_env.Task):
    """A task of one's own."""

    scene = physics.Scene([physics.Block([1, 1, 1], 2.0)], physics.corner(), [physics.Gravity(), physics.Contact()])
    actions = rigid_env.Wrench(force=2.0)
    observation = (rigid_env.observe.height(), rigid_env.observe.quat())
    draws = {"goal": rigid_env.Uniform(1.0, 2.0)}  # noqa: RUF012

    def rewards(self, worlds: Any) -> Mapping[str, NDArray[Any]]:
        """Height of the block [m]."""
        return {"height": worlds.pos[:, 0, 1]}


def run_environments() -> None:
    """Step environments of the package, a batch, and a task of one's own."""
    env = rigid_env.BlockReachEnv(render_mode="rgb_array", walls="corner", size=[5, 3, 2], mass=(5.0, 7.0))
    plain: gym.Env[NDArray[Any], NDArray[Any]] = env
    obs, info = env.reset(seed=1, options={"yaw": 0.5})
    assert_type(obs, NDArray[Any])
    assert_type(info, dict[str, Any])
    assert_type(env.step(plain.action_space.sample()), tuple[NDArray[Any], float, bool, bool, dict[str, Any]])
    assert_type(env.mass, float)
    assert_type(env.render(), NDArray[np.uint8] | None)
    env.close()
    batch = rigid_env.BlockReorientVectorEnv(num_envs=16, autoreset_mode="SameStep", accuracy="fast")
    assert_type(batch.step(np.zeros((16, 6)))[1], NDArray[np.float64])
    learner = rigid_env.RigidVecEnv(batch, monitor=False)
    assert_type(learner, rigid_env.RigidVecEnv)
    assert_type(learner.reset(), NDArray[Any])
    task = Lift(4, accuracy="precise", draws={"goal": 1.5})
    task.step(np.zeros((4, 6)))
    assert_type(task.obs, NDArray[np.float32])
    assert_type(rigid_env.rollout(task, np.zeros((4, 10, 6))).rewards, NDArray[np.float64])
    rigid_env.register_task("mine/Lift-v0", Lift, frame_skip=4)
