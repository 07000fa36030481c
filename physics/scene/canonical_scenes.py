"""Canonical scenes, which tests, benchmarks, environments and demonstrations share.

A block in these scenes is always that of the exercise, with edges of 5 x 3 x 2 m and a mass of 6 kg.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from physics.annotations import Effect, Layout
from physics.keywords import nearest_first, no_attribute
from physics.scene.bodies import Block, Ellipsoid, Sphere
from physics.scene.effects import Contact, Friction, Gravity
from physics.scene.force_fields import AngularDrag, Drag, Magnus
from physics.scene.scene import HalfSpace, Scene, corner, three_walls

SIZE = (5.0, 3.0, 2.0)  # of the block [m]
MASS = 6.0  # of the block [kg]
GRAVITY = 9.81  # [m/s²]
HALF_WIDTH = 10.0  # of the three-wall box [m]


def block_in_box(
    pos: ArrayLike = (0.0, 6.0, 0.0),
    restitution: float | None = 0.3,
    friction: float | None = 0.5,
    walls: Layout = "three",
    **start: Any,
) -> Scene:
    """Make a scene with gravity and a block of `SIZE` [m] and `MASS` [kg] among three walls.

    Parameters
    ----------
    pos : (3,) array_like
        Centre of mass at the start, world frame [m].
    restitution, friction : float or None
        Coefficients e and μ. None: plastic impacts, and no friction.
    walls : str
        ``three`` for `three_walls`, ``corner`` for `corner`.
    **start
        `quat`, `linvel` and `angvel` of the block, as of `Block`.
    """
    layouts = {"three": lambda: three_walls(HALF_WIDTH), "corner": corner}
    if walls not in layouts:
        raise ValueError(f"walls is {walls!r}; allowed are {', '.join(layouts)}")
    effects: list[Effect] = [Gravity((0.0, -GRAVITY, 0.0)), Contact(restitution)]
    if friction is not None:
        effects.append(Friction(friction))
    return Scene([Block(SIZE, MASS, pos=pos, **start)], layouts[walls](), effects)


def drop() -> Scene:
    """The exercise: a block, slightly turned and spinning, falls into a box of three walls."""
    tilt = 0.25  # [rad] about (1, 1, 0)
    s = math.sin(tilt / 2) / math.sqrt(2)
    return block_in_box((0.0, 6.0, 0.0), quat=(math.cos(tilt / 2), s, s, 0.0), angvel=(0.3, 0.2, 0.1))


def flight() -> Scene:
    """A block tumbling in free flight high above the floor, turning nearly about its intermediate axis."""
    return block_in_box((0.0, 1e6, 0.0), angvel=(0.1, 5.0, 0.1))


def tumble() -> Scene:
    """A block tumbling in empty space: no gravity, no walls."""
    return Scene([Block(SIZE, MASS, angvel=(0.1, 5.0, 0.1))])


def rest() -> Scene:
    """A block at rest face down on the floor of a box of three walls: four contacts."""
    return block_in_box((0.0, SIZE[1] / 2, 0.0))


def shove() -> Scene:
    """A block at rest on the floor of a box of three walls, to be shoved about by random wrenches of the caller."""
    return block_in_box((0.0, SIZE[1] / 2, 0.0))


def corner_drop() -> Scene:
    """A block, turned, falls into the corner of three walls at right angles."""
    half = 0.5 * 0.7
    s = math.sin(half) / math.sqrt(3)
    return block_in_box((3.5, 5.0, 3.5), walls="corner", quat=(math.cos(half), s, s, s), linvel=(-1.5, 0.0, -1.0))


def slide(speed: float = 3.0, friction: float = 0.3) -> Scene:
    """A block slides over an endless floor along x until friction stops it, after the distance v²/(2 μ g).

    v is `speed` [m/s], μ is `friction`.
    """
    body = Block(SIZE, MASS, pos=(0.0, SIZE[1] / 2, 0.0), linvel=(speed, 0.0, 0.0))
    return Scene([body], [HalfSpace((0, 1, 0))], [Gravity((0, -GRAVITY, 0)), Contact(), Friction(friction)])


def incline(angle: float, friction: float) -> Scene:
    """A block face down on an incline that falls along +x, by `angle` [rad]; the wall is tilted, gravity is not.

    `friction` is the coefficient μ.
    """
    normal = (math.sin(angle), math.cos(angle), 0.0)
    half = SIZE[1] / 2
    body = Block(
        SIZE, MASS, pos=(half * normal[0], half * normal[1], 0.0),
        quat=(math.cos(angle / 2), 0.0, 0.0, -math.sin(angle / 2)),
    )  # fmt: skip
    return Scene([body], [HalfSpace(normal)], [Gravity((0, -GRAVITY, 0)), Contact(), Friction(friction)])


def ramp(angle: float = 0.4, friction: float = 0.2) -> Scene:
    """A block slides down a fixed ramp, tips over its end, and falls onto a floor.

    The ramp falls along +x by `angle` [rad]; `friction` is the coefficient μ. The ramp is body 1, "ramp".
    """
    length, thickness, height, way = 16.0, 1.0, 8.0, 6.0  # of the ramp, of its end above the floor, of the slide [m]
    down, up = (math.cos(angle), -math.sin(angle)), (math.sin(angle), math.cos(angle))
    turn = (math.cos(angle / 2), 0.0, 0.0, -math.sin(angle / 2))

    def place(along: float, above: float) -> tuple[float, float, float]:
        """Point at a distance `along` the ramp before its end and a height `above` it, world frame [m]."""
        return above * up[0] - along * down[0], height + above * up[1] - along * down[1], 0.0

    block = Block(SIZE, MASS, pos=place(way, SIZE[1] / 2), quat=turn)
    support = Block((length, thickness, 6.0), pos=place(length / 2, -thickness / 2), quat=turn, fixed=True, name="ramp")
    effects: list[Effect] = [Gravity((0, -GRAVITY, 0)), Contact(), Friction(friction)]
    return Scene([block, support], [HalfSpace((0, 1, 0))], effects)


def bounce(height: float = 1.0, restitution: float = 1.0) -> Scene:
    """A block dropped face down on an endless floor without friction.

    Its lowest face starts at `height` [m] above the floor; `restitution` is 1 for an elastic block.
    """
    body = Block(SIZE, MASS, pos=(0.0, SIZE[1] / 2 + height, 0.0))
    return Scene([body], [HalfSpace((0, 1, 0))], [Gravity((0, -GRAVITY, 0)), Contact(restitution)])


def rolling_sphere(speed: float = 5.0, friction: float = 0.2) -> Scene:
    """A sphere of radius 1 m and 1 kg slides over the floor until it rolls, at 5/7 of its speed [m/s]."""
    body = Sphere(1.0, 1.0, pos=(0.0, 1.0, 0.0), linvel=(speed, 0.0, 0.0))
    return Scene([body], [HalfSpace((0, 1, 0))], [Gravity((0, -GRAVITY, 0)), Contact(), Friction(friction)])


def vertex_drop(restitution: float = 0.3, friction: float = 0.5) -> Scene:
    """A block, turned by 0.7 rad about (1, 1, 0), dropped from rest with its lowest vertex 1 m above the floor."""
    half, clearance = 0.5 * 0.7, 1.0
    s = math.sin(half) / math.sqrt(2)
    # Height of the centre above the lowest vertex: Σ a_i |y·e_i|, the second row of the rotation matrix.
    row = (2 * s * s, 1 - 2 * s * s, 2 * s * math.cos(half))
    height = sum(0.5 * size * abs(c) for size, c in zip(SIZE, row))
    body = Block(SIZE, MASS, pos=(0.0, height + clearance, 0.0), quat=(math.cos(half), s, s, 0.0))
    effects: list[Effect] = [Gravity((0, -GRAVITY, 0)), Contact(restitution), Friction(friction)]
    return Scene([body], [HalfSpace((0, 1, 0))], effects)


def closed_box(half: float = 5.0) -> Scene:
    """An elastic block tumbling without gravity or friction in a closed box of six walls; the motion is chaotic.

    The walls are at ±`half` [m] on all axes.
    """
    normals = [tuple(sign * (axis == k) for k in range(3)) for axis in range(3) for sign in (1.0, -1.0)]
    body = Block(SIZE, MASS, linvel=(3.0, 4.0, 5.0), angvel=(1.0, 2.0, 0.5))
    return Scene([body], [HalfSpace(normal, -half) for normal in normals], [Contact(1.0)])


def tower(count: int = 10, top: float = 1.0) -> Scene:
    """Unit cubes of 1 kg standing on each other on an endless floor.

    There are `count` cubes; the top one has the mass `top` [kg].
    """
    masses = [1.0] * (count - 1) + [top]
    bodies = [Block((1.0, 1.0, 1.0), mass, pos=(0.0, k + 0.5, 0.0)) for k, mass in enumerate(masses)]
    return Scene(bodies, [HalfSpace((0, 1, 0))], [Gravity((0, -GRAVITY, 0)), Contact(), Friction(0.5)])


def heap(count: int = 100, seed: int = 1) -> Scene:
    """Unit cubes of 1 kg, turned at random, falling in layers of 5 x 5 into a shaft of 9 m x 9 m.

    There are `count` cubes; `seed` decides their attitudes.
    """
    rng = np.random.default_rng(seed)
    pitch = 1.75  # of the grid of starting positions [m]; the diagonal of a cube is 1.732 m
    bodies = []
    for k in range(count):
        q = rng.standard_normal(4)
        place = (pitch * (k % 5 - 2), pitch * (k // 25) + 1.0, pitch * (k // 5 % 5 - 2))
        bodies.append(Block((1.0, 1.0, 1.0), 1.0, pos=place, quat=q / np.linalg.norm(q)))
    normals = [(0, 1, 0), (1, 0, 0), (-1, 0, 0), (0, 0, 1), (0, 0, -1)]
    walls = [HalfSpace(normal, 0.0 if normal[1] else -4.5) for normal in normals]
    return Scene(bodies, walls, [Gravity((0, -GRAVITY, 0)), Contact(), Friction(0.5)])


def football() -> Scene:
    """The football of the course notes in flight: kicked at 25 m/s, spinning about an axis slightly off its long axis.

    Gravity exerts no torque on it. The air exerts drag and lift, and slowly brakes the spin.
    """
    launch, spin = 0.6, 50.0  # [rad] above the horizon, [rad/s] about the long axis
    c, s = math.cos(launch), math.sin(launch)
    ball = Ellipsoid(
        (0.14, 0.085, 0.085), 0.41, pos=(0.0, 1.0, 0.0), quat=(math.cos(launch / 2), 0.0, 0.0, math.sin(launch / 2)),
        linvel=(25.0 * c, 25.0 * s, 0.0), angvel=(spin * c - 2.0 * s, spin * s + 2.0 * c, 1.0),
    )  # fmt: skip
    return Scene([ball], [], [Gravity((0, -GRAVITY, 0)), Drag(0.2), Magnus(), AngularDrag(1e-6)])


SCENES = {
    function.__name__: function
    for function in (
        drop, flight, tumble, rest, shove, corner_drop, slide, ramp, bounce, rolling_sphere, vertex_drop, closed_box,
        tower, heap, football,
    )
}  # fmt: skip


def _steep_incline() -> Scene:
    """A block face down on an incline of 20 degrees, on which friction just holds it."""
    angle = math.radians(20.0)
    return incline(angle, 1.01 * math.tan(angle))


SCENES["incline"] = _steep_incline


def about(name: str) -> str:
    """Describe the canonical scene of this name in one line: the first line of its function's docstring."""
    return (SCENES[name].__doc__ or name).splitlines()[0].rstrip(".")


def by_name(name: str) -> Scene:
    """Make the canonical scene of this name, one of `SCENES`; ValueError for other names."""
    if name not in SCENES:
        raise ValueError(f"scene is {name!r}; allowed are {', '.join(nearest_first(name, sorted(SCENES)))}")
    return SCENES[name]()


if not TYPE_CHECKING:  # else a type checker would accept every name as an attribute of the module

    def __getattr__(name: str) -> object:
        raise no_attribute("physics.scenes", name, [*SCENES, "SCENES", "about", "block_in_box", "by_name"])
