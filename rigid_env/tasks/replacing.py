"""Effects that a user gives instead of those of a task's scene."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import physics
from physics.io.plain import read_effects

REPLACES = {
    physics.Gravity: "gravity",
    physics.Contact: "restitution",
    physics.Friction: "friction",
    physics.Wind: "wind",
}
"""Parameter of a task that is fixed by an effect of each class."""


def checked_effects(effects, randomised: Collection[str]) -> tuple:
    """Check a user's effects, and return them as a tuple. Each is an object, or a table as in a scene file.

    `randomised` has the names of the parameters that the task draws from a range.

    Raises
    ------
    ValueError
        `effects` is no sequence, an effect cannot be read, or one fixes a parameter that is drawn from a range.
    """
    try:
        effects = tuple(effects)
    except TypeError:
        raise ValueError(f"effects is {effects!r}; allowed is a sequence of effects") from None
    effects = read_effects(effects)
    for field, effect in replaced(effects).items():
        if field in randomised:
            raise ValueError(f"effects holds {effect!r}, but {field} is drawn from a range; give one of the two")
    return effects


def replaced(effects: Sequence) -> dict[str, object]:
    """Parameters that the given effects fix, each with its effect."""
    return {REPLACES[type(effect)]: effect for effect in effects if type(effect) in REPLACES}


def refuse_replaced(effects: Sequence, fields: Collection[str], kind: str = "") -> None:
    """Raise a ValueError if an effect fixes one of the parameters `fields`; the message begins with the text `kind`."""
    for field, effect in replaced(effects).items():
        if field in fields:
            raise ValueError(f"{kind}{field} was given, but effects holds {effect!r}; allowed is one of the two")
