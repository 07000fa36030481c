"""Collision groups: which bodies and walls may touch each other, by bit masks of bodies and walls.

Reference: two ends touch if the group of each has a bit in common with the mask of the other, as in Box2D and Bullet.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from physics.summary import shown

if TYPE_CHECKING:
    from physics.scene.bodies import Body
    from physics.scene.scene import Scene

GROUP = 1
"""Default group of bodies and walls: bit 0."""

MASK = 2**32 - 1
"""Default mask of bodies and walls: the bits of all groups. Also the largest number that a mask may be."""


def check_groups(item: Any, prefix: str = "") -> None:
    """Check `group` and `mask` of a body or wall, and make them of type int; `prefix` stands before names in errors."""
    for name in ("group", "mask"):
        value = getattr(item, name)
        if isinstance(value, (bool, np.bool_)) or not isinstance(value, (int, np.integer)) or not 0 <= value <= MASK:
            raise ValueError(
                f"{prefix}{name} is {shown(value)}; allowed are whole numbers from 0 to {MASK}, each bit a group: "
                "1 << k for group k, 0 for none"
            )
        object.__setattr__(item, name, int(value))


def group_table(scene: Scene) -> np.ndarray | None:
    """Group and mask of each body, and behind the bodies of each wall, (bodies + walls, 2) int64.

    None if all have the defaults, so that all may touch.
    """
    items = (*scene.bodies, *scene.walls)
    if all((item.group, item.mask) == (GROUP, MASK) for item in items):
        return None
    return np.array([(item.group, item.mask) for item in items], np.int64)


def may_touch(table: np.ndarray, count: int) -> np.ndarray:
    """True (count, len(table)) where the group and mask of one of the first `count` rows let it touch a row."""
    group, mask = table[:, 0], table[:, 1]
    return ((group[:count, None] & mask) != 0) & ((mask[:count, None] & group) != 0)


def may_meet(a: Body, b: Body, between_bodies: bool) -> bool:
    """True if two different bodies may touch each other, as in the table of `touching_pairs`."""
    fixed = a.fixed + b.fixed
    share = bool(a.group & b.mask) and bool(a.mask & b.group)
    return share and (fixed == 1 or (fixed == 0 and between_bodies))


def touching_pairs(scene: Scene, between_bodies: bool) -> np.ndarray | None:
    """True (bodies, bodies + walls) for a body and a body or wall that may touch; see `potential_pairs`.

    None if groups and masks have their defaults.
    """
    table = group_table(scene)
    return None if table is None else may_touch(table, len(scene.bodies)) & potential_pairs(scene, between_bodies)


def potential_pairs(scene: Scene, between_bodies: bool) -> np.ndarray:
    """True (bodies, bodies + walls) for a body and a body or wall that may touch if their groups let them.

    A body never touches itself, and a fixed one no wall and no fixed body. Two bodies that move may touch if
    `between_bodies` is True.
    """
    fixed = np.array([body.fixed for body in scene.bodies])
    count = np.add.outer(fixed.astype(np.int64), fixed)
    pairs = (count == 1) | ((count == 0) & between_bodies & ~np.eye(len(fixed), dtype=bool))
    return np.concatenate((pairs, np.repeat(~fixed[:, None], len(scene.walls), axis=1)), axis=1)


def assign_groups(touching: np.ndarray) -> list[tuple[int, int]] | None:
    """Find a group and a mask for each of n bodies or walls under which exactly the wanted pairs touch.

    Parameters
    ----------
    touching : (n, n) bool
        True for a pair that shall touch; symmetric.

    Returns
    -------
    list of (group, mask), or None
        Bodies and walls with equal rows share a group. None if there are more kinds of rows than bits, 32.
    """
    _, kind = np.unique(touching, axis=0, return_inverse=True)
    kind = kind.ravel()  # some releases of NumPy keep the axis
    if kind.max() >= MASK.bit_length():
        return None
    bits = [sum({1 << int(other) for other in kind[row]}) for row in touching]
    return [(1 << int(k), mask) for k, mask in zip(kind, bits)]
