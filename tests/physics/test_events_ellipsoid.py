"""Ellipsoids that turn fast, in the event-driven scheme: what random scenes found."""

from __future__ import annotations

import numpy as np
import pytest

import physics


def unit(q):
    return tuple(np.array(q) / np.linalg.norm(q))


def test_a_bounce_that_the_turning_body_ends_at_once():
    """A slender body bounces up at 3 mm/s, and its turning presses it down again at 8e5 m/s²: after 8 ns.

    How long its flight is sure to meet no wall was known so badly that a hundred looks led no further than 9 ps; then
    it leapt, to first order, into the wall and back, and gained energy. Its bounces end as e^k.
    """
    body = physics.Ellipsoid(
        (1.26047958, 0.24000028, 0.18722354), 35.37, pos=(9.744930638, 0.0, 0.0),
        quat=unit((0.63538981, -0.16413558, -0.71421419, 0.2433873)),
        linvel=(-323.30082009, -33.57227803, 195.96279631), angvel=(-59.17160931, 906.51806692, 2052.0747715),
    )  # fmt: skip
    gravity, contact = physics.Gravity((-1.03, 2.04, 0.51)), physics.Contact(restitution=0.336)
    world = physics.World(physics.Scene([body], [physics.HalfSpace((-1, 0, 0), -10.0)], [gravity, contact]),
                          dt=0.01, accuracy="precise")  # fmt: skip
    before = physics.diagnose(world).energy.sum()
    report = world.step()
    assert report.ok, report.messages()
    assert report.fallbacks[0] == 0
    # Of ten smooth steps each is off by two tolerances of the energy at most; bounces only take.
    assert physics.diagnose(world).energy.sum() <= before * (1 + 20 * world.accuracy.tolerance)


WORLDS = 500


@pytest.mark.parametrize("spread", [1e-9, 1e-3])
def test_a_force_without_bound_is_not_stepped_over(spread):
    """Rolling, then sliding with μ = 1.9, and the push that holds the body up grows beyond all bounds (Painlevé).

    The push is positive before the pole and negative after it, which looks like a contact that leaves. A step over the
    pole is no solution, whatever its orders agree on; one in fourteen of these bodies gained energy by it, up to 40,000
    times what it had. Friction and plastic contacts only take.
    """
    body = physics.Ellipsoid(
        (0.180467361, 0.438551471, 0.406692079), 0.0136527, pos=(-4.70027, -9.669236007176664, 7.976143),
        quat=unit((0.21275044670289886, 0.32162582426370706, 0.8573069642044249, 0.34105548774503125)),
        linvel=(7.622404833100092, -3.7672662594596833, -5.344489222941757),
        angvel=(-83.00571592577148, -102.80165469931023, -45.92056506142797),
    )  # fmt: skip
    effects = [physics.Gravity((-0.037, 0.004, 0.0188)), physics.Contact(), physics.Friction(1.88440819)]
    world = physics.World(
        physics.Scene([body], [physics.HalfSpace((0, 1, 0), -10.0)], effects), WORLDS, dt=0.01, accuracy="precise"
    )
    rng = np.random.default_rng(1)
    world.set_state(angvel=world.angvel * (1 + spread * rng.normal(size=world.angvel.shape)))
    before = physics.diagnose(world)
    report = world.step()
    gained = physics.diagnose(world).energy.sum(axis=1) - before.energy.sum(axis=1)
    assert report.ok, report.messages()
    # A step has some hundred smooth parts, each off by two tolerances at most.
    assert (gained <= 200 * world.accuracy.tolerance * before.kinetic_energy.sum(axis=1)).all()


def test_a_rebound_that_a_wedge_does_not_allow():
    """Between two walls, with μ = 1.9 at both: friction holds any stress along the line between the two contacts.

    No impulse moves one of them along it, so the rebound that the law wants there has no solution. It was tried
    again and again, between leaps, ten thousand times in 10 ms, for 70 s; now such an impact has no rebound.
    """
    body = physics.Ellipsoid(
        (0.3726973513798245, 1.070835335996931, 0.33992841316105477), 0.045237504059034615,
        pos=(-9.086488312722647, 9.347944989733486, 8.389858713269732),
        quat=unit((0.644483438722126, -0.3010736332577428, -0.5987433368572055, -0.36810620904704233)),
        linvel=(-22.570784920280804, -3.7628925021394517, 451.1831451104407),
        angvel=(-3320.84131055008, -2370.3815937314475, -185.89683487905862),
    )  # fmt: skip
    walls = [physics.HalfSpace((1, 0, 0), -10.0), physics.HalfSpace((0, -1, 0), -10.0)]
    effects = [physics.Gravity((1.6, 1.4, -2.1)), physics.Contact(restitution=0.35), physics.Friction(1.91)]
    world = physics.World(physics.Scene([body], walls, effects), dt=0.01, accuracy="precise")
    before = physics.diagnose(world).energy.sum()
    report = world.step()
    # The impact that has no solution is counted, as one that pivoting could not solve either; nothing else is.
    assert report.unresolved[0] == report.faults[0] == 0
    assert report.unconverged[0] <= 1
    assert report.fallbacks[0] <= 1
    assert report.solves[0] <= 100
    assert physics.diagnose(world).energy.sum() <= before * (1 + 20 * world.accuracy.tolerance)


@pytest.mark.interpreted
def test_angular_momentum_is_held_against_the_real_spin():
    """A rod end over end, in a field: errors of L count by the speed of its ends, not by a spin of that L on its axis.

    About its axis the moment of inertia is a fiftieth: the same L would be fifty times the spin.
    """
    mass, reach, spin = 2.0, 1.0, 5.0
    body = physics.Ellipsoid((reach, 0.1, 0.1), mass, angvel=(0.0, spin, 0.0))
    world = physics.World(physics.Scene([body], [], [physics.AngularDrag(1e-6)]), dt=0.01, accuracy="precise")
    world.step()
    # Loads could add, in the step: the drag's 5e-6 N m about the axis, with 0.008 kg m² there, 6.25e-6 m/s in 10 ms.
    expected = mass * reach * (reach * spin + 6.25e-6)
    assert world.motions[0].smooth["scale"][0][10:] == pytest.approx([expected] * 3, rel=1e-9)
