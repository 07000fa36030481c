"""Hard cases of impacts whose order matters: Newton's cradle, and two masses that count digits of π."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

import physics
from physics.accuracy import resolve
from rigid_env.hard_cases.case import Case, Check, Setting, within

RADIUS = 0.5  # [m]
SPEED = 3.0  # speed of the striking ball [m/s]


def cradle(count: int, gap: float) -> physics.Scene:
    """Scene with one ball at `SPEED` towards count - 1 balls at rest, `gap` [m] apart; each has 1 kg, and e = 1."""
    places = [-4 * RADIUS] + [k * (2 * RADIUS + gap) for k in range(1, count)]
    bodies = [
        physics.Sphere(RADIUS, 1.0, pos=(x, 0, 0), linvel=(SPEED if k == 0 else 0.0, 0, 0))
        for k, x in enumerate(places)
    ]
    return physics.Scene(bodies, (), [physics.Contact(1.0)])


def newtons_cradle(setting: Setting) -> list[Check]:
    """One ball strikes n - 1 balls at rest, n = 3 and 5: all impacts at once, or one after the other.

    At once, one contact problem has all contacts. By Newton's law each normal velocity is reversed: u_1 = v becomes -v,
    and u_k = 0 stays. Let x be the velocity of the first ball after the impact; then all others have x + v. Momentum
    gives n x + (n - 1) v = v, so x = -(n - 2)/n v, and the others have 2/n v: (-1/3, 2/3, 2/3) v for three balls. The
    energy is kept: ((n - 2)² + 4 (n - 1))/n² = 1.

    In turn, two equal balls exchange their velocities, so that only the last ball moves in the end, with v. Balls 1 mm
    apart do this without a setting; for touching balls the setting `Accuracy(collisions="sequential")` chooses it.

    Limit: the velocities are solved to the tolerance of the free contact speed v, at each of n - 1 impacts and
    contacts.
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
    """Check that touching balls pass the impact on one after the other with the setting `sequential`."""
    chosen = replace(setting, accuracy=replace(resolve(setting.accuracy), collisions="sequential"))
    after = _after(chosen, cradle(count, 0.0))
    error = float(np.abs(after - SPEED * (np.arange(count) == count - 1)).max())
    return Check(f"{count} balls, in turn: error of the speeds", error, (count - 1) * setting.tolerance * SPEED, "m/s")


def digits_of_pi(setting: Setting) -> list[Check]:
    """A heavy ball drives a light one against a wall, e = 1: floor(π √ratio) collisions, with the wall or each other.

    In the plane (√m1 x1, √m2 x2) the motion is that of a billiard ball in a wedge of the angle atan(√(m1/m2)).
    Unfolded, it is a straight line that crosses the wedge's images π/angle times. The step is so short that it has at
    most one collision: half of x/(|v1| + 3 |v2|), where x is the free gap between wall and heavy ball. (Between two
    collisions the light ball crosses at least what is left of this gap, and a collision increases |v1| by at most 2
    |v2|.) Limit: an impact of one contact is solved in closed form, so the energy is off only by rounding in each
    collision.

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
    """Count collisions, the steps that change a velocity, until both balls move away, the heavy one not slower."""
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
