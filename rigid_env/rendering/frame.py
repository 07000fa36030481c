"""Frame: everything that one picture shows, as plain arrays in the world frame and SI units.

It is the interface between simulation and renderer.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from rigid_env.rendering import palette
from rigid_env.rendering.geometry import quaternion_product, rotation_matrices

BODY_KINDS = ("block", "sphere", "ellipsoid", "hull", "capsule", "cylinder", "compound")

FACE_COUNT = 6
"""Faces of a block, in the order -x, +x, -y, +y, -z, +z of its body axes."""


NO_POINTS = np.zeros((0, 3))
NO_POINTS.setflags(write=False)


def body_colour(body, index):
    """sRGB colour of a `BodyView` before shading: its own, or the palette's colour for its index in the frame."""
    return tuple(body.colour) if body.colour is not None else palette.BODIES[index % len(palette.BODIES)]


@dataclass(frozen=True, eq=False)
class BodyView:
    """Shape, pose and colour of one rigid body in a picture.

    Parameters
    ----------
    kind : {"block", "sphere", "ellipsoid", "hull", "capsule", "cylinder", "compound"}
        Kind of shape.
    dimensions : (3,) float
        [m], along the body axes. A block: edges. A sphere or ellipsoid: semi-axes. A capsule or cylinder: half
        extents, its axis along body y. A hull or compound: largest distances of its points from `pos`.
    pos : (3,) float
        Geometric centre of the shape; of a hull or compound its centre of mass. World frame [m].
    quat : (4,) float
        Unit quaternion w, x, y, z, body to world.
    colour : (3,) int or None
        sRGB, 0..255; None takes the next colour of the palette.
    corners : (n, 3) float
        Corners of a hull from `pos`, body frame [m]; other shapes have none.
    faces : tuple of tuples of int
        Indices of the corners of each face of a hull, counter-clockwise as seen from outside.
    parts : tuple of BodyView
        Convex parts of a compound, with `pos` and `quat` in the frame of the compound, and without colours.

    Raises
    ------
    ValueError
        On an unknown kind, a wrong shape, a dimension that is not positive, a hull without faces, or a compound without
        parts.
    """

    kind: str
    dimensions: np.ndarray
    pos: np.ndarray
    quat: np.ndarray = (1.0, 0.0, 0.0, 0.0)
    colour: tuple[int, int, int] | None = None
    corners: np.ndarray = field(default_factory=lambda: NO_POINTS)
    faces: tuple[tuple[int, ...], ...] = ()
    parts: tuple[BodyView, ...] = ()

    def __post_init__(self):
        if self.kind not in BODY_KINDS:
            raise ValueError(f"kind must be one of {BODY_KINDS}, not {self.kind!r}")
        _set_array(self, "dimensions", (3,))
        _set_array(self, "pos", (3,))
        _set_array(self, "quat", (4,))
        _set_array(self, "corners", (-1, 3))
        if (self.kind == "hull") != bool(self.faces):
            raise ValueError(f"faces must be those of a hull, and of nothing else, not {self.faces!r} of a {self.kind}")
        object.__setattr__(self, "parts", tuple(self.parts))
        if (self.kind == "compound") != bool(self.parts):
            raise ValueError(f"a compound alone must have parts, not {len(self.parts)} of a {self.kind}")
        if not (self.dimensions > 0.0).all():
            raise ValueError(f"dimensions must be positive, not {self.dimensions}")

    @cached_property
    def solids(self) -> tuple[BodyView, ...]:
        """Convex views, world frame: the body alone, or the parts of a compound, in its colour."""
        if not self.parts:
            return (self,)
        R = rotation_matrices(np.array([self.quat]))[0]
        return tuple(
            replace(
                part, pos=self.pos + R @ part.pos, quat=quaternion_product(self.quat, part.quat), colour=self.colour
            )
            for part in self.parts
        )


@dataclass(frozen=True, eq=False)
class Poses:
    """Poses and sizes of all bodies of a frame, in one array each.

    Parameters
    ----------
    pos : (n, 3) float64
        `BodyView.pos` [m].
    rotation : (n, 3, 3) float64
        Rotation matrices: columns are the body's axes in the world frame.
    size : (n, 3) float64
        `BodyView.dimensions` [m].
    radius : (n,) float64
        Radius of a sphere about `pos` that holds the body [m].
    """

    pos: np.ndarray
    rotation: np.ndarray
    size: np.ndarray
    radius: np.ndarray


@dataclass(frozen=True, eq=False)
class WallView:
    """One wall in a picture: bodies may be where normal·x ≥ offset.

    Parameters
    ----------
    normal : (3,) float
        Normal that points out of the wall, world frame; normal and offset are divided by its length.
    offset : float
        [m].

    Raises
    ------
    ValueError
        If the normal is zero or not of shape (3,).
    """

    normal: np.ndarray
    offset: float = 0.0

    def __post_init__(self):
        _set_array(self, "normal", (3,))
        length = float(np.linalg.norm(self.normal))
        if length == 0.0:
            raise ValueError("a wall's normal must not be zero")
        object.__setattr__(self, "normal", self.normal / length)
        object.__setattr__(self, "offset", float(self.offset) / length)


@dataclass(frozen=True, eq=False)
class GoalView:
    """Goal of the agent in a picture: a place on the floor, a face of body 0 to be turned, or both.

    Parameters
    ----------
    pos : (3,) float or None
        Target of the body's centre, world frame [m]; a disc is drawn on the floor below it. None: no disc.
    radius : float
        Radius of the disc or ring [m].
    reached : bool
        Whether the goal is reached; it chooses the colour.
    goal_face : int or None
        Face of body 0 (a block) to highlight: 0..5 = -x, +x, -y, +y, -z, +z of the body's axes.
    axis : (3,) float or None
        Unit vector of the axis of a ring that is drawn around `pos` itself, on a stand; it replaces the disc.

    Raises
    ------
    ValueError
        If `goal_face` is not 0..5, or `pos` or `axis` not of shape (3,).
    """

    pos: np.ndarray | None = None
    radius: float = 1.0
    reached: bool = False
    goal_face: int | None = None
    axis: np.ndarray | None = None

    def __post_init__(self):
        for name in ("pos", "axis"):
            if getattr(self, name) is not None:
                _set_array(self, name, (3,))
        if self.goal_face is not None and self.goal_face not in range(FACE_COUNT):
            raise ValueError(f"goal_face must be 0..{FACE_COUNT - 1}, not {self.goal_face!r}")


@dataclass(frozen=True, eq=False)
class Frame:
    """All contents of one picture.

    Parameters
    ----------
    bodies : tuple of BodyView
    walls : tuple of WallView
    goal : GoalView or None
    contact_points : (n, 3) float
        World frame [m].
    contact_forces : (n, 3) float
        Force on the body at each contact point, world frame [N].
    applied_force : (3,) or (n, 3) float
        Force at the centre of body 0, or of the first n bodies, world frame [N]; kept as (n, 3).
    applied_torque : (3,) or (n, 3) float
        Torque on the same bodies, world frame [N m]; kept as (n, 3).
    sensors : tuple of BodyView
        Convex regions, drawn translucent.
    path : (n, 3) float
        Earlier positions of a body, world frame [m]; they are drawn as a line, and again on the floor below.
    text : tuple of str
        Lines of text in the upper left corner.
    force_scale : float
        Length of an arrow per unit of force [m/N]; the arc of a torque is |torque| · force_scale / (1 m) long.

    Raises
    ------
    ValueError
        If an array has the wrong shape.
    """

    bodies: tuple[BodyView, ...] = ()
    walls: tuple[WallView, ...] = ()
    goal: GoalView | None = None
    contact_points: np.ndarray = field(default_factory=lambda: NO_POINTS)
    contact_forces: np.ndarray = field(default_factory=lambda: NO_POINTS)
    applied_force: np.ndarray = field(default_factory=lambda: NO_POINTS)
    applied_torque: np.ndarray = field(default_factory=lambda: NO_POINTS)
    text: tuple[str, ...] = ()
    force_scale: float = 0.1
    path: np.ndarray = field(default_factory=lambda: NO_POINTS)
    sensors: tuple[BodyView, ...] = ()

    def __post_init__(self):
        for name in ("bodies", "walls", "text", "sensors"):
            object.__setattr__(self, name, tuple(getattr(self, name)))
        _set_array(self, "contact_points", (-1, 3))
        _set_array(self, "path", (-1, 3))
        _set_array(self, "contact_forces", (len(self.contact_points), 3))
        for name in ("applied_force", "applied_torque"):
            if np.ndim(getattr(self, name)) == 1:
                object.__setattr__(self, name, np.array([getattr(self, name)], dtype=np.float64))
            _set_array(self, name, (-1, 3))
            if len(getattr(self, name)) > max(1, len(self.bodies)):
                raise ValueError(f"{name} has {len(getattr(self, name))} rows; allowed are at most {len(self.bodies)}")

    @property
    def has_arrows(self):
        """True if the frame has a contact point, or an applied force or torque."""
        return len(self.contact_points) > 0 or bool(np.any(self.applied_force)) or bool(np.any(self.applied_torque))

    @cached_property
    def owners(self):
        """Indices (solids,) int of the bodies to which the bodies of `solids` belong."""
        return np.repeat(np.arange(len(self.bodies)), [len(body.solids) for body in self.bodies])

    @cached_property
    def solids(self):
        """Frame with the parts of compounds as bodies, each in the colour of its compound; itself without compounds."""
        if not any(body.parts for body in self.bodies):
            return self
        views = [
            replace(solid, colour=body_colour(body, index))
            for index, body in enumerate(self.bodies)
            for solid in body.solids
        ]
        return replace(self, bodies=views)

    @cached_property
    def poses(self):
        """Poses and sizes of the bodies as `Poses`."""
        count = len(self.bodies)
        pos, size = (
            np.array([getattr(b, name) for b in self.bodies]).reshape(count, 3) for name in ("pos", "dimensions")
        )
        rotation = rotation_matrices(np.array([body.quat for body in self.bodies]).reshape(count, 4))
        is_block = np.array([body.kind == "block" for body in self.bodies], dtype=bool)
        # half the diagonal of a block, the longest semi-axis of a round body, the corner of a box around a hull
        is_round = np.array([body.kind in ("sphere", "ellipsoid", "capsule") for body in self.bodies], dtype=bool)
        radius = np.where(
            is_round, size.max(axis=1), np.where(is_block, 0.5, 1.0) * np.sqrt(np.sum(size * size, axis=1))
        )
        return Poses(pos, rotation, size, radius)


def _set_array(view, name, shape):
    """Replace an attribute of a view by a read-only float64 copy, and check its shape; -1 means any length."""
    given = getattr(view, name)
    if _is_kept(given):
        array = given  # no copy: the array of another view, passed on by `dataclasses.replace`
    else:
        array = np.array(given, dtype=np.float64)
        array.setflags(write=False)
    if array.size == 0 and shape[0] in (-1, 0):
        array = array.reshape(0, *shape[1:])
    if array.shape != shape and (
        array.ndim != len(shape) or any(want not in (-1, have) for want, have in zip(shape, array.shape))
    ):
        raise ValueError(f"{name} must have shape {shape}, not {array.shape}")
    object.__setattr__(view, name, array)


def _is_kept(array):
    """True if an array can no longer change: it is read-only, and not a view of another array."""
    return type(array) is np.ndarray and array.dtype == np.float64 and not array.flags.writeable and array.base is None
