"""Hard cases of piles: unequal masses, towers, pyramids and overhangs that stand, and 216 balls that fall."""

from __future__ import annotations

import math

import numpy as np

import physics
from rigid_env.hard_cases.case import Case, Check, Setting, none_of
from rigid_env.hard_cases.cases import stacks
from rigid_env.hard_cases.cases.stacks import CUBE, G

# Penetration that the published benchmark allows: sum of the squared depths of all contacts [m²].
BALLS_PENETRATION = 1.35e-4


def heavy_on_light(setting: Setting) -> list[Check]:
    """A cube of 1 to 1,000,000 kg stands on a cube of 1 kg for a minute.

    The contacts between the cubes carry the weight M g of the upper one, and the floor carries (M + 1) g. Limits: the
    velocities of a contact problem are off by its tolerance times the free speed g h. So the force on masses of at most
    M + 1 kg is off by at most tolerance * g * (M + 1) at each of eight contacts: 10 tolerances of the whole weight. The
    penetration is at most a slop at each of the two interfaces.
    """
    checks = []
    for top in (1.0, 1e2, 1e4, 1e6):
        world = setting.world(stacks.tower([1.0, top]))
        moved, wrong, depth = stacks.settle(setting, world, setting.pick(60.0, 5.0))
        what = f"{top:g} kg on 1 kg"
        checks += stacks.standing(setting, what, moved, wrong, layers=2)
        if setting.is_ours:
            error = stacks.load_error(world, G * np.array([top + 1, top]))
            checks.append(Check(f"{what}: error of the loads by the weight", error, 10 * setting.tolerance))
            checks.append(Check(f"{what}: penetration", depth, 2 * setting.slop * math.sqrt(0.75), "m"))
    return checks


def towers(setting: Setting) -> list[Check]:
    """Towers of 10, 20 and 50 cubes stand for a minute, and one of 15 whose cubes are shifted by up to 1 %.

    Cube k of n carries (n - k) g. Limit: each interface may be off by the tolerance, relative to the free speed g h,
    for every mass above it. This is n²/2 tolerances of m g, or n tolerances of the whole weight n m g, at each of four
    contacts. The shifts keep the centre of mass of all upper cubes within 0.02 of the middle, far from any edge.
    """
    checks = []
    duration = setting.pick(60.0, 5.0)
    for count in setting.pick((10, 20, 50), (10, 20)):
        world = setting.world(stacks.tower([1.0] * count))
        moved, wrong, _ = stacks.settle(setting, world, duration)
        checks += stacks.standing(setting, f"{count} cubes", moved, wrong, layers=count)
        if setting.is_ours:
            error = stacks.load_error(world, G * (count - np.arange(count)))
            limit = 4 * count * setting.tolerance
            checks.append(Check(f"{count} cubes: error of the loads by the weight", error, limit))
    shifts = np.random.default_rng(0).uniform(-0.01, 0.01, (15, 2))
    world = setting.world(stacks.tower([1.0] * 15, shifts))
    moved, wrong, _ = stacks.settle(setting, world, duration)
    return checks + stacks.standing(setting, "15 cubes, shifted by up to 1 %", moved, wrong, layers=15)


def pyramids(setting: Setting) -> list[Check]:
    """Pyramids with 10 and 20 cubes in the lowest row, 0.02 m apart, stand for 5 s.

    Every cube lies on two others, with nearly half a face on each, in balance by symmetry. The floor carries all of the
    weight. Limit: each of its contacts is off by the tolerance times the free speed g h, times the masses that lean on
    it, at most the base.
    """
    checks = []
    for base in setting.pick((10, 20), (10,)):
        rows = [(row, i) for row in range(base) for i in range(base - row)]
        places = [(1.02 * (i - (base - row - 1) / 2), row + 0.5, 0) for row, i in rows]
        world = setting.world(stacks.pile([physics.Block(CUBE, 1.0, pos=place) for place in places]))
        moved, wrong, _ = stacks.settle(setting, world, setting.pick(5.0, 1.0))
        checks += stacks.standing(setting, f"base of {base}", moved, wrong, layers=base)
        if setting.is_ours:
            floor = sum(load for (row, _), load in zip(rows, stacks.loads(world)) if row == 0)
            error = abs(floor / (len(rows) * G) - 1)
            checks.append(Check(f"base of {base}: error of the floor's load", error, 4 * base * setting.tolerance))
    return checks


def overhangs(setting: Setting) -> list[Check]:
    """Five planks of length 1 m lie on each other, each as far beyond the next lower one as balance allows.

    Let x_k be the length by which plank k from the top extends beyond plank k + 1. The upper k planks have their common
    centre above that edge exactly if x_k = 1/(2 k). (The upper k - 1 planks are centred on the edge of plank k, at
    distance 1/2 from its centre; so the common centre is 1/(2 k) from the edge.) The whole reach is (1/2) Σ 1/k. With
    0.98 of every x_k the pile stands. With 1.02 the top falls below the middle of the pile, 0.5 m.
    """
    checks = []
    for share in (0.98, 1.02):
        count, x, places = 5, 0.0, []
        for k in range(1, count + 1):
            places.append(x)
            x -= share * 0.5 / k
        bodies = [
            physics.Block((1.0, 0.2, 0.5), 1.0, pos=(place, 0.1 + 0.2 * k, 0))
            for k, place in enumerate(reversed(places))
        ]
        world = setting.world(stacks.pile(bodies))
        moved, wrong, _ = stacks.settle(setting, world, 10.0)
        if share < 1:
            checks += stacks.standing(setting, "0.98 of the overhang", moved, wrong, layers=count, edge=0.2)
        else:
            checks.append(Check("1.02 of the overhang: height of the top", float(world.pos[0, -1, 1]), 0.5, "m"))
    return checks


def balls(setting: Setting) -> list[Check]:
    """6 x 6 x 6 balls of radius 0.5 m and 1 kg, 0.1 m apart, fall from 1 m, at a tenth of the step (1 ms).

    With e = 0 and μ = 0, penetration is the error: its sum of squares over all contacts must be below the benchmark's
    limit at every hundredth of a second of 10 s. With e = 1 the energy must stay. An impact whose contact problem is
    solved to the tolerance is off by this share of the energy of its balls, so n impacts per ball lead to n tolerances.
    A ball has about 1 impact with each of 26 neighbours per fall of 0.1 m, which takes 0.14 s: 2000 in 10 s. A quick
    run with error control has 3 x 3 x 3 balls, and their share of the allowed penetration.

    The starting columns are in unstable balance: balls of a layer are moved by up to 0.01 m along x and z (seed 0).

    References
    ----------
    .. [1] J. Hwangbo, D. Kang, *SimBenchmark*, 666 balls; the starting gaps are ours.
    """
    rng = np.random.default_rng(0)
    checks, duration = [], setting.pick(10.0, 1.5)
    side = 3 if setting.is_event_driven and not setting.is_thorough else 6
    for restitution in (0.0, 1.0):
        bodies = [
            physics.Sphere(0.5, 1.0, pos=(1.1 * i + u, 1.5 + 1.1 * j, 1.1 * k + w))
            for i, j, k in np.ndindex(side, side, side)
            for u, w in [rng.uniform(-0.01, 0.01, 2)]
        ]
        effects = [physics.Gravity((0, -G, 0)), physics.Contact(restitution)]
        world = setting.world(physics.Scene(bodies, [stacks.FLOOR], effects))
        energy = _energy(world)
        worst, faults = 0.0, 0
        for _ in range(setting.steps(duration)):
            report = world.step(steps=10, dt=setting.dt / 10)
            worst = max(worst, squared_depths(world.pos[0], 0.5))
            faults += int(report.faults[0] + report.left_out[0])
        checks.append(none_of(f"e = {restitution:g}: faults and contacts left out", faults))
        if restitution == 0.0:
            share = (side / 6) ** 3  # number of balls, relative to the benchmark's
            checks.append(Check("e = 0: sum of squared depths", worst, share * BALLS_PENETRATION, "m²"))
        else:
            drift = abs(_energy(world) / energy - 1)
            checks.append(Check("e = 1: drift of the energy", drift, 200 * duration * setting.tolerance))
    return checks


def _energy(world: physics.World) -> float:
    """Kinetic and potential energy of all bodies [J]."""
    return float(physics.diagnose(world).energy.sum())


def squared_depths(pos: np.ndarray, radius: float) -> float:
    """Sum of the squared penetrations of balls at `pos` (n, 3) [m] into each other and into the floor y = 0 [m²]."""
    first, second = np.triu_indices(len(pos), 1)
    offset = pos[first] - pos[second]
    between = 2 * radius - np.sqrt((offset * offset).sum(axis=1))
    depths = np.maximum(np.concatenate([between, radius - pos[:, 1]]), 0.0)
    return float((depths * depths).sum())


CASES = (
    Case(24, "heavy-on-light", "a heavy cube on a light one, up to 1,000,000:1", "stands; loads = weight above",
         heavy_on_light),
    Case(25, "towers", "towers of 10, 20 and 50 cubes for a minute, and one of 15 askew",
         "upright; loads = weight above", towers),
    Case(26, "pyramids", "pyramids of base 10 and 20", "stand", pyramids),
    Case(27, "overhang", "five planks at the limit of overhang", "balances to (length/2) Σ 1/k, topples just beyond",
         overhangs),
    Case(45, "falling-balls", "6 x 6 x 6 balls fall, e = 0 and e = 1",
         "e = 0: sum of squared penetration <= 1.35e-4 m²; e = 1: energy kept", balls),
)  # fmt: skip
