"""Random scenes with scenery: bodies of all shapes among fixed and driven ones, with groups and materials.

`draw_scene` draws a scene, `begin` its worlds. All scenes have one plan, so that only one is compiled. They alternate:

*Furniture*: six walls, and three fixed bodies of random shapes. One of them moves by a table, one steadily, one never.
A third of the worlds has no motion at all.

*Room*: a closed box, furniture in it, as one driven compound. In two thirds of the worlds it moves at a constant
velocity. There the law of energy holds in its frame, with the work that it does (`driven_supports`).

A driven body never comes so near to a fixed body or to a wall that both could crush one that is between them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

import physics
from physics.annotations import Rule
from physics.kernels.contact_law.materials import RULES
from rigid_env.hard_cases.cases.driven_supports import ROOM
from rigid_env.hard_cases.cases.random_draws import CELL, HALF_WIDTH, WALLS, directions, draw_wrench, log_uniform

KINDS = ("block", "sphere", "ellipsoid", "capsule", "cylinder", "hull", "compound")
FURNITURE = 3
FAR = -1e6  # offset of the walls that nothing touches, beyond a room [m]

# Exponent of the strongest force over weight in a room. Stronger ones press bodies up to 0.7 m deep into its edges,
# where the sides of the compound meet, and sometimes through them.
STRONGEST_IN_ROOM = 3.0

THICKNESS = 2.0  # of the sides of a room [m]
SWING = 0.5  # amplitude of a table [m]
CORNERS = 12  # points whose hull is drawn

# Exponents of edges [m], so that all moving bodies fit between two pieces of furniture; of speeds [m/s] and of spins
# [rad/s] of driven bodies: a step turns them by at most a tenth of a radian.
EDGES, SPEEDS, SPINS = (-1.0, 0.0), (-2.0, 1.0), (-2.0, 1.0)


def draw_scene(rng: np.random.Generator, is_room: bool) -> physics.Scene:
    """Draw a scene; `begin` replaces poses, velocities, and all numbers that may differ from world to world."""
    cells = rng.permutation(CELL * (np.array(list(np.ndindex(3, 3, 3))) - 1.0))
    kinds = rng.permutation(KINDS)
    fixed = [_room(rng, cells)] if is_room else _furniture(rng, kinds, cells)
    moving = [_body(rng, kind, mass=1.0) for kind in (kinds if is_room else kinds[FURNITURE:])]
    moving += [] if is_room else [_body(rng, kind, mass=1.0) for kind in kinds[:FURNITURE]]
    bodies = fixed + [_with(body, pos=tuple(cell)) for body, cell in zip(moving, cells[FURNITURE + 1 :])]
    # The last body passes through the first moving one, and through the walls of a scene with a room.
    bodies[-1] = _with(bodies[-1], group=2)
    bodies[len(fixed)] = _with(bodies[len(fixed)], mask=1)
    walls = [
        physics.HalfSpace(
            wall.normal,
            FAR if is_room else wall.offset,
            friction=0.1 * (k + 1),
            restitution=0.1 * k,
            group=4 if is_room else 1,
        )
        for k, wall in enumerate(WALLS)
    ]
    if is_room:
        bodies = [_with(body, mask=body.mask & 3) for body in bodies]
    pairs = {(len(fixed), len(fixed) + 1): float(rng.random()), (0, len(fixed)): float(rng.random())}
    return physics.Scene(bodies, walls, _effects(rng, pairs))


def _effects(rng: np.random.Generator, pairs: dict[tuple[int, int], float]) -> list[physics.Effect]:
    rules: Sequence[Rule] = [str(rule) for rule in rng.choice(RULES, 2)]
    contact = physics.Contact(0.0, restitution_rule=rules[0], restitution_pairs=pairs)
    return [physics.Gravity(), contact, physics.Friction(0.0, rule=rules[1], pairs=pairs)]


def _with(body: physics.Body, **changes) -> physics.Body:
    """The body with other fields."""
    fields = {name: getattr(body, name) for name in body.__dataclass_fields__ if name != "density"}
    return type(body)(**{**fields, "mass": None if body.fixed else body.mass, **changes})


def _body(rng: np.random.Generator, kind: str, **more) -> physics.Body:
    """Draw a body of a kind."""
    a, b, c = log_uniform(rng, *EDGES, 3).tolist()
    if kind == "block":
        return physics.Block((a, b, c), **more)
    if kind == "sphere":
        return physics.Sphere(0.5 * a, **more)
    if kind == "ellipsoid":
        return physics.Ellipsoid((0.5 * a, 0.5 * b, 0.5 * c), **more)
    if kind == "capsule":
        return physics.Capsule(0.25 * a, 0.5 * b, **more)
    if kind == "cylinder":
        return physics.Cylinder(0.5 * a, b, **more)
    if kind == "hull":
        return physics.Hull(0.5 * directions(rng, (CORNERS,)) * (a, b, c), **more)
    own = {} if more.get("fixed") else {"mass": 1.0}
    own |= {"fixed": True} if more.get("fixed") else {}
    ends = rng.choice(KINDS[:-1], 2)
    parts = [_with(_body(rng, end, **own), pos=place) for end, place in zip(ends, ((0.3, 0, 0), (-0.3, 0.1, 0)))]
    return physics.Compound(parts, **more)


def _furniture(rng: np.random.Generator, kinds: Sequence[str], cells: np.ndarray) -> list[physics.Body]:
    """Three fixed bodies: one moves by a table, one steadily, one never."""
    times = float(log_uniform(rng, -1, 0, ())) * np.linspace(0, 1, 5)
    around = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, 0, 0)]) * SWING
    motions = [physics.Motion.table(times, pos=cells[0] + around, repeat=True), physics.Motion(), None]
    return [
        _with(_body(rng, kind, fixed=True), pos=tuple(cell), quat=tuple(directions(rng, (), 4)), motion=motion)
        for kind, cell, motion in zip(kinds, cells, motions)
    ]


def _room(rng: np.random.Generator, cells: np.ndarray) -> physics.Compound:
    """A closed box of six sides with furniture in it, as one driven body."""
    place, sides = HALF_WIDTH + 0.5 * THICKNESS, []
    for axis in range(3):
        size = [2 * HALF_WIDTH + 2 * THICKNESS] * 3
        size[axis] = THICKNESS
        sides += [
            physics.Block(size, fixed=True, pos=tuple(sign * place * (k == axis) for k in range(3))) for sign in (1, -1)
        ]
    pieces = [
        _with(_body(rng, kind, fixed=True), pos=tuple(cell), quat=tuple(directions(rng, (), 4)))
        for kind, cell in zip(rng.permutation(KINDS[:-1]), cells[: FURNITURE + 1])
    ]
    room = physics.Compound([*sides, *pieces], fixed=True)
    return _with(room, pos=room.centroid, name=ROOM, motion=physics.Motion())


def begin(world: physics.World, rng: np.random.Generator) -> None:
    """Draw parameters, states and motions of all worlds of a scene from `draw_scene`.

    Masses are 1e-3 to 1e3 kg, all other numbers as in `random_draws.begin`.
    """
    bodies, shape = world.scene.bodies, (world.worlds, world.body_count)
    is_fixed = np.array([body.fixed for body in bodies])
    middle = np.broadcast_to([body.pos for body in bodies], (*shape, 3))
    still = np.zeros((*shape, 3))
    world.set_state(pos=middle, linvel=still, angvel=still)
    world.set_parameters(
        mass=np.where(is_fixed, np.inf, log_uniform(rng, -3, 3, shape)), size=_sizes(rng, bodies, world.worlds),
        gravity=log_uniform(rng, -2, 1, (world.worlds, 1)) * directions(rng, (world.worlds,)),
        friction=rng.uniform(0, 2, shape) * rng.integers(2, size=(world.worlds, 1)),
        restitution=rng.random(shape) * rng.integers(2, size=(world.worlds, 1)),
        wall_friction=_own(rng, (world.worlds, len(WALLS)), 2.0),
        wall_restitution=_own(rng, (world.worlds, len(WALLS)), 1.0),
    )  # fmt: skip
    _move(world, rng)
    turn = np.where(is_fixed[:, None], [body.quat for body in bodies], directions(rng, shape, 4))
    free = ~is_fixed[:, None]
    world.set_state(
        quat=turn,
        linvel=free * log_uniform(rng, -2, 2, (*shape, 1)) * directions(rng, shape),
        angvel=free * log_uniform(rng, -2, 3, (*shape, 1)) * directions(rng, shape),
    )


def _own(rng: np.random.Generator, shape: tuple[int, int], most: float) -> np.ndarray:
    """Coefficients of walls, half of them none."""
    return np.where(rng.random(shape) < 0.5, np.nan, rng.uniform(0, most, shape))


def _sizes(rng: np.random.Generator, bodies: Sequence[physics.Body], worlds: int) -> np.ndarray:
    """Sizes (worlds, bodies, 3) [m]; those of hulls and compounds are the scene's."""
    size = log_uniform(rng, *EDGES, (worlds, len(bodies), 3))
    for b, body in enumerate(bodies):
        if body.kind in ("hull", "compound"):
            size[:, b] = 2 * body.dimensions
        elif body.kind == "sphere":
            size[:, b] = size[:, b, :1]
        elif body.kind == "capsule":
            size[:, b, 2] = size[:, b, 0]
            size[:, b, 1] += size[:, b, 0]
        elif body.kind == "cylinder":
            size[:, b, 2] = size[:, b, 0]
    return size


def _move(world: physics.World, rng: np.random.Generator) -> None:
    """Draw the motions of the driven bodies in all worlds."""
    kind, n = rng.integers(3, size=world.worlds), world.worlds
    velocity, spin, surface = (
        log_uniform(rng, *exponents, (n, 1)) * directions(rng, (n,)) for exponents in (SPEEDS, SPINS, SPEEDS)
    )
    if world.scene.bodies[0].name == ROOM:
        free = (kind == 0)[:, None]
        world.set_motion(0, velocity=velocity, spin=free * spin, surface_velocity=0 * surface)
        return
    still = np.flatnonzero(kind == 0)
    for b in range(2):
        world.set_motion(b, motion=physics.Motion(), worlds=still)
    others = np.flatnonzero(kind > 0)
    world.set_motion(0, motion=world.scene.bodies[0].motion, worlds=others)
    world.set_motion(1, spin=spin[others], surface_velocity=surface[others], worlds=others)


def draw_load(world: physics.World, rng: np.random.Generator) -> np.ndarray:
    """Draw wrenches (worlds, bodies, 6): the strongest of `random_draws` among furniture, weaker ones in a room."""
    return draw_wrench(world, rng, *[STRONGEST_IN_ROOM] * (ROOM in world.names))
