"""Unconstrained motion through the public interface: parabola, momenta, orders of the schemes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import physics
from physics import scenes
from rigid_env.hard_cases.case import Setting
from rigid_env.hard_cases.cases.flight import parabola
from tests.reference import rigid_body as ref

pytestmark = pytest.mark.interpreted

EPS = np.finfo(float).eps
INERTIA = np.array([6.5, 14.5, 17.0])


@pytest.mark.parametrize("dt", [0.001, 0.1, 3.0])
def test_hard_case_4_parabola_is_exact_at_any_step(dt):
    """The case itself, at steps that the others are not run at."""
    assert all(check.passes for check in parabola(Setting("balanced", dt)))


def test_tumble_agrees_with_the_reference_to_1e9_after_20_s(is_exhaustive):
    """The issue's number: ω0 = (0.1, 5, 0.1) rad/s, step 0.01 s, error at most 1e-9 rad."""
    digits = 40 if is_exhaustive else 20
    trajectory = physics.simulate(scenes.tumble(), 20.0, sample_dt=0.01)
    truth, _, error = ref.free_rotation(INERTIA, (1.0, 0, 0, 0), (0.1, 5.0, 0.1), 20.0, digits)
    assert error < 1e-13
    assert ref.orientation_error(trajectory.quat[-1, 0], truth) <= 1e-9


def test_angular_momentum_is_constant_to_the_last_bit_and_q_stays_unit(is_exhaustive):
    """L is the stored state, and no torque acts: it does not change at all. |q| - 1 stays at rounding."""
    world = physics.World(scenes.tumble(), dt=0.01)
    before = physics.diagnose(world)
    steps = 20_000 if is_exhaustive else 5_000
    world.step(steps=steps)
    after = physics.diagnose(world)
    assert np.array_equal(before.angular_momentum, after.angular_momentum)
    assert abs(np.linalg.norm(world.quat[0, 0]) - 1) < 8 * EPS
    # Energy follows from L and q; q is off by rounding that grows linearly at worst.
    assert after.kinetic_energy == pytest.approx(before.kinetic_energy, rel=steps * 4 * EPS)


def _error_of(scheme: str, dt: float) -> float:
    """Orientation error [rad] after 1 s of tumbling under gravity and a held torque."""
    torque = np.array([3.0, -5.0, 4.0])
    scene = physics.Scene(
        [physics.Block((5, 3, 2), 6.0, angvel=(0.4, 1.5, -0.7))], effects=[physics.Gravity((0, -9.81, 0))]
    )
    world = physics.World(scene, dt=dt, accuracy=physics.Accuracy(scheme=scheme))
    load = np.zeros((1, 1, 6))
    load[0, 0, 3:] = torque
    world.step(load, steps=round(1.0 / dt))
    start = ref.RigidState(np.zeros(3), np.array([1.0, 0, 0, 0]), np.zeros(3), INERTIA * [0.4, 1.5, -0.7])
    truth = ref.integrate_rigid_body(
        6.0,
        np.diag(INERTIA),
        start,
        1.0,
        gravity=np.array([0, -9.81, 0]),
        wrench=lambda t, Y: (np.zeros(3), torque),
    )
    return ref.orientation_error(world.quat[0, 0], truth.quat)


@pytest.mark.parametrize(
    ("scheme", "order"),
    [("explicit_euler", 1), ("semi_implicit_euler", 1), ("midpoint", 2), ("rk4", 4), ("exact", 2)],
)
def test_schemes_of_the_world_have_their_published_order(scheme, order):
    """Log-log slope over four halvings, within 0.1; `exact` is a Strang splitting when a torque acts."""
    steps = np.array([0.02, 0.01, 0.005, 0.0025])
    if order == 1:
        steps = steps / 8  # deeper in the asymptotic range
    errors = [_error_of(scheme, dt) for dt in steps]
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert slope == pytest.approx(order, abs=0.1)


def test_a_force_at_the_centre_turns_nothing_and_a_torque_moves_nothing():
    """Football in flight: gravity and a central force exert no torque; a pure torque no acceleration."""
    world = physics.World(scenes.tumble(), dt=0.01, worlds=2)
    load = np.zeros((2, 1, 6))
    load[0, 0, :3] = (7.0, -2.0, 1.0)
    load[1, 0, 3:] = (7.0, -2.0, 1.0)
    before = physics.diagnose(world).angular_momentum.copy()
    world.step(load, steps=100)
    after = physics.diagnose(world)
    assert np.array_equal(after.angular_momentum[0], before[0])
    assert np.array_equal(world.linvel[1, 0], np.zeros(3))
    # Impulse and angular impulse are force and torque times 1 s; 100 additions round 100 times.
    assert after.momentum[0, 0] == pytest.approx([7.0, -2.0, 1.0], rel=200 * EPS)
    assert after.angular_momentum[1, 0] - before[1, 0] == pytest.approx([7.0, -2.0, 1.0], rel=200 * EPS * 73)


def test_gyroscopic_torque_is_left_out_when_isotropic_and_tilted_axes_are_seen():
    """A cube's plan has no gyroscopic part; a full tensor has tilted axes, and turns like its principal twin."""
    cube = physics.World(physics.Scene([physics.Block((2, 2, 2), 3.0, angvel=(1, 2, 3))]), dt=0.01)
    assert cube.plan.gyroscopic is None
    cube.step(steps=50)
    assert np.abs(cube.angvel[0, 0] - [1, 2, 3]).max() < 100 * EPS * 3

    angle = 0.6
    c, s = np.cos(angle), np.sin(angle)
    P = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    body = physics.Block((5, 3, 2), 6.0, angvel=(0.4, 1.5, -0.7), inertia_body=P @ np.diag(INERTIA) @ P.T)
    tilted = physics.World(physics.Scene([body]), dt=0.01)
    assert tilted.plan.offset_frame
    tilted.step(steps=100)
    start = ref.RigidState(
        np.zeros(3), np.array([1.0, 0, 0, 0]), np.zeros(3), P @ np.diag(INERTIA) @ P.T @ [0.4, 1.5, -0.7]
    )
    truth = ref.integrate_rigid_body(6.0, P @ np.diag(INERTIA) @ P.T, start, 1.0)
    # DOP853 at its tightest tolerance is good to about 1e-12 here.
    assert ref.orientation_error(tilted.quat[0, 0], truth.quat) < 1e-11


def test_hard_case_39_powers_of_two_scale_the_trajectory_bit_for_bit():
    """Lengths by λ², time by λ, mass by 4: every number of the trajectory is multiplied by a power of two."""
    lam = 4.0
    runs = []
    for scale, time in ((1.0, 1.0), (lam**2, lam)):
        body = physics.Block(
            np.array([5, 3, 2]) * scale, 6.0 * (4.0 if scale > 1 else 1.0), pos=np.array([0, 2.3, 0]) * scale,
            quat=(np.cos(0.2), np.sin(0.2), 0, 0), angvel=np.array([0.3, 0.2, 0.1]) / time,
            linvel=np.array([1.0, 0, 0.5]) * scale / time,
        )  # fmt: skip
        scene = physics.Scene(
            [body], physics.three_walls(10.0 * scale),
            [physics.Gravity((0, -9.81 * scale / time**2, 0)), physics.Contact(0.25), physics.Friction(0.5)],
        )  # fmt: skip
        runs.append(physics.simulate(scene, 2.0 * time, sample_dt=0.01 * time))
    small, large = runs
    assert np.array_equal(large.pos, small.pos * lam**2)
    assert np.array_equal(large.quat, small.quat)
    assert np.array_equal(large.angvel, small.angvel / lam)


@pytest.mark.parametrize("scheme", ["exact", "explicit_euler", "semi_implicit_euler", "rk4"])
@given(
    st.tuples(*[st.floats(-30, 30)] * 3), st.tuples(*[st.floats(-20, 20)] * 3), st.tuples(*[st.floats(-10, 10)] * 3),
    st.sampled_from([1e-3, 1e-2, 0.05]),
)  # fmt: skip
def test_looks_at_walls_that_are_left_out_change_nothing(is_exhaustive, scheme, velocity, gravity, offset, dt):
    """One call of many steps leaves looks out, calls of one step none: the same bits, in flight and where it lands."""
    body = physics.Block((2, 1, 3), 1.0, pos=np.array(offset) / 1.5, linvel=velocity, angvel=(1, 2, 3))
    walls = [physics.HalfSpace(sign * np.eye(3)[axis] + (0.1, 0.0, 0.05), -15) for axis in range(3) for sign in (1, -1)]
    scene = physics.Scene([body], walls, [physics.Gravity(gravity), physics.Contact(0.5), physics.Friction(0.3)])
    one, other = (physics.World(scene, dt=dt, accuracy=physics.Accuracy(scheme=scheme)) for _ in range(2))
    steps = 150 if is_exhaustive else 50
    one.step(steps=steps)
    for _ in range(steps):
        other.step()
    assert np.array_equal(one.state, other.state)
    assert np.array_equal(one.memory, other.memory)
