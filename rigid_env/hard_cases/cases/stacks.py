"""Shared parts of the hard cases of piles: scenes, displacements of bodies, and the load on each body."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

import physics
from rigid_env.hard_cases.case import Check, Setting, none_of

G = 9.81  # [m/s²]
CUBE = (1.0, 1.0, 1.0)  # [m]
FLOOR = physics.HalfSpace((0, 1, 0))

# Displacement at which a body still stands, as a share of its edge, for other engines; ours has a limit by its slop.
STANDING = 0.01


def pile(bodies: Sequence[physics.Body], friction: float = 0.5) -> physics.Scene:
    """Scene of bodies on a floor y = 0, without restitution."""
    return physics.Scene(bodies, [FLOOR], [physics.Gravity((0, -G, 0)), physics.Contact(), physics.Friction(friction)])


def tower(masses: Sequence[float], shifts: np.ndarray | None = None) -> physics.Scene:
    """Scene of stacked unit cubes with these masses [kg]; `shifts` (n, 2) displace them along x and z [m]."""
    shifts = np.zeros((len(masses), 2)) if shifts is None else shifts
    return pile(
        [physics.Block(CUBE, m, pos=(x, k + 0.5, z)) for k, (m, (x, z)) in enumerate(zip(masses, shifts.tolist()))]
    )


def farthest(world, start: np.ndarray) -> float:
    """Largest displacement of any body from its position in `start`, along any axis [m]."""
    return float(np.abs(world.pos - start).max())


def loads(world: physics.World) -> np.ndarray:
    """Vertical force (bodies,) from below on every body [N]; all contacts must be with neighbours above or below."""
    found = np.zeros(world.body_count)
    for (a, b), force in zip(world.contact_ends().tolist(), world.contacts()[1]):
        lower_is_second = b < 0 or world.pos[0, b, 1] < world.pos[0, a, 1]
        found[a if lower_is_second else b] += abs(force[1])
    return found


def settle(setting: Setting, world, duration: float, enough: float = math.inf) -> tuple[float, int, float]:
    """Simulate a pile, and measure how far its bodies move.

    Parameters
    ----------
    setting : Setting
    world : World
        World of our engine, or of another one (`Setting.maker`).
    duration : float
        [s].
    enough : float
        Displacement that ends the run [m], to show that a pile falls.

    Returns
    -------
    moved, wrong, depth : float, int, float
        Largest displacement at any full second [m], number of seconds with a report that is not OK, and largest
        penetration [m]. The last two are 0 for other engines.
    """
    start = world.pos.copy()
    moved, wrong, depth = 0.0, 0, 0.0
    left = setting.steps(duration)
    while left and moved < enough:
        some = min(left, setting.steps(1.0))
        report = world.step(steps=some)
        left -= some
        moved = max(moved, farthest(world, start))
        if setting.is_ours:
            wrong += not report.ok
            depth = max(depth, float(report.penetration[0]))
    return moved, wrong, depth


def standing(setting: Setting, what: str, moved: float, wrong: int, layers: int, edge: float = 1.0) -> list[Check]:
    """Checks that a pile stands.

    Each contact between two layers may open or close by one slop, the gap that counts as touching, times a cube's
    bounding radius. So the top of n layers may move by n slops.

    Parameters
    ----------
    setting : Setting
    what : str
        Name of the pile.
    moved, wrong : float, int
        Results of `settle`.
    layers : int
        Layers of bodies in the pile.
    edge : float
        Least edge of a body, for the limit of other engines [m].
    """
    if not setting.is_ours:
        return [Check(f"{what}: moved", moved, STANDING * edge, "m")]
    slop = setting.slop * np.sqrt(0.75)
    return [
        Check(f"{what}: moved", moved, layers * slop, "m"),
        none_of(f"{what}: seconds with a contact problem above its tolerance", wrong),
    ]


def load_error(world: physics.World, expected: np.ndarray) -> float:
    """Largest error of the load on a body, as a share of the largest expected load, which is the whole weight."""
    return float(np.abs(loads(world) - expected).max() / expected.max())
