"""Effects that a user gives instead of a task's own."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import physics

REPLACES = {
    physics.Gravity: "gravity",
    physics.Contact: "restitution",
    physics.Friction: "friction",
    physics.Wind: "wind",
}
"""Parameter of a task that each effect replaces."""


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
    """Replaced parameters, each with the effect that replaces it."""
    return {REPLACES[type(effect)]: effect for effect in effects if type(effect) in REPLACES}


def refuse_replaced(effects: Sequence, fields: Collection[str], kind: str = "") -> None:
    """Raise a ValueError if an effect replaces one of `fields`; the message begins with `kind`."""
    for field, effect in replaced(effects).items():
        if field in fields:
            raise ValueError(f"{kind}{field} was given, but effects holds {effect!r}; allowed is one of the two")
