"""Hard cases of a body that rotates by radians in a step: a rod near a ball, a cube and a hull, and beside a wall."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

import physics
from rigid_env.hard_cases.case import Case, Check, Setting, none_of
from rigid_env.hard_cases.cases.scenery import FLOOR

HALF, THIN = 1.0, 0.01  # half edges of the rod [m]
REACH = math.hypot(HALF, THIN)  # distance of the rod's corners from its axis of rotation [m]
TURNS = (0.3, 0.7, 1.0, 1.5, 2.0, 2.5, 3.0)  # angles of rotation per step [rad]
MARGIN = 2e-3  # distance by which bodies are within the rod's reach or outside [m]
CLEAR = 0.05  # least angle between the rod and the other body at the start [rad]


def _rod(**start) -> physics.Block:
    return physics.Block((2 * HALF, 2 * THIN, 2 * THIN), 1.0, **start)


def _things() -> dict[str, tuple[physics.Body, float, float]]:
    """Bodies that the rod may hit, by name, with radii [m] of the largest ball inside and the smallest around each."""
    size = 0.1
    corners = tuple(tuple(float(s * size) for s in row) for row in (*np.eye(3), *-np.eye(3)))
    return {
        "ball": (physics.Sphere(size, 1.0), size, size),
        "cube": (physics.Block((2 * size,) * 3, 1.0), size, math.sqrt(3) * size),
        "hull": (physics.Hull(corners, 1.0), size / math.sqrt(3), size),
    }


def _half_turn(on: Setting) -> int:
    """Number of steps after which the slowest rod has rotated by more than π."""
    return math.ceil(math.pi / min(TURNS)) + 1


def _spread(count: int, k: float) -> np.ndarray:
    """`count` numbers evenly spread over 0 to 1, by multiples of √k; the order differs for each k."""
    return np.mod(np.arange(count) * math.sqrt(k) + 0.5, 1.0)


def past_things(on: Setting) -> Sequence[Check]:
    """A rod rotates about its middle by 0.3 to 3 rad per step: it hits all bodies within its reach, and no others.

    The middles of its ends move on a circle of radius 1 m. A body with its centre in the plane of this circle that
    contains a ball of radius r is hit if its centre is nearer than 1 m + r to the rod's middle. A body inside a ball of
    radius R is not hit if its centre is farther than √(1 + b²) m + R, where b is half the rod's width. Bodies are 2 mm
    within or beyond these distances. No other force acts. So a body that was hit moves, and another body has not moved
    by one bit.
    """
    count = on.pick(70, 14)
    turn = np.resize(TURNS, count)
    missed = moved = 0
    for thing, inner, outer in _things().values():
        effects = [physics.Contact(0.5), physics.Friction(0.3)]
        world = on.world(physics.Scene([_rod(pos=(0, 9, 0)), thing], [], effects), count)
        is_far = np.arange(count) % 5 == 4
        far = 2 * outer + (HALF + inner - MARGIN - 2 * outer) * _spread(count, 2)
        far = np.where(is_far, REACH * 1.0001 + outer + MARGIN, far)
        room = np.arcsin(np.minimum((outer + 2 * THIN) / far, 1.0)) + CLEAR
        angle = room + (math.pi - 2 * room) * _spread(count, 3)
        pos, quat, angvel = np.zeros((count, 2, 3)), np.zeros((count, 2, 4)), np.zeros((count, 2, 3))
        pos[:, 1] = far[:, None] * np.c_[np.cos(angle), np.sin(angle), np.zeros(count)]
        quat[:, 0, 0] = 1.0
        quat[:, 1] = Rotation.from_euler("xyz", 6 * np.c_[_spread(count, 5), _spread(count, 6), turn]).as_quat()
        angvel[:, 0, 2] = turn / on.dt
        world.set_state(pos, quat, np.zeros_like(pos), angvel)
        world.step(steps=_half_turn(on))
        has_moved = (np.asarray(world.linvel)[:, 1] != 0).any(axis=1)
        missed += int((~has_moved & ~is_far).sum())
        moved += int((has_moved & is_far).sum())
    return [none_of(f"bodies that were missed, {3 * count} placements", missed), none_of("struck out of reach", moved)]


def beside_wall(on: Setting) -> Sequence[Check]:
    """A rod rotates by 0.3 to 3 rad per step about its middle, lower than half its length: its end hits the wall below.

    Its corners move on circles of radius √(1 + b²) m, where b is half its width; within half a turn one of them would
    be as far below the middle. A rod that is higher by 2 mm keeps its velocity, 0, to the last bit; a lower one is
    pushed up. In the end no corner is deeper in the wall than two slops.
    """
    count = on.pick(70, 14)
    turn = np.resize(TURNS, count)
    scene = physics.Scene([_rod(pos=(0, 2, 0))], [FLOOR], [physics.Contact(0.5), physics.Friction(0.3)])
    world = on.world(scene, count)
    is_high = np.arange(count) % 5 == 4
    height = np.where(is_high, REACH + MARGIN, 3 * THIN + (REACH - MARGIN - 3 * THIN) * _spread(count, 2))
    zero = np.zeros(count)
    world.set_state(
        np.c_[zero, height, zero], np.c_[zero + 1, zero, zero, zero], np.zeros((count, 3)),
        np.c_[zero, zero, turn / on.dt],
    )  # fmt: skip
    world.step(steps=_half_turn(on))
    has_moved = (np.asarray(world.linvel)[:, 0] != 0).any(axis=1)
    R = Rotation.from_quat(np.asarray(world.quat)[:, 0][:, [1, 2, 3, 0]]).as_matrix()
    lowest = np.asarray(world.pos)[:, 0, 1] - np.abs(R[:, 1] * np.array([HALF, THIN, THIN])).sum(axis=1)
    radius = math.sqrt(HALF**2 + 2 * THIN**2)
    return [
        none_of(f"rods that went through the wall, {count} placements", int((~has_moved & ~is_high).sum())),
        none_of("pushed out of reach", int((has_moved & is_high).sum())),
        Check("deepest corner at the end", -lowest.min(), 2 * on.slop * radius + 1e-15, "m"),
    ]


CASES = (
    Case(
        50, "turning-rod", "rod that turns by 0.3 to 3 rad a step past a ball, a cube and a hull",
        "all that is within its reach is met, and nothing else",
        past_things,
    ),
    Case(
        51, "turning-rod-wall", "rod that turns by 0.3 to 3 rad a step beside a wall",
        "met where it is lower than half its length, and not where it is higher",
        beside_wall,
    ),
)  # fmt: skip
