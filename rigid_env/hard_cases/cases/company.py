"""Hard cases of several bodies: a collision, a gap, a seam or a far body must not change other motions.

Each case draws placements of one scene and runs them as worlds side by side. Public reports against other engines
describe such faults; the decisions describe those of this engine.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

import physics
from physics.rotations import rotation_matrices
from physics.scene.canonical_scenes import GRAVITY
from rigid_env.hard_cases.case import Case, Check, Setting, none_of
from rigid_env.hard_cases.cases.scenery import EPS, FLOOR, laws

RADIUS = 0.03  # radius of the balls [m]
SLAB = 0.5  # thickness of slabs [m]
LENGTH = 0.8  # length of each of five slabs in a row [m]


def _side_by_side(on: Setting, scene: physics.Scene, pos, linvel, **more) -> physics.World:
    """Make worlds of a scene, one for each row of `pos` and `linvel` (worlds, bodies, 3).

    `more` are further arguments of `World.set_state`.
    """
    world = on.world(scene, len(pos))
    world.set_state(pos=pos, linvel=np.broadcast_to(linvel, pos.shape), **more)
    return world


def _rows(*parts) -> np.ndarray:
    """Stack arrays (worlds, 3) or (3,), one for each body, to an array (worlds, bodies, 3)."""
    count = max(len(np.atleast_2d(part)) for part in parts)
    return np.stack([np.broadcast_to(part, (count, 3)) for part in parts], axis=1).astype(float)


def _along_x(x, y: float = 0.0) -> np.ndarray:
    """Points (worlds, 3) with these x, at the height y and z = 0."""
    return np.stack([np.asarray(x), np.full(np.shape(x), y), np.zeros(np.shape(x))], axis=1)


def bounce_in_company(on: Setting) -> Sequence[Check]:
    """A ball hits an equal ball on a table, a ball falls on a block: relative speeds are e times those before.

    Two balls head on, without friction: the floor has no part in it, u⁺ = -e u⁻ for the two balls, and v₂ = (1 + e)/2
    v. A ball falls on a block on the floor: the floor holds the block at the moment of impact, and Newton's law holds
    at both contacts at once. So the ball leaves with e √(2 g h), and the block rests.

    Each runs from many distances, since a step may begin at any place before the impact. Limits: if a step begins
    within a slop of the impact, the ball lacks the speed of a slop's fall. Each contact problem leaves its tolerance of
    the speed, once at the impact and once for each step at rest before it. The last check is a cube that falls flat on
    the block and hits it with four corners at once, several times.
    """
    count, checks = on.pick(400, 60), []
    for e in (0.0, 0.3, 0.8, 1.0):
        balls = [physics.Sphere(RADIUS, 0.17, pos=(k, RADIUS, 0)) for k in range(2)]
        x = 2 * RADIUS + np.linspace(0.02, 0.5, count)
        pos, scene = _rows((0, RADIUS, 0), _along_x(x, RADIUS)), physics.Scene(balls, [FLOOR], laws(e))
        world = _side_by_side(on, scene, pos, _rows((2, 0, 0), np.zeros(3)))
        world.step(steps=on.steps(0.4))
        taken = np.abs(world.linvel[:, 1, 0] - (1 + e)).max() / 2
        checks.append(Check(f"share of the speed that the second ball lacks, e = {e}", taken, 10 * on.tolerance + 1e-9))
    for e in (0.3, 0.8, 1.0):
        plate = physics.Block((1, 0.2, 1), 5.0, pos=(0, 0.1, 0))
        h = np.linspace(0.3, 0.6, count)
        scene = physics.Scene([plate, physics.Sphere(0.05, 0.5, pos=(0, 1, 0))], [FLOOR], laws(e))
        pos = _rows((0, 0.1, 0), _along_x(np.zeros(count), 0.25) + h[:, None] * (0, 1, 0))
        world, limit = _side_by_side(on, scene, pos, np.zeros(3)), 20 * on.tolerance + 4 * on.slop
        checks.append(Check(f"energy that a bounce on a block lacks, e = {e}", _lack(world, on, h, e), limit))
    return [*checks, _flat(on)]


def _flat(on: Setting) -> Check:
    """Check the spin of a cube that falls flat on a block on the floor, until after its third impact.

    The limit is the solver's tolerance times v/a, the speed over half the edge.
    """
    side, h, e = 0.5, 0.5, 0.8
    bodies = [
        physics.Block((2, 0.2, 2), 50.0, pos=(0, 0.1, 0)),
        physics.Block((side, side, side), 1.0, pos=(0, 0.2 + side / 2 + h, 0)),
    ]
    fall, speed = math.sqrt(2 * h / GRAVITY), math.sqrt(2 * GRAVITY * h)
    world = on.world(physics.Scene(bodies, [FLOOR], laws(e, 0.5)))
    world.step(steps=on.steps(fall * (1 + 2 * e + 1.5 * e * e)))
    limit = 20 * on.tolerance * speed / (side / 2) + 1e-7
    return Check("spin of a cube that lands flat on a block", float(np.abs(world.angvel[0, 1]).max()), limit, "rad/s")


def _lack(world: physics.World, on: Setting, h: np.ndarray, e: float) -> float:
    """Largest relative error of the energy of bouncing balls after the first bounce, as a share of m g h.

    The energy above the block should be e² m g h; `h` (worlds,) are the heights of fall [m].
    """
    fall = np.sqrt(2 * h / GRAVITY)
    worst = np.zeros(len(h))
    for _ in range(on.steps(float((fall * (1 + e)).min()))):
        world.step()
        height, speed = world.pos[:, 1, 1] - 0.25, world.linvel[:, 1, 1]
        is_after = (world.time > fall + 2 * on.dt) & (world.time < fall * (1 + e))
        lack = np.abs((speed**2 / (2 * GRAVITY) + height) / h - e * e)
        worst = np.maximum(worst, np.where(is_after, lack, 0.0))
    return float(worst.max())


def _attitudes(rng, count: int) -> np.ndarray:
    """Random attitudes (count, 2, 4), unit quaternions uniform over all attitudes."""
    quat = rng.normal(size=(count, 2, 4))
    return quat / np.linalg.norm(quat, axis=2, keepdims=True)


def passing(on: Setting) -> Sequence[Check]:
    """Bodies that pass each other without touching move as if they were alone.

    Blocks and balls fly past each other at clearances from 1e-5 to 0.1 m. No force acts, so velocities keep their bits,
    apart from the rounding of the sums that form them, and there is no impact. For bodies that turn, the clearance is
    that of their bounding spheres. For others it is the clearance of their projections along the flight direction: the
    largest n·d - s(n) over all n perpendicular to it, with d from the block to the ball and s the support functions of
    both.
    """
    rng, count = np.random.default_rng(5), on.pick(400, 60)
    bodies = [physics.Block((1, 0.6, 0.4), 1.0, pos=(0, 0, 0)), physics.Sphere(0.4, 0.7, pos=(5, 0, 0))]
    scene = physics.Scene(bodies, [], laws(0.5, 0.3, (0, 0, 0)))
    quat = _attitudes(rng, count)
    speed, clearance = np.exp(rng.uniform(math.log(0.3), math.log(30), count)), 10 ** rng.uniform(-5, -1, count)
    is_turning = rng.random(count) < 0.3
    pos, linvel, angvel = np.zeros((3, count, 2, 3))
    for k in range(count):
        way, across, other = np.linalg.qr(rng.normal(size=(3, 3)))[0].T
        offset = 0.5 * math.hypot(1, 0.6, 0.4) + 0.4 + clearance[k]
        if is_turning[k]:
            angvel[k] = 3 * rng.normal(size=(2, 3))
        else:
            offset = _offset(across, other, rotation_matrices(quat[k, 0]), clearance[k])
        pos[k, 0], linvel[k, 0] = offset * across - 2 * way, speed[k] * way
    world = _side_by_side(on, scene, pos, linvel, quat=quat, angvel=angvel)
    world.make_event_room(4)
    events = 0
    for _ in range(min(on.steps(4 / 0.3), on.pick(4000, 300))):
        world.step()
        events += int(world.event_counts.sum())
    change = np.abs(world.linvel - linvel).max(axis=(1, 2)) / speed
    return [
        Check(f"change of a velocity, {count} pairs", float(change.max()), 4 * EPS),
        none_of("impacts", events),
    ]


def _offset(across, other, R, clearance: float) -> float:
    """Offset of a ball's path along `across` [m] for which the ball passes the turned block at a clearance [m].

    Seen along the path, `across` and `other` are the axes of the picture, and the clearance is the gap in it. R is the
    rotation matrix of the block.
    """
    angle = np.linspace(0, 2 * math.pi, 3601)
    n = np.cos(angle)[:, None] * across + np.sin(angle)[:, None] * other
    reach = np.abs(n @ R) @ (0.5, 0.3, 0.2) + 0.4
    low, high = 0.0, 3.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if (middle * (n @ across) - reach).max() > clearance else (middle, high)
    return high


def sliding_past(on: Setting) -> Sequence[Check]:
    """A block slides past a heavy one at a clearance, and only the floor slows it down: v = v₀ - μ g t.

    The heavy block lies beside the path of the sliding one. The solver's residual turns the sliding block, so that its
    corner might reach the other. So the clearances are larger than the tolerance times the path.
    """
    count, checks = on.pick(24, 6), []
    for speed in (1.0, 5.0):
        way = speed * 0.2
        clearance = np.geomspace(max(1e-4, 20 * on.tolerance * way), 1e-1, count)
        bodies = [
            physics.Block((0.4, 0.2, 0.3), 0.5, pos=(-0.27, 0.1, 0)),
            physics.Block((2, 0.5, 2), 1e4, pos=(1, 0.25, -3)),
        ]
        beside = np.stack([np.ones(count), np.full(count, 0.25), -1.15 - clearance], axis=1)
        world = _side_by_side(
            on,
            physics.Scene(bodies, [FLOOR], laws(0.0, 0.2)),
            _rows((-0.27, 0.1, 0), beside),
            _rows((speed, 0, 0), np.zeros((count, 3))),
        )
        world.step(steps=on.steps(0.2))
        lost = np.abs(world.linvel[:, 0] - (speed - 0.2 * GRAVITY * world.time, 0, 0)).max() / speed
        checks.append(Check(f"speed lost to a block beside the way, {speed} m/s", float(lost), 20 * on.tolerance))
    return checks


def seams(on: Setting) -> Sequence[Check]:
    """A block slides, and a ball rolls, over five slabs in a row as over a single one.

    The slabs are flush, or each is slightly lower than the one before. Flush slabs are one plane, so any difference
    comes from a seam. Bodies also start 15 µm above it and land softly,
    some slops deep. A ball that rolls over the common corner of four slabs keeps its velocity. Where each slab is 5e-6
    m lower than the one before, the four seams add g times their height to ½ v²: 1.3e-4 m/s at 1.5 m/s, which is less
    than 4e-5 m.
    """
    count, checks = on.pick(60, 10), []
    rng = np.random.default_rng(3)
    for name, mu, body in (
        ("block", 0.2, physics.Block((0.4, 0.2, 0.3), 0.5, pos=(-0.5, 0.1, 0))),
        ("ball", 0.5, physics.Sphere(0.1, 0.5, pos=(-0.5, 0.1, 0))),
    ):
        start, speed = rng.uniform(-0.6, -0.4, count), rng.uniform(1.5, 3.0, count)
        turn = 0.0 if name == "block" else -speed / 0.1
        for drop, above in ((0.0, 0.0), (5e-6, 0.0), (0.0, 1.5e-5)):
            slabs = [_slab(k, LENGTH, SLAB - k * drop) for k in range(5)]
            motion = (_along_x(start, 0.1 + above), speed, turn)
            one = _cross(on, body, mu, [_slab(0, 5 * LENGTH, SLAB)], *motion)
            off = np.abs(_cross(on, body, mu, slabs, *motion) - one).max()
            what = f"{name} off its way over five slabs, {drop:g} m lower each, from {above:g} m above"
            checks.append(Check(what, float(off), 1e-4, "m"))
    return [*checks, _over_corner(on)]


def _over_corner(on: Setting) -> Check:
    """Check that a ball keeps its velocity as it rolls diagonally over the common corner of four slabs.

    The step is at most 1 ms: then the ball meets edges ahead of it only within some slops, as if it landed on them.
    While the ball is on an edge within the slop, the contact normal leans by √(2 slop/r). Gravity times this angle
    times the duration changes the velocity by 2e-6 of 1 m/s.
    """
    on = replace(on, dt=min(on.dt, 1e-3))
    slabs = [physics.Block((1, SLAB, 1), 1e4, pos=(x, 0.5 * SLAB, z)) for x in (-0.5, 0.5) for z in (-0.5, 0.5)]
    aside = np.array([0.0, 1e-9, 1e-6, 1e-4, -1e-4])
    pos = _rows(_along_x(aside - 0.25, SLAB + 0.1) - (0, 0, 0.25), *(slab.pos for slab in slabs))
    linvel, angvel = np.zeros_like(pos), np.zeros_like(pos)
    linvel[:, 0], angvel[:, 0] = (1, 0, 1), (10, 0, -10)
    ball = physics.Sphere(0.1, 0.5, pos=(0, SLAB + 0.1, 0))
    world = _side_by_side(on, physics.Scene([ball, *slabs], [FLOOR], laws(0.0, 0.5)), pos, linvel, angvel=angvel)
    world.step(steps=on.steps(0.5))
    lost = np.abs(world.linvel[:, 0] - (1, 0, 1)).max()
    return Check("speed that a ball loses over the corner of four slabs", float(lost), 20 * on.tolerance + 1e-11, "m/s")


def _slab(k: int, length: float, thickness: float) -> physics.Block:
    """Slab k of a row along x that starts at -1 m, on a floor at y = -`SLAB`."""
    return physics.Block((length, thickness, 4.0), 1e4, pos=(length * (k + 0.5) - 1, 0.5 * thickness - SLAB, 0))


def _cross(on: Setting, body: physics.Body, mu: float, slabs, start, speed, turn) -> np.ndarray:
    """Positions x (worlds,) of a body after 0.6 s [m], in worlds with different starts and speeds of the body.

    The speed (worlds,) is along x [m/s], `turn` is the angular velocity about z [rad/s], and `mu` the friction
    coefficient.
    """
    pos = _rows(start, *(slab.pos for slab in slabs))
    linvel, angvel = _rows(_along_x(speed), *np.zeros((len(slabs), 3))), np.zeros_like(pos)
    angvel[:, 0, 2] = turn
    scene = physics.Scene([body, *slabs], [physics.HalfSpace((0, 1, 0), -SLAB)], laws(0.0, mu))
    world = _side_by_side(on, scene, pos, linvel, angvel=angvel)
    world.step(steps=on.steps(0.6))
    return world.pos[:, 0, 0]


def closed_pairs(on: Setting) -> Sequence[Check]:
    """Pairs of bodies that collide in free space keep linear and angular momentum to rounding, at any restitution.

    Impulses of a contact are opposite and act at one point. Each step rounds positions, attitudes and momenta a few
    times, in the worst case always in the same direction.
    """
    rng, count, checks = np.random.default_rng(9), on.pick(200, 40), []
    parts = 10 if on.is_event_driven else 1  # parts of a step with error control, each with its own roundings
    sizes = {(1, 0.6, 0.4): 1.0, (0.5, 0.7, 0.6): 0.6}
    bodies = [physics.Block(size, mass, pos=(5 * k, 0, 0)) for k, (size, mass) in enumerate(sizes.items())]
    inertia = [body.mass / 12 * (np.sum(np.square(body.size)) - np.square(body.size)) for body in bodies]
    for e in (0.0, 0.5, 1.0):
        away = rng.normal(size=(count, 3))
        away *= 1.7 / np.linalg.norm(away, axis=1, keepdims=True)
        quat = _attitudes(rng, count)
        pos = _rows(np.zeros(3), away)
        linvel = _rows(rng.uniform(0.5, 2, (count, 1)) * away, 0.3 * rng.normal(size=(count, 3)))
        scene = physics.Scene(bodies, [], laws(e, 0.5, (0, 0, 0)))
        world = _side_by_side(on, scene, pos, linvel, quat=quat, angvel=1.5 * rng.normal(size=(count, 2, 3)))
        before, steps = _momenta(world, bodies, inertia), on.steps(on.pick(2.0, 1.0))
        world.step(steps=steps)
        for what, one, other in zip(("linear", "angular"), before, _momenta(world, bodies, inertia)):
            change = np.abs(one - other).max() / np.abs(one).max()
            checks.append(Check(f"change of the {what} momentum, e = {e}", float(change), 8 * EPS * steps * parts))
    return checks


def _momenta(world: physics.World, bodies, inertia) -> tuple[np.ndarray, np.ndarray]:
    """Linear and angular momentum (worlds, 3) of each world, from moments of inertia for each body."""
    p = np.array([body.mass for body in bodies])[:, None] * world.linvel
    L = np.cross(world.pos, p)
    for k, moments in enumerate(inertia):
        R = rotation_matrices(world.quat[:, k])
        L[:, k] += np.einsum("wij,wj->wi", R, moments * np.einsum("wji,wj->wi", R, world.angvel[:, k]))
    return p.sum(axis=1), L.sum(axis=1)


def far_body(on: Setting) -> Sequence[Check]:
    """The position of a body that nothing comes near changes no bit of the other bodies' motion.

    Three blocks topple under a ball. Another ball lies at one of five places, or flies at one of three speeds. The
    motion of the others has the same bits for all five places, and the same bits for all three speeds.
    """
    bodies = [
        *(physics.Block((0.4, 0.4, 0.4), 1.0, pos=(0.05 * (k % 2), 0.2 + 0.4 * k, 0)) for k in range(3)),
        *(physics.Sphere(0.2, 1.0, pos=(0.5 + 19 * k, 1.5 - 1.3 * k, 0)) for k in range(2)),
    ]
    lying = np.array([(-20, 0.2, 0), (30, 0.2, 0), (0, 0.2, 40), (-20, 0.2, 7.3), (5, 0.2, -5000)])
    flying = np.array([(-20, 50, 0), (30, 900, 0), (0, 3000, 40)])
    places = np.concatenate([lying, flying])
    scene = physics.Scene(bodies, [FLOOR], laws(0.4, 0.4))
    pos = _rows(*(body.pos for body in bodies[:4]), places)
    away = np.concatenate([np.zeros((5, 3)), [(0, 0, 0), (2000, 0, 0), (3, 500, 1e5)]])
    linvel = _rows((0.1, 0, 0), np.zeros(3), (-0.3, 0, 0.2), (-0.5, 0, 0), away)
    world = _side_by_side(on, scene, pos, linvel)
    world.step(steps=on.steps(on.pick(1.5, 0.6)))
    parts = [np.asarray(part)[:, :4] for part in (world.pos, world.quat, world.linvel, world.angvel)]
    return [
        none_of(f"numbers with other bits, it {what}", sum(int((part[one] != part[one][:1]).sum()) for part in parts))
        for what, one in (("lies", slice(0, 5)), ("flies", slice(5, 8)))
    ]


CASES = (
    Case(
        56, "bounce-in-company", "balls hit on a table, and on a block", "speeds apart are e times those before",
        bounce_in_company,
    ),
    Case(57, "passing", "bodies fly past each other at a clearance", "velocities as if alone, no impact", passing),
    Case(58, "sliding-past", "a block slides past a heavy one", "v = v₀ - μ g t, as if alone", sliding_past),
    Case(
        59, "seams", "a block and a ball cross level slabs", "as over one slab, within 1e-4 m", seams,
        faults={"fast": "slabs sink into the floor by some slops each, at 1e-3 of their weight: edges stand out"},
    ),
    Case(60, "closed-pairs", "hits in space, e from 0 to 1", "both momenta kept to rounding", closed_pairs),
    Case(61, "far-body", "a body far off lies elsewhere", "the same bits of all others", far_body),
)  # fmt: skip
