"""Draw random scenes, parameters, states and wrenches for many worlds; `random_scenes` checks laws in them."""

from __future__ import annotations

import numpy as np

import physics
from physics.kernels.state import layout as at
from rigid_env.hard_cases.cases.driven_supports import free_masses

HALF_WIDTH = 10.0  # half width of the closed box that contains each scene [m]
CELL = 5.0  # distance between the places at which several bodies start [m]
LARGEST_EDGE = 2.7  # [m] a cube with this edge has a bounding radius of 2.34 m, so it can turn within its cell

# Exponents of the strongest force over weight, and of the strongest torque over weight times radius. Torques are weaker
# only to save time: the exact rotation is made in parts of 0.06 rad, millions of them in a step at 1e7 rad/s.
STRONGEST_FORCE, STRONGEST_TORQUE = 6, 3

WALLS = tuple(
    physics.HalfSpace(tuple(sign * (k == axis) for k in range(3)), -HALF_WIDTH) for axis in range(3) for sign in (1, -1)
)

BODIES = {
    "block": (physics.Block((1, 2, 3), 1.0),),
    "ellipsoid": (physics.Ellipsoid((0.5, 1, 1.5), 1.0),),
    "bodies": (
        physics.Block((1, 2, 3), 1.0, pos=(-CELL, 0, 0)),
        physics.Block((1, 2, 3), 1.0),
        physics.Block((1, 2, 3), 1.0, pos=(CELL, 0, 0)),
        physics.Sphere(1.0, 1.0, pos=(0, CELL, 0)),
        physics.Sphere(1.0, 1.0, pos=(0, -CELL, 0)),
    ),
}


def scene_of(family: str) -> physics.Scene:
    """Scene of a family of `BODIES`; it fixes which kernels run, and `begin` replaces all of its numbers."""
    effects = [physics.Gravity(), physics.Contact(0.0), physics.Friction(0.0)]
    return physics.Scene(BODIES[family], WALLS, effects)


def log_uniform(rng: np.random.Generator, low: float, high: float, shape) -> np.ndarray:
    """Draw 10**x with x uniform between `low` and `high`."""
    return 10.0 ** rng.uniform(low, high, shape)


def directions(rng: np.random.Generator, shape: tuple[int, ...], size: int = 3) -> np.ndarray:
    """Draw unit vectors (..., size), uniform on the sphere; `shape` are the leading axes."""
    v = rng.normal(size=(*shape, size))
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def begin(world: physics.World, rng: np.random.Generator) -> None:
    """Draw all parameters and states of the worlds of a scene from `scene_of`.

    Edges are 0.1 to 2.7 m, masses 1e-3 to 1e3 kg, gravity 0.01 to 10 m/s² in any direction, speeds 0.01 to 100 m/s,
    spins 0.01 to 1000 rad/s. A third of the worlds has no friction and any restitution, a third has friction (μ up to
    2) and no restitution, and a third has both.
    """
    bodies, shape = world.scene.bodies, (world.worlds, world.body_count)
    size = log_uniform(rng, -1.0, np.log10(LARGEST_EDGE), (*shape, 3))
    for b, body in enumerate(bodies):
        if body.kind == "sphere":
            size[:, b] = size[:, b, :1]
    kind = rng.integers(3, size=world.worlds)
    friction = np.where(kind == 0, 0.0, rng.uniform(0.0, 2.0, world.worlds))
    restitution = np.where(kind == 1, 0.0, rng.uniform(0.0, 1.0, world.worlds))
    gravity = log_uniform(rng, -2, 1, (world.worlds, 1)) * directions(rng, (world.worlds,))
    middle = np.broadcast_to([body.pos for body in bodies], (*shape, 3))
    world.set_state(pos=middle)  # places at which bodies of any size have room
    world.set_parameters(
        mass=log_uniform(rng, -3, 3, shape), size=size, gravity=gravity,
        friction=np.repeat(friction[:, None], world.body_count, 1),
        restitution=np.repeat(restitution[:, None], world.body_count, 1),
    )  # fmt: skip
    world.set_state(
        pos=_places(rng, world, size),
        quat=directions(rng, shape, 4),
        linvel=log_uniform(rng, -2, 2, (*shape, 1)) * directions(rng, shape),
        angvel=log_uniform(rng, -2, 3, (*shape, 1)) * directions(rng, shape),
    )


def _places(rng: np.random.Generator, world: physics.World, size: np.ndarray) -> np.ndarray:
    """Draw starting positions (worlds, bodies, 3) [m]: one body anywhere in the box, several in separate cells."""
    if world.body_count == 1:
        return (HALF_WIDTH - 0.5 * np.linalg.norm(size, axis=-1, keepdims=True)) * rng.uniform(-1, 1, size.shape)
    cells = CELL * (np.array(list(np.ndindex(3, 3, 3))) - 1.0)
    chosen = np.argsort(rng.random((world.worlds, len(cells))), axis=1)[:, : world.body_count]
    return cells[chosen]


def draw_wrench(world: physics.World, rng: np.random.Generator, strongest: float = STRONGEST_FORCE) -> np.ndarray:
    """Draw wrenches (worlds, bodies, 6): forces [N] of 0.01 to 10**strongest times the weight, and torques [N m].

    Torques go up to 1,000 times the weight times the radius. Strong forces are rarer: for 1,000,000 times the weight
    the exponent is -2 + 8 u⁴ with u uniform, which is above 5 in 3 % of the draws.
    """
    shape = (world.worlds, world.body_count, 1)
    weight = free_masses(world).reshape(shape) * np.linalg.norm(world.gravity, axis=-1)[:, None, None]
    radius = world.params[:, at.RADIUS].reshape(shape)
    force = weight * 10.0 ** (-2 + (strongest + 2) * rng.random(shape) ** 4) * directions(rng, shape[:2])
    torque = weight * radius * log_uniform(rng, -2, STRONGEST_TORQUE, shape) * directions(rng, shape[:2])
    return np.concatenate([force, torque], axis=-1)
