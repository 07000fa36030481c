"""Leaning bodies: cards, a ladder, dominoes."""

from __future__ import annotations

import math

import numpy as np

import physics
from rigid_env.hard_cases.case import Case, Check, Setting, none_of
from rigid_env.hard_cases.cases import stacks
from rigid_env.hard_cases.cases.stacks import G

# Share by which the condition for holding is met or missed.
NEAR = 0.01


def turned(angle: float) -> tuple[float, float, float, float]:
    """Quaternion of a turn about z [rad]."""
    return (math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2))


def cards(setting: Setting) -> list[Check]:
    """Two cards of length L and thickness t lean on each other, φ from the vertical, on a floor with μ.

    Each stands on its lower inner edge; the inner upper edges touch. By symmetry they push each other horizontally,
    with H; a card's foot carries m g and the friction H. Both edges lie on the inner face, so the way from foot to apex
    is L along the card, and its centre L/2 along it and t/2 off it. Moments about the foot:

        H L cosφ = m g (L/2 sinφ - t/2 cosφ),   H = m g (½ tanφ - t/(2 L)),

    and the foot holds iff μ >= ½ tanφ - t/(2 L). Run at 1 % above and below, φ = 20°, t = L/100, for 3 s. Standing: one
    slop of a card at each of three interfaces. Falling from 1 % short: the feet accelerate by 1 % of μ g = 0.18 g at
    least, so that they are more than 1 mm away after ½ 0.0018 g t² with t = 0.34 s.

    At edges that lie in each other any direction between the two faces' normals is a normal; horizontal is in their
    middle.
    """
    angle, length, thickness = math.radians(20.0), 1.0, 0.01
    limit = 0.5 * math.tan(angle) - thickness / (2 * length)
    s, c = math.sin(angle), math.cos(angle)
    x, y = 0.5 * (length * s + thickness * c), 0.5 * (length * c + thickness * s)
    bodies = [
        physics.Block((thickness, length, 0.5), 1.0, pos=(side * x, y, 0), quat=turned(side * angle))
        for side in (-1, 1)
    ]
    moved = []
    for friction in ((1 + NEAR) * limit, (1 - NEAR) * limit):
        world = setting.world(stacks.pile(bodies, friction))
        moved.append(stacks.settle(setting, world, 3.0)[0])
    stands = 3 * setting.slop * math.hypot(length, thickness, 0.5) / 2 if setting.is_ours else stacks.STANDING * length
    return [
        Check("1 % above the limit: moved", moved[0], stands, "m"),
        Check("1 % below the limit: moved", moved[1], 1e-3, "m", "at least"),
    ]


def ladder(setting: Setting) -> list[Check]:
    """A ladder of length L and thickness t against a wall, θ from the floor, μ at both ends.

    It touches floor and wall with edges of its lower face: the way between them is L along the ladder, and its centre
    L/2 along it and t/2 above that face. At the limit both ends slip: the floor pushes N and rubs μ N, which is the
    push of the wall; that rubs μ² N: N (1 + μ²) = m g. Moments about the foot:

        m g (L/2 cosθ - t/2 sinθ) = μ N L sinθ + μ² N L cosθ,
        tanθ = (1 - μ²) / (2 μ + (t/L) (1 + μ²)).

    Run with tanθ 0.1 % above and below, μ = 0.5, for 5 s. Holding: where nothing moves the forces are not unique, and
    iterated to the tolerance; the velocity left is at most the tolerance times the free speed g h, every step, all in
    one direction at worst: tolerance * g h * 5 s. Slipping: the forces lack 0.1 % of the weight's moment, which turns
    it by α = 0.001 (m g L/2 cosθ)/(m L²/3) or more, its centre is ½ α 5² L/2 and more away: centimetres. (It lies
    before.)

    References
    ----------
    .. [1] The ladder problem, in any textbook of statics; for t = 0 tanθ = (1 - μ²)/(2 μ).
    """
    mu, length, thickness, duration = 0.5, 4.0, 0.1, 5.0
    limit = (1 - mu**2) / (2 * mu + thickness / length * (1 + mu**2))
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(), physics.Friction(mu)]
    moved = []
    for share in (1.001, 0.999):
        theta = math.atan(share * limit)
        s, c = math.sin(theta), math.cos(theta)
        x, y = 0.5 * (length * c + thickness * s), 0.5 * (length * s + thickness * c)
        body = physics.Block((thickness, length, 0.5), 10.0, pos=(x, y, 0), quat=turned(math.pi / 2 - theta))
        scene = physics.Scene([body], [stacks.FLOOR, physics.HalfSpace((1, 0, 0))], effects)
        moved.append(stacks.settle(setting, setting.world(scene), duration)[0])
    creep = setting.tolerance * G * setting.dt * duration
    return [
        Check("0.1 % above the limit: moved", moved[0], creep if setting.is_ours else stacks.STANDING * length, "m"),
        Check("0.1 % below the limit: moved", moved[1], 0.02, "m", "at least"),
    ]


def dominoes(setting: Setting) -> list[Check]:
    """Twenty dominoes 0.2 x 1 x 0.5 m, 0.6 m apart; the first one starts beyond its balance.

    It is in balance on its edge when tilted by atan(0.2/1) = 0.197 rad, and starts at 0.3 rad. A falling domino hits
    the next one at 0.9 of its height (gap 0.4 m, height 1 m: √(1 - 0.4²) = 0.92), far above its centre, so that with
    friction to hold its foot it is pushed over. Fallen: its centre, 0.51 m high at the top of its way, is below 0.45 m.
    They fall in order, all within 10 s. A quick run to an error has eight.
    """
    tilt = 0.15
    first = physics.Block((0.2, 1, 0.5), 1.0, pos=(0.1, 0.55, 0), quat=(math.cos(tilt), 0, 0, -math.sin(tilt)))
    count = 8 if setting.is_event_driven and not setting.is_thorough else 20
    others = [physics.Block((0.2, 1, 0.5), 1.0, pos=(0.6 * k, 0.5, 0)) for k in range(1, count)]
    world = setting.world(stacks.pile([first, *others]))
    fallen = np.full(count, np.inf)
    for k in range(setting.steps(10.0)):
        world.step()
        low = world.pos[0, :, 1] < 0.45
        fallen[low & np.isinf(fallen)] = k
        if low.all():
            break
    order = np.nan_to_num(fallen, posinf=1e9)
    return [
        none_of("dominoes that stand", int(np.isinf(fallen).sum())),
        none_of("dominoes that fall before the one in front of them", int((np.diff(order) < 0).sum())),
    ]


CASES = (
    Case(28, "cards", "two cards lean on each other, 20° from the vertical",
         "hold iff μ >= ½ tanφ (less half their thickness by length)", cards, peers=True),
    Case(29, "ladder", "a ladder against a wall, both ends rough",
         "slips below tanθ = (1 - μ²)/(2 μ), θ from the floor", ladder, peers=True),
    Case(44, "dominoes", "a run of twenty dominoes", "all fall, in order", dominoes, peers=True),
)  # fmt: skip
