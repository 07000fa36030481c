"""Rolling and spin friction of cylinders on walls and on fixed blocks, against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

import physics

pytestmark = pytest.mark.interpreted

G, R, H, M = 9.81, 0.2, 0.5, 2.0
FLOORS = {
    "wall": ([], [physics.HalfSpace((0, 1, 0))]),
    "block": ([physics.Block((4, 1, 4), fixed=True, pos=(0, -0.5, 0))], []),
}
ON = pytest.mark.parametrize("floor", FLOORS)
LYING = (math.sqrt(0.5), math.sqrt(0.5), 0, 0)  # body y along world z
PRESETS = ["balanced", pytest.param("precise", marks=[pytest.mark.exhaustive, pytest.mark.compiled])]


def world(body, *laws, preset="balanced", gravity=(0, -G, 0), mu=0.5, floor="wall"):
    effects = [physics.Gravity(gravity), physics.Contact(), physics.Friction(mu), *laws]
    bodies, walls = FLOORS[floor]
    return physics.World(physics.Scene([body, *bodies], walls, effects), dt=0.005, accuracy=preset)


@ON
@pytest.mark.parametrize("preset", PRESETS)
def test_a_cylinder_on_its_side_slows_by_two_thirds_of_a_g_over_r(preset, floor):
    """(½ + 1) m r² α = a m g about the line of contact, which holds: v' = -2 a g/(3 r), exact at any step.

    A solve leaves 1e-6 of the speed g dt of a step.
    """
    a, v, t = 0.01, 0.5, 0.25
    body = physics.Cylinder(R, H, M, pos=(0, R, 0), quat=LYING, linvel=(v, 0, 0), angvel=(0, 0, -v / R))
    built = world(body, physics.RollingFriction(a), preset=preset, floor=floor)
    built.step(steps=round(t / 0.005))
    slowing = 2 * a * G / (3 * R)
    assert built.linvel[0, 0] == pytest.approx([v - slowing * t, 0, 0], abs=1e-6 * G * 0.005)
    assert built.angvel[0, 0] == pytest.approx([0, 0, -(v - slowing * t) / R], abs=1e-6 * G * 0.005 / R)
    assert built.pos[0, 0, 0] == pytest.approx(v * t - slowing * t * t / 2, abs=1e-6)


@ON
@pytest.mark.parametrize(("share", "rolls"), [(0.9, False), (1.2, True)])
def test_it_stands_on_a_slope_up_to_a_over_r(share, rolls, floor):
    a = 0.02
    slope = math.atan(share * a / R)
    body = physics.Cylinder(R, H, M, pos=(0, R, 0), quat=LYING)
    gravity = (G * math.sin(slope), -G * math.cos(slope), 0)
    built = world(body, physics.RollingFriction(a), gravity=gravity, floor=floor)
    built.step(steps=60)
    speed = (2 / 3) * G * math.cos(slope) * (math.tan(slope) - a / R) * 0.3 if rolls else 0.0
    assert built.linvel[0, 0, 0] == pytest.approx(speed, abs=1e-5)


@ON
@pytest.mark.parametrize("preset", PRESETS)
def test_a_standing_cylinder_spins_down(preset, floor):
    """½ m r² ω' = -b m g: the eight points of the face share the weight, so that b p of each adds up to b m g.

    Friction of the rim adds μ m g r, which is left out here with μ = 0.
    """
    b, w, t = 0.01, 3.0, 0.25
    body = physics.Cylinder(R, H, M, pos=(0, H / 2, 0), angvel=(0, w, 0))
    built = world(body, physics.SpinFriction(b), preset=preset, mu=0.0, floor=floor)
    built.step(steps=round(t / 0.005))
    assert built.angvel[0, 0] == pytest.approx([0, w - 2 * b * G / R**2 * t, 0], abs=1e-5)
    assert built.pos[0, 0] == pytest.approx([0, H / 2, 0], abs=1e-6)


@ON
def test_a_face_does_not_roll(floor):
    """A moment that does not tip a standing cylinder presses its face unevenly, with rolling friction as without it.

    A torque of a p at each point would take a part of the moment, and the place would be the same; so the forces of the
    points are compared. Solves leave 1e-6 of the weight.
    """
    found = []
    for laws in ((), (physics.RollingFriction(0.05),)):
        built = world(physics.Cylinder(R, H, M, pos=(0, H / 2, 0)), *laws, floor=floor)
        wrench = np.zeros((1, built.pos.shape[1], 6))
        wrench[0, 0, 5] = 0.5  # [N m], less than m g r cos(π/8) = 3.6
        built.step(wrench, steps=20)
        points, forces = built.contacts(0)
        found.append(sum(np.cross(r - built.pos[0, 0], f) for r, f in zip(points, forces, strict=True)))
        assert built.pos[0, 0] == pytest.approx([0, H / 2, 0], abs=1e-6)
    assert found[0] == pytest.approx([0, 0, -0.5], abs=1e-4)
    assert found[1] == pytest.approx(found[0], abs=1e-4)
