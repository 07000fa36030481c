"""Prescribed motion of a fixed body: constant velocity and spin, a moving surface, or a table of times and poses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from physics import validation
from physics.annotations import Quaternion, Vector
from physics.html_table import fields_table
from physics.kernels.flight import prescribed_motion as columns
from physics.keywords import known_keywords
from physics.summary import SHOWN_IF_GIVEN, fields_repr, shown

# Most knots of a table: each world keeps a copy of it, so that worlds may have different ones.
MOST_KNOTS = 1000

# Difference up to which the last pose of a table that repeats may be off the first one: that of rounded numbers.
SAME_POSE = 1e-9

# Cosine of half the angle between two attitudes below which the shorter way from one to the other is not clear.
LEAST_COSINE = 1e-6

STILL = (0.0, 0.0, 0.0)


def _tuples(array: np.ndarray) -> Any:
    return tuple(tuple(row) for row in array.tolist())


@known_keywords
@dataclass(frozen=True, kw_only=True)
class Motion:
    """Prescribed motion of a body with ``fixed=True``; no force changes it.

    A motion is steady, or a table (`Motion.table`). In both the surface may move along the body.

    Parameters
    ----------
    velocity, spin : (3,) array_like
        Constant velocity of the body's `pos` [m/s] and angular velocity about it [rad/s], world frame.
    surface_velocity : (3,) array_like
        Velocity of the surface along the body, body frame [m/s]: a belt that runs round the body. At each contact only
        its component along the surface counts.
    times, pos, quat, repeat
        Table of poses; see `Motion.table`.

    Raises
    ------
    ValueError
        A number that is not finite, both a table and a velocity, or a table that `Motion.table` refuses.
    """

    velocity: Vector = field(default=STILL, metadata=SHOWN_IF_GIVEN)
    spin: Vector = field(default=STILL, metadata=SHOWN_IF_GIVEN)
    surface_velocity: Vector = field(default=STILL, metadata=SHOWN_IF_GIVEN)
    times: tuple[float, ...] | None = field(default=None, metadata=SHOWN_IF_GIVEN)
    pos: tuple[Vector, ...] | None = field(default=None, metadata=SHOWN_IF_GIVEN)
    quat: tuple[Quaternion, ...] | None = field(default=None, metadata=SHOWN_IF_GIVEN)
    repeat: bool = field(default=False, metadata=SHOWN_IF_GIVEN)

    __repr__ = fields_repr
    _repr_html_ = fields_table

    if TYPE_CHECKING:

        def __init__(
            self,
            *,
            velocity: ArrayLike = ...,
            spin: ArrayLike = ...,
            surface_velocity: ArrayLike = ...,
            times: ArrayLike | None = None,
            pos: ArrayLike | None = None,
            quat: ArrayLike | None = None,
            repeat: bool = False,
        ) -> None: ...

    def __post_init__(self) -> None:
        for name in ("velocity", "spin", "surface_velocity"):
            value = validation.finite(getattr(self, name), (3,), f"Motion.{name}").tolist()
            self._set(name, STILL if not any(value) else tuple(value))
        if not isinstance(self.repeat, (bool, np.bool_)):
            raise ValueError(f"Motion.repeat is {shown(self.repeat)}; allowed are True and False")
        self._set("repeat", bool(self.repeat))
        if self.times is not None:
            self._check_table()
            return
        for name in ("pos", "quat"):
            if getattr(self, name) is not None:
                raise ValueError(f"Motion.{name} is given without times; allowed with it are the times of its rows")
        if self.repeat:
            raise ValueError("Motion.repeat is True without times; allowed is True for a table")

    @classmethod
    def table(
        cls,
        times: ArrayLike,
        pos: ArrayLike | None = None,
        quat: ArrayLike | None = None,
        repeat: bool = False,
        surface_velocity: ArrayLike = STILL,
    ) -> Motion:
        """Motion through the poses of a table, with continuous velocity and acceleration between its ends.

        Parameters
        ----------
        times : (n,) array_like
            Times since the motion was set, from 0 on, increasing [s]; at most `MOST_KNOTS`.
        pos : (n, 3) array_like, optional
            Places of the body's `pos` at these times, world frame [m]; between them it moves by a cubic spline. None:
            the body stays at its place.
        quat : (n, 4) array_like, optional
            Attitudes (w, x, y, z), each less than half a turn from the next one. Their components move by a cubic
            spline, scaled to unit length. None: the body keeps its attitude.
        repeat : bool
            True: the table is a period, and its last pose must be the first one. False: the body starts and ends at
            rest, and then stays.
        surface_velocity : (3,) array_like
            As in `Motion`.

        Raises
        ------
        ValueError
            Times that do not increase from 0, another number of poses, a pose that is not finite, two attitudes half a
            turn apart, or a table that repeats and does not end where it begins.
        """
        return cls(times=times, pos=pos, quat=quat, repeat=repeat, surface_velocity=surface_velocity)

    def _check_table(self) -> None:
        for name in ("velocity", "spin"):
            if any(getattr(self, name)):
                raise ValueError(f"Motion.{name} is {getattr(self, name)} with a table; allowed is (0, 0, 0)")
        times = validation.floats(self.times, "Motion.times", "are times [s]")
        n = times.size
        if times.ndim != 1 or not 2 <= n <= MOST_KNOTS:
            raise ValueError(f"Motion.times has the shape {times.shape}; allowed are 2 to {MOST_KNOTS} times")
        if not (np.isfinite(times).all() and times[0] == 0.0 and (np.diff(times) > 0.0).all()):
            raise ValueError(f"Motion.times is {shown(times)}; allowed are increasing times, the first of them 0")
        if self.pos is None and self.quat is None:
            raise ValueError("Motion.times is given without poses; allowed with it are pos, quat, or both")
        self._set("times", tuple(times.tolist()))
        if self.pos is not None:
            self._set("pos", _tuples(validation.finite(self.pos, (n, 3), "Motion.pos")))
        if self.quat is not None:
            self._set("quat", _tuples(validation.unit_quaternion(self.quat, (n, 4), "Motion.quat")))
            self._check_turns()
        if self.repeat:
            self._check_period()

    def _check_turns(self) -> None:
        q = np.array(self.quat)
        apart = np.flatnonzero(np.abs((q[1:] * q[:-1]).sum(axis=1)) < LEAST_COSINE)
        if len(apart):
            k = int(apart[0])
            raise ValueError(
                f"Motion.quat[{k + 1}] is half a turn from Motion.quat[{k}]; allowed is less: put an attitude between"
            )

    def _check_period(self) -> None:
        if self.pos is not None and np.abs(np.subtract(self.pos[-1], self.pos[0])).max() > SAME_POSE:
            raise ValueError(
                f"Motion.pos ends at {self.pos[-1]} and begins at {self.pos[0]} with repeat=True; allowed are equal "
                "places"
            )
        if self.quat is not None:
            ends = np.array([self.quat[0], self.quat[-1]])
            if min(np.abs(ends[1] - ends[0]).max(), np.abs(ends[1] + ends[0]).max()) > SAME_POSE:
                raise ValueError(
                    f"Motion.quat ends at {self.quat[-1]} and begins at {self.quat[0]} with repeat=True; allowed are "
                    "equal attitudes"
                )

    def _set(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    @property
    def column_count(self) -> int:
        """Number of columns that the motion needs in the table of parameters."""
        return columns.MOTION_SIZE + columns.KNOT_SIZE * len(self.times or ())

    def row(self, width: int, pos: ArrayLike, quat: ArrayLike, start: float) -> NDArray[np.float64]:
        """Columns (width,) of the motion in the table of parameters, as `kernels.flight.prescribed_motion` reads them.

        `pos` and `quat` are the body's pose where the table has none; `start` is the time of the world at which the
        motion begins [s].
        """
        row = np.zeros(width)
        row[columns.KIND] = columns.STEADY if self.times is None else columns.TABLE
        row[columns.VELOCITY : columns.VELOCITY + 3] = self.velocity
        row[columns.SPIN : columns.SPIN + 3] = self.spin
        row[columns.SURFACE : columns.SURFACE + 3] = self.surface_velocity
        row[columns.START] = start
        if self.times is not None:
            knots = _knots(self, pos, quat)
            row[columns.PERIOD] = self.times[-1] if self.repeat else 0.0
            row[columns.KNOTS] = len(knots)
            row[columns.MOTION_SIZE : columns.MOTION_SIZE + knots.size] = knots.ravel()
        return row

    def start_pose(self) -> dict[str, Any]:
        """Pose at the start of the table, `pos` and `quat`, as far as it has one; empty for a steady motion."""
        first = {"pos": self.pos and self.pos[0], "quat": self.quat and self.quat[0]}
        return {name: value for name, value in first.items() if value is not None}


def motion_of(value: Any) -> Motion | None:
    """Motion from a `Motion`, from its table in a scene file, or None.

    Raises
    ------
    ValueError
        The value is something else, or a table with unknown keys or values that `Motion` refuses.
    """
    if value is None or isinstance(value, Motion):
        return value
    if isinstance(value, Mapping):
        try:
            return Motion(**value)
        except TypeError as error:
            raise ValueError(f"motion is {shown(dict(value))}: {error}") from None
    raise ValueError(f"motion is {shown(value)}; allowed are None and a physics.Motion")


def _knots(motion: Motion, pos: ArrayLike, quat: ArrayLike) -> NDArray[np.float64]:
    """Knots (n, KNOT_SIZE) of a table: times, places and attitudes with their slopes."""
    times = np.array(motion.times)
    n = len(times)
    x = np.array(motion.pos) if motion.pos is not None else np.tile(np.asarray(pos, dtype=float), (n, 1))
    q = np.array(motion.quat) if motion.quat is not None else np.tile(np.asarray(quat, dtype=float), (n, 1))
    for k in range(1, n):
        if q[k] @ q[k - 1] < 0.0:
            q[k] *= -1.0  # q and -q are the same attitude; the nearer one is the shorter way
    sign = 1.0 if not motion.repeat or q[-1] @ q[0] > 0.0 else -1.0
    if motion.repeat:
        x[-1], q[-1] = x[0], sign * q[0]
    return np.hstack([times[:, None], x, slopes(times, x, motion.repeat), q, slopes(times, q, motion.repeat, sign)])


def slopes(times: NDArray[np.float64], y: NDArray[np.float64], repeat: bool, sign: float = 1.0) -> NDArray[np.float64]:
    """Slopes (n, d) of the cubic spline through y (n, d) at `times`, whose second derivative is continuous.

    At the ends they are 0 or, if the spline repeats, equal but for the factor `sign`, as the second derivative is.
    Between two intervals h and k with the steepnesses a and b the slopes satisfy

        m₋/h + 2 (1/h + 1/k) m + m₊/k = 3 (a/h + b/k).
    """
    n, h = len(times), np.diff(times)[:, None]
    steep, w = np.diff(y, axis=0) / h, (1.0 / h)[:, 0]
    A, b = np.zeros((n, n)), np.zeros_like(y)
    inner = np.arange(1, n - 1)
    A[inner, inner - 1], A[inner, inner], A[inner, inner + 1] = w[:-1], 2.0 * (w[:-1] + w[1:]), w[1:]
    b[1:-1] = 3.0 * (steep[:-1] * w[:-1, None] + steep[1:] * w[1:, None])
    A[0, 0] = A[-1, -1] = 1.0
    if repeat:
        A[-1, 0] = -sign
        A[0, 0], A[0, 1] = 2.0 * (w[0] + w[-1]), w[0]
        A[0, -2] += sign * w[-1]
        b[0] = 3.0 * (steep[0] * w[0] + sign * steep[-1] * w[-1])
    return np.linalg.solve(A, b)
