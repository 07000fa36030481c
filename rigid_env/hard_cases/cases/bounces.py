"""Hard cases of sequences of impacts: bounces to rest, bounces for ever, a body in a closed box."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

import physics
from physics.accuracy import resolve
from physics.scene.canonical_scenes import GRAVITY, MASS, SIZE
from rigid_env.hard_cases.case import Case, Check, Setting, none_of, within
from rigid_env.hard_cases.cases.scenery import (
    EPS,
    block,
    boxed,
    early,
    energy,
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
    speeds, 1e-5 m/s, 4e-11 s, again a series. Else the body rests when it is seen no more above H = g dt²/8, the height
    of a flight of dt, and the slop. A flight of t is seen at g (t² - dt²)/8 or higher, wherever in it the steps end:
    those of t <= √(dt² + 8H/g), and what follows, t/(1-e), are not seen; the last sight is up to a step old.
    The way of a step with an impact is taken as that from start to floor to end; an apex between floor and end of one
    step is not seen, which is no higher than g dt²/2 = 4 H, nor all after it, up and down; and each of ln(h/H)/ln(1/e²)
    bounces may happen a slop too high.
    """
    checks = []
    for e in (0.3, 0.5, 0.8):
        truth = math.sqrt(2 * HEIGHT / GRAVITY) * (1 + e) / (1 - e)
        heights, speeds, times = _fall(on.world(_dropped(e)), on.steps(1.5 * truth))
        slop = on.slop * 0.5 * float(np.linalg.norm(SIZE))
        low = GRAVITY * on.dt**2 / 8 + slop
        high = np.flatnonzero(heights > low)[-1]
        rest = times[min(high + 1, len(times) - 1)]
        limit = on.dt + math.sqrt(on.dt**2 + 8 * low / GRAVITY) / (1 - e)
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
    """Path length [m] up and down in a step between two heights and speeds: a parabola, or to the floor and up."""
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
    """Speed after the block's impact on the floor in the first of 20 steps without gravity, by the speed before.

    An engine with soft contacts needs some of these steps.
    """
    scene = on_floor(block((0.0, SIZE[1] / 2 + 0.5 * speed * on.dt, 0.0), linvel=(0, -speed, 0)), e, gravity=(0, 0, 0))
    world = on.world(scene)
    world.step(steps=20)
    return world.linvel[0, 0, 1] / speed


def restitution(on: Setting) -> Sequence[Check]:
    """The block hits the floor flat: -v⁺/v⁻ is the scene's e, 0 to 1, from 1 mm/s to 100 m/s.

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
    """Place of a point that flies between walls at ±half [m] and is reflected: the straight line, folded."""
    along = np.mod(place + velocity * t + half, 4 * half)
    return np.where(along < 2 * half, along, 4 * half - along) - half


def billiard(on: Setting) -> Sequence[Check]:
    """A sphere between six walls, e = 1, no gravity, no friction: the unfolded straight line, folded; 10,000 hits.

    Reflected in the walls the path is straight (Tabachnikov, *Geometry and Billiards*, chapter 1). Speeds are turned
    round without rounding; steps and hits round places of up to 5 m by half a unit in the last place, all the same
    way at worst. A constant speed makes the time of a hit one division, without a slop (but see `early`).
    """
    radius, half, place, velocity = 0.5, 5.0, np.array([0.3, -1.1, 2.0]), np.array([3.0, 4.0, 5.0])
    hits = on.pick(10_000, 1000)
    room = half - radius
    world = on.world(boxed(physics.Sphere(radius, 1.0, pos=place, linvel=velocity), (half,) * 3, 1.0))
    steps = on.steps(hits * 2 * room / velocity.sum())
    world.step(steps=steps)
    error = np.abs(world.pos[0, 0] - _unfolded(place, velocity, world.time, room)).max()
    limit = EPS * half * (steps + 2 * hits) + hits * early(on, physics.Sphere(radius, 1.0))
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
)  # fmt: skip
