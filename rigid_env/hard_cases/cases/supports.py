"""Hard cases of bodies that do not move by themselves: joints, wedges, belts and plates that push.

Engines treat them as meshes of edges or as bodies of a huge mass. Then a sliding body catches an edge inside a floor,
a wedge sinks, a belt carries its load too far, and a press loses what it holds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

import physics
from physics.rotations import rotation_matrices
from physics.scene.canonical_scenes import GRAVITY
from rigid_env.hard_cases.case import Case, Check, Setting, within
from rigid_env.hard_cases.cases.scenery import FLOOR, laws, turned

COIN = physics.Cylinder(0.0125, 0.002, 0.005, pos=(0, 0.001, 0))

BOX = physics.Block((0.5, 0.3, 0.4), 2.0, pos=(-1, 0.15, 0), linvel=(3, 0, 0))


def _solved(on: Setting) -> float:
    """Share of the free contact speed that a step may leave: a solve, or a part of a step with error control."""
    return (100 if on.is_event_driven else 1) * max(on.tolerance, 1e-11)


def joint(on: Setting) -> Sequence[Check]:
    """A block slides over the joint of two flush fixed boxes as over one floor: v = v₀ - μ g t, and it does not turn.

    Contact points at the joint have the edge of the other box before them (the ghost collision). Each step leaves at
    most a share ε of the speed that loads give, and there are ten contacts around the joint at most. So the velocity is
    off by 10 ε (g t + v₀), the place by as much times t, and the block turns by it over half its height.
    """
    mu, speed, time = 0.2, BOX.linvel[0], 0.8
    floor = [physics.Block((4, 1, 4), fixed=True, pos=(x, -0.5, 0)) for x in (-2, 2)]
    world = on.world(physics.Scene([*floor, BOX], effects=laws(0.0, mu)))
    turning = 0.0
    for _ in range(on.steps(time)):
        world.step()
        turning = max(turning, float(np.abs(world.angvel[0, 2]).max()))
    t = world.time
    limit = 10 * _solved(on) * (GRAVITY * t + speed) + 10 * on.slop
    way = BOX.pos[0] + speed * t - 0.5 * mu * GRAVITY * t * t
    return [
        within("speed behind the joint", world.linvel[0, 2, 0], speed - mu * GRAVITY * t, limit, "m/s"),
        within("place behind the joint", world.pos[0, 2, 0], way, limit * t, "m"),
        Check("turning of the block", turning, limit / 0.15, "rad/s"),
    ]


def wedge(on: Setting) -> Sequence[Check]:
    """A wedge of 10° between two fixed plates without friction: each pushes with N = W/(2 sin 5°), and nothing sinks.

    The wedge is a prism that stands on its edge. Its sides lie flat on the plates, each by four contacts, so that the
    forces are those of rigid bodies with redundant contacts: only their sum is known. Weight and forces balance to
    the tolerance of a solve, which a small angle makes larger by 1/sin 5°.
    """
    half, height, mass = math.radians(5.0), 1.0, 3.0
    sine, cosine = math.sin(half), math.cos(half)
    wide = height * math.tan(half)
    corners = [(x, y, z) for z in (-0.3, 0.3) for x, y in ((0, 0), (wide, height), (-wide, height))]
    prism = physics.Hull(corners, mass, pos=(0, 2 / 3 * height, 0))
    plates = []
    for sign in (1, -1):
        along, out = np.array((sign * sine, cosine, 0)), np.array((sign * cosine, -sine, 0))
        middle = 0.6 * along + 0.1 * out
        plates.append(physics.Block((0.2, 1.6, 1), fixed=True, pos=middle, quat=turned(-sign * half)))
    world = on.world(physics.Scene([*plates, prism], effects=laws()))
    world.step(steps=on.steps(on.pick(5.0, 0.5)))
    sunk = float(np.abs(world.pos[0, 2] - prism.pos).max())
    found = world.read_contacts(body=2)
    force, ends = found.force[0, : found.count[0]], found.ends[0, : found.count[0]]
    limit = 20 * _solved(on) / sine + 1e-9
    expected = mass * GRAVITY / (2 * sine)
    return [
        Check("way that the wedge sinks", sunk, (20 * _solved(on) * GRAVITY * on.dt**2 + 20 * on.slop) / sine, "m"),
        *(
            within(f"force of plate {plate}, as a share of W/(2 sin 5°)",
                   float(np.linalg.norm(force[ends[:, 1] == plate].sum(axis=0))) / expected, 1.0, limit)
            for plate in (0, 1)
        ),
    ]  # fmt: skip


def capsule_upright(on: Setting) -> Sequence[Check]:
    """A capsule stands on its end: its weight passes through the contact, so nothing turns it, however long it stands.

    An upright capsule is an unstable equilibrium, and a rounding that turned it would grow by e in every 0.2 s. The
    contact lies below the centre exactly, so the lever is 0 and not a rounding.
    """
    capsule = physics.Capsule(0.1, 0.6, 1.0, pos=(0, 0.4, 0))
    world = on.world(physics.Scene([capsule], [FLOOR], laws(0.0, 0.5)))
    world.step(steps=on.steps(on.pick(60.0, 2.0)))
    sunk = abs(world.pos[0, 0, 1] - 0.4)
    return [
        Check("turning", float(np.abs(world.angvel).max()), 0.0, "rad/s"),
        Check("way that it sinks", float(sunk), 20 * _solved(on) * GRAVITY * on.dt**2 + 20 * on.slop, "m"),
    ]


def belt_reverses(on: Setting) -> Sequence[Check]:
    """A belt carries a block, and reverses before the block has its speed: ways under μ g in closed form, then rest.

    From rest the block gains μ g while the belt runs forward at 2 m/s. The belt then runs back at 1 m/s. Friction turns
    round at once, and ends when the block has the speed of the belt, which it keeps. Each step leaves at most a share ε
    of the speed that loads give, at up to ten contacts.
    """
    most, forward, back = 0.3 * GRAVITY, 0.5, 1.0
    box = physics.Block((0.4, 0.2, 0.3), 2.0, pos=(0, 0.1, 0))
    belt = physics.Block((20, 1, 6), fixed=True, pos=(0, -0.5, 0), motion=physics.Motion(surface_velocity=(2, 0, 0)))
    world = on.world(physics.Scene([belt, box], effects=laws(0.0, 0.3)))
    world.step(steps=on.steps(forward))
    before = world.time
    world.set_motion(0, surface_velocity=(-1, 0, 0))
    world.step(steps=on.steps(1.5))
    speed, left = most * before, world.time - before
    turn = (speed + back) / most
    way = 0.5 * speed * before + speed * turn - 0.5 * most * turn**2 - back * (left - turn)
    limit = 10 * _solved(on) * GRAVITY * world.time
    return [
        within("speed of the block at last", world.linvel[0, 1, 0], -back, limit, "m/s"),
        within("way of the block", world.pos[0, 1, 0], way, limit * world.time + 10 * on.slop, "m"),
    ]


def press(on: Setting) -> Sequence[Check]:
    """A plate pushes a light block against one of a million times its mass: all move with the plate, and none overlaps.

    The plate has 0.5 m/s whatever it meets. Without gravity nothing else acts, so that the blocks keep this speed from
    the moment at which the heavy one has it. A solve leaves ε of the speed.
    """
    speed, ratio = 0.5, 1e6
    plate = physics.Block((1, 1, 1), fixed=True, pos=(-0.55, 0, 0), motion=physics.Motion(velocity=(speed, 0, 0)))
    blocks = [physics.Block((0.5, 0.4, 0.6), 1.0, pos=(0.25, 0, 0)), physics.Block((1, 0.9, 0.8), ratio, pos=(1, 0, 0))]
    world = on.world(physics.Scene([plate, *blocks], effects=laws(0.0, 0.3, (0, 0, 0))))
    world.step(steps=on.steps(1.0))
    apart = np.diff(world.pos[0, :, 0]) - (0.75, 0.75)
    limit = 20 * _solved(on) * speed
    return [
        within("speed of the light block", world.linvel[0, 1, 0], speed, limit, "m/s"),
        within("speed of the heavy block", world.linvel[0, 2, 0], speed, limit, "m/s"),
        Check("overlap", float(max(0.0, -apart.min())), limit * on.dt + 20 * on.slop, "m"),
    ]


def coin_spins_down(on: Setting) -> Sequence[Check]:
    """A coin on its face spins down at 2 μ g/r by friction at its rim; on its edge it falls, and never gains energy.

    On the face, points of the rim carry all the load, so that friction has the torque μ m g r, and the moment of
    inertia is m r²/2: ω = ω₀ - 2 μ g t/r, until it rests. Each step of length h leaves at most a share ε of the speed
    that loads give. Friction opposes the slip of points that turn by ω h/2 until the end of the step, so that it is
    less by a share (ω h/2)²/2 at most. The energy is m r² ω²/4, so that its error is m r² ω/2 times that of ω.

    Then the coin stands on its edge, leans by 0.3 rad, and turns at 12 rad/s. It is too slow to stay up: it falls,
    rolls on its rim ever faster, and slips. Friction only takes energy. A solve that leaves ε of the speed may give
    ε of it.
    """
    r, mu, spin = COIN.radius, 0.2, 40.0
    world = on.world(physics.Scene([replace(COIN, angvel=(0, spin, 0))], [FLOOR], laws(0.0, mu)))
    world.step(steps=on.steps(0.05))
    slower = spin - 2 * mu * GRAVITY * world.time / r
    energy = 0.25 * COIN.mass * (r * spin) ** 2
    off = 20 * _solved(on) * GRAVITY * world.time / r + (spin - slower) * (spin * on.dt) ** 2 / 8
    left = 0.25 * COIN.mass * r * r * world.angvel[0, 0, 1] ** 2
    world.step(steps=on.steps(0.25))
    lean = 0.5 * math.pi - 0.3
    height = r * math.sin(lean) + 0.5 * COIN.height * math.cos(lean)
    quat = (math.cos(lean / 2), math.sin(lean / 2), 0, 0)
    coin = replace(COIN, pos=(0, height, 0), quat=quat, angvel=(0, 12, 0))
    falling = on.world(physics.Scene([coin], [FLOOR], laws(0.0, mu)))
    energies = [_energy(coin, falling)]
    for _ in range(on.steps(on.pick(1.5, 0.3) if not on.is_event_driven else on.pick(0.1, 0.03))):
        falling.step()
        energies.append(_energy(coin, falling))
    return [
        within("energy left on its face", left / energy, (slower / spin) ** 2, 2 * off / spin),
        Check("spin at last", float(np.abs(world.angvel).max()), off, "rad/s"),
        Check("gain of energy on its edge", max(np.diff(energies)) / energies[0], 10 * _solved(on)),
    ]


def _energy(coin: physics.Cylinder, world) -> float:
    """Energy of a coin above the floor [J]."""
    axis = rotation_matrices(world.quat[0, 0])[:, 1]
    turn, (across, along, _) = world.angvel[0, 0], np.diag(coin.inertia)
    spin = float(turn @ axis)
    turning = along * spin**2 + across * float(turn @ turn - spin**2)
    v = world.linvel[0, 0]
    return 0.5 * (coin.mass * float(v @ v) + turning) + coin.mass * GRAVITY * float(world.pos[0, 0, 1])


CASES = (
    Case(62, "joint", "a block slides over the joint of fixed boxes", "v = v₀ - μ g t, and nothing turns", joint),
    Case(63, "wedge", "a wedge of 10° between fixed plates", "each pushes with W/(2 sin 5°)", wedge),
    Case(64, "capsule-upright", "a capsule stands on its end", "it does not turn", capsule_upright),
    Case(65, "belt-reverses", "a belt reverses under a block that slips", "ways under μ g", belt_reverses),
    Case(66, "press", "a plate pushes blocks of 1 kg and 1,000,000 kg", "both have its speed, no overlap", press),
    Case(
        67,
        "coin",
        "a coin spins down on its face, and on its edge",
        "ω₀ - 2 μ g t/r; no gain of energy",
        coin_spins_down,
    ),
)
