"""Types in public signatures: vectors, named choices, decorated functions."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, TypeVar

Vector = tuple[float, float, float]
"""Type of three numbers of a frozen description, made from any sequence or array of three."""

Quaternion = tuple[float, float, float, float]
"""Type of four numbers (w, x, y, z) of a frozen description."""

Shape = Literal["block", "sphere", "ellipsoid", "hull"]
"""Name of a kind of body."""

Frame = Literal["world", "body"]
"""Name of the frame of a vector."""

Layout = Literal["three", "corner"]
"""Name of a layout of walls."""

Preset = Literal["fast", "balanced", "precise", "reference"]
"""Name of an accuracy."""

SchemeName = Literal["events", "exact", "explicit_euler", "semi_implicit_euler", "midpoint", "rk4"]
"""Name of an integration scheme; see `physics.Accuracy`."""

Function = TypeVar("Function", bound=Callable[..., Any])
"""Type variable of a function whose signature a decorator keeps."""

if TYPE_CHECKING:

    class Effect:
        """Base class of effects, so that checkers see a list of different ones as a list of effects."""

else:
    Effect = object
