"""A body at rest stays at rest wherever friction can bear its loads, at the event-driven presets.

A linear program finds the limit.
"""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

import physics
from tests.reference.static_load import largest_share
from tests.tiers.sweep import sweep

MASS, GRAVITY, FRICTION = 6.0, 9.81, 0.5
SIZE = np.array([5.0, 3.0, 2.0])
EXACT = sweep(["precise", "reference"], ["precise"])
UP, RIGHT = np.array([0.0, 1.0, 0.0]), np.array([1.0, 0.0, 0.0])
WEIGHT = np.array([0.0, -MASS * GRAVITY, 0.0, 0.0, 0.0, 0.0])


def turn(yaw: float) -> np.ndarray:
    c, s = np.cos(yaw), np.sin(yaw)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def corners(yaw: float = 0.0, size: np.ndarray = SIZE) -> np.ndarray:
    """Corners of the block, from its centre."""
    signs = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
    return (0.5 * signs * size) @ turn(yaw).T


def resting_block(
    accuracy: str,
    yaw: float = 0.0,
    walls: tuple = (),
    friction: physics.Friction | None = None,
    size: np.ndarray = SIZE,
) -> physics.World:
    """World with the block at rest on the floor."""
    body = physics.Block(size, MASS, pos=0.5 * size[1] * UP, quat=(np.cos(yaw / 2), 0.0, np.sin(yaw / 2), 0.0))
    effects = [physics.Gravity(), physics.Contact(restitution=0.2), friction or physics.Friction(FRICTION)]
    return physics.World(physics.Scene([body], [physics.HalfSpace(UP), *walls], effects), accuracy=accuracy, dt=5e-3)


def speed_after(world: physics.World, load: np.ndarray, steps: int = 5) -> float:
    world.step(load[None, None], steps=steps)
    return float(np.abs([world.linvel, world.angvel]).max())


def random_load(rng: np.random.Generator, yaw: float) -> tuple[np.ndarray, np.ndarray]:
    """Load that presses within the face, off its centre, and one that pushes along it and turns; both about the centre.

    The second has no moment that tips the block: it is about the block's underside.
    """
    push, spin = rng.normal(size=2) * 10.0, rng.normal() * 20.0
    down = rng.uniform(0.0, 1.0) * MASS * GRAVITY
    place = turn(yaw) @ (rng.uniform(-0.95, 0.95, 3) * [2.5, 0.0, 1.0]) - 1.5 * UP
    pressing = np.append(-down * UP, np.cross(place, -(down + MASS * GRAVITY) * UP))
    along = np.array([push[0], 0.0, push[1]])
    return pressing, np.append(along, np.cross(-1.5 * UP, along) + spin * UP)


def loads(seed: int, count: int, friction: float | tuple = FRICTION):
    """Yield random yaws and loads: (yaw, pressing load, growing load at the limit of friction)."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yaw = rng.uniform(0.0, np.pi)
        pressing, growing = random_load(rng, yaw)
        underside = corners(yaw)[corners(yaw)[:, 1] < 0]
        limit = largest_share(underside, np.tile(UP, (4, 1)), friction, pressing + WEIGHT, growing)
        yield yaw, pressing, limit * growing


@pytest.mark.parametrize("accuracy", EXACT)
def test_a_block_holds_to_the_limit_of_friction(accuracy):
    """At 99.5 % of what friction can hold nothing moves, to the last bit; at 100.5 % all blocks move.

    The linear program is right to 1.9e-5, since the polygon is inside the disk.
    """
    for yaw, pressing, limit in loads(3, 12):
        assert speed_after(resting_block(accuracy, yaw), pressing + 0.995 * limit) == 0.0
        assert speed_after(resting_block(accuracy, yaw), pressing + 1.005 * limit, steps=1) > 0.0


@pytest.mark.exhaustive
@pytest.mark.parametrize(
    ("accuracy", "share"), [("precise", 0.999), ("reference", 0.999), ("fast", 0.8), ("balanced", 0.8)]
)
def test_many_loads_hold(accuracy, share):
    """300 loads at 99.9 % of the limit; in time stepping at 80 %, above which its sharing may let some blocks slide."""
    for yaw, pressing, limit in loads(4, 300):
        assert speed_after(resting_block(accuracy, yaw), pressing + share * limit) == 0.0


@pytest.mark.exhaustive
@pytest.mark.parametrize("accuracy", ["precise", "reference"])
def test_it_holds_in_a_corner(accuracy):
    """A block pressed against a wall, too: six corners at two walls share the load."""
    rng = np.random.default_rng(5)
    wall = physics.HalfSpace(-RIGHT, -0.5 * SIZE[0])
    below, beside = corners()[:, 1] < 0, corners()[:, 0] > 0
    points = np.vstack([corners()[below], corners()[beside]])
    normals = np.vstack([np.tile(UP, (4, 1)), np.tile(-RIGHT, (4, 1))])
    for _ in range(12):
        pressing = np.array([rng.uniform(20.0, 80.0), 0.0, 0.0, 0.0, 0.0, 0.0])
        growing = np.append([0.0, rng.uniform(0.0, 10.0), rng.normal() * 10.0], rng.normal(size=3) * 10.0)
        limit = largest_share(points, normals, FRICTION, pressing + WEIGHT, growing)
        assert speed_after(resting_block(accuracy, walls=(wall,)), pressing + 0.995 * limit * growing) == 0.0
        assert speed_after(resting_block(accuracy, walls=(wall,)), pressing + 1.005 * limit * growing, steps=1) > 0.0


@pytest.mark.exhaustive
@pytest.mark.parametrize("accuracy", ["precise", "reference"])
def test_it_holds_with_two_coefficients(accuracy):
    """Friction that is 0.5 along the diagonal of the floor, and 0.2 across it."""
    axis = np.array([1.0, 0.0, 1.0]) / np.sqrt(2.0)
    friction = physics.Friction((0.5, 0.2), axis=axis)
    for yaw, pressing, limit in loads(6, 12, (0.5, 0.2, axis)):
        assert speed_after(resting_block(accuracy, yaw, friction=friction), pressing + 0.995 * limit) == 0.0


def test_its_forces_are_the_least():
    """They balance the load, are in their cones, and no other such forces have a smaller sum of squares.

    The load is that of a policy of BlockReachGoal, at 98.8 % of the limit. SLSQP, a general solver, ends within 1e-6 of
    the same sum.
    """
    yaw, size = 0.9005, np.array([5.0, 2.0, 3.0])
    load = np.array([-43.096, -30.543, -4.012, 44.235, -40.783, -42.347])
    world = resting_block("precise", yaw, size=size)
    underside = corners(yaw, size)[corners(yaw, size)[:, 1] < 0]
    assert speed_after(world, load) == 0.0
    points, forces = world.contacts()
    arms = points - world.pos[0, 0]
    total = np.append(forces.sum(axis=0), np.cross(arms, forces).sum(axis=0))
    np.testing.assert_allclose(total, -(load + WEIGHT), atol=1e-11 * MASS * GRAVITY * 5.0)
    assert (np.hypot(forces[:, 0], forces[:, 2]) <= FRICTION * forces[:, 1] * (1 + 1e-12)).all()

    def miss(f):
        f = f.reshape(4, 3)
        return np.append(f.sum(axis=0), np.cross(underside, f).sum(axis=0)) + load + WEIGHT

    def slack(f):
        f = f.reshape(4, 3)
        return np.append((FRICTION * f[:, 1]) ** 2 - f[:, 0] ** 2 - f[:, 2] ** 2, f[:, 1])

    found = minimize(
        lambda f: f @ f, np.tile(forces.sum(axis=0) / 4, 4), jac=lambda f: 2 * f, method="SLSQP",
        constraints=[{"type": "eq", "fun": miss}, {"type": "ineq", "fun": slack}],
        options={"maxiter": 500, "ftol": 1e-12},
    )  # fmt: skip
    assert found.success
    assert (forces**2).sum() == pytest.approx(found.fun, rel=1e-6)
