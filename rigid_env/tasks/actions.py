"""Actions on bodies: convert numbers between -1 and 1 to forces, torques, impulses and prescribed velocities.

An action is a row of numbers. A task lists its actuations: `Wrench`, `Force`, `Impulse` and `Drive`. Each of them takes
the next numbers of the row and turns them into one or two vectors. First each number is clipped to ±1. Then a vector
that is longer than 1 is shortened to length 1, and multiplied by its limit. Limits are given in units of the weight m g
of the body, so that the same action has the same effect for every mass and gravity. Those of `Drive` are in m/s and
rad/s.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from physics import validation
from physics.annotations import Frame

AXES = "xyz"
FRAMES = ("world", "body")
FORCE, TORQUE, IMPULSE, VELOCITY, SPIN = range(5)  # kinds of a vector

WORDS = {
    FORCE: ("force", "along", "{:g} m g"),
    TORQUE: ("torque", "about", "{:g} m g a"),
    IMPULSE: ("impulse", "along", "{:g} m g s"),
    VELOCITY: ("velocity", "along", "{:g} m/s"),
    SPIN: ("spin", "about", "{:g} rad/s"),
}
"""Name of each kind of vector, the preposition before its axes, and its unit with its largest length."""


class Vector(NamedTuple):
    """One force, torque, impulse, velocity or spin that an action sets.

    Attributes
    ----------
    kind : int
        FORCE, TORQUE, IMPULSE, VELOCITY or SPIN.
    body : int
        Index of the body that the vector acts on.
    axes : str
        Axes along which the action sets the vector, letters of "xyz"; the other components are 0.
    share : float
        Largest length: of a force over the weight m g, of a torque over m g times the body's reach, of an impulse over
        m g times 1 s, of a velocity [m/s], of a spin [rad/s].
    frame : {"world", "body"}
        Frame of the axes.
    point : (3,) tuple or None
        Point of the body at which the vector acts, body frame, from the centre of mass [m]; None: the centre of mass.
    """

    kind: int
    body: int
    axes: str
    share: float
    frame: Frame = "world"
    point: Sequence[float] | None = None

    @property
    def names(self) -> list[str]:
        """Names of the vector's numbers for tables, such as "force along x"."""
        what, preposition, _ = WORDS[self.kind]
        axes = "" if self.frame == "world" else "body axis "
        return [f"{what} {preposition} {axes}{axis}" for axis in self.axes]

    @property
    def unit(self) -> str:
        """Unit of the vector's numbers for tables, where m is the body's mass, g gravity, and a the body's reach."""
        return WORDS[self.kind][2].format(self.share)

    @property
    def text(self) -> str:
        """Description of the vector in words, with all digits of its numbers."""
        what = WORDS[self.kind][0]
        at = "" if self.point is None else f" at {self.point}"
        return f"{what} {self.share!r} on body {self.body} along {self.axes} of the {self.frame} frame{at}"


@dataclass(frozen=True)
class Wrench:
    """A force at a body's centre of mass and a torque: six numbers of an action, or fewer if axes are left out.

    Parameters
    ----------
    body : int
        Index of the body.
    force : float
        Largest force over the weight of the body; 0: no force.
    torque : float
        Largest torque over the weight times the body's reach; 0: no torque. The reach is the longest half extent; of a
        hull it is the largest distance from the centre of mass along a body axis.
    force_axes, torque_axes : str
        Axes along which the agent can act, letters of "xyz".
    frame : {"world", "body"}
        Frame of the axes.
    agent : str
        Name of the agent that chooses these numbers.

    Raises
    ------
    ValueError
        A negative number, force and torque both 0, or unknown axes or frame.
    """

    body: int = 0
    force: float = 0.9
    torque: float = 0.5
    force_axes: str = AXES
    torque_axes: str = AXES
    frame: Frame = "world"
    agent: str = "agent"

    def __post_init__(self) -> None:
        check_body(self.body)
        for name in ("force", "torque"):
            validation.non_negative(getattr(self, name), (), name)
        check_axes("force_axes", self.force_axes)
        check_axes("torque_axes", self.torque_axes)
        validation.one_of(self.frame, FRAMES, "frame")
        if self.force == 0.0 == self.torque:
            raise ValueError("force and torque are 0; allowed is at least one above 0")

    @property
    def vectors(self) -> tuple[Vector, ...]:
        """Force and torque as `Vector`, without the one whose limit is 0."""
        both = (
            Vector(FORCE, self.body, self.force_axes, float(self.force), self.frame),
            Vector(TORQUE, self.body, self.torque_axes, float(self.torque), self.frame),
        )
        return tuple(vector for vector in both if vector.share > 0.0)


@dataclass(frozen=True)
class Force:
    """A force at a point of a body: one number of an action for each axis.

    Parameters
    ----------
    body : int
        Index of the body.
    strength : float
        Largest force over the weight of the body.
    point : (3,) float
        Point at which the force acts, body frame, from the centre of mass [m].
    axes : str
        Axes along which the agent can push, letters of "xyz".
    frame : {"world", "body"}
        Frame of the axes; `point` is always in the body frame.
    agent : str
        Name of the agent that chooses these numbers.

    Raises
    ------
    ValueError
        The message names the field, its value and what is allowed.
    """

    body: int = 0
    strength: float = 0.9
    point: Sequence[float] = (0.0, 0.0, 0.0)
    axes: str = AXES
    frame: Frame = "world"
    agent: str = "agent"

    def __post_init__(self) -> None:
        check_body(self.body)
        validation.positive(self.strength, (), "strength")
        check_axes("axes", self.axes)
        validation.one_of(self.frame, FRAMES, "frame")
        point = validation.finite(validation.floats(self.point, "point", "are three numbers"), (3,), "point")
        object.__setattr__(self, "point", tuple(point.tolist()))

    @property
    def vectors(self) -> tuple[Vector, ...]:
        """The force as the only `Vector`."""
        point = self.point if any(self.point) else None
        return (Vector(FORCE, self.body, self.axes, float(self.strength), self.frame, point),)


@dataclass(frozen=True)
class Impulse:
    """An impulse at a point of a body at the start of a control step; it acts as a force during the first physics step.

    Parameters
    ----------
    body : int
        Index of the body.
    strength : float
        Largest impulse over the weight of the body times 1 s: with 0.1 the body gains at most 0.1 g · 1 s of speed.
    point, axes, frame, agent
        As in `Force`.

    Raises
    ------
    ValueError
        The message names the field, its value and what is allowed.
    """

    body: int = 0
    strength: float = 0.1
    point: Sequence[float] = (0.0, 0.0, 0.0)
    axes: str = AXES
    frame: Frame = "world"
    agent: str = "agent"

    __post_init__ = Force.__post_init__  # type: ignore[misc]

    @property
    def vectors(self) -> tuple[Vector, ...]:
        """The impulse as the only `Vector`."""
        point = self.point if any(self.point) else None
        return (Vector(IMPULSE, self.body, self.axes, float(self.strength), self.frame, point),)


@dataclass(frozen=True)
class Drive:
    """Velocity and spin of a fixed body with a prescribed motion, such as a paddle or a turntable.

    The body has them during the whole control step, whatever it meets, and contacts feel them exactly
    (`physics.World.set_motion`). An episode begins with the motion that the scene gives the body.

    Parameters
    ----------
    body : int
        Index of the body, which has ``fixed=True`` and a steady `physics.Motion`.
    velocity : float
        Largest speed of the body's `pos` [m/s]; 0: it stays.
    spin : float
        Largest angular velocity about `pos` [rad/s]; 0: it does not turn.
    velocity_axes, spin_axes : str
        Axes of the world along which and about which the agent can move it, letters of "xyz".
    agent : str
        Name of the agent that chooses these numbers.

    Raises
    ------
    ValueError
        A negative number, velocity and spin both 0, or unknown axes.
    """

    body: int = 0
    velocity: float = 0.0
    spin: float = 0.0
    velocity_axes: str = AXES
    spin_axes: str = AXES
    agent: str = "agent"

    def __post_init__(self) -> None:
        check_body(self.body)
        for name in ("velocity", "spin"):
            validation.non_negative(getattr(self, name), (), name)
        check_axes("velocity_axes", self.velocity_axes)
        check_axes("spin_axes", self.spin_axes)
        if self.velocity == 0.0 == self.spin:
            raise ValueError("velocity and spin are 0; allowed is at least one above 0")

    @property
    def vectors(self) -> tuple[Vector, ...]:
        """Velocity and spin as `Vector`, without the one whose limit is 0."""
        both = (
            Vector(VELOCITY, self.body, self.velocity_axes, float(self.velocity)),
            Vector(SPIN, self.body, self.spin_axes, float(self.spin)),
        )
        return tuple(vector for vector in both if vector.share > 0.0)


def check_movable(acting, bodies) -> None:
    """Raise a ValueError if an action or disturbance acts on a body that is not in the scene or is fixed.

    `bodies` are those of the scene.
    """
    movable = ", ".join(str(b) for b, body in enumerate(bodies) if not body.fixed)
    if acting.body >= len(bodies):
        raise ValueError(f"body of {acting!r} is {acting.body}; allowed are 0 to {len(bodies) - 1}")
    if bodies[acting.body].fixed:
        raise ValueError(f"body of {acting!r} is {acting.body}, which is fixed; allowed are {movable}")


def check_body(body) -> None:
    """Raise a ValueError unless `body` is an integer of at least 0."""
    if isinstance(body, bool) or not isinstance(body, (int, np.integer)) or body < 0:
        raise ValueError(f"body is {body!r}; allowed are indices of bodies, from 0 on")


def check_axes(field: str, axes) -> None:
    """Raise a ValueError unless the text `axes` has one to three letters of "xyz", in this order.

    `field` is the name of the argument in the error.
    """
    if not isinstance(axes, str) or not axes or axes != "".join(axis for axis in AXES if axis in axes):
        raise ValueError(f"{field} is {axes!r}; allowed are axes of 'xyz', in this order")
