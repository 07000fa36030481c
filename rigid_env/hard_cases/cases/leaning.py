"""Hard cases of leaning bodies: two cards, a ladder, and a row of dominoes."""

from __future__ import annotations

import math

import numpy as np

import physics
from rigid_env.hard_cases.case import Case, Check, Setting, at_least, none_of
from rigid_env.hard_cases.cases import stacks
from rigid_env.hard_cases.cases.stacks import G

# Share by which friction is above or below the limit for holding.
NEAR = 0.01


def turned(angle: float) -> tuple[float, float, float, float]:
    """Quaternion (4,), w first, of a rotation about z by `angle` [rad]."""
    return (math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2))


def cards(setting: Setting) -> list[Check]:
    """Two cards of length L and thickness t lean on each other, φ from the vertical, on a floor with friction μ.

    Each card stands on its lower inner edge, and the inner upper edges touch. By symmetry the cards push each other
    horizontally, with H. The foot of a card carries m g and the friction H. Both edges lie on the inner face: the apex
    is L along the card from the foot, and the centre is L/2 along it and t/2 off it. Moments about the foot:

        H L cosφ = m g (L/2 sinφ - t/2 cosφ),   H = m g (½ tanφ - t/(2 L)),

    so the foot holds iff μ >= ½ tanφ - t/(2 L). The case runs 1 % above and below, with φ = 20° and t = L/100, for 3 s.
    Limit for standing: one slop of a card at each of three interfaces. Limit for falling 1 % below: the feet accelerate
    by at least 1 % of μ g = 0.18 g, so they have moved by more than 1 mm after ½ 0.0018 g t² with t = 0.34 s.

    Where two edges touch, every direction between the two faces' normals is a possible contact normal; the horizontal
    is in the middle of them.
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
        at_least("1 % below the limit: moved", moved[1], 1e-3, "m"),
    ]


def ladder(setting: Setting) -> list[Check]:
    """A ladder of length L and thickness t leans against a wall, θ from the floor, with friction μ at both ends.

    It touches floor and wall with edges of its lower face. They are L apart along the ladder; the centre is L/2 along
    it and t/2 above that face. At the limit both ends slip: the floor pushes with N and rubs with μ N, which balances
    the push of the wall. The wall rubs with μ² N, so N (1 + μ²) = m g. Moments about the foot:

        m g (L/2 cosθ - t/2 sinθ) = μ N L sinθ + μ² N L cosθ,
        tanθ = (1 - μ²) / (2 μ + (t/L) (1 + μ²)).

    The case runs tanθ 0.1 % above and below, with μ = 0.5, for 5 s. Limit for holding: without motion the forces are
    not unique, and the solver iterates to the tolerance. The velocity left in a step is at most the tolerance times the
    free speed g h, in the worst case always in one direction: tolerance * g * h * 5 s. Limit for slipping: the forces
    lack 0.1 % of the weight's moment. This rotates the ladder by at least α = 0.001 (m g L/2 cosθ)/(m L²/3), so its
    centre moves by at least ½ α 5² L/2, which is centimetres, unless it lies on the floor before.

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
        at_least("0.1 % below the limit: moved", moved[1], 0.02, "m"),
    ]


def dominoes(setting: Setting) -> list[Check]:
    """Twenty dominoes stand in a row, and the first starts beyond its balance: all fall, in order.

    They are 0.2 x 1 x 0.5 m, 0.6 m apart. A domino is balanced on its edge at a tilt of atan(0.2/1) = 0.197 rad; the
    first starts at 0.3 rad. A falling domino hits the next one at 0.9 of its height: the gap is 0.4 m, the height 1 m,
    and √(1 - 0.4²) = 0.92. This is far above the centre, so the next one is pushed over if friction holds its foot. A
    domino counts as fallen when its centre, which passes 0.51 m at the top of its way, is below 0.45 m. All must fall
    within 10 s. A quick run with error control has eight.
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
