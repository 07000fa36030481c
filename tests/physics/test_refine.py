"""Error control where bodies touch each other (`adaptive_substep`): what `precise` means there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import physics
from physics.accuracy import PRESETS
from physics.kernels.multibody.stepping.allowed_error import ERROR_PER_TOLERANCE

G = 9.81
FLOOR = physics.HalfSpace((0, 1, 0))
PRECISE = PRESETS["precise"]


def rough(bodies, friction) -> physics.Scene:
    return physics.Scene(bodies, [FLOOR], [physics.Gravity((0, -G, 0)), physics.Contact(), physics.Friction(friction)])


def run(scene, tolerance, duration=1.2, dt=0.01):
    world = physics.World(scene, dt=dt, accuracy=replace(PRECISE, tolerance=tolerance))
    report = world.step(steps=round(duration / dt))
    return world, report


def dominoes(count=4) -> physics.Scene:
    """In a row, 0.6 m apart; the first one falls on the others."""
    tilt = 0.15
    first = physics.Block((0.2, 1, 0.5), 1.0, pos=(0.1, 0.55, 0), quat=(np.cos(tilt), 0, 0, -np.sin(tilt)))
    return rough([first, *(physics.Block((0.2, 1, 0.5), 1.0, pos=(0.6 * k, 0.5, 0)) for k in range(1, count))], 0.5)


def tower() -> physics.Scene:
    return rough([physics.Block((1, 1, 1), 1.0, pos=(0, k + 0.5, 0)) for k in range(3)], 0.5)


@pytest.mark.parametrize("tolerance", [1e-8, 1e-9, 1e-10])
def test_a_block_stops_on_a_slab_where_it_must(tolerance):
    """A cube slides at v on a slab that rests, v²/(2 μ g) far.

    Forces are constant, and a stage ends where it stops. What is left are residuals of a tolerance of the speed.
    """
    v, mu = 2.0, 0.3
    slab = physics.Block((4, 1, 4), 4.0, pos=(0, 0.5, 0))
    cube = physics.Block((1, 1, 1), 1.0, pos=(-1, 1.5, 0), linvel=(v, 0, 0))
    world, _ = run(rough([slab, cube], mu), tolerance)
    way = v * v / (2 * mu * G)
    assert world.pos[0, 1, 0] + 1 == pytest.approx(way, abs=tolerance * way)
    assert np.abs(world.pos[0, 0] - (0, 0.5, 0)).max() <= ERROR_PER_TOLERANCE * tolerance * np.sqrt(8.25)


def test_a_cube_that_falls_flat_on_a_block_does_not_turn():
    """It bounces at t₀ (1 + 2 e + 2 e² ...); solves leave their tolerance of v/a as a spin.

    The time of a bounce is off by what the speeds before it are, relative to them: some tolerances.
    """
    side, height, e = 0.5, 0.5, 0.8
    plate = physics.Block((2, 0.2, 2), 50.0, pos=(0, 0.1, 0))
    cube = physics.Block((side,) * 3, 1.0, pos=(0, 0.2 + side / 2 + height, 0))
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(e), physics.Friction(0.5)]
    run = physics.simulate(physics.Scene([plate, cube], [FLOOR], effects), 2.0, "precise", 0.01)
    fall = np.sqrt(2 * height / G)
    bounces = fall * (1 + 2 * np.cumsum(e ** np.arange(5)) - 2)
    hits = [event.t for event in run.events if event.kind == "impact" and event.other == 1]
    assert hits == pytest.approx(bounces, abs=100 * PRECISE.tolerance * fall)
    assert np.abs(run.angvel[:, 1]).max() <= 20 * PRECISE.tolerance * G * fall / (side / 2)


def test_dominoes_converge_with_the_tolerance():
    """Against the run at 3e-11, until the first domino has struck the second one (two impacts, sliding, rolling over).

    A part of h errs by C h³, as much as is allowed, so that T/h of them err by tolerance**(2/3), to the tolerance where
    single events decide: a slope of 2/3 to 1, and 0.1 for three points. The truth has an error of its own, 0.3 of that
    at 1e-10. So that point is lower by up to log10(1/0.7), which is half of 0.15 in the slope of three points.
    """
    duration = 0.45
    truth, _ = run(dominoes(), 3e-11, duration)
    tolerances = np.array([1e-8, 1e-9, 1e-10])
    errors = np.array([np.abs(run(dominoes(), t, duration)[0].pos - truth.pos).max() for t in tolerances])
    slope = np.polyfit(np.log(tolerances), np.log(errors), 1)[0]
    print("dominoes: tolerance", tolerances, "error [m]", errors, "slope", slope)
    assert 2 / 3 - 0.1 <= slope <= 1.1 + 0.08
    assert truth.linvel[0, 1, 0] > 0.1  # [m/s]: the second one has been struck


def test_a_part_is_of_second_order():
    """A block rocks on its edge, a step of 1/400 to 1/3200 s a part each: the slope of its velocity's error is 2."""
    tilt, spin = 0.1, -0.5
    c, s = np.cos(tilt), np.sin(tilt)
    pos = np.array([0.1 * c - 0.5 * s, 0.1 * s + 0.5 * c, 0])
    block = physics.Block(
        (0.2, 1, 0.5), 1.0, pos=pos, quat=(np.cos(tilt / 2), 0, 0, np.sin(tilt / 2)),
        linvel=(-spin * pos[1], spin * pos[0], 0), angvel=(0, 0, spin),
    )  # fmt: skip
    scene = rough([block, physics.Block((1, 1, 1), 1.0, pos=(5, 0.5, 0))], 0.6)

    def spin_after(steps):
        world, report = run(scene, 1e-6, 0.01, 0.01 / steps)
        assert report.solves[0] == 3 * steps  # no part was refused: a part and its two halves
        return world.angvel[0, 0, 2]

    steps = np.array([4, 8, 16, 32])
    errors = np.abs([spin_after(n) - spin_after(512) for n in steps])
    slope = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    print("rocking: order", slope, "errors [rad/s]", errors)
    assert slope == pytest.approx(2, abs=0.1)


def test_what_rests_keeps_its_bits_at_three_solves_a_step():
    world = physics.World(tower(), accuracy="precise")
    world.step(steps=10)
    before = world.state.copy()
    report = world.step(steps=1000)
    assert np.array_equal(world.pos, before.reshape(1, 3, -1)[:, :, :3])
    assert np.array_equal(world.quat, before.reshape(1, 3, -1)[:, :, 3:7])
    assert report.solves[0] <= 3000
    assert report.ok


def test_batch_threads_and_snapshots_do_not_change_a_bit():
    one = physics.World(dominoes(), accuracy="precise")
    one.step(steps=30)
    many = physics.World(dominoes(), worlds=5, threads=3, accuracy="precise")
    many.set_state(linvel=np.full((1, 4, 3), 0.25), worlds=[2])  # another motion, other parts
    many.step(steps=17)
    snapshot = many.snapshot()
    many.step(steps=13)
    once = many.state.copy()
    many.restore(snapshot)
    many.step(steps=13)
    assert np.array_equal(many.state, once)
    for world in (0, 1, 3, 4):
        assert np.array_equal(many.pos[world], one.pos[0])
        assert np.array_equal(many.angvel[world], one.angvel[0])
    assert not np.array_equal(many.pos[2], one.pos[0])


def test_an_error_that_cannot_be_met_is_counted_and_ends():
    world = physics.World(dominoes(), accuracy="precise")
    world.scratch[0].settings["tolerance"] = 1e-30
    assert world.step(steps=2).fallbacks[0] > 0
    # After 12 of them in a substep the shortest part is the substep, and what is left doubles its parts: 24 at most.
    assert world.report.fallbacks[0] <= 2 * (12 + 24)
    assert np.isfinite(world.state).all()


def test_only_what_asks_for_an_error_pays_for_it():
    two, alone = tower(), rough([physics.Block((1, 1, 1), 1.0, pos=(0, 0.5, 0))], 0.5)
    assert physics.make_plan(two, PRECISE).scheme.is_error_controlled
    assert not physics.make_plan(two, PRECISE).scheme.is_event_driven
    assert physics.make_plan(alone, PRECISE).scheme.is_event_driven
    for scene, accuracy in ((alone, PRECISE), (two, PRESETS["balanced"]), (two, PRESETS["fast"])):
        assert not physics.make_plan(scene, accuracy).scheme.is_error_controlled
    assert physics.World(two).motions == [None]


def test_a_block_that_slides_and_turns_takes_long_parts():
    """It takes half of the parts that friction against the slip at the end of a stage would need, at most.

    The slip u of a corner turns at the rate k = ω² r/u. Friction of a stage of length h would then err by μ g k h²/2,
    and a part would differ from its halves by half of that. So parts of h = √(4 e s/(μ g k)) would be the longest ones,
    for the allowed error e and the speed s that errors are relative to. Against the mean slip the error is of third
    order.
    """
    speed, spin, mu, steps, dt = 2.0, 1.0, 0.3, 5, 0.01
    size, other = (1, 0.5, 1), physics.Block((1, 0.5, 1), 5.0, pos=(5, 0.25, 0))
    block = physics.Block(size, 5.0, pos=(0, 0.25, 0), linvel=(speed, 0, 0), angvel=(0, spin, 0))
    _, report = run(rough([block, other], mu), PRECISE.tolerance, steps * dt, dt)
    radius = np.linalg.norm(size) / 2
    reference = speed + radius * spin + np.sqrt(radius * G)
    rate = spin**2 * np.sqrt(0.5) / (speed + np.sqrt(0.5) * spin)
    longest = np.sqrt(4 * ERROR_PER_TOLERANCE * PRECISE.tolerance * reference / (mu * G * rate))
    print("sliding and turning: contact problems", report.solves[0], "parts of first order", steps * dt / longest)
    assert report.solves[0] / 3 <= steps * dt / longest / 2
