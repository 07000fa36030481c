"""Bodies with a prescribed motion: blocks on belts, shakers, turntables and in presses, against exact motions."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import physics
from tests.reference.driven import GRAVITY, BlockOnBelt, on_turntable

MU = 0.3
LAWS = [physics.Gravity((0, -GRAVITY, 0)), physics.Contact(), physics.Friction(MU)]
BOX = physics.Block((0.4, 0.2, 0.3), 2.0, pos=(0, 0.1, 0))
PRESETS = ["balanced", "precise"]


def support(motion: physics.Motion, **given) -> physics.Block:
    return physics.Block((20, 1, 6), fixed=True, motion=motion, **{"pos": (0, -0.5, 0), **given})


def world(motion: physics.Motion, box: physics.Block = BOX, preset: str = "balanced", **given) -> physics.World:
    return physics.World(physics.Scene([support(motion), box], effects=LAWS), dt=0.005, accuracy=preset, **given)


# --- belts ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("way", ["surface_velocity", "velocity"])
@pytest.mark.parametrize(("preset", "bound"), [("balanced", 1e-5), ("precise", 1e-9)])
def test_a_belt_carries_a_block_along(preset, bound, way):
    """Friction gives μ g until the block has the speed of the belt, whether the surface moves or the whole body.

    The step in which the slip ends holds the block for all of it: at most μ g h²/8 = 9e-6 m too far.
    """
    speed, time = 2.0, 2.0
    on_belt = world(physics.Motion(**{way: (speed, 0, 0)}), preset=preset)
    on_belt.step(steps=400)
    end = speed / (MU * GRAVITY)
    place = 0.5 * MU * GRAVITY * end**2 + speed * (time - end)
    np.testing.assert_allclose(on_belt.pos[0, 1], (place, 0.1, 0), atol=bound)
    np.testing.assert_allclose(on_belt.linvel[0, 1], (speed, 0, 0), atol=bound)
    np.testing.assert_allclose(on_belt.pos[0, 0, 0], time * speed if way == "velocity" else 0.0, atol=1e-13)
    assert on_belt.report.ok


@pytest.mark.parametrize(("preset", "bound"), [("balanced", 1e-5), ("precise", 2e-9)])
def test_a_belt_reverses(preset, bound):
    """`set_motion` reverses the belt while the block still slips on it."""
    on_belt = world(physics.Motion(surface_velocity=(2, 0, 0)), preset=preset)
    on_belt.step(steps=100)
    on_belt.set_motion(0, surface_velocity=(-1, 0, 0))
    on_belt.step(steps=300)
    most = MU * GRAVITY
    start, speed = 0.5 * most * 0.5**2, most * 0.5
    turn = (speed + 1) / most
    place = start + speed * turn - 0.5 * most * turn**2 - (1.5 - turn)
    np.testing.assert_allclose(on_belt.pos[0, 1], (place, 0.1, 0), atol=bound)


def test_a_belt_up_a_slope_carries_a_block_without_slip():
    """The surface moves along the body axes: up the slope of 10°, where friction holds the block."""
    angle = math.radians(10.0)
    up, out = np.array((math.cos(angle), math.sin(angle), 0)), np.array((-math.sin(angle), math.cos(angle), 0))
    quat = (math.cos(angle / 2), 0, 0, math.sin(angle / 2))
    belt = support(physics.Motion(surface_velocity=(1, 0.7, 0)), pos=-0.5 * out, quat=quat)
    box = physics.Block((0.4, 0.2, 0.3), 2.0, pos=0.1 * out, quat=quat, linvel=up)
    on_belt = physics.World(physics.Scene([belt, box], effects=LAWS), dt=0.005)
    on_belt.step(steps=200)
    np.testing.assert_allclose(on_belt.pos[0, 1], 0.1 * out + 1.0 * up, atol=1e-5)


# --- a shaker -------------------------------------------------------------------------------------------------------

AMPLITUDE, RATE = 0.1, 3.0 * math.pi
PERIOD = 2.0 * math.pi / RATE


def shaker() -> tuple[physics.Motion, CubicSpline]:
    """Table of a sin(ω t) along x, and the spline that SciPy puts through it."""
    times = np.linspace(0.0, PERIOD, 33)
    x = AMPLITUDE * np.sin(RATE * times)
    x[-1] = 0.0
    pos = np.stack([x, np.full(33, -0.5), np.zeros(33)], axis=1)
    return physics.Motion.table(times, pos, repeat=True), CubicSpline(times, x, bc_type="periodic")


@pytest.mark.parametrize(("preset", "bound"), [("balanced", 1e-2), ("precise", 2e-3)])
def test_a_block_drifts_on_a_shaker(preset, bound):
    """a ω² = 3 μ g: in each period the block slips both ways; its way after ten periods."""
    motion, spline = shaker()
    place, velocity, acceleration = (lambda t, k=k: float(spline(t % PERIOD, k)) for k in range(3))
    true = BlockOnBelt(place, velocity, acceleration, MU, PERIOD)
    on_shaker, steps = world(motion, preset=preset), round(10 * PERIOD / 0.005)
    on_shaker.step(steps=steps)
    time = steps * 0.005
    assert on_shaker.pos[0, 0, 0] == pytest.approx(float(spline(time % PERIOD)), abs=1e-14)
    assert on_shaker.linvel[0, 0, 0] == pytest.approx(float(spline(time % PERIOD, 1)), abs=1e-12)
    assert on_shaker.pos[0, 1, 0] == pytest.approx(true.state(time)[0], abs=bound)


# --- turntables -----------------------------------------------------------------------------------------------------

SPIN = 2.0
HOLDING_RADIUS = MU * GRAVITY / SPIN**2
CHIP = {"size": (0.004, 0.001, 0.004), "mass": 0.1}


@pytest.mark.parametrize(("preset", "bound"), [("balanced", 2e-5), ("precise", 1e-9)])
def test_a_block_stays_on_a_turntable(preset, bound):
    """Within μ g/ω² it turns with the table. At `balanced` the angle is off by 4/3 (ω h/2)³ in each step: 6.7e-6 m."""
    radius, angle = 0.5 * HOLDING_RADIUS / 0.73575 , SPIN * 0.5
    start = {"pos": (radius, 0.1, 0), "linvel": (0, 0, -SPIN * radius), "angvel": (0, SPIN, 0)}
    on_table = world(physics.Motion(spin=(0, SPIN, 0)), physics.Block((0.4, 0.2, 0.3), 2.0, **start), preset)
    on_table.step(steps=100)
    true = (radius * math.cos(angle), 0.1, -radius * math.sin(angle))
    np.testing.assert_allclose(on_table.pos[0, 1], true, atol=bound)
    np.testing.assert_allclose(on_table.quat[0, 0], (math.cos(angle / 2), 0, math.sin(angle / 2), 0), atol=1e-13)
    np.testing.assert_allclose(on_table.angvel[0, :, 1], SPIN, atol=1e-5)


@pytest.mark.parametrize(("preset", "bound"), [("balanced", 1e-3), ("precise", 1e-5)])
def test_a_chip_slides_off_a_turntable(preset, bound):
    """Outside μ g/ω² a chip, small enough to be a point, slides outwards. Friction of faces opposes the slip at the end
    of a step, which is of first order in the turn of the slip.
    """
    radius = 1.36 * HOLDING_RADIUS
    start = {"pos": (radius, 0.0005, 0), "linvel": (0, 0, -SPIN * radius), "angvel": (0, SPIN, 0)}
    on_table = world(physics.Motion(spin=(0, SPIN, 0)), physics.Block(**CHIP, **start), preset)
    on_table.step(steps=100)
    true = on_turntable((radius, 0), (0, -SPIN * radius), SPIN, MU, 0.5)
    assert np.linalg.norm(true) > radius + 0.05
    np.testing.assert_allclose(on_table.pos[0, 1, [0, 2]], true, atol=bound)
