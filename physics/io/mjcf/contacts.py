"""Conversion of the contact properties of a MuJoCo model's geoms to the contact and friction of a scene.

In MuJoCo bit masks and lists of pairs decide which geoms touch. A pair has the larger friction of its geoms, unless a
priority, a condim or the list decides otherwise; a scene has the rule "maximum" for that, and exceptions for pairs.
Where only some pairs touch, collision groups say which.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import combinations_with_replacement
from typing import Any, NamedTuple

import numpy as np

from physics.io.mjcf.left_out import LeftOut
from physics.io.mjcf.text import ModelError
from physics.scene.effects import Contact, Friction
from physics.scene.groups import assign_groups


@dataclass(frozen=True)
class Surface:
    """Properties of a geom in contact; geoms with equal properties behave alike.

    Attributes
    ----------
    label : str
        Name of the geom in messages; comparisons ignore it.
    line : int
        Line of the geom in the file; comparisons ignore it.
    contype, conaffinity : int
        Bit masks: two geoms touch if the `contype` of one and the `conaffinity` of the other have a common bit.
    condim : int
        1: without friction, 3: friction along the surface.
    friction : float
        Coefficient of friction along the surface.
    priority : int
        The geom of higher priority determines `condim` and `friction` of a pair.
    geom : int
        Number of the geom if the model's list of pairs, or of excluded bodies, names it; else -1.
    """

    label: str = field(compare=False)
    line: int = field(compare=False)
    contype: int
    conaffinity: int
    condim: int
    friction: float
    priority: int = 0
    geom: int = -1


LEAST_FRICTION = 1e-5  # least coefficient in MuJoCo, which raises smaller ones to it

FrictionOf = Callable[[Surface, Surface], "float | None"]


class _Met(NamedTuple):
    """Pair of surfaces and their friction; None: they do not touch."""

    a: Surface
    b: Surface
    friction: float | None


def dynamic_friction(a: Surface, b: Surface) -> float | None:
    """Friction coefficient of two geoms, from their masks, priorities and coefficients; None if they do not touch."""
    if not (a.contype & b.conaffinity or b.contype & a.conaffinity):
        return None
    highest = max(a.priority, b.priority)
    deciding = [surface for surface in (a, b) if surface.priority == highest]
    if max(surface.condim for surface in deciding) == 1:
        return 0.0
    return max(LEAST_FRICTION, *(surface.friction for surface in deciding))


def touched(surface: Surface, others: Iterable[Surface], friction_of: FrictionOf = dynamic_friction) -> bool:
    """True if `surface` touches any of the `others`; `friction_of` returns None for surfaces that do not touch."""
    return any(friction_of(surface, other) is not None for other in others)


class FoundContact(NamedTuple):
    """Contact properties of a model, as a scene has them.

    Attributes
    ----------
    effects : list
        Effects `Contact` and `Friction`.
    bodies, still : list of float or None
        Frictions that bodies that move, and walls and fixed bodies, have of their own.
    groups : dict of Surface to dict
        Arguments `group` and `mask` of a body or wall, by its surface; none for those with the defaults.
    """

    effects: list[Any]
    bodies: list[float | None]
    still: list[float | None]
    groups: dict[Surface, dict[str, int]]


def find_contact(
    bodies: Sequence[Surface],
    still: Sequence[Surface],
    left: LeftOut,
    friction_of: FrictionOf = dynamic_friction,
    ends: Sequence[int] | None = None,
) -> FoundContact:
    """Find the effects `Contact` and `Friction` of a scene, if anything touches, and the frictions of single surfaces.

    Parameters
    ----------
    bodies, still : sequence of Surface
        Surfaces of the bodies that move, and of the walls and fixed bodies.
    left : LeftOut
        Collects a message where some pairs touch, and there are more kinds of these than groups; then all do.
    friction_of : callable
        Returns the friction coefficient of two surfaces, or None if they do not touch.
    ends : sequence of int, optional
        Numbers of `bodies` and of `still` in the scene, -1 - k for wall k. None: `still` are the walls.
    """
    number = Counter(bodies)
    at_still = [_Met(a, b, friction_of(a, b)) for a in number for b in dict.fromkeys(still)]
    between = [
        _Met(a, b, friction_of(a, b)) for a, b in combinations_with_replacement(number, 2) if a != b or number[a] > 1
    ]
    none = FoundContact([], [None] * len(bodies), [None] * len(still), {})
    meet_still, meet_bodies = ({pair.friction is not None for pair in met} for met in (at_still, between))
    if True not in meet_still | meet_bodies:
        return none
    if len(meet_still) == 2 or len(meet_bodies) == 2:
        none = none._replace(groups=_groups([*number], [*dict.fromkeys(still)], at_still + between, left))
    meet_bodies = True in meet_bodies
    if len(bodies) == 1:  # there is no other body: decide as if there were a second one with the same masks
        meet_bodies = friction_of(bodies[0], bodies[0]) is not None
    contact = Contact(between_bodies=meet_bodies)
    found = {pair.friction for pair in at_still + between if pair.friction is not None}
    if len(found) == 1:
        friction = [Friction(mu) for mu in found if mu > 0]
        return none._replace(effects=[contact, *friction])
    own = [max(LEAST_FRICTION, surface.friction) for surface in (*bodies, *still)]
    if ends is None:
        ends = [*range(len(bodies)), *(-1 - k for k in range(len(still)))]
    parts = list(zip(ends, (*bodies, *still)))
    pairs = _exceptions(parts[: len(bodies)], parts[len(bodies) :], meet_bodies, friction_of)
    effect = Friction(max(found), rule="maximum", pairs=pairs)
    return none._replace(effects=[contact, effect], bodies=own[: len(bodies)], still=own[len(bodies) :])


def _exceptions(bodies, still, meet_bodies: bool, friction_of: FrictionOf) -> list[tuple[int, int, float]]:
    """Pairs (end, end, friction) that touch and whose friction is not the larger one of their surfaces.

    `bodies` and `still` hold an end and a surface each. A plane that only some bodies touch, or a pair of bodies that
    pass through each other, keeps the larger one.
    """
    pairs = []
    for i, (end, a) in enumerate(bodies):
        for other, b in [*still, *(bodies[i + 1 :] if meet_bodies else [])]:
            mu = friction_of(a, b)
            if mu is not None and mu != max(LEAST_FRICTION, a.friction, b.friction):
                pairs.append((end, other, mu))
    return pairs


def _groups(
    bodies: list[Surface], still: list[Surface], met: list[_Met], left: LeftOut
) -> dict[Surface, dict[str, int]]:
    """Groups and masks with which those pairs of `met` touch that have a friction; none if there are too many kinds."""
    row = {surface: k for k, surface in enumerate(dict.fromkeys((*bodies, *still)))}
    touching = np.zeros((len(row), len(row)), bool)
    for pair in met:
        touching[row[pair.a], row[pair.b]] |= pair.friction is not None
    found = assign_groups(touching | touching.T)
    if found is None:
        yes, no = (next(pair for pair in met if (pair.friction is None) == apart) for apart in (False, True))
        left.add(
            ModelError(
                f"{yes.a.label} touches {yes.b.label}, and {no.a.label} passes through {no.b.label}; allowed are at "
                "most 32 kinds of geoms that touch different ones",
                no.a.line,
            )
        )
        return {}
    return {surface: {"group": group, "mask": mask} for surface, (group, mask) in zip(row, found)}
