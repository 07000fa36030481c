"""Types that stand in public signatures: vectors as they are kept, choices by name, and functions as they are."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, TypeVar

Vector = tuple[float, float, float]
"""Three numbers, kept by a frozen description; any sequence or array of three is taken."""

Quaternion = tuple[float, float, float, float]
"""Four numbers (w, x, y, z), kept likewise."""

Shape = Literal["block", "sphere", "ellipsoid", "hull"]
"""Kind of a body."""

Frame = Literal["world", "body"]
"""Axes of a vector."""

Layout = Literal["three", "corner"]
"""Walls of a canonical scene."""

Preset = Literal["fast", "balanced", "precise", "reference"]
"""Accuracy by name."""

Scheme = Literal["events", "exact", "explicit_euler", "semi_implicit_euler", "midpoint", "rk4"]
"""Integration scheme by name; see `physics.Accuracy`."""

Function = TypeVar("Function", bound=Callable[..., Any])
"""A function that a decorator returns with its signature."""

if TYPE_CHECKING:

    class Effect:
        """Effect of a scene, as checkers see it: a list of different ones is a list of these."""

else:
    Effect = object
