"""Ways to act upon bodies: from numbers between -1 and 1 to forces, torques and impulses.

An action is a row of numbers. Each way that a task declares takes the next of them, and makes one or two vectors: their
entries are clipped to ±1, then a vector is shortened to length 1 where it is longer, and multiplied by its limit.
Limits are told in units of the weight m g of the body, so that a task means the same for every mass and gravity.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from physics import validation
from physics.annotations import Frame

AXES = "xyz"
FRAMES = ("world", "body")
FORCE, TORQUE, IMPULSE = 0, 1, 2  # kinds of a vector


class Vector(NamedTuple):
    """One vector of an action.

    Attributes
    ----------
    kind : int
        FORCE, TORQUE or IMPULSE.
    body : int
    axes : str
        Axes that the action has numbers for, of "xyz".
    share : float
        Longest force over the weight, torque over weight times reach, impulse over weight times 1 s.
    frame : str
        Of the vector.
    point : (3,) tuple or None
        Where it acts, body frame, from the centre of mass [m]; None: at the centre of mass.
    """

    kind: int
    body: int
    axes: str
    share: float
    frame: Frame = "world"
    point: Sequence[float] | None = None

    @property
    def names(self) -> list[str]:
        """Names of its numbers, for tables."""
        what = {FORCE: "force along", TORQUE: "torque about", IMPULSE: "impulse along"}[self.kind]
        axes = "" if self.frame == "world" else "body axis "
        return [f"{what} {axes}{axis}" for axis in self.axes]

    @property
    def unit(self) -> str:
        """Unit of its numbers, for tables: m mass of the body, g gravity, a its reach."""
        return f"{self.share:g} m g" + {FORCE: "", TORQUE: " a", IMPULSE: " s"}[self.kind]

    @property
    def text(self) -> str:
        """All of it in words, with every digit of its numbers."""
        what = {FORCE: "force", TORQUE: "torque", IMPULSE: "impulse"}[self.kind]
        at = "" if self.point is None else f" at {self.point}"
        return f"{what} {self.share!r} on body {self.body} along {self.axes} of the {self.frame} frame{at}"


@dataclass(frozen=True)
class Wrench:
    """A force at the centre of mass and a torque: six numbers, or fewer axes.

    Parameters
    ----------
    body : int
    force : float
        Longest force over the weight of the body; 0: no force.
    torque : float
        Longest torque over the weight times the body's reach, which is its longest half extent, and of a hull the
        farthest along a body axis from the centre of mass; 0: no torque.
    force_axes, torque_axes : str
        Axes that the agent has in hand, of "xyz".
    frame : {"world", "body"}
    agent : str
        Name of the agent whose numbers these are.

    Raises
    ------
    ValueError
        A number below 0, both of them 0, or unknown axes or frame.
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
        """The force and the torque, without those whose limit is 0."""
        both = (
            Vector(FORCE, self.body, self.force_axes, float(self.force), self.frame),
            Vector(TORQUE, self.body, self.torque_axes, float(self.torque), self.frame),
        )
        return tuple(vector for vector in both if vector.share > 0.0)


@dataclass(frozen=True)
class Force:
    """A force at a point of a body.

    Parameters
    ----------
    body : int
    strength : float
        Longest force over the weight of the body.
    point : (3,) float
        Where it acts, along the body axes from the centre of mass [m].
    axes : str
        Axes that the agent has in hand, of "xyz".
    frame : {"world", "body"}
        Of the force.
    agent : str

    Raises
    ------
    ValueError
        Naming the field, the value and what is allowed.
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
        """The force."""
        point = self.point if any(self.point) else None
        return (Vector(FORCE, self.body, self.axes, float(self.strength), self.frame, point),)


@dataclass(frozen=True)
class Impulse:
    """An impulse at a point of a body at the start of the control step: it acts during the first physics step.

    Parameters
    ----------
    body : int
    strength : float
        Longest impulse over the weight of the body times 1 s: with 0.1 the body gains up to 0.1 g · 1 s of speed.
    point, axes, frame, agent
        As of `Force`.

    Raises
    ------
    ValueError
        Naming the field, the value and what is allowed.
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
        """The impulse."""
        point = self.point if any(self.point) else None
        return (Vector(IMPULSE, self.body, self.axes, float(self.strength), self.frame, point),)


def check_body(body) -> None:
    """Raise a ValueError unless `body` is an index."""
    if isinstance(body, bool) or not isinstance(body, (int, np.integer)) or body < 0:
        raise ValueError(f"body is {body!r}; allowed are indices of bodies, from 0 on")


def check_axes(field: str, axes) -> None:
    """Raise a ValueError unless `axes` are some of "xyz", in this order."""
    if not isinstance(axes, str) or not axes or axes != "".join(axis for axis in AXES if axis in axes):
        raise ValueError(f"{field} is {axes!r}; allowed are axes of 'xyz', in this order")


class ActionTable:
    """The vectors of a task's actions as arrays, for `kernels.write_wrenches`.

    Parameters
    ----------
    ways : sequence of Wrench, Force and Impulse
    body_count : int

    Attributes
    ----------
    size : int
        Numbers of an action.
    vectors : list of Vector
    table : (vectors, 6) int64
        Kind, body, index of the number for x, y and z (-1: none), and whether the vector is in the body frame.
    points : (vectors, 3) float64
        [m], body frame.
    has_impulses : bool
    agents : dict of str to (k,) int64
        Which numbers of an action belong to which agent.

    Raises
    ------
    ValueError
        No ways, one that is none, or a body that is not there.
    """

    def __init__(self, ways, body_count: int):
        ways = tuple(ways) if isinstance(ways, (list, tuple)) else (ways,)
        if not ways or not all(isinstance(way, (Wrench, Force, Impulse)) for way in ways):
            raise ValueError(f"actions is {ways!r}; allowed are Wrench, Force and Impulse, at least one")
        self.vectors: list[Vector] = []
        rows: list[Any] = []
        agents: dict[str, Any] = {}
        self.size = 0
        for way in ways:
            if way.body >= body_count:
                raise ValueError(f"body of {way!r} is {way.body}; allowed are 0 to {body_count - 1}")
            first = self.size
            for vector in way.vectors:
                places = {axis: self.size + k for k, axis in enumerate(vector.axes)}
                rows.append(
                    [vector.kind, vector.body, *(places.get(axis, -1) for axis in AXES), vector.frame == "body"]
                )
                self.vectors.append(vector)
                self.size += len(vector.axes)
            agents.setdefault(way.agent, []).extend(range(first, self.size))
        self.table = np.array(rows, dtype=np.int64)
        self.points = np.array([vector.point or (0.0, 0.0, 0.0) for vector in self.vectors])
        self.has_impulses = any(vector.kind == IMPULSE for vector in self.vectors)
        self.agents = {agent: np.array(places) for agent, places in agents.items()}

    def limits(self, weight: np.ndarray, reach: np.ndarray, first_dt: float) -> np.ndarray:
        """Longest vectors.

        Parameters
        ----------
        weight, reach : (worlds, bodies) float64
            Weights m g [N], and reaches [m].
        first_dt : float
            Time in which an impulse acts, as a force [s].

        Returns
        -------
        (worlds, vectors) float64
            [N] of forces and, while they act, of impulses; [N m] of torques.
        """
        columns = []
        for vector in self.vectors:
            limit = vector.share * weight[:, vector.body]
            if vector.kind == TORQUE:
                limit = limit * reach[:, vector.body]
            columns.append(limit / first_dt if vector.kind == IMPULSE else limit)
        return np.stack(columns, axis=1)
