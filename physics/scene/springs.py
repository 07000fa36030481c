"""Springs and pushes: force fields that act at a point of one body, or between two bodies.

Formulas and sources are in `physics.kernels.forces`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from physics import validation
from physics.annotations import Frame, Vector
from physics.kernels.forces import implicit_two_body_spring, spring, two_body_spring
from physics.keywords import known_keywords
from physics.rotations import rotation_matrices
from physics.scene.body_names import body_index
from physics.scene.force_field import Checked, Field

if TYPE_CHECKING:
    from physics.scene.scene import Scene


def _take_end(effect: Any, name: str) -> None:
    """Check the field `name` of a spring or a push, an index or a name of a body; make an index an int."""
    value = getattr(effect, name)
    if not isinstance(value, str):
        object.__setattr__(effect, name, validation.count(value, f"{type(effect).__name__}.{name}", least=0))


def with_indices(effect: Any, scene: Scene) -> Any:
    """Replace names of bodies in a spring or a push by indices in `scene.bodies`; other effects are returned as given.

    Raises
    ------
    ValueError
        The scene has no such body, or both ends of a spring are the same.
    """
    if not isinstance(effect, (Spring, Push)):
        return effect
    ends: dict[str, Any] = {name: getattr(effect, name, None) for name in ("body", "other")}
    named: dict[str, Any] = {
        name: body_index(end, f"{type(effect).__name__}.{name}", scene)
        for name, end in ends.items()
        if isinstance(end, str)
    }
    return replace(effect, **named) if named else effect


def _check_body(effect: Any, body_count: int, name: str) -> None:
    index = getattr(effect, name)
    if index >= body_count:
        raise ValueError(f"{type(effect).__name__}.{name} is {index}; allowed are indices below {body_count}")


def check_ends(effect: Any, bodies: Sequence[Any]) -> None:
    """Raise a ValueError if a spring or a push acts on a fixed body, which no force moves.

    `bodies` are those of the scene. The message about a spring names the anchor in the world that does the same.
    """
    if not isinstance(effect, (Spring, Push)):
        return
    name, none = type(effect).__name__, "allowed are bodies that are not fixed"
    other = getattr(effect, "other", None)
    if bodies[effect.body].fixed:
        if other is not None and not bodies[other].fixed:
            none += f": exchange the ends of the spring, with body={other} and an anchor in the world"
        raise ValueError(f"{name}.body is {effect.body}, a fixed body; {none}")
    if isinstance(effect, Spring) and other is not None and bodies[other].fixed:
        held = bodies[other]
        anchor = np.array(held.pos) + rotation_matrices(np.array(held.quat)) @ np.array(effect.anchor)
        raise ValueError(
            f"{name}.other is {other}, a fixed body; {none}, or an anchor in the world: anchor={tuple(anchor.tolist())}"
        )


@known_keywords
@dataclass(frozen=True)
class Spring(Checked):
    """Spring and damper from a point of a body to an anchor: force ``-(k (l - l0) + c dl/dt)`` along their line.

    A scene may hold any number of springs.

    Parameters
    ----------
    anchor : (3,) array_like
        Fixed anchor, world frame [m]. With `other` it is a point of that body: body frame, from its centre of mass.
    point : (3,) array_like
        Point of the body to which the spring is fixed: body frame, from the centre of mass [m].
    stiffness : float
        Stiffness k [N/m].
    damping : float
        Damping constant c [N s/m].
    length : float
        Rest length l0 [m].
    body : int or str
        Index of the body in `Scene.bodies`, or its name, which a `Scene` replaces by the index.
    other : int, str or None
        Index or name of another body that holds the anchor and gets the opposite force. None: the anchor is fixed in
        the world.
    """

    anchor: Vector = (0.0, 0.0, 0.0)
    point: Vector = (0.0, 0.0, 0.0)
    stiffness: float = 100.0
    damping: float = 0.0
    length: float = 0.0
    body: int = 0
    other: int | None = None

    if TYPE_CHECKING:

        def __init__(
            self,
            anchor: ArrayLike = ...,
            point: ArrayLike = ...,
            stiffness: float = 100.0,
            damping: float = 0.0,
            length: float = 0.0,
            body: int | str = 0,
            other: int | str | None = None,
        ) -> None: ...

    function: ClassVar[Any] = spring.spring
    energy: ClassVar[Any] = spring.spring_energy
    _rates: ClassVar[Any] = spring.spring_rates
    _soften: ClassVar[Any] = spring.soften_spring
    _mean: ClassVar[Any] = spring.mean_spring
    has_many: ClassVar[bool] = True

    def __post_init__(self) -> None:
        self._set("anchor", validation.finite, (3,))
        self._set("point", validation.finite, (3,))
        for name in ("stiffness", "damping", "length"):
            self._set(name, validation.non_negative)
        _take_end(self, "body")
        if self.other is not None:
            _take_end(self, "other")
            if self.other == self.body:
                raise ValueError(f"Spring.other is {self.other!r}, as Spring.body; allowed are other bodies and None")

    def check(self, body_count: int) -> None:
        _check_body(self, body_count, "body")
        if self.other is not None:
            _check_body(self, body_count, "other")

    @property
    def kind(self) -> type[Field]:
        return Spring if self.other is None else _LinkedSpring

    @property
    def takes_energy(self) -> bool | None:
        return None if self.other is not None else self.damping > 0  # between bodies it carries energy across

    def columns(self, body: int, worlds: NDArray[np.int64]) -> NDArray[np.float64]:
        if self.other is not None:
            return self._linked_columns(body)
        acts = float(body == self.body)
        return np.array([*self.point, *self.anchor, self.length, acts * self.stiffness, acts * self.damping])

    def _linked_columns(self, body: int) -> NDArray[np.float64]:
        """Numbers (`LINK_SIZE`,) of this two-body spring for one of its two bodies, or for a body at neither end."""
        ends = {self.body: (self.point, self.other, self.anchor), self.other: (self.anchor, self.body, self.point)}
        here, other, there = ends.get(body, ((0.0, 0.0, 0.0), -1, (0.0, 0.0, 0.0)))
        columns = np.zeros(implicit_two_body_spring.LINK_SIZE)
        columns[spring.SPRING_POINT : spring.SPRING_POINT + 3] = here
        columns[spring.SPRING_LENGTH : spring.SPRING_DAMPING + 1] = self.length, self.stiffness, self.damping
        columns[implicit_two_body_spring.LINK_OTHER] = other
        columns[implicit_two_body_spring.LINK_OTHER_POINT : implicit_two_body_spring.LINK_OTHER_POINT + 3] = there
        return columns


class _LinkedSpring(Spring):
    """Class with the functions that are compiled for springs between two bodies; users make a `Spring` with `other`."""

    function: ClassVar[Any] = two_body_spring.linked_spring
    energy: ClassVar[Any] = two_body_spring.linked_spring_energy
    _rates: ClassVar[Any] = two_body_spring.linked_spring_rates
    _soften: ClassVar[Any] = two_body_spring.soften_linked_arm
    _mean: ClassVar[Any] = None
    is_linked: ClassVar[bool] = True


@known_keywords
@dataclass(frozen=True)
class Push(Checked):
    """Constant force at a point of a body. A scene may hold any number of pushes.

    Parameters
    ----------
    force : (3,) array_like
        Force [N], in the frame that `frame` names.
    point : (3,) array_like
        Point at which the force acts: body frame, from the centre of mass [m].
    frame : {"world", "body"}
        Frame of `force`. In the body frame the force turns with the body, like the thrust of a rocket.
    body : int or str
        Index of the body in `Scene.bodies`, or its name, which a `Scene` replaces by the index.
    """

    force: Vector = (0.0, 0.0, 0.0)
    point: Vector = (0.0, 0.0, 0.0)
    frame: Frame = "world"
    body: int = 0

    if TYPE_CHECKING:

        def __init__(
            self,
            force: ArrayLike = ...,
            point: ArrayLike = ...,
            frame: Frame = "world",
            body: int | str = 0,
        ) -> None: ...

    function: ClassVar[Any] = spring.push_load
    _rates: ClassVar[Any] = spring.push_rates
    _soften: ClassVar[Any] = spring.soften_push
    has_many: ClassVar[bool] = True

    def __post_init__(self) -> None:
        self._set("force", validation.finite, (3,))
        self._set("point", validation.finite, (3,))
        validation.one_of(self.frame, ("world", "body"), "Push.frame")
        _take_end(self, "body")

    def check(self, body_count: int) -> None:
        _check_body(self, body_count, "body")

    def columns(self, body: int, worlds: NDArray[np.int64]) -> NDArray[np.float64]:
        acts = float(body == self.body)
        return np.array([*self.point, *(acts * np.array(self.force)), float(self.frame == "body")])
