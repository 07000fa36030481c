"""Hard cases of friction and rest: sliding, inclines, squeezing, pressing into a corner, jamming."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

import physics
from physics.scene.canonical_scenes import GRAVITY, MASS, SIZE
from rigid_env.hard_cases.case import Case, Check, Setting, none_of, within
from rigid_env.hard_cases.cases.scenery import (
    EPS,
    FLOOR,
    block,
    boxed,
    energy,
    is_finite,
    laws,
    none_of_finite,
    of_last_step,
    on_floor,
    state_of,
    turned,
    wrench,
)

RADIUS = 0.5 * float(np.linalg.norm(SIZE))  # radius of the block's bounding sphere [m]
HOUR, MINUTE = 3600.0, 60.0  # [s]


def stop(on: Setting) -> Sequence[Check]:
    """The block slides straight in any direction, stops after v²/(2 μ g), and then no bit of its state changes.

    The deceleration is constant, so the motion is exact apart from the step in which the block stops. A contact problem
    is solved to the tolerance, relative to the free speed g dt of a step: its force is off by this share of the weight.
    """
    v, mu = 3.0, 0.3
    distance, wrong, bent, creep = v * v / (2 * mu * GRAVITY), 0.0, 0.0, 0
    for heading in np.radians([0, 7, 30, 45, 73, 90, 135, 200, 301]):
        along = np.array([math.cos(heading), 0, math.sin(heading)])
        world = on.world(on_floor(block(linvel=v * along), friction=mu))
        world.step(steps=on.steps(v / (mu * GRAVITY)) + 10)
        way = np.array(world.pos[0, 0]) - (0, SIZE[1] / 2, 0)
        wrong = max(wrong, abs(way @ along - distance))
        bent = max(bent, abs(way[0] * along[2] - way[2] * along[0]))
        before = state_of(world)
        world.step(steps=on.steps(10.0))
        creep += int(np.count_nonzero(state_of(world) != before))
    share = max(on.tolerance / mu, 64 * EPS) * distance
    return [
        Check("error of the distance, nine headings", wrong, of_last_step(on, mu) / 4 + share, "m"),
        Check("departure from the straight line", bent, share, "m"),
        Check("numbers of the state that change in 10 s of rest", creep, 0.0),
    ]


def _incline(angle: float, mu: float) -> physics.Scene:
    """Scene with the block face down on an incline that descends along +x: gravity is rotated instead of the floor."""
    pull = (GRAVITY * math.sin(angle), -GRAVITY * math.cos(angle), 0.0)
    return on_floor(block(), friction=mu, gravity=pull)


def _tilted(angle: float, mu: float) -> physics.Scene:
    """Scene with the block face down on an incline that descends along +x: the floor is rotated, not gravity."""
    normal = (math.sin(angle), math.cos(angle), 0.0)
    body = block(tuple(0.5 * SIZE[1] * n for n in normal), quat=turned(-angle))
    return physics.Scene([body], [physics.HalfSpace(normal)], laws(0.0, mu))


def incline(on: Setting) -> Sequence[Check]:
    """The block on an incline sticks iff tanθ ≤ μ, without creep in an hour; else it slides with a = g (sinθ - μ cosθ).

    This is Coulomb's law, tested with μ 0.1 % above and below tanθ. The block first settles within the slop for one
    second; then no bit may change for an hour. Limit: a contact force is accurate to the tolerance, relative to the
    weight. So a is off by this share of g, and once more by the part that comes from rotation.
    """
    checks, long = [], on.pick(HOUR, MINUTE)
    moved, wrong, limit = 0.0, 0.0, 0.0
    for angle in np.radians([10.0, 20.0, 35.0]):
        for make in (_incline, _tilted):
            held = on.world(make(angle, 1.001 * math.tan(angle)))
            held.step(steps=on.steps(1.0))
            before = np.array(held.pos[0, 0])
            held.step(steps=on.steps(long))
            moved = max(moved, float(np.linalg.norm(held.pos[0, 0] - before)))
            mu = 0.999 * math.tan(angle)
            slips = on.world(make(angle, mu))
            start = np.array(slips.pos[0, 0])
            slips.step(steps=on.steps(10.0))
            a = GRAVITY * (math.sin(angle) - mu * math.cos(angle))
            way = float(np.linalg.norm(slips.pos[0, 0] - start))
            wrong = max(wrong, abs(2 * way / slips.time**2 - a))
    limit = 2 * on.tolerance * GRAVITY + 64 * EPS
    checks += [
        Check(f"creep in {long:.0f} s, μ 0.1 % above tanθ", moved, 0.0, "m"),
        Check("error of the acceleration, μ 0.1 % below tanθ", wrong, limit, "m/s²"),
    ]
    return checks


def at_rest(on: Setting) -> Sequence[Check]:
    """The block lies on the floor for 1,000,000 steps: no creep, no sinking, no kinetic energy; no bit changes.

    The sum of the forces at the four corners equals the weight.
    """
    world = on.world(on_floor(block(), friction=0.5))
    world.step(steps=10)
    before, steps = state_of(world), 1_000_000 if on.is_ours else on.pick(1_000_000, 100_000)
    world.step(steps=steps)
    after = state_of(world)
    checks = [
        Check(f"creep in {steps} steps", np.linalg.norm(after[:3] - before[:3]), 0.0, "m"),
        Check("turn", np.linalg.norm(after[3:7] - before[3:7]), 0.0),
        Check("kinetic energy", 0.5 * MASS * float(after[7:] @ after[7:]), 0.0, "J"),
    ]
    if on.is_ours:
        _, forces = world.contacts()
        load = MASS * GRAVITY
        checks.append(within("sum of the forces", forces[:, 1].sum(), load, max(on.tolerance, 8 * EPS) * load, "N"))
    return checks


def squeezed(on: Setting) -> Sequence[Check]:
    """A block is held between two jaws that are pressed together by F iff 2 μ F ≥ m g, tested 1 % above and below.

    The normal force of each jaw is F, and its friction is at most μ F. External forces carry the weight of the jaws and
    of the block, so that all three bodies stand still while the block is held. Below the limit it falls with g - 2 μ
    F/m. Limit: a contact is solved to the tolerance, relative to the free speed g dt of a step; its force is off by
    this share of a jaw's weight.
    """
    mass, heavy, mu, fall = 1.0, 10.0, 0.5, {}
    for share in (1.01, 0.99):
        force, lift = share * mass * GRAVITY / (2 * mu), (heavy + mass / 2) * GRAVITY
        jaws = [physics.Block((1, 2, 2), heavy, pos=(side, 10, 0)) for side in (-1.0, 1.0)]
        scene = physics.Scene([physics.Block((1, 1, 1), mass, pos=(0, 10, 0)), *jaws], [FLOOR], laws(0.0, mu))
        world = on.world(scene)
        load = np.zeros((1, 3, 6))
        load[0, 1:, 0], load[0, 1:, 1] = (force, -force), lift
        for _ in range(on.steps(1.0)):
            world.step(load)
        fall[share] = 10 - world.pos[0, 0, 1]
    t2 = world.time**2 / 2
    loose = 2 * 2 * mu * on.tolerance * heavy / mass * GRAVITY * t2
    return [
        Check("fall in 1 s, 2μF = 1.01 m g", abs(fall[1.01]), loose, "m"),
        within("fall in 1 s, 2μF = 0.99 m g", fall[0.99], 0.01 * GRAVITY * t2, loose, "m"),
    ]


PUSHES = ((1.0, 1.0, 1.0), (1.5, 0.6, 0.9), (0.7, 1.4, 1.1), (1.2, 1.2, 0.5))  # forces into the three walls, in loads


def pressed(on: Setting) -> Sequence[Check]:
    """The block is pressed into a corner by 1e3 to 1e6 weights: the walls balance it, and release adds no energy.

    Statics: the sum of the wall forces equals the load. Limit for the displacement: each step is solved to the
    tolerance, relative to its free speed a dt under the load. So it moves the block by this share of a dt², which the
    next step corrects, and by the slop. Limit for the energy after the release: that before, plus the block's weight
    times a slop.
    """
    checks, balance, gain, wrong, slop = [], 0.0, 0.0, 0, on.slop * RADIUS
    for times in (1e3, 1e4, 1e5, 1e6):
        way, load = 0.0, times * MASS * GRAVITY
        for push in PUSHES:
            world, off, start, energies = _press(on, load * np.array(push))
            way, wrong = max(way, off), wrong + (not is_finite(world))
            forces = world.contacts()[1].sum(axis=0) if len(world.contacts()[1]) else np.zeros(3)
            expected = load * np.array(push) + (0, MASS * GRAVITY, 0)
            balance = max(balance, np.abs(forces - expected).max() / load)
            before = max(start, energies)
            for _ in range(on.steps(1.0)):
                world.step()
                gain = max(gain, energy(world, world.scene) - before)
        limit = math.sqrt(3) * (2 * slop + 1.5 * on.tolerance * times * GRAVITY * on.dt**2) + 64 * EPS * CORNER
        checks.append(Check(f"way in 2 s, {times:g} times", way, limit, "m"))
    return [
        *checks,
        Check("wall forces against the load", balance, 4 * on.tolerance + 64 * EPS),
        Check("energy gained when let go", gain, MASS * GRAVITY * slop + 1e-9 * on.tolerance, "J"),
        none_of("states that are not finite", wrong),
    ]


CORNER = 50.0  # distance of the corner from the origin along each axis [m]


def _press(on: Setting, push: np.ndarray) -> tuple:
    """Push the block into the corner with the force `push` (3,) [N] for 2 s.

    Returns the world, the largest distance from the start [m], and the energies at the start and in the end [J].
    """
    place = np.array(SIZE) / 2 - CORNER
    scene = boxed(block(tuple(place)), (CORNER,) * 3, 0.2, 0.5, (0, -GRAVITY, 0))
    world = on.world(scene)
    start, off = energy(world, scene), 0.0
    for _ in range(on.steps(2.0)):
        world.step(wrench(-push))
        off = max(off, float(np.linalg.norm(world.pos[0, 0] - place)))
    return world, off, start, energy(world, scene)


def painleve(on: Setting) -> Sequence[Check]:
    """A rod slides on one end with μ > (tanθ + 4 cotθ)/3, where no contact force obeys Coulomb's law.

    With A_nn = (1 + 3 cosθ (cosθ - μ sinθ))/m < 0, a contact force and its friction accelerate the end into the floor;
    the bound is A_nn = 0 (Stewart, *Rigid-body dynamics with friction and impact*, SIAM Review 42, 2000, section 1).
    The state must be finite, without penetration, and must not gain energy. The event-driven scheme solves for forces,
    so its report must say that an impulse replaced them (`fallbacks`). Time stepping solves for impulses, for which
    there is no paradox (Stewart, Trinkle).
    """
    length, thin, mass, theta = 2.0, 1e-3, 1.0, math.radians(63.4)
    mu = 1.3 * (math.tan(theta) + 4 / math.tan(theta)) / 3
    across = mass * length**2 / 12
    low = 0.5 * length * (math.sin(theta) + thin * math.cos(theta))
    body = physics.Block(
        (length, thin * length, thin * length), mass, pos=(0, low, 0), quat=turned(theta), linvel=(-5.0, 0, 0),
        inertia_body=(across / 2, across, across),
    )  # fmt: skip
    scene = on_floor(body, 0.0, mu)
    world = on.world(scene)
    last = start = energy(world, scene)
    gain, fallbacks, depth, wrong = 0.0, 0, 0.0, 0
    for _ in range(on.steps(0.3)):
        report = world.step()
        now = energy(world, scene)
        gain, last = max(gain, now - last), now
        fallbacks += int(report.fallbacks[0]) if on.is_ours else 0
        depth = max(depth, -float(physics.diagnose(world).gap[0, 0])) if on.is_ours else 0.0
        wrong += not report.ok if on.is_ours else 0
    checks = [
        none_of_finite("numbers that are not finite", world),
        Check("energy gained in a step", gain / start, 10 * on.tolerance),
        Check("depth", depth, 10 * on.slop * length / 2, "m"),
        none_of("reports of an unsolved contact", wrong),
    ]
    if on.is_event_driven:
        checks.append(Check("steps without a word that forces had no solution", float(fallbacks == 0), 0.0))
    return checks


def kane(on: Setting) -> Sequence[Check]:
    """A rod hits the floor obliquely with friction, so that its slip reverses: no energy may be gained.

    Newton's restitution with Coulomb friction can create energy where the slip reverses (Kane and Levinson, *Dynamics:
    Theory and Applications*, 1985; Stronge, *Impact Mechanics*, section 3.5). The case runs angles of 10° to 80°, four
    speeds along the floor, three μ, and e = 0, 0.5, 1. Limit: a contact problem is solved to the tolerance, which is
    twice that share of the energy.
    """
    length, thin, mass, worst = 2.0, 1e-6, 1.0, {0.0: -math.inf, 0.5: -math.inf, 1.0: -math.inf}
    across = mass * length**2 / 12
    for e in worst:
        for theta in np.radians(np.arange(10, 90, 10)):
            for along in (-3.0, -1.0, 0.3, 2.0):
                for mu in (0.1, 0.5, 1.0):
                    low = 0.5 * length * (math.sin(theta) + thin * math.cos(theta))
                    body = physics.Block(
                        (length, thin * length, thin * length), mass, pos=(0, low, 0), quat=turned(theta),
                        linvel=(along, -1.0, 0), inertia_body=(across / 2, across, across),
                    )  # fmt: skip
                    scene = on_floor(body, e, mu, gravity=(0, 0, 0))
                    world = replace(on, dt=1e-4).world(scene)
                    start = energy(world, scene)
                    world.step()
                    worst[e] = max(worst[e], energy(world, scene) / start - 1)
    return [Check(f"energy gained, e = {e}", gain, 4 * on.tolerance + 64 * EPS) for e, gain in worst.items()]


CASES = (
    Case(16, "sliding-stop", "sliding stop, any heading", "distance v²/(2μg), straight, then rest", stop, peers=True),
    Case(17, "incline", "incline, μ 0.1 % above and below tanθ", "no creep in an hour; else a = g(sinθ - μ cosθ)",
         incline, peers=True),
    Case(20, "at-rest", "at rest for 1,000,000 steps", "no creep, no sinking, no kinetic energy", at_rest, peers=True),
    Case(30, "squeezed", "squeezed between two jaws by F", "holds iff 2μF ≥ mg", squeezed),
    Case(31, "pressed", "pressed into a corner with 1e3 to 1e6 times its weight",
         "wall forces balance; let go, no energy comes of it", pressed),
    Case(35, "painleve", "Painlevé's rod, μ > (tanθ + 4cotθ)/3", "finite, no energy gained, and the report says so",
         painleve),
    Case(36, "slip-reversal", "oblique impact with slip reversal (Kane)", "no energy gained", kane),
)  # fmt: skip
