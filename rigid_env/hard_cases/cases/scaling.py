"""Hard cases of symmetry and size: overlap, scaling, distance, rotation, mirroring, time reversal, extreme sizes.

Two runs that should agree are compared. The difference that rounding or a tolerance may cause is measured: a third run
starts with a small displacement, and shows the factor by which the scene amplifies it, its `growth`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

import physics
from physics.rotations import rotation_matrices
from physics.scene.canonical_scenes import GRAVITY, MASS, SIZE
from rigid_env.hard_cases.case import Case, Check, Setting, none_of, within
from rigid_env.hard_cases.cases.scenery import (
    EPS,
    FLOOR,
    attitude,
    block,
    boxed,
    early,
    energy,
    laws,
    none_of_finite,
    on_floor,
)

RADIUS = 0.5 * float(np.linalg.norm(SIZE))  # radius of the block's bounding sphere [m]
TILT = (math.cos(0.2), math.sin(0.2), 0.0, 0.0)
NUDGE = 2.0**-30  # small displacement of a start, to measure how a scene amplifies it [m, m/s]


def overlap(on: Setting) -> Sequence[Check]:
    """Two cubes overlap by a quarter of their edge: they separate without a launch speed.

    Overlapping bodies are pushed apart without a velocity. In free space they keep the speed 0 until they only touch.
    Here the lower cube lies on a floor, and the upper one ends on it. Limit for the speed: that of falling back by a
    slop, and of one step's free fall.
    """
    edge = 1.0
    pair = [physics.Block((edge,) * 3, 1.0, pos=(0, 0.5, 0)), physics.Block((edge,) * 3, 1.0, pos=(0, 1.25, 0))]
    world = on.world(physics.Scene(pair, [FLOOR], laws(0.0, 0.5)))
    fastest, highest = 0.0, 0.0
    for _ in range(on.steps(3.0)):
        world.step()
        fastest = max(fastest, np.abs(world.linvel).max())
        highest = max(highest, world.pos[0, 1, 1])
    slop = 2 * on.slop * edge
    return [
        Check("fastest speed", fastest, math.sqrt(2 * GRAVITY * slop) + GRAVITY * on.dt, "m/s"),
        Check("how far the upper cube rises above its place", highest - 1.5, slop + 64 * EPS, "m"),
        within("where it ends", world.pos[0, 1, 1], 1.5, 2 * slop + 64 * EPS, "m"),
        none_of_finite("numbers that are not finite", world),
    ]


def _throw(scale: float = 1.0, time: float = 1.0, heavy: float = 1.0, offset=(0.0, 0.0, 0.0), boost=(0.0, 0.0, 0.0),
           friction: float = 0.5) -> physics.Scene:  # fmt: skip
    """Scene with the block thrown tilted onto a floor.

    `scale`, `time` and `heavy` multiply lengths, times and masses. `offset` [m] and `boost` [m/s] are added to the
    start's position and velocity before scaling of the velocity; the floor moves with the offset.
    """
    offset = np.asarray(offset)
    body = physics.Block(
        np.array(SIZE) * scale, MASS * heavy, pos=np.array([0.1, 2.6, 0.2]) * scale + offset, quat=TILT,
        linvel=(np.array([1.0, 0.0, 0.5]) + boost) * scale / time, angvel=np.array([0.3, 0.2, 0.1]) / time,
    )  # fmt: skip
    wall = physics.HalfSpace((0, 1, 0), float(offset[1]))
    return physics.Scene([body], [wall], laws(0.25, friction, (0, -GRAVITY * scale / time**2, 0)))


def _path(on: Setting, scene: physics.Scene, seconds: float = 2.0, time: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Positions (10, 3) [m] and rotation matrices (10, 3, 3) of the first body, at ten times within `seconds`.

    `time` multiplies the step of the setting.
    """
    world = replace(on, dt=on.dt * time).world(scene)
    places, attitudes = [], []
    for _ in range(10):
        world.step(steps=max(1, round(seconds / on.dt / 10)))
        places.append(np.array(world.pos[0, 0]))
        attitudes.append(attitude(world))
    return np.array(places), np.array(attitudes)


def _apart(one, other) -> float:
    """Largest difference of two paths from `_path`: of positions, and of rotations times the block's radius [m]."""
    return max(float(np.abs(one[0] - other[0]).max()), RADIUS * float(np.abs(one[1] - other[1]).max()))


def _growth(on: Setting, make: Callable[..., physics.Scene], path) -> float:
    """Factor, at least 1, by which the scene amplifies a small change of its start: the largest for three directions.

    `make` makes the scene with an offset and a boost, and `path` is its undisturbed path.
    """
    nudges = np.eye(3) * NUDGE
    return max(1.0, *(_apart(_path(on, make(offset=tuple(nudge * (1, 0, 1)), boost=tuple(nudge))), path) / NUDGE
                      for nudge in nudges))  # fmt: skip


def powers_of_two(on: Setting) -> Sequence[Check]:
    """Lengths times λ², times times λ, masses times 4, λ = 4 and 2^±10: the same bits, apart from exponents.

    Multiplication by a power of two is exact, so every number of the run differs only by its exponent; gravity is
    multiplied by λ² / λ² = 1. A hidden length, time, mass or tolerance would show.
    """
    path = _path(on, _throw())
    checks = []
    for scale in (4.0, 2.0**10, 2.0**-10):
        other = _path(on, _throw(scale**2, scale, 4.0), time=scale)
        wrong = np.count_nonzero(other[0] != path[0] * scale**2) + np.count_nonzero(other[1] != path[1])
        checks.append(none_of(f"numbers that differ, λ = {scale:g}", wrong))
    return checks


def far_away(on: Setting) -> Sequence[Check]:
    """A scene 1e6 m (2^20 m) from the origin, and one in a frame that moves at 100 m/s: the same motion, to rounding.

    Limit at a distance: positions 2^20 m away are rounded to 1.2e-10 m a few times in each step, times the growth.
    Contact problems that are solved to a tolerance may have other solutions, which differ by the tolerance times the
    body's radius.

    Limit in the moving frame, without friction: each step adds the same h v to the position. While the position stays
    between two powers of two, all these sums are rounded in the same direction, by up to half the last binary digit of
    the final 256 m in each step.
    """
    far, fast = 2.0**20, 128.0
    path = _path(on, _throw())
    growth = _growth(on, _throw, path)
    steps = max(2.0 / on.dt, 1000.0)  # the event-driven scheme chooses its own steps between events
    moved = _path(on, _throw(offset=(far, far, far)))
    off = _apart((moved[0] - far, moved[1]), path)
    still = _path(on, _throw(friction=0.0))
    boosted = _path(on, _throw(boost=(fast, 0.0, fast), friction=0.0))
    t = on.dt * max(1, round(0.2 / on.dt)) * np.arange(1, 11)[:, None]
    drift = _apart((boosted[0] - fast * t * [1, 0, 1], boosted[1]), still)
    rounding = 4 * EPS * far * math.sqrt(steps) + on.tolerance * RADIUS
    moving = 0.5 * EPS * fast * 2.0 * steps + on.tolerance * RADIUS
    return [
        Check("difference, 2^20 m away", off, growth * rounding, "m"),
        Check("difference, moving at 181 m/s", drift, growth * moving, "m"),
    ]


def _turned_scene(Q: np.ndarray, first: int = 0, between: bool = False) -> physics.Scene:
    """Scene of the thrown block and a second one, rotated or mirrored as a whole by the orthogonal matrix Q (3, 3).

    A mirror image of a block is a block: its attitude R becomes Q R S with a reflection S of one of its own axes.
    `first` (0 or 1) is the block that comes first.
    """
    body, handed = _throw().bodies[0], np.linalg.det(Q)
    R = Q @ rotation_matrices(np.array(body.quat)) @ np.diag([1.0, 1.0, handed])
    x, y, z, w = Rotation.from_matrix(R).as_quat()
    bodies = [
        physics.Block(
            SIZE, MASS, pos=Q @ body.pos + 20.0 * k * Q[:, 2], quat=(w, x, y, z), linvel=Q @ body.linvel,
            angvel=handed * (Q @ body.angvel) * (1 + k),
        )
        for k in range(2)
    ]  # fmt: skip
    effects = laws(0.25, 0.5, tuple(Q @ (0.0, -GRAVITY, 0.0)))
    effects[1] = physics.Contact(0.25, between_bodies=False)
    return physics.Scene([bodies[first], bodies[1 - first]], [physics.HalfSpace(Q[:, 1])], effects)


def symmetry(on: Setting) -> Sequence[Check]:
    """A scene rotated by 90° or mirrored has the same motion; with two bodies swapped, the same bits.

    Limit: attitudes of 90° are not exact in binary, and sums are added in another order. This rounds at the start and
    in every step. Contact problems are solved to a tolerance, which adds an error of the tolerance times the body's
    radius. Both errors are multiplied by the scene's growth of small differences.
    """
    path = _path(on, _turned_scene(np.eye(3)))
    growth = _growth(on, _throw, _path(on, _throw()))
    limit = growth * (8 * EPS * 10.0 * math.sqrt(2.0 / on.dt) + on.tolerance * RADIUS)
    quarter = [np.round(Rotation.from_rotvec(axis * math.pi / 2).as_matrix()) for axis in np.eye(3)]
    mirrors = [np.diag(1.0 - 2.0 * axis) for axis in np.eye(3)]
    off = {"turned by 90°": 0.0, "mirrored": 0.0}
    for name, matrices in zip(off, (quarter, mirrors)):
        for Q in matrices:
            places, attitudes = _path(on, _turned_scene(Q))
            back = np.einsum("ji,njk->nik", Q, attitudes) @ np.diag([1.0, 1.0, np.linalg.det(Q)])
            off[name] = max(off[name], _apart((places @ Q, back), path))
    worlds = [on.world(_turned_scene(np.eye(3), first)) for first in (0, 1)]
    for world in worlds:
        world.step(steps=on.steps(2.0))
    swapped = sum(
        np.count_nonzero(np.asarray(getattr(worlds[0], part)) != np.asarray(getattr(worlds[1], part))[:, ::-1])
        for part in ("pos", "quat", "linvel", "angvel")
    )
    return [
        *(Check(f"difference, {name}", value, limit, "m") for name, value in off.items()),
        none_of("numbers that differ with the bodies swapped", swapped),
    ]


def backwards(on: Setting) -> Sequence[Check]:
    """With e = 1 and μ = 0, everything returns to the start after all velocities are reversed.

    The sphere in a box returns after 1000 hits, to rounding (case 8). The block tumbling in the box returns after 2 s
    and a few hits: a hit is at most half a slop off its position, and this is amplified by the growth of a nudge.
    """
    half, checks = 5.0, []
    start, velocity, hits = np.array([0.3, -1.1, 2.0]), np.array([3.0, 4.0, 5.0]), on.pick(1000, 200)
    world = on.world(boxed(physics.Sphere(0.5, 1.0, pos=start, linvel=velocity), (half,) * 3, 1.0))
    steps = on.steps(hits * 2 * (half - 0.5) / velocity.sum())
    back = _there_and_back(world, steps)
    limit = 2 * (EPS * half * (steps + 2 * hits) + hits * early(on, world.scene.bodies[0]))
    checks.append(Check(f"sphere, {hits} hits", np.abs(back - start).max(), limit, "m"))

    def tumbling(nudge):
        body = block(tuple(nudge), linvel=(3.0, 4.0, 5.0), angvel=(1.0, 2.0, 0.5))
        return on.world(boxed(body, (half,) * 3, 1.0))

    steps = on.steps(2.0)
    ends = []
    for nudge in (np.zeros(3), *(np.eye(3) * NUDGE)):
        world = tumbling(nudge)
        world.step(steps=steps)
        ends.append((np.array(world.pos[0]), attitude(world)[None]))
    growth = max(1.0, *(_apart(end, ends[0]) / NUDGE for end in ends[1:]))
    world = tumbling(np.zeros(3))
    back = _there_and_back(world, steps)
    off = max(np.abs(back).max(), RADIUS * np.abs(attitude(world) - np.eye(3)).max())
    limit = growth * (on.slop * RADIUS + 64 * EPS * half * math.sqrt(steps))
    return [*checks, Check("block, 2 s", off, limit, "m")]


def _there_and_back(world, steps: int) -> np.ndarray:
    """Position (3,) of the first body after `steps` steps, a reversal of all velocities, and `steps` more [m]."""
    world.step(steps=steps)
    world.set_state(linvel=-np.array(world.linvel), angvel=-np.array(world.angvel))
    world.step(steps=steps)
    return np.array(world.pos[0, 0])


BAD = {
    "mass 0": {"mass": 0.0},
    "negative mass": {"mass": -1.0},
    "mass that is not a number": {"mass": math.nan},
    "infinite mass": {"mass": math.inf},
    "an edge of 0": {"size": (1.0, 0.0, 1.0)},
    "a negative edge": {"size": (1.0, -1.0, 1.0)},
    "an infinite edge": {"size": (1.0, math.inf, 1.0)},
    "a quaternion that is not a unit": {"quat": (1.0, 1.0, 0.0, 0.0)},
    "a quaternion of zeros": {"quat": (0.0, 0.0, 0.0, 0.0)},
    "a place that is not a number": {"pos": (0.0, math.nan, 0.0)},
    "an infinite velocity": {"linvel": (0.0, math.inf, 0.0)},
    "an infinite spin": {"angvel": (0.0, 0.0, -math.inf)},
    "moments that break the triangle inequality": {"inertia_body": (1.0, 1.0, 3.0)},
    "a moment of 0": {"inertia_body": (1.0, 1.0, 0.0)},
    "a negative moment": {"inertia_body": (1.0, 1.0, -1.0)},
}


def extremes(on: Setting) -> Sequence[Check]:
    """Masses and sizes times 1e-6 and 1e6 give the scaled motion; a ratio of moments of 1e4 gains no energy.

    As in case 39, but 1e±6 are no powers of two: numbers are rounded in every step, and contact problems are solved to
    the tolerance. Bodies with impossible numbers (`BAD`) must raise a ValueError that says what is allowed.
    """
    path = _path(on, _throw())
    growth = _growth(on, _throw, path)
    rounding = growth * (64 * EPS * math.sqrt(2.0 / on.dt) + on.tolerance * RADIUS)
    checks = []
    for name, scale, time, heavy in (
        ("size 1e-6", 1e-6, 1e-3, 1.0), ("size 1e6", 1e6, 1e3, 1.0), ("mass 1e-6", 1.0, 1.0, 1e-6),
        ("mass 1e6", 1.0, 1.0, 1e6),
    ):  # fmt: skip
        places, attitudes = _path(on, _throw(scale, time, heavy), time=time)
        checks.append(Check(f"difference, {name}", _apart((places / scale, attitudes), path), rounding, "m"))
    body = block((0, 2, 0), quat=TILT, inertia_body=(1e-4, 1.0, 1.0), angvel=(1.0, 2.0, 0.5))
    scene = on_floor(body, 0.0, 0.0)
    world = on.world(scene)
    last, gain = energy(world, scene), 0.0
    for _ in range(on.steps(2.0)):
        world.step()
        now = energy(world, scene)
        gain, last = max(gain, now - last), now
    checks.append(Check("energy gained in a step, moments 1 : 1e4", gain, 4 * on.tolerance * MASS * GRAVITY * 2, "J"))
    return [*checks, none_of("senseless bodies that were taken without a word", sum(map(_is_taken, BAD)))]


def _is_taken(name: str) -> bool:
    try:
        physics.Block(**{"size": (1.0, 1.0, 1.0), "mass": 1.0, **BAD[name]})
    except ValueError as error:
        return len(str(error)) < 20  # it must say what is allowed
    return True


CASES = (
    Case(38, "overlap", "deep initial overlap, 25 %", "comes apart without launch speed", overlap),
    Case(39, "powers-of-two", "lengths by λ², times by λ, powers of two", "the same bits, scaled", powers_of_two),
    Case(40, "far-away", "origin 1e6 m away; a moving frame", "the same to rounding", far_away),
    Case(41, "symmetry", "90° rotations, mirrors, order of bodies", "the same, turned", symmetry),
    Case(42, "backwards", "time reversal, e = 1, μ = 0", "back to the start", backwards),
    Case(46, "extremes", "mass or size 1e-6, 1e6; moments 1 : 1e4; nonsense", "as 39; a clear error", extremes),
)  # fmt: skip
