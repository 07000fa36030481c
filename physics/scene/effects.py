"""Effects of a scene: a small frozen dataclass for each part of the physics.

A scene declares its effects. The kernels of a scene contain only the effects that it declares.
The gyroscopic torque is on automatically where a body's moments of inertia differ.
Force fields (drag, springs and others) are in `physics.scene.force_fields`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from physics import validation
from physics.annotations import BodyAxis, Effect, End, Pair, Rule, Vector
from physics.html_table import fields_table
from physics.keywords import known_keywords
from physics.scene.body_axes import checked_axes
from physics.scene.force_field import Field
from physics.scene.pairs import FRICTION_RULE, RESTITUTION_RULE, checked_pairs, checked_rule
from physics.summary import SHOWN_IF_GIVEN, fields_repr, shown


@known_keywords
@dataclass(frozen=True)
class Gravity(Effect):
    """Uniform gravity: all bodies have the same acceleration, and no torque from it.

    Parameters
    ----------
    acceleration : (3,) array_like
        Acceleration of every body, world frame [m/s²].
    """

    acceleration: Vector = (0.0, -9.81, 0.0)

    if TYPE_CHECKING:

        def __init__(self, acceleration: ArrayLike = ...) -> None: ...

    _repr_html_ = fields_table

    def __post_init__(self) -> None:
        given: Any = self.acceleration
        if isinstance(given, (int, float)) and not isinstance(given, bool) and abs(given) < 1e300:
            down = f"(0, {-abs(given):g}, 0) if y points up"
            raise ValueError(f"Gravity.acceleration is {given!r}; allowed is shape (3,), such as {down}")
        value = validation.finite(self.acceleration, (3,), "Gravity.acceleration")
        object.__setattr__(self, "acceleration", tuple(value.tolist()))


@known_keywords
@dataclass(frozen=True)
class Contact(Effect):
    """Contact: bodies do not pass through walls, nor through each other.

    Parameters
    ----------
    restitution : float, optional
        Newton's coefficient e in [0, 1]: the normal velocity after an impact is -e times the one before it. None:
        impacts are plastic and the kernel holds no restitution, unless a body, a wall or a pair has a coefficient.
        It is that of all bodies without a `Body.restitution`.
    between_bodies : bool, optional
        True: bodies touch walls and each other. False: they touch walls only, and pass through each other.
    tangential : float, optional
        Tangential coefficient e_t in [-1, 1] of spheres, at walls, fixed bodies and each other (Walton 1993). The
        point of contact leaves an impact with -e_t times its tangential velocity, as far as the cone of `Friction`
        allows. 1: a superball; 0: the point sticks; -1: it slides on. None acts like 0, and compiles nothing for it.
    stiffness : float, optional
        k of a spring at each contact point (a vertex, the lowest point of a round body) of a body with a wall or with
        another body [N/m]; greater than 0. The spring pushes with k times the depth; it makes a body bounce, and
        `restitution` must be None. None: rigid contact.
    damping : float, optional
        c of a damper beside the spring [N s/m]; at least 0. Spring and damper together never pull (Kelvin and Voigt's
        model, without adhesion).
    restitution_rule : str, optional
        Rule that combines the restitutions of two bodies, or of a body and a wall with a restitution: ``"minimum"``,
        ``"average"``, ``"geometric_mean"``, ``"product"`` or ``"maximum"``.
    restitution_pairs : dict or sequence, optional
        Exceptions to the rule, as `Friction.pairs` has them.
    """

    restitution: float | None = None
    between_bodies: bool = True
    tangential: float | None = None
    stiffness: float | None = None
    damping: float = 0.0
    restitution_rule: Rule = field(default=RESTITUTION_RULE, kw_only=True, metadata=SHOWN_IF_GIVEN)
    restitution_pairs: tuple[Pair, ...] = field(default=(), kw_only=True, metadata=SHOWN_IF_GIVEN)

    if TYPE_CHECKING:

        def __init__(
            self,
            restitution: float | None = None,
            between_bodies: bool = True,
            tangential: float | None = None,
            stiffness: float | None = None,
            damping: float = 0.0,
            *,
            restitution_rule: Rule = "maximum",
            restitution_pairs: Mapping[tuple[End, End], float] | Iterable[Sequence[End | float]] = (),
        ) -> None: ...

    __repr__ = fields_repr
    _repr_html_ = fields_table

    def __post_init__(self) -> None:
        if not isinstance(self.between_bodies, (bool, np.bool_)):
            raise ValueError(f"Contact.between_bodies is {shown(self.between_bodies)}; allowed are True and False")
        object.__setattr__(self, "between_bodies", bool(self.between_bodies))
        if self.restitution is not None:
            value = float(validation.share(self.restitution, (), "Contact.restitution"))
            object.__setattr__(self, "restitution", value)
        if self.tangential is not None:
            object.__setattr__(self, "tangential", validation.number(self.tangential, "Contact.tangential"))
            if not -1.0 <= self.tangential <= 1.0:
                raise ValueError(f"Contact.tangential is {self.tangential}; allowed are numbers from -1 to 1")
        checked_rule(self.restitution_rule, "Contact.restitution_rule")
        pairs = checked_pairs(self.restitution_pairs, "Contact.restitution_pairs", validation.share)
        object.__setattr__(self, "restitution_pairs", pairs)
        self._check_springs()

    def _check_springs(self) -> None:
        object.__setattr__(self, "damping", float(validation.non_negative(self.damping, (), "Contact.damping")))
        if self.stiffness is None:
            if self.damping > 0:
                raise ValueError(f"Contact.damping is {self.damping}; allowed without a stiffness is 0")
            return
        object.__setattr__(self, "stiffness", float(validation.positive(self.stiffness, (), "Contact.stiffness")))
        for name, nothing in (("restitution", None), ("tangential", None), ("restitution_pairs", ())):
            if getattr(self, name) != nothing:
                raise ValueError(
                    f"Contact.{name} is {getattr(self, name)} with a stiffness; allowed is {nothing}: springs and "
                    "dampers say how a body bounces"
                )


@known_keywords
@dataclass(frozen=True)
class Friction(Effect):
    """Coulomb friction with the exact cone: |f_t| <= μ f_n, opposed to sliding.

    Parameters
    ----------
    coefficient : float or (2,) array_like
        μ, the same for sticking and sliding; at least 0. It is that of all bodies without a `Body.friction`. Two
        coefficients, greater than 0, describe walls with a grain: μ1 acts along `axis` and μ2 across it. The possible
        friction forces then fill the ellipse (f1/μ1)² + (f2/μ2)² <= f_n². A sliding contact has the force of them that
        dissipates most (Goyal, Ruina and Papadopoulos 1991). Coefficients of bodies, walls and pairs are then μ1, and
        the ratio μ2/μ1 is the same everywhere.
    axis : (3,) or (walls, 3) array_like, optional
        Direction of μ1, world frame: one for all contacts, or one for each wall. Only its component along the contact
        counts. It must be given with two coefficients, and only then.
    rule : str, optional
        Rule that combines the frictions of two bodies, or of a body and a wall with a friction: ``"minimum"``,
        ``"average"``, ``"geometric_mean"``, ``"product"`` or ``"maximum"``. At a wall without a friction the body's own
        acts.
    pairs : dict or sequence, optional
        Exceptions to the rule: ``{("die", "tray"): 0.2}``, or a sequence of ``("die", "tray", 0.2)``. An end of a pair
        is the name of a body or wall, the index of a body, or -1 - k for wall k. The order of both ends does not count.
    body_axes : dict or sequence, optional
        Directions of μ1 in the frames of bodies, which turn with them: ``{"ski": (1, 0, 0)}``, by name or index. They
        take the place of `axis`; of two bodies the axis of the first one acts. Only with two coefficients.
    """

    coefficient: float | tuple[float, float] = 0.5
    axis: Vector | tuple[Vector, ...] | None = None
    rule: Rule = field(default=FRICTION_RULE, kw_only=True, metadata=SHOWN_IF_GIVEN)
    pairs: tuple[Pair, ...] = field(default=(), kw_only=True, metadata=SHOWN_IF_GIVEN)
    body_axes: tuple[BodyAxis, ...] = field(default=(), kw_only=True, metadata=SHOWN_IF_GIVEN)

    if TYPE_CHECKING:

        def __init__(
            self,
            coefficient: ArrayLike = 0.5,
            axis: ArrayLike | None = None,
            *,
            rule: Rule = "geometric_mean",
            pairs: Mapping[tuple[End, End], float] | Iterable[Sequence[End | float]] = (),
            body_axes: Mapping[End, ArrayLike] | Iterable[Sequence[Any]] = (),
        ) -> None: ...

    def __post_init__(self) -> None:
        name, given = "Friction.coefficient", self.coefficient
        is_even = not np.iterable(given) or isinstance(given, str)
        if is_even:
            object.__setattr__(self, "coefficient", float(validation.non_negative(given, (), name)))
        else:
            object.__setattr__(self, "coefficient", tuple(validation.positive(given, (2,), name).tolist()))
        if is_even != (self.axis is None):
            allowed = "None with one coefficient" if is_even else "a direction with two coefficients"
            raise ValueError(f"Friction.axis is {shown(self.axis)}; allowed is {allowed}")
        if not is_even:
            object.__setattr__(self, "axis", _axes(self.axis))
        checked_rule(self.rule, "Friction.rule")
        pairs = checked_pairs(self.pairs, "Friction.pairs", validation.non_negative)
        object.__setattr__(self, "pairs", pairs)
        object.__setattr__(self, "body_axes", checked_axes(self.body_axes))
        if is_even and self.body_axes:
            raise ValueError(f"Friction.body_axes is {shown(self.body_axes)}; allowed with one coefficient is none")

    __repr__ = fields_repr
    _repr_html_ = fields_table

    @property
    def along(self) -> float:
        """Coefficient μ; with two coefficients μ1, the one along `axis`."""
        return self.coefficient[0] if isinstance(self.coefficient, tuple) else self.coefficient

    @property
    def ratio(self) -> float:
        """Ratio μ2/μ1 of the coefficients across and along `axis`; 1 with a single coefficient."""
        return self.coefficient[1] / self.coefficient[0] if isinstance(self.coefficient, tuple) else 1.0

    def directions(self, walls: int) -> NDArray[np.float64] | None:
        """Directions of μ1 (walls, 3), one for each of `walls` walls, world frame; None with a single coefficient."""
        return None if self.axis is None else np.broadcast_to(np.array(self.axis), (walls, 3))


def _axes(axis: Any) -> tuple:
    """Check `Friction.axis`, a vector (3,) or one per wall (walls, 3); return it as a tuple, or a tuple of tuples."""
    try:
        shape = np.shape(axis)
    except ValueError:
        shape = ()
    value = validation.finite(axis, (*shape[:-1], 3) if len(shape) == 2 else (3,), "Friction.axis")
    if not value.any(axis=-1).all():
        raise ValueError(f"Friction.axis is {shown(axis)}; allowed are directions, any vectors but zero")
    return tuple(value.tolist()) if value.ndim == 1 else tuple(tuple(row) for row in value.tolist())


class _Resistance(Effect):
    """Base of rolling and spin friction: a contact torque of at most `radius` [m] times the normal force."""

    radius: float
    _repr_html_ = fields_table

    def __post_init__(self) -> None:
        name = f"{type(self).__name__}.radius"
        object.__setattr__(self, "radius", float(validation.non_negative(self.radius, (), name)))


@known_keywords
@dataclass(frozen=True)
class RollingFriction(_Resistance):
    """Rolling resistance at contacts of round bodies: a torque of at most ``radius`` times the normal force.

    Spheres, ellipsoids and capsules are round. The torque opposes the component of their angular velocity along the
    wall or body that they touch, relative to it. It may stop it, but never reverses it.

    Parameters
    ----------
    radius : float
        Distance by which the normal force acts ahead of the middle of the contact [m] (Coulomb 1785); at least 0.
    """

    radius: float = 0.001


@known_keywords
@dataclass(frozen=True)
class SpinFriction(_Resistance):
    """Friction of round bodies that spin on a wall or body: a torque of at most ``radius`` times the normal force.

    The torque opposes the component of the angular velocity along the wall's normal; it may stop it, but never reverses
    it.

    Parameters
    ----------
    radius : float
        Arm of the friction [m]; at least 0. A round contact patch of radius a under Hertz's pressure has the arm
        3π/16 μ a (Contensou 1962).
    """

    radius: float = 0.001


@known_keywords
@dataclass(frozen=True)
class Actuator(Effect):
    """Actuator between the wrench given to `World.step` and the bodies: delay, then limits, then lag, in this order.

    Parameters
    ----------
    limit_force, limit_torque : float, optional
        Largest length of the force [N] and of the torque [N m]; more than 0. A longer one is shortened to it, its
        direction kept. None: no limit.
    lag : float
        Time constant τ with which the acting wrench w follows the command, ``τ dw/dt = command - w`` [s]; at least 0.
        0: the command acts at once.
    delay : float
        Time after which a command arrives [s]; at least 0.
    """

    limit_force: float | None = None
    limit_torque: float | None = None
    lag: float = 0.0
    delay: float = 0.0

    _repr_html_ = fields_table

    def __post_init__(self) -> None:
        for name in ("limit_force", "limit_torque"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, float(validation.positive(value, (), f"Actuator.{name}")))
        for name in ("lag", "delay"):
            value = validation.non_negative(getattr(self, name), (), f"Actuator.{name}")
            object.__setattr__(self, name, float(value))

    @property
    def remembers(self) -> bool:
        """True if the acting wrench depends on commands of earlier steps: with a lag or a delay."""
        return self.lag > 0.0 or self.delay > 0.0


@known_keywords
@dataclass(frozen=True)
class Sleeping(Effect):
    """Sleeping: bodies at rest are left out of the step until something changes that acts on them.

    Bodies that touch, are near each other or are tied together form a group. A group falls asleep once the
    displacements of its bodies stay below the threshold in two successive windows of time, and at most double from the
    first to the second. A sleeping body keeps its place to the last bit, has no velocity, and costs next to nothing.
    It wakes when its wrench changes, when an awake body comes near, or when a user changes the world
    (`World.set_state`, `World.set_parameters`). Bodies that touch walls only sleep and wake alone.

    It acts at every preset. At ``precise`` and ``reference`` the motion that sleep stops, a few slops per window, is
    below the tolerance. There a body also needs an equilibrium of forces. So it stays awake if a bounce brings it back
    to its highest point at the end of each step.

    Parameters
    ----------
    slops : float
        Threshold of the displacement of any point of a body within a window, in units of `Accuracy.slop` times the
        body's bounding radius; more than 0. A slop that the scheme raises to its least value counts as raised.
    time : float, optional
        Length of a window [s]; more than 0. None: √(2 r/a), the time in which the body would fall its bounding radius r
        at the acceleration a that it would have without contact. A body without such an acceleration does not sleep.
    """

    slops: float = 4.0
    time: float | None = None

    _repr_html_ = fields_table

    def __post_init__(self) -> None:
        object.__setattr__(self, "slops", float(validation.positive(self.slops, (), "Sleeping.slops")))
        if self.time is not None:
            object.__setattr__(self, "time", float(validation.positive(self.time, (), "Sleeping.time")))


RESISTANCES = (RollingFriction, SpinFriction)
EFFECTS = (Gravity, Contact, Friction, *RESISTANCES, Actuator, Sleeping, Field)
