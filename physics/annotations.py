"""Types in public signatures: vectors, named choices, decorated functions."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, TypeVar

Vector = tuple[float, float, float]
"""Three floats, as bodies, walls and effects store a vector; users may give any sequence or array of three numbers."""

Quaternion = tuple[float, float, float, float]
"""Four floats (w, x, y, z), as bodies store an attitude; users may give any sequence or array of four numbers."""

Shape = Literal["block", "sphere", "ellipsoid", "hull", "capsule", "cylinder", "compound"]
"""Name of the shape of a body, as in `Body.kind`."""

Frame = Literal["world", "body"]
"""Name of the frame in which a vector's components are given."""

Layout = Literal["three", "corner"]
"""Name of a set of walls: ``three`` for `physics.three_walls`, ``corner`` for `physics.corner`."""

Preset = Literal["fast", "balanced", "precise", "reference"]
"""Name of a preset of accuracy; see `physics.PRESETS`."""

SchemeName = Literal["events", "exact", "explicit_euler", "semi_implicit_euler", "midpoint", "rk4"]
"""Name of an integration scheme, as `physics.Accuracy` explains them."""

Rule = Literal["minimum", "average", "geometric_mean", "product", "maximum"]
"""Name of a rule that combines the coefficients of two bodies, or of a body and a wall."""

End = str | int
"""End of a contact: name of a body or wall, or index of a body, or -1 - k for wall k."""

Pair = tuple[End, End, float]
BodyAxis = tuple[End, Vector]
"""Two ends of a contact, and a coefficient of theirs."""

Function = TypeVar("Function", bound=Callable[..., Any])
"""Type variable for decorators that return a function of the same signature."""

if TYPE_CHECKING:

    class Effect:
        """Common base class of all effects, for type checkers: a list of different effects is then a `list[Effect]`."""

else:
    Effect = object
