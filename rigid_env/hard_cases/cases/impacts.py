"""Hard cases of a single impact: into a corner, with the end of a rod, a vertex or a whole face, and a fast bullet."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import permutations

import numpy as np

import physics
from physics.scene.canonical_scenes import GRAVITY, MASS, SIZE
from rigid_env.hard_cases.case import Case, Check, Setting, none_of
from rigid_env.hard_cases.cases.scenery import (
    EPS,
    FLOOR,
    attitude,
    block,
    boxed,
    laws,
    on_floor,
)

HEIGHT = 1.0  # height from which bodies are dropped [m]


def corner(on: Setting) -> Sequence[Check]:
    """A sphere flies into the corner of three perpendicular walls, e = 1, μ = 0: v' = -v, whichever wall it hits first.

    Each wall reverses only the velocity along its normal. Two or three walls at once do the same, since they are
    independent. The case runs three different speeds in all orders of the walls, then two and three equal speeds, for
    which the sphere hits several walls at one moment.
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
    """Velocity of the sphere just after the corner; each later reflection at a far wall is undone.

    `aim` is the velocity before, and `room` the distance from the middle to a wall, less the radius [m].
    """
    hits = np.floor((np.abs(aim) * world.time + room) / (2 * room))
    return world.linvel[0, 0] * np.where(np.mod(hits, 2) == 0, -1.0, 1.0)


def superball(on: Setting) -> Sequence[Check]:
    """A sphere with tangential restitution e_t: its contact point leaves at -e_t times its slip u = v + ω x (-r n).

    The impulse J along the wall changes v by J/m, ω by (-r n) x J/I with I = (2/5) m r², and u by (7/2) J/m. So
    Δv = -(2/7)(1+e_t) u, and r Δω is 5/2 of it (R. L. Garwin, *Kinematics of an ultraelastic rough ball*, Am. J. Phys.
    37, 1969). The friction coefficient is large enough for this impulse. Limit: a few rounded numbers of size 10.
    """
    radius, e, worst, worst_spin = 0.5, 0.6, 0.0, 0.0
    v, w, n = np.array([3.0, -4.0, 1.0]), np.array([0.5, 2.0, -3.0]), np.array([0.0, 1.0, 0.0])
    for tangential in (-1.0, 0.0, 0.4, 1.0):
        body = physics.Sphere(radius, 2.0, pos=(0, radius, 0), linvel=v, angvel=w)
        effects = [physics.Contact(e, tangential=tangential), physics.Friction(50.0)]
        world = on.world(physics.Scene([body], [FLOOR], effects))
        world.step()
        slip = v + np.cross(w, -radius * n)
        change = -2 / 7 * (1 + tangential) * (slip - (slip @ n) * n)
        speed = v + change - (1 + e) * (v @ n) * n
        spin = w + 2.5 / radius**2 * np.cross(-radius * n, change)
        worst = max(worst, np.abs(world.linvel[0, 0] - speed).max())
        worst_spin = max(worst_spin, np.abs(world.angvel[0, 0] - spin).max())
    return [Check("error of v', four e_t", worst, 1e-12, "m/s"), Check("error of ω'", worst_spin, 1e-11, "rad/s")]


def rod(on: Setting) -> Sequence[Check]:
    """A thin rod falls on one end at θ, μ = 0: J = (1+e)mv/(1+3cos²θ), ω = 6(1+e)v cosθ/(L(1+3cos²θ)).

    The end is L/2 cosθ beside the centre, so that 1/W = m/(1 + (L/2 cosθ)² m/I) with I = m L²/12 (Beer and Johnston,
    *Dynamics*, section 17.3). A block with the thickness 1e-9 L replaces the rod. The vertices of its end are that far
    from the axis, so results are off by this share. Its moment of inertia about the rod's axis, which has no effect, is
    I/2.
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
    """The block hits with one vertex: J = -(1+e) v_n/(1/m + n·(I⁻¹(r x n) x r)); momenta change by J n and r x J n.

    Witkin and Baraff, *Physically Based Modeling*, "Rigid Body Simulation II", eq. 8-18. After the impact the block
    flies without gravity, and keeps its momenta until the step ends. Limit: a few rounded numbers of size 30.
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
    """The block lands on a face, four contacts at once: no spin, no tilt and no sideways speed, to the last bit.

    By symmetry the four impulses are equal, and their moments cancel in pairs. At rest the four forces are m g/4, equal
    to the last bit.
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
    """A cube of 2 cm flies at 500 m/s at a wall, e = 1: it never passes through, and rebounds at the time x/v.

    Its position is its straight path, folded at the wall. Limit: the impact happens within half a slop of the wall,
    which shifts the path after it by twice that.
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
    Case(
        10, "corner", "sphere into a corner, e = 1", "v' = -v, whichever wall comes first, or all at once", corner,
        peers=True,
    ),
    Case(
        11, "superball", "superball: tangential restitution",
        "v' = v - (2/7)(1+e_t)(v+rω), rω' = rω - (5/7)(1+e_t)(v+rω)", superball,
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
