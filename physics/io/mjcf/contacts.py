"""Conversion of the contact properties of a MuJoCo model's geoms to the contact and friction of a scene.

In MuJoCo bit masks and lists of pairs decide which geoms touch, and every pair has its own friction. A scene has one
coefficient of friction; its bodies touch all walls or none, and all other bodies or none.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from itertools import combinations_with_replacement
from typing import Any, NamedTuple

from physics.io.mjcf.left_out import LeftOut
from physics.io.mjcf.text import ModelError
from physics.scene.effects import Contact, Friction


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
    """Group of `count` pairs of geoms with the surfaces `a` and `b`, and their friction; None: they do not touch."""

    a: Surface
    b: Surface
    count: int
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


def contact_effects(
    bodies: Sequence[Surface],
    planes: Sequence[Surface],
    left: LeftOut,
    friction_of: FrictionOf = dynamic_friction,
) -> list[Any]:
    """Make the effects `Contact` and `Friction` of a scene; an empty list if nothing touches.

    Parameters
    ----------
    bodies, planes : sequence of Surface
        Surfaces of the bodies, and of the walls.
    left : LeftOut
        Collects the differences between pairs. Where pairs differ in friction the coefficient of most pairs is taken;
        where only some touch, all do.
    friction_of : callable
        Returns the friction coefficient of two surfaces, or None if they do not touch.
    """
    number = Counter(bodies)
    at_planes = [_Met(a, b, n, friction_of(a, b)) for a, n in number.items() for b in dict.fromkeys(planes)]
    between = [
        _Met(a, b, pairs, friction_of(a, b))
        for a, b in combinations_with_replacement(number, 2)
        if (pairs := number[a] * (number[a] - 1) // 2 if a == b else number[a] * number[b])
    ]
    meet_planes = _agreed_contact(at_planes, left)
    meet_bodies = _agreed_contact(between, left)
    if not meet_planes and not meet_bodies:
        return []
    if len(bodies) == 1:  # there is no other body: decide as if there were a second one with the same masks
        meet_bodies = friction_of(bodies[0], bodies[0]) is not None
    friction = _agreed_friction(at_planes + between, left)
    return [Contact(between_bodies=meet_bodies)] + ([Friction(friction)] if friction > 0 else [])


def _agreed_contact(met: list[_Met], left: LeftOut) -> bool:
    """True if any of these pairs touch; if only some do, a message about the others goes to `left`."""
    touching = [pair for pair in met if pair.friction is not None]
    apart = [pair for pair in met if pair.friction is None]
    if touching and apart:
        yes, no = touching[0], apart[0]
        left.add(
            ModelError(
                f"{yes.a.label} touches {yes.b.label}, and {no.a.label} passes through {no.b.label}; allowed is that "
                "bodies touch all planes or none, and each other all or none",
                no.a.line,
            )
        )
    return bool(touching)


def _agreed_friction(met: list[_Met], left: LeftOut) -> float:
    """Friction coefficient that most of the touching pairs have; messages about other coefficients go to `left`."""
    number: Counter[float] = Counter()
    first: dict[float, _Met] = {}
    for pair in met:
        if pair.friction is not None:
            number[pair.friction] += pair.count
            first.setdefault(pair.friction, pair)
    friction = max(number, key=lambda value: (number[value], value))
    for value, pair in first.items():
        if value != friction:
            common = first[friction]
            left.add(
                ModelError(
                    f"friction is {value:g} between {pair.a.label} and {pair.b.label}, and {friction:g} between "
                    f"{common.a.label} and {common.b.label}; allowed is one coefficient",
                    pair.a.line,
                )
            )
    return friction
