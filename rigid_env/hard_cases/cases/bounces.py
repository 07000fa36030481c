"""Hard cases of sequences of impacts: bounces that come to rest, bounces without end, a body in a closed box."""

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

HEIGHT = 1.0  # height from which bodies are dropped [m]


def _dropped(e: float, height: float = HEIGHT) -> physics.Scene:
    """Scene in which the block falls face down from `height` [m] onto a floor with restitution e, without friction."""
    return on_floor(block((0.0, SIZE[1] / 2 + height, 0.0)), e)


def zeno(on: Setting) -> Sequence[Check]:
    """The block is dropped from h with e < 1: it rests after √(2h/g)(1+e)/(1-e), after a path of h (1+e²)/(1-e²).

    A fall of √(2h/g) is followed by flights of 2 e^k √(2h/g) to heights e^2k h: two geometric series (Stronge, *Impact
    Mechanics*, section 1).

    Limit of the event-driven scheme for the time of rest, which it reports as an event: positions are rounded to 4e-16
    m, at the last speeds, 1e-5 m/s, 4e-11 s, which add up in a geometric series, too.

    Limit of time stepping: the body counts as resting once it is no longer seen above H, the height g dt²/8 of a flight
    of dt plus the slop. A flight of the duration t is seen at g (t² - dt²)/8 or higher, wherever the steps end in it.
    So flights with t <= √(dt² + 8H/g), and the time t/(1-e) that follows, are not seen. The last sight is up to a step
    old.

    Limit for the path: a step with an impact counts as a path from its start to the floor and on to its end. An apex
    between the floor and the end of the same step is not seen. It is at most g dt²/2 = 4 H high, like all later ones,
    up and down. Each of ln(h/H)/ln(1/e²) bounces may happen a slop too high.
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
    """Motion (3, steps + 1) of a falling block: heights above the floor [m], velocities along y [m/s], times [s]."""
    rows = []
    for _ in range(steps + 1):
        rows.append((world.pos[0, 0, 1] - SIZE[1] / 2, world.linvel[0, 0, 1], world.time))
        world.step()
    return np.array(rows).T


def _way(y: float, v: float, new_y: float, new_v: float) -> float:
    """Path length of the block in a step, up and down [m], from the heights and velocities before and after it.

    The path is a piece of a parabola, or goes down to the floor and up again if the step contains an impact.
    """
    if new_v > max(v, 0.0):  # hit the floor, and rises
        return max(v, 0.0) ** 2 / GRAVITY + abs(y) + abs(new_y)
    if v > 0 > new_v:
        return (v * v + new_v * new_v) / (2 * GRAVITY)
    return abs(new_y - y)


def elastic(on: Setting) -> Sequence[Check]:
    """The block bounces 10,000 times with e = 1, and its apex stays at the same height.

    The energy E = m g (h + apex) must stay the same. An impact reverses the velocity in place. Each step and each
    impact rounds the energy a few times, in the worst case always in the same direction.
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
    """Ratio of the block's speed after its impact on the floor to `speed` before it.

    The impact is in the first of 20 steps without gravity; an engine with soft contacts needs some of these steps.
    """
    scene = on_floor(block((0.0, SIZE[1] / 2 + 0.5 * speed * on.dt, 0.0), linvel=(0, -speed, 0)), e, gravity=(0, 0, 0))
    world = on.world(scene)
    world.step(steps=20)
    return world.linvel[0, 0, 1] / speed


def restitution(on: Setting) -> Sequence[Check]:
    """The block hits the floor flat: -v⁺/v⁻ equals the scene's e, from 0 to 1, at speeds from 1 mm/s to 100 m/s.

    Without gravity the velocity after the impact stays, apart from a few roundings. Time stepping leaves out a rebound
    that would end within the share `rest_share` of a step. The user can set this threshold. With 0 even a bounce at 0.5
    mm/s under gravity is made, which is a flight of 2 e v/g = 50 µs.
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
        limit = 64 * EPS * speed  # it starts in contact: the impact is at once, and only a few operations follow
        found = world.linvel[0, 0, 1]
        checks.append(within("speed after a bounce at 0.5 mm/s, threshold 0", found, expected, limit, "m/s"))
    return checks


def _unfolded(place, velocity, t, half):
    """Position at time t [s] of a point between reflecting walls at ±half [m]: its straight path, folded."""
    along = np.mod(place + velocity * t + half, 4 * half)
    return np.where(along < 2 * half, along, 4 * half - along) - half


def billiard(on: Setting) -> Sequence[Check]:
    """A sphere flies between six walls, e = 1, no gravity or friction: after 10,000 hits it is on the folded line.

    Reflecting the space at each wall instead of the path makes the path straight (Tabachnikov, *Geometry and
    Billiards*, chapter 1). Impacts reverse velocities without rounding. Each step and each hit rounds positions of up
    to 5 m by half a unit in the last place, in the worst case always in the same direction. At a constant speed the
    time of a hit is one division, without a slop; `early` has the exception.
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
    """The block tumbles between six walls, e = 1, μ = 0: the energy stays, and a second run has the same bits.

    After an impact of one contact, j = -2 v_n/W, the energy is exactly that before. Some 300 operations per hit and per
    step round it at random. The limit is three standard deviations of this random walk.
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
