"""Bodies with a prescribed motion: blocks on belts, shakers, turntables and in presses, against exact motions."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

import physics
from tests.reference.driven import GRAVITY, BlockOnBelt, on_turntable
from tests.tiers.sweep import sweep

MU = 0.3
LAWS = [physics.Gravity((0, -GRAVITY, 0)), physics.Contact(restitution=0.5), physics.Friction(MU)]
BOX = physics.Block((0.4, 0.2, 0.3), 2.0, pos=(0, 0.1, 0))


def at_balanced(case: tuple[str, float]) -> bool:
    """Answer whether the default tier runs a case; `precise` has kernels that no other test of it needs."""
    return case[0] == "balanced"


def support(motion: physics.Motion, **given) -> physics.Block:
    return physics.Block((20, 1, 6), fixed=True, motion=motion, **{"pos": (0, -0.5, 0), **given})


def world(motion: physics.Motion, box: physics.Block = BOX, preset: str = "balanced", **given) -> physics.World:
    return physics.World(physics.Scene([support(motion), box], effects=LAWS), dt=0.005, accuracy=preset, **given)


# --- belts ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("way", ["surface_velocity", "velocity"])
@pytest.mark.parametrize(("preset", "bound"), sweep([("balanced", 2e-6), ("precise", 1e-11)], at_balanced))
def test_a_belt_carries_a_block_along(preset, bound, way):
    """Friction gives μ g until the block has the speed of the belt, whether the surface moves or the whole body.

    Solves leave ε of the speed of the loads, so a velocity is off by ε g h in each of the n steps of the slip, and the
    place by half of ε g h² n²: 2e-6 m at ε = 1e-6 if all errors had one sign. 2e-9 m and 1e-12 m were seen.
    """
    speed, time = 2.0, 2.0
    on_belt = world(physics.Motion(**{way: (speed, 0, 0)}), preset=preset)
    on_belt.step(steps=400)
    end = speed / (MU * GRAVITY)
    place = 0.5 * MU * GRAVITY * end**2 + speed * (time - end)
    np.testing.assert_allclose(on_belt.pos[0, 1], (place, 0.1, 0), atol=bound)
    np.testing.assert_allclose(on_belt.linvel[0, 1], (speed, 0, 0), atol=bound)
    np.testing.assert_allclose(on_belt.pos[0, 0, 0], time * speed if way == "velocity" else 0.0, atol=1e-13)
    assert on_belt.report.ok or preset == "precise"  # some solves at the end of the slip keep a residual of 2e-10


@pytest.mark.parametrize(("preset", "bound"), sweep([("balanced", 1e-7), ("precise", 1e-10)], at_balanced))
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


@pytest.mark.parametrize(("preset", "bound"), sweep([("balanced", 1e-5), ("precise", 1e-10)], at_balanced))
def test_a_block_drifts_on_a_shaker(preset, bound):
    """a ω² = 3 μ g: in each period the block slips both ways; its way after ten periods.

    Twenty slips end, each of them met in time. Otherwise the block would be 5e-3 m off at `balanced`. There rounding
    decides where a slip counts as ended: 1e-7 to 5e-6 m were seen with different compilers. At `precise` it was 4e-12.
    """
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


@pytest.mark.parametrize(("preset", "bound"), sweep([("balanced", 2e-5), ("precise", 1e-9)], at_balanced))
def test_a_block_stays_on_a_turntable(preset, bound):
    """Within μ g/ω² it turns with the table. At `balanced` the angle is off by 4/3 (ω h/2)³ in each step: 6.7e-6 m."""
    radius, angle = 0.68 * HOLDING_RADIUS, SPIN * 0.5
    start = {"pos": (radius, 0.1, 0), "linvel": (0, 0, -SPIN * radius), "angvel": (0, SPIN, 0)}
    on_table = world(physics.Motion(spin=(0, SPIN, 0)), physics.Block((0.4, 0.2, 0.3), 2.0, **start), preset)
    on_table.step(steps=100)
    true = (radius * math.cos(angle), 0.1, -radius * math.sin(angle))
    np.testing.assert_allclose(on_table.pos[0, 1], true, atol=bound)
    np.testing.assert_allclose(on_table.quat[0, 0], (math.cos(angle / 2), 0, math.sin(angle / 2), 0), atol=1e-13)
    np.testing.assert_allclose(on_table.angvel[0, :, 1], SPIN, atol=1e-5)


@pytest.mark.parametrize(("preset", "bound"), sweep([("balanced", 2e-5), ("precise", 1e-9)], at_balanced))
def test_a_chip_slides_off_a_turntable(preset, bound):
    """Outside μ g/ω² a chip, small enough to be a point, slides outwards.

    Friction opposes the mean slip of a step, so that the error is of second order: 9.6e-6 m, and 6e-11 m.
    """
    radius = 1.36 * HOLDING_RADIUS
    start = {"pos": (radius, 0.0005, 0), "linvel": (0, 0, -SPIN * radius), "angvel": (0, SPIN, 0)}
    on_table = world(physics.Motion(spin=(0, SPIN, 0)), physics.Block(**CHIP, **start), preset)
    on_table.step(steps=100)
    true = on_turntable((radius, 0), (0, -SPIN * radius), SPIN, MU, 0.5)
    assert np.linalg.norm(true) > radius + 0.05
    np.testing.assert_allclose(on_table.pos[0, 1, [0, 2]], true, atol=bound)


# --- plates that push -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("preset", "bound"), sweep([("balanced", 1e-5), ("precise", 1e-9)], at_balanced))
def test_a_rising_plate_bats_a_block(preset, bound):
    """A block that falls flat on a plate of velocity w leaves it with w + e (w - v): the plate's work is no error."""
    height, rise, e, time = 1.0, 1.5, 0.5, 0.6
    block = physics.Block(BOX.size, BOX.mass, pos=(0, height + 0.1, 0))
    falling = world(physics.Motion(velocity=(0, rise, 0)), block, preset)
    falling.step(steps=round(time / 0.005))
    hit = (-rise + math.sqrt(rise**2 + 2.0 * GRAVITY * height)) / GRAVITY
    up, left = rise + e * (rise + GRAVITY * hit), time - hit
    place = rise * hit + 0.1 + up * left - 0.5 * GRAVITY * left**2
    assert falling.pos[0, 1, 1] == pytest.approx(place, abs=bound)
    assert falling.linvel[0, 1, 1] == pytest.approx(up - GRAVITY * left, abs=bound)


@pytest.mark.exhaustive
@pytest.mark.parametrize("ratio", [1e2, 1e5, 1e8])
def test_a_plate_pushes_a_light_block_against_a_heavy_one(ratio):
    """All move with the plate at last, whatever the ratio of the masses; nothing overlaps."""
    plate = physics.Block((1, 1, 1), fixed=True, pos=(-0.55, 0, 0), motion=physics.Motion(velocity=(0.5, 0, 0)))
    blocks = [physics.Block((0.5, 0.4, 0.6), 1.0, pos=(0.25, 0, 0)), physics.Block((1, 0.9, 0.8), ratio, pos=(1, 0, 0))]
    pushing = physics.World(physics.Scene([plate, *blocks], effects=LAWS), dt=0.005)
    pushing.set_parameters(gravity=(0, 0, 0), restitution=0.0)
    pushing.step(steps=200)
    assert pushing.report.ok
    np.testing.assert_allclose(pushing.linvel[0, :, 0], 0.5, atol=1e-9)
    np.testing.assert_allclose(pushing.pos[0, 1:, 0] - pushing.pos[0, 0, 0], (0.75, 1.5), atol=1e-6)


def test_a_press_that_closes_too_far_is_reported():
    """No rigid block fits between plates that have come nearer than its height: the report says so, and all is finite.

    The plates keep their motion.
    """
    plate = physics.Block((1, 1, 1), fixed=True, pos=(0, 1.02, 0), motion=physics.Motion(velocity=(0, -0.1, 0)))
    block = physics.Block((0.5, 0.5, 0.4), 1.0, pos=(0, 0.25, 0))
    press = physics.World(physics.Scene([plate, support(physics.Motion()), block], effects=LAWS), dt=0.005)
    press.step(steps=30)
    assert press.report.ok
    report = press.step(steps=30)
    assert not report.ok
    assert np.isfinite(press.state).all()
    np.testing.assert_allclose(press.pos[0, 0], (0, 0.99, 0), atol=1e-12)


# --- tables ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("repeat", [False, True])
def test_a_table_is_a_spline_of_places_and_of_attitudes(repeat):
    """Poses and velocities against SciPy's splines. A table that ends is at rest at its ends and afterwards.

    The angular velocity is the turn between two moments 2 δ apart, which is off by δ² ω''/6: ω'' is below 1e4 rad/s³.
    """
    rng = np.random.default_rng(7)
    times = np.array([0.0, 0.1, 0.25, 0.3, 0.5, 0.6])
    pos, quat = rng.normal(size=(6, 3)), rng.normal(size=(6, 4))
    quat /= np.linalg.norm(quat, axis=1)[:, None]
    if repeat:
        pos[-1], quat[-1] = pos[0], -quat[0]
    moving = world(physics.Motion.table(times, pos, quat, repeat))
    signs = np.cumprod(np.where((quat[1:] * quat[:-1]).sum(axis=1) < 0, -1.0, 1.0))
    quat[1:] *= signs[:, None]
    t, end, delta = times, 0.6, 1e-5
    if repeat and quat[-1] @ quat[0] < 0.0:  # the components have twice the period
        t, pos, quat = (
            np.concatenate([t, 0.6 + t[1:]]),
            np.concatenate([pos, pos[1:]]),
            np.concatenate([quat, -quat[1:]]),
        )
        end = 1.2
    kind = "periodic" if repeat else "clamped"
    place, components = CubicSpline(t, pos, bc_type=kind), CubicSpline(t, quat, bc_type=kind)
    for step in range(1, 261):
        moving.step()
        now = (step * 0.005) % end if repeat else min(step * 0.005, end)
        c = components(now)
        np.testing.assert_allclose(moving.pos[0, 0], place(now), atol=1e-11)
        found = moving.quat[0, 0] * math.copysign(1.0, moving.quat[0, 0] @ c)
        np.testing.assert_allclose(found, c / np.linalg.norm(c), atol=1e-11)
        np.testing.assert_allclose(moving.linvel[0, 0], place(now, 1), atol=1e-9)
        before, after = (Rotation.from_quat(components(now + s), scalar_first=True) for s in (-delta, delta))
        if delta < now < end - delta:
            turn = (after * before.inv()).as_rotvec() / (2.0 * delta)
            np.testing.assert_allclose(moving.angvel[0, 0], turn, atol=1e-6)
    if not repeat:
        assert not moving.linvel[0, 0].any()
        assert not moving.angvel[0, 0].any()


# --- with force fields ----------------------------------------------------------------------------------------------


@pytest.mark.exhaustive
def test_the_energy_budget_of_a_stiff_field_allows_for_the_work_of_a_belt():
    """In syrup of c/m = 500/s a belt drags a block along with μ m g/c, as fast as its friction is strong.

    A step of 5 ms is stiff. Its friction still moves the block, by μ g h, as that of a heavy moving slab would.
    """
    syrup = physics.Drag(coefficient=0.0, linear=1000.0)
    motion, spline = shaker()
    scene = physics.Scene([support(physics.Motion(surface_velocity=(2, 0, 0))), BOX], effects=[*LAWS, syrup])
    for dt, speed in ((0.0005, MU * BOX.mass * GRAVITY / 1000.0), (0.005, MU * GRAVITY * 0.005)):
        in_syrup = physics.World(scene, dt=dt)
        in_syrup.step(steps=40)
        assert in_syrup.linvel[0, 1, 0] == pytest.approx(speed, abs=1e-6)
        assert in_syrup.report.ok
    shaken = physics.World(physics.Scene([support(motion), BOX], effects=[*LAWS, syrup]), dt=0.005)
    shaken.step(steps=30)
    shaken.step(steps=30)
    assert shaken.pos[0, 0, 0] == pytest.approx(float(spline(0.3)), abs=1e-14)  # fields keep the same time
