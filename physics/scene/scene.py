"""A scene: an immutable, checked description of bodies, walls and effects, without numerics."""

from __future__ import annotations

import sys
import warnings
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from physics import validation
from physics.annotations import Effect, Vector
from physics.html_table import fields_table, parts_table, table
from physics.keywords import known_keywords
from physics.scene.bodies import Block, Body, Ellipsoid, Hull, Sphere, check_coefficients, check_name
from physics.scene.body_axes import axis_table
from physics.scene.capsule import Capsule
from physics.scene.compound import Compound
from physics.scene.cylinder import Cylinder
from physics.scene.effects import EFFECTS, RESISTANCES, Contact, Friction, Sleeping
from physics.scene.field_shapes import DESCRIBED
from physics.scene.force_field import Field
from physics.scene.groups import GROUP, MASK, check_groups
from physics.scene.materials import check_materials
from physics.scene.sensor import Sensor, carrier_index
from physics.scene.springs import check_ends, with_indices
from physics.summary import SCREEN, SHOWN_IF_GIVEN, counted, fields_repr, parts_repr, shown

# An axis of friction and the normal of a wall count as parallel if the sine of the angle between them is below this.
# Of the sixteen digits of a direction ten are then left for its component along the wall.
LEAST_SINE = 1e-6

# A `repr` shows every body, wall and effect of a scene that has at most so many of them together and fits on a screen.
MOST_SHOWN = 12

NO_CONTACT = (
    "Scene.walls are given, but no effect lets bodies touch them: bodies pass through; add physics.Contact() to "
    "Scene.effects, or leave the walls out"
)
FIXED_WITHOUT_CONTACT = (
    "Scene.bodies holds fixed bodies, but no effect lets others touch them: they pass through; add physics.Contact() "
    "to Scene.effects, or leave the fixed bodies out"
)


EffectType = TypeVar("EffectType")


class SceneWarning(UserWarning):
    """Warning about a scene that is valid, but in which something is hardly meant, such as walls without `Contact`."""


@known_keywords
@dataclass(frozen=True)
class HalfSpace:
    """Plane wall: bodies stay in the half-space {x : normal·x >= offset}.

    Parameters
    ----------
    normal : (3,) array_like
        Normal out of the wall, towards the bodies, world frame; any vector but zero, it is normalised.
    offset : float
        Distance of the plane from the origin along the unit normal [m].
    name : str, optional
        Name of the wall; no other wall or body of a scene may have it. It changes no motion.
    friction, restitution : float, optional
        Coefficients μ, at least 0, and e, from 0 to 1. `Friction.rule` and `Contact.restitution_rule` combine them with
        those of a body. None: the body's own act.
    group, mask : int
        Bits of the collision groups that the wall belongs to, and of those that it touches, as of a body.
    """

    normal: Vector
    offset: float = 0.0
    name: str | None = field(default=None, kw_only=True, metadata=SHOWN_IF_GIVEN)
    friction: float | None = field(default=None, kw_only=True, metadata=SHOWN_IF_GIVEN)
    restitution: float | None = field(default=None, kw_only=True, metadata=SHOWN_IF_GIVEN)
    group: int = field(default=GROUP, kw_only=True, metadata=SHOWN_IF_GIVEN)
    mask: int = field(default=MASK, kw_only=True, metadata=SHOWN_IF_GIVEN)

    if TYPE_CHECKING:

        def __init__(
            self,
            normal: ArrayLike,
            offset: float = 0.0,
            *,
            name: str | None = None,
            friction: float | None = None,
            restitution: float | None = None,
            group: int = GROUP,
            mask: int = MASK,
        ) -> None: ...

    __repr__ = fields_repr
    _repr_html_ = fields_table

    def __post_init__(self) -> None:
        normal = validation.finite(self.normal, (3,), "HalfSpace.normal")
        length = float(np.linalg.norm(normal))
        if not length > 0 or not np.isfinite(length):
            raise ValueError(f"HalfSpace.normal is {shown(self.normal)}; allowed is any vector but zero")
        object.__setattr__(self, "normal", tuple(validation.unit(normal, length).tolist()))
        object.__setattr__(self, "offset", validation.number(self.offset, "HalfSpace.offset"))
        if self.name is not None:
            check_name(self.name, "HalfSpace.name")
        check_coefficients(self, "HalfSpace.")
        check_groups(self, "HalfSpace.")


@known_keywords
def three_walls(half_width: float = 10.0) -> list[HalfSpace]:
    """Walls of the three-wall box: the floor y = 0 and walls at x = ±half_width [m], open to front, back and top."""
    half_width = float(validation.positive(half_width, (), "half_width"))
    return [HalfSpace((0, 1, 0), 0.0), HalfSpace((1, 0, 0), -half_width), HalfSpace((-1, 0, 0), -half_width)]


def corner() -> list[HalfSpace]:
    """Walls of a corner: the floor y = 0 and the walls x = 0 and z = 0, with bodies at positive x, y and z."""
    return [HalfSpace((0, 1, 0), 0.0), HalfSpace((1, 0, 0), 0.0), HalfSpace((0, 0, 1), 0.0)]


@known_keywords
@dataclass(frozen=True)
class Scene:
    """Immutable description of a simulation: bodies, walls and effects.

    Parameters
    ----------
    bodies : sequence of Body
        At least one body that is not fixed. No two bodies may have the same name.
    walls : sequence of HalfSpace
        Walls, possibly none.
    effects : sequence of effects
        At most one of each kind, but any number of `Spring` and `Push`. `Friction`, `RollingFriction`,
        `SpinFriction` and `Sleeping` need `Contact`. `Contact.tangential` needs `Friction`. `Wind` needs a field
        through which it acts, such as `Drag`.
    sensors : sequence of Sensor
        Regions that tell which bodies are in them, and do not push.

    Warns
    -----
    SceneWarning
        Walls or fixed bodies without `Contact`: bodies pass through them.

    Raises
    ------
    ValueError
        An argument is invalid; the message names it. `World` also refuses a body that starts deep inside a wall.
    """

    bodies: tuple[Body, ...]
    walls: tuple[HalfSpace, ...] = ()
    effects: tuple[Effect, ...] = ()
    sensors: tuple[Sensor, ...] = field(default=(), kw_only=True)

    if TYPE_CHECKING:

        def __init__(
            self,
            bodies: Iterable[Body] | Body,
            walls: Iterable[HalfSpace] | HalfSpace = (),
            effects: Iterable[Effect] | Effect = (),
            *,
            sensors: Iterable[Sensor] | Sensor = (),
        ) -> None: ...

    def __post_init__(self) -> None:
        for name, allowed in (("bodies", Body), ("walls", HalfSpace), ("effects", EFFECTS), ("sensors", Sensor)):
            object.__setattr__(self, name, _items(getattr(self, name), name, allowed))
        if not self.bodies:
            raise ValueError("Scene.bodies is empty; allowed is at least one body")
        if all(body.fixed for body in self.bodies):
            raise ValueError("Scene.bodies holds only fixed bodies; allowed is at least one body that is not fixed")
        self._check_names()
        object.__setattr__(self, "effects", tuple(with_indices(effect, self) for effect in self.effects))
        kinds = [type(effect) for effect in self.effects]
        for kind in set(kinds):
            if kinds.count(kind) > 1 and not getattr(kind, "has_many", False):
                raise ValueError(f"Scene.effects holds {kinds.count(kind)} {kind.__name__}; allowed is one")
        for kind in (Friction, *RESISTANCES, Sleeping):
            if kind in kinds and Contact not in kinds:
                raise ValueError(f"Scene.effects holds {kind.__name__} without Contact; add physics.Contact()")
        contact = self.effect(Contact)
        if contact is not None and contact.tangential is not None and Friction not in kinds:
            raise ValueError(
                f"Contact.tangential is {contact.tangential} without Friction, which is what acts along a wall; add "
                "physics.Friction(...)"
            )
        self._check_axes()
        self._check_fields()
        check_materials(self)
        for k, sensor in enumerate(self.sensors):
            carrier_index(sensor, self.bodies, f"Scene.sensors[{k}]")
        if self.walls and contact is None:
            warnings.warn(NO_CONTACT, SceneWarning, stacklevel=frames_of_package())
        if contact is None and any(body.fixed for body in self.bodies):
            warnings.warn(FIXED_WITHOUT_CONTACT, SceneWarning, stacklevel=frames_of_package())

    def __repr__(self) -> str:
        return self._expression() or parts_repr(self)

    def _repr_html_(self) -> str:
        if not self._expression():
            return parts_table(self)
        lists = {"bodies": self.bodies, "walls": self.walls, "effects": self.effects, "sensors": self.sensors}
        return table(
            "Scene", ((f"{name}[{k}]", repr(each)) for name, items in lists.items() for k, each in enumerate(items))
        )

    def _expression(self) -> str:
        """Python expression that makes the scene again; "" if it would not fit on a screen."""
        if len(self.bodies) + len(self.walls) + len(self.effects) + len(self.sensors) > MOST_SHOWN:
            return ""
        sensors = f", sensors={self.sensors!r}" if self.sensors else ""
        text = f"Scene(bodies={self.bodies!r}, walls={self.walls!r}, effects={self.effects!r}{sensors})"
        return text if len(text) <= SCREEN else ""

    def _parts(self) -> tuple[str, ...]:
        kinds = {name: [type(item).__name__ for item in getattr(self, name)] for name in ("bodies", "effects")}
        return (
            f"{len(self.bodies)} bodies: {counted(kinds['bodies'])}", f"{len(self.walls)} walls",
            f"effects: {counted(kinds['effects'])}", *([f"{len(self.sensors)} sensors"] if self.sensors else []),
        )  # fmt: skip

    def _check_names(self) -> None:
        named = [(f"Scene.bodies[{b}]", body.name) for b, body in enumerate(self.bodies)]
        named += [(f"Scene.walls[{k}]", wall.name) for k, wall in enumerate(self.walls)]
        named += [(f"Scene.sensors[{k}]", sensor.name) for k, sensor in enumerate(self.sensors)]
        first: dict[str, str] = {}
        for place, name in named:
            if name is not None and first.setdefault(name, place) != place:
                raise ValueError(f"{place} has the name {shown(name)}, as {first[name]}; allowed are different names")

    def _check_axes(self) -> None:
        friction = self.effect(Friction)
        if friction is None or friction.axis is None:
            return
        axis_table(self, friction.body_axes)
        if not self.walls:
            return
        axes = np.array(friction.axis)
        if axes.ndim == 2 and len(axes) != len(self.walls):
            count = len(self.walls)
            raise ValueError(f"Friction.axis has {len(axes)} directions; allowed are one, or {count}: one per wall")
        directions: Any = friction.directions(len(self.walls))
        for k, (axis, wall) in enumerate(zip(directions, self.walls)):
            if not np.linalg.norm(np.cross(axis, wall.normal)) > LEAST_SINE * np.linalg.norm(axis):
                raise ValueError(
                    f"Friction.axis is {axis.tolist()}, the normal of walls[{k}]; allowed are directions along a wall, "
                    "which may be given one per wall"
                )

    def _check_fields(self) -> None:
        fields = [effect for effect in self.effects if isinstance(effect, Field)]
        for each in fields:
            each.check(len(self.bodies))
            check_ends(each, self.bodies)
        for b, body in enumerate(self.bodies):
            is_without_axes = body.kind in ("hull", "capsule", "cylinder", "compound") and not body.fixed
            needy = [each for each in fields if each.needs_axes and not (each.knows_shapes and body.kind in DESCRIBED)]
            unknown = [type(each).__name__ for each in needy if is_without_axes]
            if unknown:
                raise ValueError(
                    f"Scene.effects holds {', '.join(unknown)}, and Scene.bodies[{b}] is a {body.kind}; allowed with "
                    "it are blocks, spheres and ellipsoids: its law is that of round bodies, in terms of half axes"
                )
        if fields and all(each.is_air for each in fields):
            raise ValueError("Scene.effects holds Wind without what it acts through; add physics.Drag()")

    def effect(self, kind: type[EffectType]) -> EffectType | None:
        """The scene's first effect of this class; None if it has none."""
        validation.instance(kind, type, "kind", "the class of an effect, as physics.Gravity")
        return next((effect for effect in self.effects if isinstance(effect, kind)), None)


def _items(given: Any, name: str, allowed: Any) -> tuple:
    """Check the argument `name` of `Scene`, one object or several, all of the `allowed` classes; return a tuple."""
    if isinstance(given, allowed):
        return (given,)
    if isinstance(given, (str, bytes, dict)) or not isinstance(given, Iterable):
        raise ValueError(f"Scene.{name} is {shown(given)}; allowed is a list of {_names(allowed)}")
    items = tuple(given)
    for k, item in enumerate(items):
        if isinstance(item, allowed):
            continue
        hint = f": write {item.__name__}(...)" if isinstance(item, type) and issubclass(item, allowed) else ""
        raise ValueError(f"Scene.{name}[{k}] is {shown(item)}; allowed are instances of {_names(allowed)}{hint}")
    return items


def frames_of_package() -> int:
    """`stacklevel` with which a warning of the caller names the line outside this package that called into it."""
    level, frame = 1, sys._getframe(1)
    while frame.f_back is not None and frame.f_globals.get("__name__", "").split(".")[0] in ("physics", "dataclasses"):
        level, frame = level + 1, frame.f_back
    return level


def _names(allowed: Any) -> str:
    kinds = allowed if isinstance(allowed, tuple) else (allowed,)
    if allowed is Body:
        kinds = (Block, Sphere, Ellipsoid, Capsule, Cylinder, Hull, Compound)
    return ", ".join(kind.__name__ for kind in kinds)
