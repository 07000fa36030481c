"""Effects that a user gives in place of a task's own."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import physics

REPLACES = {physics.Gravity: "gravity", physics.Contact: "restitution", physics.Friction: "friction"}
"""The parameter of a task that an effect takes the place of."""


def checked_effects(effects, randomised: Collection[str]) -> tuple:
    """The effects as a tuple.

    Raises
    ------
    ValueError
        They are no sequence, or one takes the place of a parameter that is drawn from a range.
    """
    try:
        effects = tuple(effects)
    except TypeError:
        raise ValueError(f"effects is {effects!r}; allowed is a sequence of effects") from None
    for field, effect in replaced(effects).items():
        if field in randomised:
            raise ValueError(f"effects holds {effect!r}, but {field} is drawn from a range; give one of the two")
    return effects


def replaced(effects: Sequence) -> dict[str, object]:
    """Parameters that `effects` take the place of, each with its effect."""
    return {REPLACES[type(effect)]: effect for effect in effects if type(effect) in REPLACES}


def refuse_replaced(effects: Sequence, fields: Collection[str], kind: str = "") -> None:
    """Raise a ValueError if one of `fields`, of a `kind` that the message begins with, is taken by an effect."""
    for field, effect in replaced(effects).items():
        if field in fields:
            raise ValueError(f"{kind}{field} was given, but effects holds {effect!r}; allowed is one of the two")
