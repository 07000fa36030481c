"""Actuators: limits, lag and delay of the wrench, against closed forms."""

from __future__ import annotations

import copy
import math

import numpy as np
import pytest

import physics

pytestmark = pytest.mark.interpreted

M = 2.0
BALL = physics.Sphere(0.5, M)
FORCE = np.array([[[6.0, 0, 0, 0, 0, 0.3]]])
INERTIA = 0.4 * M * 0.25


def world(dt=0.01, worlds=1, accuracy="balanced", **actuator) -> physics.World:
    effects = [physics.Actuator(**actuator)] if actuator else []
    return physics.World(physics.Scene([BALL], effects=effects), worlds=worlds, dt=dt, accuracy=accuracy)


def response(lag, delay, t):
    """(velocity, way) per unit of acceleration at t after a step of the command: first-order lag, dead time."""
    t = max(t - delay, 0.0)
    gone = -lag * math.expm1(-t / lag) if lag > 0 else 0.0
    return t - gone, t * t / 2 - lag * (t - gone)


@pytest.mark.parametrize("accuracy", ["balanced", "precise"])
@pytest.mark.parametrize(("lag", "delay"), [(0.2, 0.0), (0.0, 0.1), (0.07, 0.123), (0.0, 0.0456)])
def test_a_step_of_the_command_arrives_as_lag_and_dead_time_say(lag, delay, accuracy):
    """Velocities to rounding, at any dt, delays that are no multiple of it included; the way to second order."""
    a, alpha, t = 3.0, 0.3 / INERTIA, 0.6
    speed, way = response(lag, delay, t)
    errors = []
    for dt in (0.1, 0.05, 0.025):
        built = world(dt, accuracy=accuracy, lag=lag, delay=delay)
        built.step(FORCE, steps=round(t / dt))
        assert built.linvel[0, 0, 0] == pytest.approx(a * speed, abs=1e-12)
        assert built.angvel[0, 0, 2] == pytest.approx(alpha * speed, abs=1e-11)
        errors.append(abs(built.pos[0, 0, 0] - a * way))
        assert errors[-1] <= a * dt * dt  # one switch, and held means: (dt²/8) (1 + range of the force) at most
    if lag > 0 and delay == 0:
        assert np.polyfit(np.log([4, 2, 1]), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.1)


def test_limits_shorten_the_wrench_and_keep_its_direction():
    built = world(limit_force=5.0, limit_torque=0.1)
    wrench = np.array([[[30.0, 40.0, 0, 0, 0, 0.05]]])
    built.step(wrench, steps=10)
    assert built.linvel[0, 0] == pytest.approx(np.array([3.0, 4.0, 0]) / M * 0.1, abs=1e-15)
    assert built.angvel[0, 0] == pytest.approx([0, 0, 0.05 / INERTIA * 0.1], abs=1e-15)
    assert wrench[0, 0, 0] == 30.0  # what was handed in is not touched


def test_the_command_is_limited_before_the_lag():
    """A command a hundred times the limit is no faster than one at the limit."""
    ends = []
    for size in (1.0, 100.0):
        built = world(lag=0.2, limit_force=6.0, limit_torque=0.3)
        built.step(size * FORCE, steps=30)
        ends.append(built.linvel[0, 0].copy())
    assert ends[0] == pytest.approx(ends[1], rel=1e-14)


def test_many_steps_at_once_are_the_same_as_one_by_one_and_as_a_stepper():
    given = {"lag": 0.05, "delay": 0.034, "limit_force": 5.0}
    at_once, one_by_one, stepped = world(**given), world(**given), world(**given)
    stepper = physics.Stepper(stepped, 5)
    for turn in range(4):
        wrench = (-1.0) ** turn * FORCE
        at_once.step(wrench, steps=5)
        for _ in range(5):
            one_by_one.step(wrench)
        stepper.wrench[...] = wrench
        stepper()
        assert np.array_equal(at_once.state, one_by_one.state)
        assert np.array_equal(at_once.state, stepped.state)
    assert at_once.time == one_by_one.time == stepped.time


def test_the_report_of_many_steps_is_of_all_of_them():
    effects = [physics.Gravity(), physics.Contact(0.5), physics.Friction()]
    reports = []
    for extra in ([], [physics.Actuator(lag=0.1)]):
        body = physics.Sphere(0.5, M, pos=(0, 1, 0), linvel=(1, 0, 0))
        built = physics.World(physics.Scene([body], [physics.HalfSpace((0, 1, 0))], [*effects, *extra]))
        reports.append((built.step(steps=200), built.state.copy()))
    assert np.array_equal(reports[0][1], reports[1][1])
    for name in ("penetration", "residual", "iterations", "solves", "impacts", "solver"):
        assert np.array_equal(getattr(reports[0][0], name), getattr(reports[1][0], name)), name
    assert reports[0][0].impacts[0] > 1


def test_steps_of_other_lengths_in_between():
    """The delay is a time, not a number of steps."""
    built = world(delay=0.1, lag=0.05)
    for dt, steps in ((0.03, 4), (0.01, 7), (0.11, 1)):
        built.step(FORCE, steps=steps, dt=dt)
    assert built.linvel[0, 0, 0] == pytest.approx(3.0 * response(0.05, 0.1, 0.3)[0], abs=1e-12)


def test_snapshot_and_restore_take_the_actuator_along():
    built = world(lag=0.05, delay=0.034)
    built.step(FORCE, steps=7)
    kept, twin = built.snapshot(), copy.deepcopy(built)
    for run in (built, twin):
        run.step(-FORCE, steps=9)
    late = built.state.copy()
    assert np.array_equal(twin.state, late)
    built.step(FORCE, steps=3)
    built.restore(kept)
    built.step(-FORCE, steps=9)
    assert np.array_equal(built.state, late)


def test_set_state_lets_a_world_begin_at_rest_and_leaves_the_others_alone():
    built, fresh, other = (world(worlds=2, lag=0.05, delay=0.034) for _ in range(3))
    wrench = np.concatenate((FORCE, 2 * FORCE))
    for run in (built, other):
        run.step(wrench, steps=8)
    still = np.zeros((1, 1, 3))
    built.set_state(pos=still, linvel=still, angvel=still, quat=[[[1.0, 0, 0, 0]]], worlds=[0])
    for run in (built, fresh, other):
        run.step(-wrench, steps=8)
    assert np.array_equal(built.state[0], fresh.state[0])  # which is at another time
    assert np.array_equal(built.state[1], other.state[1])


def test_a_world_does_not_depend_on_its_batch():
    given = {"lag": 0.05, "delay": 0.034, "limit_force": 3.0}
    rng = np.random.default_rng(1)
    wrenches = rng.normal(size=(20, 5, 1, 6)) * 5
    batch, alone = world(worlds=5, **given), world(**given)
    for wrench in wrenches:
        batch.step(wrench)
        alone.step(wrench[3:4])
    assert np.array_equal(batch.state[3], alone.state[0])


@pytest.mark.parametrize("delay", [0.034, 0.005, 0.0123])
def test_a_world_does_not_depend_on_when_it_began(delay):
    """A batch whose worlds begin anew at times of their own, each against one that stands alone."""
    rng, given = np.random.default_rng(2), {"lag": 0.05, "delay": delay, "dt": 0.01}
    batch, singles = world(worlds=4, **given), [world(**given) for _ in range(4)]
    for step in range(60):
        if step in (7, 20, 33):  # one of them begins anew, and its time, too, where it stands alone
            k = step % 4
            batch.set_state(*((0, 0, 0), (1, 0, 0, 0), (0, 0, 0), (0, 0, 0)), worlds=[k])
            singles[k] = world(**given)
        wrenches = rng.normal(size=(4, 1, 6))
        batch.step(wrenches)
        for single, wrench in zip(singles, wrenches):
            single.step(wrench[None])
    for k, single in enumerate(singles):
        assert np.array_equal(batch.state[k], single.state[0])


def test_loads_past_the_actuator_act_unchanged_and_only_in_their_block():
    built, plain = world(limit_force=5.0, lag=0.1), world()
    load = np.array([[[30.0, 0, 0, 0, 0, 0.5]]])
    with built.actuation.passed_by(load):
        built.step(steps=3)
    plain.step(load, steps=3)
    assert built.state == pytest.approx(plain.state, abs=1e-14)
    speed = built.linvel[0, 0, 0]
    built.step()
    assert built.linvel[0, 0, 0] == speed
    with pytest.raises(ValueError, match="steps is 0"), built.actuation.passed_by(load):
        built.step(steps=0)
    assert built.actuation.past is None


def test_an_actuator_without_effect_leaves_every_bit_and_costs_no_parameters():
    runs = [world(), world(lag=0.0), world(limit_force=1e9)]
    for run in runs:
        run.step(FORCE, steps=50)
        assert np.array_equal(run.state, runs[0].state)
        assert run.params.shape == runs[0].params.shape
        assert run.plan.key == runs[0].plan.key
    assert runs[0].actuation is None


def test_environments_take_an_actuator():
    from rigid_env.envs.block_reach import BlockReachEnv

    env = BlockReachEnv(effects=[physics.Actuator(lag=0.1, delay=0.02)])
    plain = BlockReachEnv()
    action = np.array([1, 1, 0, 0, 0, 0], dtype=np.float32)
    ways = []
    for one in (env, plain):
        first = []
        for _ in range(2):
            one.reset(seed=3)
            start = one.unwrapped.task.world.pos.copy()
            one.step(action)
            first.append(np.abs(one.unwrapped.task.world.pos - start).max())
        assert first[0] == pytest.approx(first[1], abs=1e-12)  # an episode does not begin with what the last one left
        ways.append(first[0])
    assert 0 <= ways[0] < 0.5 * ways[1]


BAD = [
    (lambda: physics.Actuator(limit_force=0), "Actuator.limit_force is 0"),
    (lambda: physics.Actuator(limit_torque=-1), "Actuator.limit_torque is -1"),
    (lambda: physics.Actuator(lag=-1), "Actuator.lag is -1"),
    (lambda: physics.Actuator(delay=math.inf), "Actuator.delay is inf"),
    (lambda: physics.Scene([BALL], effects=[physics.Actuator(), physics.Actuator()]), "2 Actuator; allowed is one"),
]


@pytest.mark.parametrize(("make", "message"), BAD)
def test_an_actuator_says_what_is_wrong(make, message):
    with pytest.raises(ValueError, match=message):
        make()
