"""Actions that drive fixed bodies: paddles and turntables, felt exactly by contacts."""

from __future__ import annotations

import numpy as np
import pytest

import physics
import rigid_env
from rigid_env.envs.task import TaskVectorEnv
from rigid_env.tasks import Drive, Task, Wrench, observe
from rigid_env.tasks.describe import describe
from tests.tasks.conftest import started

pytestmark = pytest.mark.interpreted

STEADY = physics.Motion()


def paddle_and_ball(gravity=(0, 0, 0), restitution=1.0, **paddle) -> physics.Scene:
    """A paddle, and a ball of 1 kg that touches its face x = 0."""
    bodies = [
        physics.Block((1, 2, 2), fixed=True, pos=(-0.5, 0, 0), motion=STEADY, **paddle),
        physics.Sphere(0.5, 1.0, pos=(0.5, 0, 0)),
    ]
    return physics.Scene(bodies, effects=[physics.Gravity(gravity), physics.Contact(restitution)])


def task_of(ways, world: physics.Scene | None = None, **functions) -> type[Task]:
    """A task whose scene, ways to act and functions are given."""
    declared = {
        "scene": world or paddle_and_ball(),
        "actions": ways,
        "observation": (observe.pos(0), observe.linvel(0), observe.pos(1), observe.linvel(1)),
        "rewards": lambda self, worlds: {"ahead": worlds.pos[:, 1, 0]},
    }
    return type("Driving", (Task,), {**declared, **functions})


PADDLE = Drive(0, velocity=3.0, velocity_axes="x")


class Paddle(Task):
    """A task with a name, so that it can be pickled."""

    scene = paddle_and_ball()
    actions = PADDLE
    observation = (observe.pos(0), observe.linvel(0), observe.pos(1), observe.linvel(1))

    def rewards(self, worlds):
        return {"ahead": worlds.pos[:, 1, 0]}


@pytest.mark.parametrize(("number", "speed"), [(0.5, 1.5), (7.0, 3.0), (-0.5, -1.5)])
def test_a_paddle_moves_at_the_speed_of_the_action_and_hits_as_it_moves(number, speed):
    task = started(task_of(PADDLE)(frame_skip=4))
    task.step(np.array([[number]]))
    world = task.world
    # Sums of four products that are no binary fractions.
    np.testing.assert_allclose(world.pos[0, 0], (-0.5 + speed * task.control_dt, 0, 0), rtol=0, atol=1e-15)
    assert world.linvel[0, 0].tolist() == [speed, 0, 0]
    # An elastic hit by a wall of speed v gives a ball at rest 2 v; one that goes away gives none.
    assert abs(world.linvel[0, 1, 0] - 2 * max(speed, 0.0)) < 1e-5 * abs(speed)
    task.step(np.array([[0.0]]))
    assert world.linvel[0, 0].tolist() == [0, 0, 0]


def test_a_turntable_turns_by_the_spin_of_the_action_and_carries_its_load():
    table = physics.Block((4, 0.2, 4), fixed=True, pos=(0, -0.1, 0), motion=STEADY)
    load = physics.Block((0.4, 0.4, 0.4), 1.0, pos=(1.0, 0.2, 0))
    scene = physics.Scene([table, load], effects=[physics.Gravity(), physics.Contact(), physics.Friction(2.0)])
    task = started(task_of(Drive(0, spin=0.5, spin_axes="y"), scene)(frame_skip=5))
    for _ in range(4):
        task.step(np.array([[0.8]]))
    angle = 0.4 * 4 * task.control_dt
    np.testing.assert_allclose(task.world.quat[0, 0], (np.cos(angle / 2), 0, np.sin(angle / 2), 0), atol=1e-14)
    # The load goes round with the table: |ω x r| = 0.4 m/s. Its friction acts along the mean direction of a step, so
    # that its velocity is off by at most two turns of a step: 2 ω h |ω x r|.
    off = 2 * 0.4 * task.world.dt * 0.4
    np.testing.assert_allclose(task.world.linvel[0, 1], (-0.4 * np.sin(angle), 0, -0.4 * np.cos(angle)), atol=off)
    assert abs(task.world.angvel[0, 1, 1] - 0.4) < 1e-4


def test_a_vector_is_shortened_and_other_ways_act_besides():
    task = started(task_of([Wrench(1, force=0.5, torque=0.0, force_axes="y"), Drive(0, velocity=2.0, spin=1.0)])())
    assert task.action_size == 7
    task.step(np.array([[1.0, 1.0, -1.0, 1.0, 0.0, 0.25, 0.0]]))
    np.testing.assert_allclose(task.world.linvel[0, 0], np.array((1, -1, 1)) * 2 / np.sqrt(3), rtol=1e-15)
    assert task.world.angvel[0, 0].tolist() == [0, 0.25, 0]
    assert task.wrench[0, 1].tolist() == [0, 0.5 * 9.81, 0, 0, 0, 0]
    assert not task.wrench[0, 0].any()
    assert "velocity 2.0 on body 0" in task.action_text


def test_each_world_of_a_batch_has_its_own_motion_and_an_episode_begins_with_the_scenes():
    task = started(task_of(PADDLE)(3))
    task.step(np.array([[1.0], [0.0], [-1.0]]))
    assert task.world.linvel[:, 0, 0].tolist() == [3.0, 0.0, -3.0]
    task.start(np.array([0]))
    assert task.world.linvel[:, 0, 0].tolist() == [0.0, 0.0, -3.0]
    assert task.world.pos[0, 0].tolist() == [-0.5, 0, 0]


def test_the_task_keeps_all_promises_of_environments():
    rigid_env.check_task(Paddle, steps=12, contexts=(), accuracy="fast")


def test_rollouts_and_states_give_the_same_bits():
    task, envs = started(Paddle(2)), TaskVectorEnv(2, task=Paddle, autoreset_mode="Disabled")
    envs.reset(seed=0)
    actions = np.random.default_rng(0).uniform(-1, 1, (2, 6, 1))
    rigid_env.rollout(task, actions)
    for k in range(6):
        envs.step(actions[:, k])
        if k == 2:
            kept = envs.get_state()
    assert (task.world.state == envs.task.world.state).all()
    envs.set_state(kept)
    for k in range(3, 6):
        envs.step(actions[:, k])
    assert (task.world.state == envs.task.world.state).all()


def test_an_error_takes_the_motion_back():
    def measure(self, worlds):
        if worlds.pos[0, 0, 0] > -0.45:
            raise RuntimeError("far enough")
        return {}

    task = started(task_of(PADDLE, measure=measure)())
    task.step(np.array([[0.5]]))
    state, params = task.world.state.copy(), task.world.params.copy()
    with pytest.raises(RuntimeError, match="far enough"):
        task.step(np.array([[1.0]]))
    assert (task.world.state == state).all()
    assert (task.world.params == params).all()


def test_a_recording_holds_the_motions():
    task = started(task_of(PADDLE)())
    recorder = physics.Recorder(task.world)
    for number in (1.0, -0.3, 0.2):
        task.step(np.array([[number]]))
    assert recorder.recording().replay().is_identical


def test_the_description_tells_units():
    text = describe(task_of(Drive(0, velocity=3.0, spin=2.0, velocity_axes="x", spin_axes="z"))())
    assert "velocity along x of body 0" in text
    assert "3 m/s" in text
    assert "spin about z of body 0" in text
    assert "2 rad/s" in text
    assert "m is the mass" not in text


def still_scene() -> physics.Scene:
    return physics.Scene(
        [physics.Block((1, 1, 1), fixed=True), physics.Sphere(0.5, 1.0, pos=(3, 0, 0))], effects=[physics.Contact()]
    )


def with_table() -> physics.Scene:
    motion = physics.Motion.table([0, 1], pos=[(0, 0, 0), (1, 0, 0)])
    bodies = [physics.Block((1, 1, 1), fixed=True, motion=motion), physics.Sphere(0.5, 1.0, pos=(5, 0, 0))]
    return physics.Scene(bodies, effects=[physics.Contact()])


REFUSED = {
    "zero": (lambda: Drive(0), ("velocity and spin", "above 0")),
    "negative": (lambda: Drive(0, velocity=-1.0), ("velocity", "-1")),
    "axes": (lambda: Drive(0, spin=1.0, spin_axes="yx"), ("spin_axes", "'yx'")),
    "moving": (lambda: task_of(Drive(1, velocity=1.0))(), ("body", "1", "allowed are 0: ", "fixed=True")),
    "missing": (lambda: task_of(Drive(7, velocity=1.0))(), ("body", "7", "allowed are 0: ")),
    "still": (lambda: task_of(Drive(0, velocity=1.0), still_scene())(), ("steady", "motion=physics.Motion()")),
    "table": (lambda: task_of(Drive(0, velocity=1.0), with_table())(), ("steady", "motion=physics.Motion()")),
    "twice": (lambda: task_of([PADDLE, Drive(0, spin=1.0)])(), ("several Drive of body 0", "one")),
    "wrench": (lambda: task_of(Wrench(0))(), ("body", "0", "fixed")),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refusals_name_field_value_and_what_is_allowed(name):
    make, words = REFUSED[name]
    with pytest.raises(ValueError, match="allowed") as error:
        make()
    assert all(word in str(error.value) for word in words), str(error.value)
