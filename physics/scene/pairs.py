"""Exceptions for named pairs: coefficients of two bodies, or of a body and a wall, that replace those of a rule."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from physics.annotations import End, Pair, Rule
from physics.kernels.contact_law.materials import RULES
from physics.keywords import nearest_first
from physics.summary import shown

if TYPE_CHECKING:
    from physics.scene.scene import Scene

FRICTION_RULE: Rule = "geometric_mean"
"""Rule of friction unless a scene names another one."""

RESTITUTION_RULE: Rule = "maximum"
"""Rule of restitution unless a scene names another one."""

PAIRS_ALLOWED = (
    """allowed is a dict of two names to a number, as {('die', 'tray'): 0.2}; in a file [["die", "tray", 0.2]]"""
)


def checked_rule(rule: Any, field: str) -> str:
    """Check the name of a rule that combines two coefficients; errors name it `field`."""
    if not isinstance(rule, str) or rule not in RULES:
        names = nearest_first(rule, RULES) if isinstance(rule, str) else RULES
        raise ValueError(f"{field} is {shown(rule)}; allowed are {', '.join(map(repr, names))}")
    return rule


def checked_pairs(given: Any, field: str, check: Callable) -> tuple[Pair, ...]:
    """Check exceptions for pairs; return them as a tuple of (end, end, number).

    Parameters
    ----------
    given : mapping of (end, end) to number, or iterable of (end, end, number)
        An end is a name or an index.
    field : str
        Name of the argument for errors.
    check : callable
        Function of `physics.validation` for a number, such as `non_negative`.

    Raises
    ------
    ValueError
        No such mapping or list, an end that is neither text nor a whole number, a number out of range, or a pair that
        is given twice, in whatever order.
    """
    if isinstance(given, Mapping):
        given = [(*key, value) if isinstance(key, tuple) else (key, value) for key, value in given.items()]
    if isinstance(given, (str, bytes)) or not isinstance(given, Iterable):
        raise ValueError(f"{field} is {shown(given)}; {PAIRS_ALLOWED}")
    found: dict[frozenset, Pair] = {}
    for item in given:
        if isinstance(item, (str, bytes)) or not isinstance(item, Iterable) or len(parts := tuple(item)) != 3:
            raise ValueError(f"{field} holds {shown(item)}; {PAIRS_ALLOWED}")
        a, b, value = parts
        for end in (a, b):
            if not (isinstance(end, str) or _is_index(end)):
                raise ValueError(f"{field} holds the end {shown(end)}; allowed are names and indices")
        a, b = (end if isinstance(end, str) else int(end) for end in (a, b))
        key = frozenset((a, b))
        if key in found:
            raise ValueError(f"{field} holds the pair {shown((a, b))} twice; allowed is one number for a pair")
        found[key] = (a, b, float(check(value, (), f"{field}[{shown((a, b))}]")))
    return tuple(found.values())


def _is_index(value: Any) -> bool:
    return isinstance(value, (int, np.integer)) and not isinstance(value, bool)


def end_index(scene: Scene, end: End, field: str) -> int:
    """Index of the end of a contact: a body of the scene, or -1 - k for wall k.

    `end` is the name of a body or wall, or such an index, as in `World.contacts`.

    Raises
    ------
    ValueError
        The scene has no such body or wall; the message calls the list of pairs `field`.
    """
    names = {body.name: b for b, body in enumerate(scene.bodies) if body.name is not None}
    names.update({wall.name: -1 - k for k, wall in enumerate(scene.walls) if wall.name is not None})
    if isinstance(end, str):
        if end in names:
            return names[end]
    elif -len(scene.walls) <= end < len(scene.bodies):
        return end
    known = nearest_first(end, names) if isinstance(end, str) else list(names)
    indices = f"indices from {-len(scene.walls)} to {len(scene.bodies) - 1} (b: body b, -1 - k: wall k)"
    raise ValueError(f"{field} holds the end {shown(end)}; allowed are {', '.join([*known, indices])}")


def pair_indices(scene: Scene, pairs: tuple[Pair, ...], field: str) -> dict[tuple[int, int], float]:
    """Numbers of exceptions by the indices (a, b) of their ends: bodies a < b, or body a and wall b = -1 - k.

    Raises
    ------
    ValueError
        An end that the scene does not have, a pair without a body or with one body twice, or a pair that is given twice
        under different names. The message calls the list of pairs `field`.
    """
    found: dict[tuple[int, int], float] = {}
    for one, other, value in pairs:
        low, high = sorted(end_index(scene, end, field) for end in (one, other))
        if high < 0 or low == high:
            what = "two walls, which never touch" if high < 0 else "one body twice"
            raise ValueError(
                f"{field} holds the pair {shown((one, other))}, {what}; allowed are two bodies, or a body and a wall"
            )
        key = (high, low) if low < 0 else (low, high)
        if key in found:
            raise ValueError(f"{field} holds the pair {shown((one, other))} twice; allowed is one number for a pair")
        found[key] = value
    return found
