"""Bodies of a scene: immutable descriptions of shape, mass and start; their only numerics are mass properties."""

from __future__ import annotations

import functools
import math
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from physics import validation
from physics.annotations import Quaternion, Shape, Vector
from physics.html_table import fields_table
from physics.keywords import known_keywords
from physics.mass import inertia
from physics.mass.polyhedron import Polyhedron, convex_hull
from physics.scene.groups import GROUP, MASK, check_groups
from physics.scene.motion import Motion, motion_of
from physics.summary import SHOWN_IF_GIVEN, fields_repr, shown

FROM_DENSITY: Any = None  # default of `mass`, replaced by density times volume when the body is made


def _tuple(array: ArrayLike) -> Any:
    return tuple(float(v) for v in np.ravel(array))


def check_name(name: str, field: str = "name") -> None:
    """Raise a ValueError for a name that is no text, is empty, or has unprintable characters or outer blanks."""
    if not isinstance(name, str) or not name or name != name.strip() or not name.isprintable():
        raise ValueError(f"{field} is {shown(name)}; allowed are printable characters, no blank at the ends")


def check_coefficients(item: Any, prefix: str = "") -> None:
    """Check `friction` and `restitution` of a body or wall, and make them floats unless they are None.

    `prefix` stands before the name of the field in an error.
    """
    for name, check in (("friction", validation.non_negative), ("restitution", validation.share)):
        value = getattr(item, name)
        if value is not None:
            object.__setattr__(item, name, float(check(value, (), prefix + name)))


if TYPE_CHECKING:

    class _Shape:
        """Attributes of every shape, for type checkers."""

        kind: ClassVar[Shape]
        mass: float
        center: Vector

        @property
        def volume(self) -> float: ...

        @property
        def dimensions(self) -> NDArray[np.float64]: ...

        @staticmethod
        def uniform_moments(dimensions: NDArray[np.float64], mass: Any) -> NDArray[np.float64]: ...

        def bounding_radius(self, dimensions: NDArray[np.float64]) -> NDArray[np.float64]: ...

else:
    _Shape = object


def _telling_itself(check: Callable) -> Callable:
    """Wrap the `__post_init__` of a body: an error about a field tells the class, and the name of the body."""

    @functools.wraps(check)
    def checked(self) -> None:
        try:
            check(self)
        except ValueError as error:
            told = re.match(r"(\w+)(\[[^]]*\])?(\.\w+)?", str(error))
            if told is None or told.group(1) not in self.__dataclass_fields__:
                raise
            is_named = isinstance(self.name, str) and told.group(1) != "name"
            owner = f" of {shown(self.name)}" if is_named else ""
            message = f"{type(self).__name__}.{told.group()}{owner}{str(error)[told.end() :]}"
            raise ValueError(message) from None

    return checked


def body_repr(body: Body) -> str:
    """`repr` of a body, an expression that makes it again: the infinite mass of a fixed one is left out."""
    return fields_repr(body, omitted=("mass",) if body.fixed else ())


@dataclass(frozen=True, kw_only=True)
class Body(_Shape):
    """Base of all bodies; use `Block`, `Sphere`, `Ellipsoid`, `Capsule`, `Cylinder`, `Hull` or `Compound`.

    Parameters
    ----------
    pos, quat, linvel, angvel : array_like
        Start: centre of mass [m], unit quaternion (w, x, y, z) from body to world, velocity [m/s] and angular
        velocity [rad/s], world frame. A quaternion of norm 1 within 1e-4, as four decimals have it, is normalised.
    inertia_body : (3,) or (3, 3) array_like, optional
        Moments, or tensor, about the centre of mass in the body frame [kg m²]. None: uniform density.
    density : float, optional
        Density [kg/m³], given instead of `mass`, which becomes density times `volume`. The attribute is then None.
    name : str, optional
        Name of the body in files and environments; no other body or wall of a scene may have it. It changes no motion.
    friction, restitution : float, optional
        Coefficients μ, at least 0, and e, from 0 to 1. None: those of the scene's `Friction` and `Contact`, without
        which a scene has no friction and no contact. `World.set_parameters` changes them in each world. In a contact of
        two bodies `Friction.rule` and `Contact.restitution_rule` combine both, and at a wall with a coefficient, too.
        At a wall without one the body's own acts.
    fixed : bool
        True: the body stays where it is, like a wall of this shape. Other bodies rest on it and hit it; no force moves
        it. Mass, density and inertia must be left out; the attribute `mass` is then infinite. Velocities must be 0.
    group, mask : int
        Bits of the collision groups that the body belongs to, and of those that it touches. Two bodies, or a body and a
        wall, touch only if the group of each has a bit of the other's mask. By default all touch.
    motion : Motion, optional
        Prescribed motion of a fixed body, such as ``Motion(spin=(0, 1, 0))``. With a table `pos` and `quat` become
        those of its start.

    Raises
    ------
    ValueError
        A parameter out of range, not exactly one of mass and density, or a name without printable characters. A fixed
        body with a mass, a density, an inertia, a velocity, or a `center` other than 0. A motion without `fixed`.
    """

    pos: Vector = (0.0, 0.0, 0.0)
    quat: Quaternion = (1.0, 0.0, 0.0, 0.0)
    linvel: Vector = (0.0, 0.0, 0.0)
    angvel: Vector = (0.0, 0.0, 0.0)
    inertia_body: tuple[Vector, Vector, Vector] | None = None
    density: float | None = field(default=None, repr=False, compare=False)
    name: str | None = None
    friction: float | None = field(default=None, metadata=SHOWN_IF_GIVEN)
    restitution: float | None = field(default=None, metadata=SHOWN_IF_GIVEN)
    fixed: bool = field(default=False, metadata=SHOWN_IF_GIVEN)
    group: int = field(default=GROUP, metadata=SHOWN_IF_GIVEN)
    mask: int = field(default=MASK, metadata=SHOWN_IF_GIVEN)
    motion: Motion | None = field(default=None, metadata=SHOWN_IF_GIVEN)
    center = (0.0, 0.0, 0.0)  # of the shape, from the centre of mass; a block may have another

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        if "__post_init__" in vars(cls):
            cls.__post_init__ = _telling_itself(cls.__post_init__)  # type: ignore[method-assign]

    def _repr_html_(self) -> str:
        return fields_table(self, omitted=("mass",) if self.fixed else ())

    def __post_init__(self) -> None:
        if type(self) is Body:
            raise TypeError(
                "Body has no shape; allowed are Block, Sphere, Ellipsoid, Capsule, Cylinder, Hull, Compound"
            )
        if not isinstance(self.fixed, (bool, np.bool_)):
            raise ValueError(f"fixed is {shown(self.fixed)}; allowed are True and False")
        self._set("fixed", bool(self.fixed))
        self._set("motion", motion_of(self.motion))
        if self.motion is not None:
            self._check_motion(self.motion)
        if self.fixed:
            self._check_fixed()
        else:
            self._set_mass()
        for name in ("pos", "linvel", "angvel"):
            self._set(name, _tuple(validation.finite(getattr(self, name), (3,), name)))
        self._set("quat", _tuple(validation.unit_quaternion(self.quat, (4,), "quat")))
        if self.inertia_body is not None:
            tensor = inertia.check_inertia(self.inertia_body, "inertia_body")
            self._set("inertia_body", tuple(map(_tuple, tensor)))
        if self.name is not None:
            check_name(self.name)
        check_coefficients(self)
        check_groups(self)
        if not self.fixed:
            self._check_range()

    def _check_motion(self, motion: Motion) -> None:
        """Raise a ValueError for a motion of a body that is not fixed; take the pose at the start of a table."""
        if not self.fixed:
            raise ValueError(f"motion is {shown(motion)} of a body that is not fixed; allowed is None, or fixed=True")
        for name, value in motion.start_pose().items():
            self._set(name, value)

    def _check_fixed(self) -> None:
        """Raise a ValueError for parameters that a fixed body must not have; set `mass` to infinity."""
        if self.mass is not None and not self.mass == math.inf:
            raise ValueError(f"mass is {shown(self.mass)} of a fixed body; allowed is none: leave it out")
        for name in ("density", "inertia_body"):
            if getattr(self, name) is not None:
                raise ValueError(
                    f"{name} is {shown(getattr(self, name))} of a fixed body; allowed is none: leave it out"
                )
        for name in ("linvel", "angvel", "center"):
            if np.any(validation.finite(getattr(self, name), (3,), name)):
                raise ValueError(f"{name} is {shown(getattr(self, name))} of a fixed body; allowed is (0, 0, 0)")
        self._set("mass", math.inf)

    def _set_mass(self) -> None:
        """Check mass or density, of which exactly one must be given, and set `mass` [kg]; `density` becomes None."""
        if (self.mass is None) == (self.density is None):
            raise ValueError(
                f"mass is {shown(self.mass)} and density is {shown(self.density)}; allowed is exactly one of the two: "
                "mass [kg], or density [kg/m³]"
            )
        mass = self.mass
        if mass is None:
            mass = float(validation.positive(self.density, (), "density")) * self.volume
            self._set("density", None)
        self._set("mass", float(validation.positive(mass, (), "mass")))

    def _check_range(self) -> None:
        """Raise a ValueError if the mass or a moment of inertia is so small or large that its inverse is not finite."""
        with np.errstate(over="ignore", invalid="ignore"):
            moments = np.diagonal(self.inertia)
        inertia.check_range(np.array([self.mass]), moments[None])

    def _set(self, name: str, value: Any) -> None:
        object.__setattr__(self, name, value)

    @property
    def inertia(self) -> NDArray[np.float64]:
        """(3, 3) inertia tensor about the centre of mass in the body frame [kg m²]; infinite if fixed."""
        if self.fixed:
            return np.diag(np.full(3, math.inf))
        if self.inertia_body is not None:
            return np.array(self.inertia_body)
        return np.diag(self.uniform_moments(self.dimensions, self.mass))


@known_keywords
@dataclass(frozen=True)
class Block(Body):
    """A rectangular block, whose body axes run along its edges.

    Parameters
    ----------
    size : (3,) array_like
        Full edge lengths along body x, y, z [m].
    mass : float
        Mass [kg]; `density` may be given instead.
    center : (3,) array_like
        Position of the geometric centre, where the diagonals meet, relative to the centre of mass, along the body
        axes [m]: a block heavy on its +x side has a negative x here. `pos` is the centre of mass, so that the block
        occupies the space around ``pos + R(quat) center``. A center other than 0 means that the density is not uniform;
        `inertia_body`, about the centre of mass, must be given then.
    """

    size: Vector
    mass: float = FROM_DENSITY
    center: Vector = field(default=(0.0, 0.0, 0.0), kw_only=True)
    kind = "block"
    __repr__ = body_repr

    if TYPE_CHECKING:  # sequences and arrays are taken, tuples are kept

        def __init__(
            self,
            size: ArrayLike,
            mass: float | None = None,
            *,
            pos: ArrayLike = ...,
            quat: ArrayLike = ...,
            linvel: ArrayLike = ...,
            angvel: ArrayLike = ...,
            inertia_body: ArrayLike | None = None,
            density: float | None = None,
            name: str | None = None,
            friction: float | None = None,
            restitution: float | None = None,
            fixed: bool = False,
            group: int = GROUP,
            mask: int = MASK,
            motion: Motion | None = None,
            center: ArrayLike = ...,
        ) -> None: ...

    def __post_init__(self) -> None:
        self._set("size", _tuple(validation.positive(self.size, (3,), "size")))
        self._set("center", _tuple(validation.finite(self.center, (3,), "center")))
        if any(self.center) and self.inertia_body is None and not self.fixed:
            raise ValueError(
                f"center is {self.center!r} without inertia_body; give the inertia about the centre of mass"
            )
        super().__post_init__()

    @property
    def volume(self) -> float:
        """Volume [m³]."""
        return math.prod(self.size)

    @property
    def dimensions(self) -> NDArray[np.float64]:
        """Half edge lengths (3,) along body x, y, z [m]."""
        return 0.5 * np.array(self.size)

    @staticmethod
    def uniform_moments(dimensions: NDArray[np.float64], mass: Any) -> NDArray[np.float64]:
        """Principal moments (..., 3) [kg m²] of uniform blocks with half edges `dimensions` (..., 3) [m].

        The moments are about the body axes through the centre; `mass` (...) is in kg.
        """
        return inertia.block_moments(2 * dimensions, mass)

    @staticmethod
    def bounding_radius(dimensions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Radius (...) [m] of the sphere about the geometric centre through all vertices, from half edges (..., 3)."""
        a, b, c = np.moveaxis(dimensions * dimensions, -1, 0)
        return np.sqrt(a + b + c)


@known_keywords
@dataclass(frozen=True)
class Sphere(Body):
    """A solid sphere.

    Parameters
    ----------
    radius : float
        Radius [m].
    mass : float
        Mass [kg]; `density` may be given instead.
    """

    radius: float
    mass: float = FROM_DENSITY
    kind = "sphere"
    __repr__ = body_repr

    if TYPE_CHECKING:  # sequences and arrays are taken, tuples are kept

        def __init__(
            self,
            radius: float,
            mass: float | None = None,
            *,
            pos: ArrayLike = ...,
            quat: ArrayLike = ...,
            linvel: ArrayLike = ...,
            angvel: ArrayLike = ...,
            inertia_body: ArrayLike | None = None,
            density: float | None = None,
            name: str | None = None,
            friction: float | None = None,
            restitution: float | None = None,
            fixed: bool = False,
            group: int = GROUP,
            mask: int = MASK,
            motion: Motion | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        self._set("radius", float(validation.positive(self.radius, (), "radius")))
        super().__post_init__()

    @property
    def volume(self) -> float:
        """Volume [m³]."""
        return 4 / 3 * math.pi * math.prod((self.radius,) * 3)

    @property
    def dimensions(self) -> NDArray[np.float64]:
        """Radius, three times (3,) [m]: semi-axes, as of an ellipsoid."""
        return np.full(3, self.radius)

    @staticmethod
    def uniform_moments(dimensions: NDArray[np.float64], mass: Any) -> NDArray[np.float64]:
        """Principal moments (..., 3) [kg m²] of solid spheres of `mass` (...) [kg].

        `dimensions` (..., 3) is the radius, three times [m].
        """
        return inertia.ellipsoid_moments(dimensions, mass)

    @staticmethod
    def bounding_radius(dimensions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Radius (...) [m] of spheres with `dimensions` (..., 3), their radius three times."""
        return dimensions[..., 0]


@known_keywords
@dataclass(frozen=True)
class Ellipsoid(Body):
    """A solid ellipsoid.

    Parameters
    ----------
    semi_axes : (3,) array_like
        Semi-axes along body x, y, z [m].
    mass : float
        Mass [kg]; `density` may be given instead.
    """

    semi_axes: Vector
    mass: float = FROM_DENSITY
    kind = "ellipsoid"
    __repr__ = body_repr

    if TYPE_CHECKING:  # sequences and arrays are taken, tuples are kept

        def __init__(
            self,
            semi_axes: ArrayLike,
            mass: float | None = None,
            *,
            pos: ArrayLike = ...,
            quat: ArrayLike = ...,
            linvel: ArrayLike = ...,
            angvel: ArrayLike = ...,
            inertia_body: ArrayLike | None = None,
            density: float | None = None,
            name: str | None = None,
            friction: float | None = None,
            restitution: float | None = None,
            fixed: bool = False,
            group: int = GROUP,
            mask: int = MASK,
            motion: Motion | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        self._set("semi_axes", _tuple(validation.positive(self.semi_axes, (3,), "semi_axes")))
        super().__post_init__()

    @property
    def volume(self) -> float:
        """Volume [m³]."""
        return 4 / 3 * math.pi * math.prod(self.semi_axes)

    @property
    def dimensions(self) -> NDArray[np.float64]:
        """Semi-axes (3,) along body x, y, z [m]."""
        return np.array(self.semi_axes)

    @staticmethod
    def uniform_moments(dimensions: NDArray[np.float64], mass: Any) -> NDArray[np.float64]:
        """Principal moments (..., 3) [kg m²] of solid ellipsoids of semi-axes `dimensions` (..., 3) [m].

        The moments are about the body axes; `mass` (...) is in kg.
        """
        return inertia.ellipsoid_moments(dimensions, mass)

    @staticmethod
    def bounding_radius(dimensions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Largest semi-axis (...) [m] of ellipsoids with semi-axes `dimensions` (..., 3) [m]."""
        return np.max(dimensions, axis=-1)


@known_keywords
@dataclass(frozen=True)
class Hull(Body):
    """The convex hull of points, of uniform density: a wedge, a prism, a rock.

    `points` fix the shape only, and `pos` the place: the hull is shifted so that its centre of mass lies at `pos`.
    `centroid` is the centre of mass in the coordinates of `points`. So ``pos=hull.centroid`` leaves points that are
    world coordinates where they are.

    Parameters
    ----------
    points : (n, 3) array_like
        Coordinates along the body axes, from any origin [m]. Points inside the hull are ignored.
    mass : float
        Mass [kg]; `density` may be given instead.

    Raises
    ------
    ValueError
        Fewer than four points, all in one plane (within 1e-9 of the size) or nearly on a line, or a hull of more than
        `polyhedron.MOST_CORNERS` corners.
    """

    points: tuple[Vector, ...]
    mass: float = FROM_DENSITY
    kind = "hull"

    __repr__ = body_repr

    if TYPE_CHECKING:  # sequences and arrays are taken, tuples are kept

        def __init__(
            self,
            points: ArrayLike,
            mass: float | None = None,
            *,
            pos: ArrayLike = ...,
            quat: ArrayLike = ...,
            linvel: ArrayLike = ...,
            angvel: ArrayLike = ...,
            inertia_body: ArrayLike | None = None,
            density: float | None = None,
            name: str | None = None,
            friction: float | None = None,
            restitution: float | None = None,
            fixed: bool = False,
            group: int = GROUP,
            mask: int = MASK,
            motion: Motion | None = None,
        ) -> None: ...

    def __post_init__(self) -> None:
        self._set("points", tuple(map(_tuple, validation.rows(self.points, 3, "points"))))
        if self.points and not np.abs(self.points).max() < 1 / inertia.LEAST:
            raise ValueError(f"points is {shown(self.points)}; allowed are coordinates below {1 / inertia.LEAST:g}")
        convex_hull(self.points)
        super().__post_init__()

    @property
    def polyhedron(self) -> Polyhedron:
        """Corners, faces and edges about the centre of mass, body frame; hulls of equal points share one object."""
        return convex_hull(self.points)

    @property
    def centroid(self) -> Vector:
        """Centre of mass in the coordinates of `points` [m]."""
        return _tuple(self.polyhedron.centroid)

    @property
    def inertia(self) -> NDArray[np.float64]:
        """(3, 3) inertia tensor about the centre of mass in the body frame [kg m²]."""
        if self.fixed or self.inertia_body is not None:
            return super().inertia
        return self.polyhedron.inertia(self.mass)

    @property
    def volume(self) -> float:
        """Volume [m³]."""
        return self.polyhedron.volume

    @property
    def dimensions(self) -> NDArray[np.float64]:
        """Largest distance (3,) of the hull from the centre of mass along each body axis, in either direction [m]."""
        return np.abs(self.polyhedron.vertices).max(axis=0)

    def bounding_radius(self, dimensions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Distance [m] of the farthest corner from the centre of mass, once for each row of `dimensions` (..., 3)."""
        return np.full(np.shape(dimensions)[:-1], self.polyhedron.radius)
