"""Hard cases of impacts: sequences of bounces, corners, one end, one vertex, a whole face."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import permutations

import numpy as np

import physics
from physics.accuracy import resolve
from physics.scenes import GRAVITY, MASS, SIZE
from rigid_env.hard_cases.case import Case, Check, Setting, none_of, within
from rigid_env.hard_cases.scenery import (
    EPS,
    attitude,
    block,
    boxed,
    energy,
    laws,
    on_floor,
    state_of,
)

HEIGHT = 1.0  # from which bodies are dropped [m]


def _dropped(e: float, height: float = HEIGHT) -> physics.Scene:
    """The block falls face down, without friction."""
    return on_floor(block((0.0, SIZE[1] / 2 + height, 0.0)), e)


def zeno(on: Setting) -> Sequence[Check]:
    """Dropped from h with e < 1: at rest after √(2h/g)(1+e)/(1-e), having gone h (1+e²)/(1-e²) up and down.

    A fall of √(2h/g), then flights of 2 e^k √(2h/g) to heights e^2k h: two geometric series (Stronge, *Impact
    Mechanics*, section 1). The event-driven scheme states the time of rest: places are rounded to 4e-16 m, at the last
    speeds, 1e-5 m/s, 4e-11 s, again a series. Else the body rests when it rises no more above H = g dt²/8, the height
    of a flight of dt, and the slop: flights of t = √(8H/g) and what follows, t/(1-e), are left then; seen at whole
    steps. The way of a step with an impact is taken as that from start to floor to end; an apex between floor and end
    of one step is not seen, which is no higher than g dt²/2 = 4 H, nor all after it, up and down; and each of
    ln(h/H)/ln(1/e²) bounces may happen a slop too high.
    """
    checks = []
    for e in (0.3, 0.5, 0.8):
        truth = math.sqrt(2 * HEIGHT / GRAVITY) * (1 + e) / (1 - e)
        heights, speeds, times = _fall(on.world(_dropped(e)), on.steps(1.5 * truth))
        slop = on.slop * 0.5 * float(np.linalg.norm(SIZE))
        low = GRAVITY * on.dt**2 / 8 + slop
        high = np.flatnonzero(heights > low)[-1]
        rest = times[min(high + 1, len(times) - 1)]
        limit = on.dt + math.sqrt(8 * low / GRAVITY) / (1 - e)
        if on.is_event_driven:
            events = physics.simulate(_dropped(e), 1.5 * truth, on.accuracy, on.dt).events
            rest, limit = next((event.t for event in events if event.kind == "rest"), math.nan), 4e-11 / (1 - e)
        way = sum(map(_way, heights[:-1], speeds[:-1], heights[1:], speeds[1:]))
        expected = HEIGHT * (1 + e * e) / (1 - e * e)
        slack = 8 * low / (1 - e * e) + slop * math.log(HEIGHT / low) / math.log(1 / e**2)
        checks += [
            within(f"time of rest, e = {e}", rest, truth, limit, "s"),
            within(f"way to rest, e = {e}", way, expected, slack, "m"),
        ]
    return checks


def _fall(world, steps: int) -> np.ndarray:
    """(3, steps + 1): heights above the floor [m], speeds [m/s], times [s]."""
    rows = []
    for _ in range(steps + 1):
        rows.append((world.pos[0, 0, 1] - SIZE[1] / 2, world.linvel[0, 0, 1], world.time))
        world.step()
    return np.array(rows).T


def _way(y: float, v: float, new_y: float, new_v: float) -> float:
    """Way [m] up and down in a step between two heights and speeds: along the parabola, or to the floor and up."""
    if new_v > max(v, 0.0):  # hit the floor, and rises
        return max(v, 0.0) ** 2 / GRAVITY + abs(y) + abs(new_y)
    if v > 0 > new_v:
        return (v * v + new_v * new_v) / (2 * GRAVITY)
    return abs(new_y - y)


def elastic(on: Setting) -> Sequence[Check]:
    """e = 1: 10,000 bounces of the block, and the apex stays where it was.

    E = m g (h + apex) is that of the start. An impact turns the velocity round in place; steps and impacts round the
    energy a few times each, all of them the same way at worst.
    """
    scene = _dropped(1.0)
    world = on.world(scene)
    start = energy(world, scene)
    bounces = on.pick(10_000, 300)
    steps = on.steps(bounces * 2 * math.sqrt(2 * HEIGHT / GRAVITY))
    world.step(steps=steps)
    drift = (energy(world, scene) - start) / (MASS * GRAVITY)
    limit = 2 * EPS * (steps + bounces) * start / (MASS * GRAVITY)
    return [Check(f"drift of the apex after {bounces} bounces", abs(drift), limit, "m")]


def _leaving(on: Setting, e: float, speed: float) -> float:
    """Speed after the block, a hair above the floor, has hit it in one step without gravity, by the speed before."""
    scene = on_floor(block((0.0, SIZE[1] / 2 + 0.5 * speed * on.dt, 0.0), linvel=(0, -speed, 0)), e, gravity=(0, 0, 0))
    world = on.world(scene)
    world.step()
    return world.linvel[0, 0, 1] / speed


def restitution(on: Setting) -> Sequence[Check]:
    """The block hits the floor flat: -v⁺/v⁻ is the e asked for, 0 to 1, from 1 mm/s to 100 m/s.

    Without gravity the velocity after it is that of the impact; rounded a few times. Time stepping does not make a
    rebound that would be over within `rest_share` of the step: the threshold is there to be set, and 0 lets a
    bounce at 0.5 mm/s under gravity, of a flight of 2 e v/g = 50 µs, happen.
    """
    shares = np.arange(11) / 10
    worst = max(abs(_leaving(on, e, speed) - e) for e in shares for speed in (1e-3, 1.0, 100.0))
    checks = [Check("|e measured - e asked|, 0 to 1 in tenths, 1 mm/s to 100 m/s", worst, 8 * EPS)]
    if on.is_ours:
        e, speed = 0.5, 5e-4
        # A step of half the rebound's flight of 2 e v/g.
        small = replace(on, accuracy=replace(resolve(on.accuracy), rest_share=0.0), dt=0.5 * e * speed / GRAVITY)
        world = small.world(on_floor(block(linvel=(0, -speed, 0)), e))
        world.step()
        expected = e * speed - GRAVITY * small.dt
        limit = 64 * EPS * speed  # it starts in touch: the impact is at once, and what follows a few operations
        found = world.linvel[0, 0, 1]
        checks.append(within("speed after a bounce at 0.5 mm/s, threshold 0", found, expected, limit, "m/s"))
    return checks


def _unfolded(place, velocity, t, half):
    """Where a point that flies between walls at ±half [m] and is reflected is: the straight line, folded."""
    along = np.mod(place + velocity * t + half, 4 * half)
    return np.where(along < 2 * half, along, 4 * half - along) - half


def billiard(on: Setting) -> Sequence[Check]:
    """A sphere between six walls, e = 1, no gravity, no friction: the unfolded straight line, folded; 10,000 hits.

    Reflected in the walls the path is straight (Tabachnikov, *Geometry and Billiards*, chapter 1). Speeds are turned
    round without rounding; steps and hits round places of up to 5 m by half a unit in the last place, all the same
    way at worst. A constant speed makes the time of a hit one division: no slop enters.
    """
    radius, half, place, velocity = 0.5, 5.0, np.array([0.3, -1.1, 2.0]), np.array([3.0, 4.0, 5.0])
    hits = on.pick(10_000, 1000)
    room = half - radius
    world = on.world(boxed(physics.Sphere(radius, 1.0, pos=place, linvel=velocity), (half,) * 3, 1.0))
    steps = on.steps(hits * 2 * room / velocity.sum())
    world.step(steps=steps)
    error = np.abs(world.pos[0, 0] - _unfolded(place, velocity, world.time, room)).max()
    limit = EPS * half * (steps + 2 * hits)
    return [
        Check(f"distance from the folded line after {hits} hits", error, limit, "m"),
        none_of("speeds that have changed", np.count_nonzero(np.abs(world.linvel[0, 0]) != velocity)),
    ]


def tumbling(on: Setting) -> Sequence[Check]:
    """The block tumbles between six walls, e = 1, μ = 0, no gravity: energy constant, and a replay has the same bits.

    One contact at a time leaves with exactly the energy it came with, j = -2 v_n/W: some 300 operations per hit and per
    step round it at random, a walk of which three deviations are allowed.
    """
    body = block((0, 0, 0), linvel=(3.0, 4.0, 5.0), angvel=(1.0, 2.0, 0.5))
    scene = boxed(body, (5.0, 5.0, 5.0), 1.0)
    ends, impacts = [], 0
    steps = on.steps(on.pick(1000.0, 100.0))
    for _ in range(2):
        world = on.world(scene)
        start = energy(world, scene)
        report = world.step(steps=steps)
        impacts = int(report.impacts[0])
        ends.append(state_of(world))
    drift = abs(energy(world, scene) / start - 1)
    limit = 3 * math.sqrt(300) * EPS * math.sqrt(impacts + steps)
    return [
        Check(f"change of the energy, {impacts} hits", drift, limit),
        none_of("bits that a replay has different", np.count_nonzero(ends[0] != ends[1])),
    ]


def corner(on: Setting) -> Sequence[Check]:
    """A sphere into the corner of three walls at right angles, e = 1, μ = 0: v' = -v, whichever wall comes first.

    Each wall turns round the speed along its normal and no other; so do two or three of them at once, being
    independent. Three speeds in all orders of the walls, then two and three equal ones, which hit at one moment.
    """
    half, wrong = 3.0, 0.0
    aims = [*permutations((-3.0, -2.0, -1.0)), (-2.0, -2.0, -1.0), (-2.0, -2.0, -2.0), (-2.0, -2.0, 0.0)]
    for aim in aims:
        world = on.world(boxed(physics.Sphere(0.5, 1.0, linvel=aim), (half,) * 3, 1.0))
        world.step(steps=on.steps(_until_all_have_hit(aim, half - 0.5)))
        wrong = max(wrong, np.abs(_signed(world, aim, half - 0.5) + aim).max())
    return [Check(f"|v' + v|, {len(aims)} directions", wrong, 8 * EPS, "m/s")]


def _until_all_have_hit(aim, room: float) -> float:
    return 1.01 * room / min(abs(a) for a in aim if a)


def _signed(world, aim, room: float) -> np.ndarray:
    """Velocity with what further hits of the far walls have turned round turned back."""
    hits = np.floor((np.abs(aim) * world.time + room) / (2 * room))
    return world.linvel[0, 0] * np.where(np.mod(hits, 2) == 0, -1.0, 1.0)


def rod(on: Setting) -> Sequence[Check]:
    """A thin rod at θ to the floor falls on one end, μ = 0: J = (1+e)mv/(1+3cos²θ), ω = 6(1+e)v cosθ/(L(1+3cos²θ)).

    The end is L/2 cosθ beside the centre, so that 1/W = m/(1 + (L/2 cosθ)² m/I) with I = m L²/12 (Beer and Johnston,
    *Dynamics*, section 17.3). A block of a thickness of 1e-9 L stands for the rod: with its end's vertices that far
    from the axis, results are off by that share. Its moment about the axis, which the motion does not see, is I/2.
    """
    mass, length, thin, speed, worst_impulse, worst_spin = 2.0, 1.5, 1e-9, 1.2, 0.0, 0.0
    across = mass * length**2 / 12
    for e in (0.0, 0.5, 1.0):
        for theta in np.radians([5, 20, 45, 63.4, 80]):
            c, s = math.cos(theta), math.sin(theta)
            low = 0.5 * length * (s + thin * c)
            body = physics.Block(
                (length, thin * length, thin * length), mass, pos=(0, low, 0), quat=(math.cos(theta / 2), 0, 0,
                math.sin(theta / 2)), linvel=(0, -speed, 0), inertia_body=(across / 2, across, across),
            )  # fmt: skip
            world = replace(on, dt=1e-6).world(on_floor(body, e, gravity=(0, 0, 0)))
            world.step()
            share = (1 + e) * speed / (1 + 3 * c * c)
            worst_impulse = max(worst_impulse, abs((world.linvel[0, 0, 1] + speed) / share - 1))
            # The lower end is at -x: pushed up there, the rod turns clockwise.
            worst_spin = max(worst_spin, abs(-world.angvel[0, 0, 2] * length / (6 * share * c) - 1))
    limit = 8 * thin + on.tolerance
    return [Check("error of J by J", worst_impulse, limit), Check("error of ω by ω", worst_spin, limit)]


def vertex(on: Setting) -> Sequence[Check]:
    """One vertex of the block hits: J = -(1+e) v_n/(1/m + n·(I⁻¹(r x n) x r)), momenta change by J n and r x J n.

    Witkin and Baraff, *Physically Based Modeling*, "Rigid Body Simulation II", eq. 8-18. A handful of rounded numbers
    of size 30. After it the block flies, without gravity, and keeps its momenta until the step ends.
    """
    turn = np.array([math.cos(0.35), math.sin(0.35) / math.sqrt(2), math.sin(0.35) / math.sqrt(2), 0.0])
    v, w, n = np.array([0.4, -3.0, 0.2]), np.array([0.1, 0.0, -0.2]), np.array([0.0, 1.0, 0.0])
    checks = []
    for e in (0.0, 0.3, 1.0):
        at_rest = replace(on, dt=1e-6).world(on_floor(block((0, 9, 0), quat=turn)))
        R = attitude(at_rest)
        r = R @ (-np.sign(R[1]) * np.array(SIZE) / 2)
        scene = on_floor(block((0, -r[1], 0), quat=turn, linvel=v, angvel=w), e, gravity=(0, 0, 0))
        world = on.world(scene)
        world.step()
        tensor = R @ scene.bodies[0].inertia @ R.T
        J = -(1 + e) * n @ (v + np.cross(w, r)) / (1 / MASS + n @ np.cross(np.linalg.solve(tensor, np.cross(r, n)), r))
        R = attitude(world)
        spin = R @ scene.bodies[0].inertia @ R.T @ world.angvel[0, 0]
        off = np.abs(MASS * (world.linvel[0, 0] - v) - J * n).max()
        off_spin = np.abs(spin - tensor @ w - np.cross(r, J * n)).max()
        checks += [
            Check(f"error of the momentum, e = {e}", off, 1e-12, "N s"),
            Check(f"error of the angular momentum, e = {e}", off_spin, 1e-12, "N m s"),
        ]
    return checks


def flat_landing(on: Setting) -> Sequence[Check]:
    """The block lands on a face, four contacts at once: no spin, no tilt, no sideways speed, not one bit of them.

    By symmetry the four impulses are equal, and each of their moments has its opposite. At rest the four forces are
    m g/4, to the last bit the same.
    """
    wrong, uneven, weight = 0, 0.0, 0.0
    for e in (0.0, 0.5, 1.0):
        for friction in (0.0, 0.5):
            world = on.world(on_floor(block((0, SIZE[1] / 2 + HEIGHT, 0)), e, friction))
            for _ in range(on.steps(3.0)):
                world.step()
                sideways = (*world.angvel[0, 0], world.linvel[0, 0, 0], world.linvel[0, 0, 2])
                wrong += any(sideways) or not np.array_equal(world.quat[0, 0], [1, 0, 0, 0])
            if e < 1:
                _, forces = world.contacts()
                uneven = max(uneven, np.ptp(forces[:, 1]))
                weight = max(weight, abs(forces[:, 1].sum() / (MASS * GRAVITY) - 1))
    return [
        none_of("steps with spin, tilt or sideways speed", wrong),
        Check("difference of the four forces at rest", uneven, 0.0, "N"),
        Check("their sum by the weight, less 1", weight, max(on.tolerance, 8 * EPS)),
    ]


def bullet(on: Setting) -> Sequence[Check]:
    """A cube of 2 cm flies at 500 m/s at a wall, e = 1: no miss, it turns round at the time x/v.

    Reflected at the wall its place is the path folded there. An impact is made within half a slop of the wall, which
    moves what follows by twice that.
    """
    speed, edge, worst, missed = 500.0, 0.02, 0.0, 0
    for reach in np.linspace(1.0, 40.0, 27):
        body = physics.Block((edge,) * 3, 0.01, pos=(0, 0, 0), linvel=(0, -speed, 0))
        scene = physics.Scene([body], [physics.HalfSpace((0, 1, 0), -reach)], laws(1.0, gravity=(0, 0, 0)))
        world = on.world(scene)
        for _ in range(on.steps(0.1)):
            world.step()
            way, room = speed * world.time, reach - edge / 2
            expected = -way if way <= room else way - 2 * room
            worst = max(worst, abs(world.pos[0, 0, 1] - expected))
        missed += not world.linvel[0, 0, 1] > 0
    limit = on.slop * edge + 64 * EPS * speed * 0.1
    return [none_of("walls missed, of 27", missed), Check("distance from the folded path", worst, limit, "m")]


CASES = (
    Case(5, "zeno", "bounces with e < 1 (Zeno)", "rest after √(2h/g)(1+e)/(1-e); way h(1+e²)/(1-e²)", zeno, peers=True),
    Case(6, "elastic-bounces", "10,000 bounces with e = 1", "the apex stays, to rounding", elastic, peers=True),
    Case(
        7, "restitution", "asked e against measured e, 0 to 1", "equal; the threshold can be 0", restitution,
        peers=True,
    ),
    Case(
        8, "billiard", "sphere in a closed box, e = 1, 10,000 hits", "the straight line, folded", billiard,
        peers=True,
    ),
    Case(
        9, "tumbling-block", "tumbling block in a closed box, e = 1", "energy constant; a replay has the same bits",
        tumbling,
    ),
    Case(
        10, "corner", "sphere into a corner, e = 1", "v' = -v, whichever wall comes first, or all at once", corner,
        peers=True,
    ),
    Case(
        11, "superball", "superball: tangential restitution",
        "v' = v - (2/7)(1+e_t)(v+rω), rω' = rω - (5/7)(1+e_t)(v+rω)",
        missing="tangential restitution is not an effect yet",
    ),
    Case(
        13, "rod", "one end of a rod hits at an angle θ, μ = 0",
        "J = (1+e)mv/(1+3cos²θ), ω = 6(1+e)v cosθ/(L(1+3cos²θ))", rod,
    ),
    Case(14, "vertex", "one vertex of the block hits", "J = -(1+e)v_n/(1/m + n·(I⁻¹(r x n) x r))", vertex),
    Case(
        15, "flat-landing", "lands on a face, four contacts at once", "equal impulses; no spin, bit for bit",
        flat_landing,
    ),
    Case(37, "bullet", "bullet: 500 m/s at a wall", "no miss; it hits at the time x/v", bullet, peers=True),
)  # fmt: skip
