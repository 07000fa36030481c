"""Impacts that depend on their order: Newton's cradle, and two masses that count digits of π."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

import physics
from physics.accuracy import resolve
from rigid_env.hard_cases.case import Case, Check, Setting, within

RADIUS = 0.5  # [m]
SPEED = 3.0  # of the ball that strikes [m/s]


def cradle(count: int, gap: float) -> physics.Scene:
    """One ball at `SPEED` towards count - 1 balls at rest, `gap` [m] apart; 1 kg each, e = 1."""
    places = [-4 * RADIUS] + [k * (2 * RADIUS + gap) for k in range(1, count)]
    bodies = [
        physics.Sphere(RADIUS, 1.0, pos=(x, 0, 0), linvel=(SPEED if k == 0 else 0.0, 0, 0))
        for k, x in enumerate(places)
    ]
    return physics.Scene(bodies, (), [physics.Contact(1.0)])


def newtons_cradle(setting: Setting) -> list[Check]:
    """One ball strikes n - 1 that touch, n = 3 and 5: at once, or in turn.

    At once: one problem for all contacts. By Newton's law each normal velocity is reversed, u_1 = v becomes -v and u_k
    = 0 stays. With x the first ball's velocity after, all others have x + v, and momentum says n x + (n - 1) v = v: x =
    -(n - 2)/n v, the others 2/n v: (-1/3, 2/3, 2/3) v of three. Energy: ((n - 2)² + 4 (n - 1))/n² = 1.

    In turn: two equal balls exchange their velocities, so that the last one alone leaves with v. Balls a hair apart (1
    mm) do that by themselves; for balls that touch it is chosen by `Accuracy(collisions="sequential")`.

    The speeds are solved to the tolerance of the free contact speed v, at each of n - 1 impacts and contacts.
    """
    checks = []
    for count in (3, 5):
        limit = (count - 1) * setting.tolerance * SPEED
        for gap, how in ((0.0, "at once"), (1e-3, "1 mm apart")):
            after = _after(setting, cradle(count, gap))
            expected = np.full(count, 2 * SPEED / count) if gap == 0.0 else np.zeros(count)
            expected[0 if gap == 0.0 else -1] = -(count - 2) / count * SPEED if gap == 0.0 else SPEED
            error = float(np.abs(after - expected).max())
            checks.append(Check(f"{count} balls, {how}: error of the speeds", error, limit, "m/s"))
            energy = float((after @ after) / SPEED**2)
            checks.append(within(f"{count} balls, {how}: energy after by before", energy, 1.0, 2 * limit / SPEED))
        checks.append(_in_turn(setting, count))
    return checks


def _after(setting: Setting, scene: physics.Scene) -> np.ndarray:
    """Velocities along x after all impacts [m/s]."""
    world = setting.world(scene)
    world.step(steps=setting.steps(1.0))  # the first ball arrives after 2 m / (3 m/s)
    return world.linvel[0, :, 0].copy()


def _in_turn(setting: Setting, count: int) -> Check:
    """True if balls that touch pass the impact on one by one with the option `sequential`."""
    chosen = replace(setting, accuracy=replace(resolve(setting.accuracy), collisions="sequential"))
    after = _after(chosen, cradle(count, 0.0))
    error = float(np.abs(after - SPEED * (np.arange(count) == count - 1)).max())
    return Check(f"{count} balls, in turn: error of the speeds", error, (count - 1) * setting.tolerance * SPEED, "m/s")


def digits_of_pi(setting: Setting) -> list[Check]:
    """A heavy ball drives a light one against a wall, e = 1: floor(π √ratio) collisions, those with the wall included.

    In the plane (√m1 x1, √m2 x2) the motion is a billiard ball in a wedge of angle atan(√(m1/m2)); unfolded, a straight
    line that crosses the wedge's images π/angle times. Between two collisions the light ball crosses the free gap x
    between wall and heavy ball at the speed v1, or from one to the other at least as much as is left of it, so that
    half of x/(|v1| + 3 |v2|) is a step with at most one collision (|v1| grows by 2 |v2| in one). An impact of one
    contact is answered in closed form: the energy is off by rounding per collision, and two gaps within the slop.

    References
    ----------
    .. [1] G. Galperin, *Playing pool with π*, Regul. Chaotic Dyn. 8, 2003.
    """
    checks = []
    for ratio in setting.pick((1, 100, 10**4, 10**6), (1, 100, 10**4)):
        bodies = [
            physics.Sphere(RADIUS, 1.0, pos=(2, 0, 0)),
            physics.Sphere(RADIUS, ratio, pos=(6, 0, 0), linvel=(-1, 0, 0)),
        ]
        world = setting.world(physics.Scene(bodies, [physics.HalfSpace((1, 0, 0))], [physics.Contact(1.0)]))
        seen = _collisions(setting, world)
        expected = math.floor(math.pi * math.sqrt(ratio))
        checks.append(within(f"mass ratio {ratio:,}: collisions", seen, expected, 0))
        speeds = world.linvel[0, :, 0]
        energy = float(speeds[0] ** 2 + ratio * speeds[1] ** 2) / ratio
        limit = 1e-14 * max(expected, 10)
        checks.append(within(f"mass ratio {ratio:,}: energy after by before", energy, 1.0, limit))
    return checks


def _collisions(setting: Setting, world) -> int:
    """Count changes of any velocity until both balls move off, the heavy one no slower."""
    seen = 0
    for _ in range(100_000):
        (light, heavy), place = world.linvel[0, :, 0].tolist(), float(world.pos[0, 1, 0])
        if 0 <= light <= heavy:
            return seen
        free = place - 3 * RADIUS
        world.step(dt=min(setting.dt, 0.5 * free / (abs(light) + 3 * abs(heavy))))
        seen += not np.array_equal(world.linvel[0, :, 0], (light, heavy))
    return seen


CASES = (
    Case(33, "cradle", "Newton's cradle of 3 and 5 balls",
         "(0, ..., 0, v) in turn, (-1/3, 2/3, 2/3) v at once: both can be chosen", newtons_cradle),
    Case(34, "digits-of-pi", "two masses and a wall, ratio 1 to 1,000,000", "3, 31, 314, 3141 collisions",
         digits_of_pi),
)  # fmt: skip
