"""Mass properties: the table of inertia tensors, and the algebra that combines them.

Every function for a shape assumes uniform density and returns the inertia tensor
[kg m²] about the centre of mass as a (3, 3) array in the body frame, which is
the principal frame. A body of revolution (cylinder, disk) and a rod have their
axis along **body y**, so that a body with the identity as attitude stands upright
in a world whose y is up. Lengths are in metres and masses in kilograms; a length
or mass that is not finite and positive raises a ValueError that names it.

Sources: Witkin and Baraff, *Physically Based Modeling* (SIGGRAPH course notes,
1997), "Rigid Body Simulation I", sections 2.10-2.11, for the tensor and the
block; Goldstein, Poole and Safko, *Classical Mechanics*, 3rd ed., 2002, sections
5.3-5.4, for the parallel-axis theorem and the principal axes; the moments of
the table are the integrals of rr·I - r rᵀ over each shape.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np
from numpy.typing import ArrayLike

from physics import validation
from physics.summary import shown

# Rounding error of sums of a thousand terms, relative to the largest moment (1e3 · 4 · 2.2e-16).
RELATIVE_TOLERANCE = 1e-12
# Rounding error of R I Rᵀ off the diagonal of a tensor that should be diagonal, relative to the largest moment.
DIAGONAL_TOLERANCE = 8 * np.finfo(float).eps


# Smallest allowed mass and moment of inertia [kg, kg m²]; the largest is its inverse. Products of two such numbers, and
# of their inverses, are normal floats.
LEAST = 1e-150


def _floats(value: ArrayLike, shape: tuple[int, ...], field: str) -> np.ndarray:
    """Convert `value` to a finite float64 array of `shape` (-1: any length); an error calls the argument `field`."""
    array = np.array(validation.floats(value, field, f"are numbers in shape {shape}"))
    fits = array.ndim == len(shape) and all(want in (-1, have) for want, have in zip(shape, array.shape))
    if not fits or not np.all(np.isfinite(array)):
        raise ValueError(f"{field} is {value!r}; allowed are finite numbers in shape {shape}")
    return array


def _positive(value: ArrayLike, shape: tuple[int, ...], field: str) -> np.ndarray:
    """Convert `value` to a finite, positive float64 array of `shape`; an error calls the argument `field`."""
    array = _floats(value, shape, field)
    if not np.all(array > 0):
        raise ValueError(f"{field} is {value!r}; allowed is what is greater than 0")
    return array


def _hollow(radius: float, inner_radius: float | None) -> tuple[float, float]:
    """Check and return outer and inner radius of a hollow body [m]; `inner_radius` None is an infinitely thin wall."""
    outer = float(_positive(radius, (), "radius"))
    inner = outer if inner_radius is None else float(_floats(inner_radius, (), "inner_radius"))
    if not 0 <= inner <= outer:
        raise ValueError(f"inner_radius is {inner_radius!r}; allowed is from 0 to the radius, {outer}")
    return outer, inner


def _of_revolution(across: float, along: float) -> np.ndarray:
    """Inertia tensor (3, 3) of a body of revolution about body y, from its moments across and along that axis."""
    return np.diag([across, along, across])


def block_moments(size: np.ndarray, mass: float | np.ndarray) -> np.ndarray:
    """Principal moments (..., 3) [kg m²] of solid blocks of edges `size` (..., 3) [m] and `mass` (...) [kg]."""
    return _plane_symmetric(size, mass) / 12


def ellipsoid_moments(semi_axes: np.ndarray, mass: float | np.ndarray) -> np.ndarray:
    """Principal moments (..., 3) [kg m²] of solid ellipsoids of `semi_axes` (..., 3) [m] and `mass` (...) [kg]."""
    return _plane_symmetric(semi_axes, mass) / 5


def capsule_moments(dimensions: np.ndarray, mass: float | np.ndarray) -> np.ndarray:
    """Principal moments (..., 3) [kg m²] of solid capsules along body y, of `mass` (...) [kg].

    `dimensions` (..., 3) are half extents (r, l + r, r) [m]. The cylinder, of length 2 l, has the mass m, and both
    hemispheres together have M. The centre of a hemisphere is 3 r/8 from its plane, so that across the axis they have
    M (2 r²/5 + l² + 3 l r/4), by the parallel-axis theorem twice.
    """
    r, square = dimensions[..., 0], dimensions[..., 0] * dimensions[..., 0]
    half = dimensions[..., 1] - r
    cylinder = mass * (half / (half + 2 / 3 * r))
    ball = mass - cylinder
    across = cylinder * (square / 4 + half * half / 3) + ball * (2 / 5 * square + half * (half + 3 / 4 * r))
    along = cylinder * (square / 2) + ball * (2 / 5 * square)
    return np.stack([across, along, across], axis=-1)


def cylinder_moments(dimensions: np.ndarray, mass: float | np.ndarray) -> np.ndarray:
    """Principal moments (..., 3) [kg m²] of solid cylinders along body y, of `mass` (...) [kg].

    `dimensions` (..., 3) are half extents (r, l, r) [m]: M r²/2 along the axis, M (r²/4 + l²/3) across it.
    """
    r, half = dimensions[..., 0], dimensions[..., 1]
    across, along = mass * (r * r / 4 + half * half / 3), mass * (r * r / 2)
    return np.stack([across, along, across], axis=-1)


def _plane_symmetric(axes: np.ndarray, mass: float | np.ndarray) -> np.ndarray:
    """Products (b² + c², a² + c², a² + b²) mass (..., 3), where `axes` (..., 3) are (a, b, c).

    Divided by 12 they are the moments of blocks with these edges, by 5 those of ellipsoids with these semi-axes.
    """
    a, b, c = np.moveaxis(axes * axes, -1, 0)
    return np.stack([b + c, a + c, a + b], axis=-1) * np.asarray(mass)[..., None]


def block(size: ArrayLike, mass: float) -> np.ndarray:
    """Inertia tensor (3, 3) of a solid block with edges `size` (3,) [m] along the body axes."""
    return np.diag(block_moments(_positive(size, (3,), "size"), _positive(mass, (), "mass")))


def solid_ellipsoid(semi_axes: ArrayLike, mass: float) -> np.ndarray:
    """Inertia tensor (3, 3) of a solid ellipsoid with `semi_axes` (3,) [m] along the body axes."""
    return np.diag(ellipsoid_moments(_positive(semi_axes, (3,), "semi_axes"), _positive(mass, (), "mass")))


def solid_sphere(radius: float, mass: float) -> np.ndarray:
    """Inertia tensor (3, 3) of a solid sphere: 2/5 M r² about any axis."""
    return hollow_sphere(radius, mass, 0.0)


def hollow_sphere(radius: float, mass: float, inner_radius: float | None = None) -> np.ndarray:
    """Inertia tensor (3, 3) of a hollow sphere: 2/3 M r² about any axis if its wall is thin (`inner_radius` None).

    A wall between the radii r and R has 2/5 M (R⁵ - r⁵) / (R³ - r³). The code
    divides both differences by R - r, which avoids cancellation for thin walls.
    """
    outer, inner = _hollow(radius, inner_radius)
    mass = float(_positive(mass, (), "mass"))
    ratio = inner / outer
    fifth = 1 + ratio * (1 + ratio * (1 + ratio * (1 + ratio)))
    third = 1 + ratio * (1 + ratio)
    return np.diag([0.4 * mass * outer**2 * (fifth / third)] * 3)


def solid_cylinder(radius: float, height: float, mass: float) -> np.ndarray:
    """Inertia tensor (3, 3) of a solid cylinder along body y: M r²/2 about the axis, M (3 r² + h²)/12 across it."""
    return hollow_cylinder(radius, height, mass, 0.0)


def hollow_cylinder(radius: float, height: float, mass: float, inner_radius: float | None = None) -> np.ndarray:
    """Inertia tensor (3, 3) of a tube with open ends along body y; its wall is thin if `inner_radius` is None.

    A wall between the radii r and R has M (R² + r²)/2 about the axis and
    M (3 (R² + r²) + h²)/12 across it.
    """
    outer, inner = _hollow(radius, inner_radius)
    height = float(_positive(height, (), "height"))
    mass = float(_positive(mass, (), "mass"))
    squares = outer**2 + inner**2
    return _of_revolution(across=mass * (3 * squares + height**2) / 12, along=mass * squares / 2)


def disk(radius: float, mass: float) -> np.ndarray:
    """Inertia tensor (3, 3) of a flat disk with its axis along body y: M r²/2 about the axis, M r²/4 across it."""
    square = float(_positive(radius, (), "radius")) ** 2
    mass = float(_positive(mass, (), "mass"))
    return _of_revolution(across=mass * square / 4, along=mass * square / 2)


def solid_capsule(radius: float, length: float, mass: float) -> np.ndarray:
    """Inertia tensor (3, 3) of a solid capsule along body y; `length` [m] is that of its cylinder alone."""
    radius, half = float(_positive(radius, (), "radius")), 0.5 * float(_positive(length, (), "length"))
    return np.diag(capsule_moments(np.array([radius, half + radius, radius]), float(_positive(mass, (), "mass"))))


def rod(length: float, mass: float) -> np.ndarray:
    """Inertia tensor (3, 3) of a thin rod along body y: M L²/12 across the rod, 0 about it.

    A rod may be a part of a body (`compose`), but not a whole one, since `check_inertia` refuses a moment of 0.
    """
    length = float(_positive(length, (), "length"))
    return _of_revolution(across=float(_positive(mass, (), "mass")) * length**2 / 12, along=0.0)


def _displaced(offset: np.ndarray, mass: float) -> np.ndarray:
    """Inertia tensor M (d·d 1 - d dᵀ) of a point mass M [kg] at the offset d (3,) [m]."""
    return mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))


def parallel_axis(inertia: ArrayLike, mass: float, offset: ArrayLike) -> np.ndarray:
    """Inertia tensor about another point than the centre of mass (Steiner's theorem).

    Parameters
    ----------
    inertia : (3, 3)
        Inertia tensor about the centre of mass [kg m²].
    mass : float
        Mass [kg].
    offset : (3,)
        Vector d between the centre of mass and the other point [m], along the axes of `inertia`; its sign does not
        matter.

    Returns
    -------
    (3, 3) float64
        inertia + mass (d·d 1 - d dᵀ), along the same axes [kg m²].
    """
    return _floats(inertia, (3, 3), "inertia") + _displaced(
        _floats(offset, (3,), "offset"), float(_positive(mass, (), "mass"))
    )


def rotate(inertia: ArrayLike, R: ArrayLike) -> np.ndarray:
    """Inertia tensor R I Rᵀ of a body that is turned by the rotation matrix `R` (3, 3); exactly symmetric."""
    R = _floats(R, (3, 3), "R")
    if np.abs(R.T @ R - np.eye(3)).max() > RELATIVE_TOLERANCE or np.linalg.det(R) < 0:
        raise ValueError(f"R is {R!r}; allowed is a rotation matrix: RᵀR = 1 and det R = 1")
    turned = R @ _floats(inertia, (3, 3), "inertia") @ R.T
    return (turned + turned.T) / 2


@dataclass(frozen=True, eq=False)
class MassProperties:
    """Mass, centre of mass and inertia tensor of a body, all in one frame.

    Attributes
    ----------
    mass : float
        Mass [kg], greater than 0.
    centre : (3,) float64, read-only
        Centre of mass [m].
    inertia : (3, 3) float64, read-only
        Inertia tensor about `centre` [kg m²].
    """

    mass: float
    centre: np.ndarray
    inertia: np.ndarray

    def __post_init__(self) -> None:
        object.__setattr__(self, "mass", float(_positive(self.mass, (), "mass")))
        for name, shape in (("centre", (3,)), ("inertia", (3, 3))):
            array = _floats(getattr(self, name), shape, name)
            array.flags.writeable = False
            object.__setattr__(self, name, array)

    def placed(self, pos: ArrayLike = (0, 0, 0), R: ArrayLike | None = None) -> MassProperties:
        """Mass properties of the same body in another frame.

        In that frame the old frame has its origin at `pos` (3,) [m], and its axes are the columns of `R` (3, 3).
        """
        R = np.eye(3) if R is None else _floats(R, (3, 3), "R")
        return MassProperties(self.mass, _floats(pos, (3,), "pos") + R @ self.centre, rotate(self.inertia, R))


def compose(parts: Sequence[MassProperties]) -> MassProperties:
    """Mass properties of a body made of rigidly joined parts, which must all be in one frame.

    `MassProperties.placed` brings a part into that frame.
    """
    parts = tuple(parts)
    if not parts:
        raise ValueError("parts is empty; allowed is one part or more")
    masses = np.array([part.mass for part in parts])
    mass = masses.sum()
    centre = masses @ np.array([part.centre for part in parts]) / mass
    inertia = sum(part.inertia + _displaced(part.centre - centre, part.mass) for part in parts)
    return MassProperties(mass, centre, inertia)


def point_cloud(positions: ArrayLike, masses: ArrayLike) -> MassProperties:
    """Mass properties of n particles at `positions` (n, 3) [m] with `masses` (n,) [kg]."""
    positions = _floats(positions, (-1, 3), "positions")
    masses = _positive(masses, (len(positions),), "masses")
    if not len(masses):
        raise ValueError(f"positions is {positions!r}; allowed is one particle or more")
    mass = masses.sum()
    centre = masses @ positions / mass
    r = positions - centre
    second_moment = (masses[:, None] * r).T @ r
    return MassProperties(mass, centre, np.trace(second_moment) * np.eye(3) - second_moment)


def principal_axes(inertia: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Principal moments and axes of an inertia tensor: inertia = R diag(moments) Rᵀ.

    Parameters
    ----------
    inertia : (3, 3)
        Symmetric tensor [kg m²].

    Returns
    -------
    moments : (3,) float64
        Principal moments [kg m²], in the order of the columns of R.
    R : (3, 3) float64
        Rotation from the principal frame to the frame of `inertia`. Of the 24
        possible ones, which differ in order and direction of the axes, it is the
        nearest to the identity (largest trace). A tensor that is diagonal, up to
        `DIAGONAL_TOLERANCE`, gives the identity and its diagonal bit for bit.
    """
    inertia = _floats(inertia, (3, 3), "inertia")
    diagonal = np.diag(inertia).copy()
    if np.abs(inertia - np.diag(diagonal)).max() <= DIAGONAL_TOLERANCE * np.abs(diagonal).max():
        return diagonal, np.eye(3)
    moments, axes = np.linalg.eigh((inertia + inertia.T) / 2)
    best = (np.array([0, 1, 2]), np.eye(3), -np.inf)
    for order in permutations(range(3)):
        R = axes[:, order] * np.where(np.diag(axes[:, order]) < 0, -1.0, 1.0)
        if np.linalg.det(R) < 0:
            R[:, np.argmin(np.diag(R))] *= -1
        if np.trace(R) > best[2]:
            best = (moments[list(order)], R, np.trace(R))
    return best[0], best[1]


def check_range(masses: np.ndarray, moments: np.ndarray) -> None:
    """Refuse masses (n,) [kg] and principal moments (n, 3) [kg m²] whose inverses would leave the range of floats.

    Raises
    ------
    ValueError
        A number is not between `LEAST` and 1 / `LEAST`. The message names mass and moments of the first such body.
    """
    numbers = np.concatenate((masses[:, None], moments), axis=1)
    good = (numbers >= LEAST) & (numbers <= 1 / LEAST)
    if not good.all():
        k = int(np.argmin(good.all(axis=1)))
        raise ValueError(
            f"mass is {float(masses[k])!r} kg, and the moments of inertia are {shown(moments[k])} kg m²; allowed is "
            f"what lies between {LEAST:g} and {1 / LEAST:g}: choose other units"
        )


def check_inertia(inertia: ArrayLike, field: str) -> np.ndarray:
    """Check that a body can have this inertia tensor; return it as an exactly symmetric matrix.

    Parameters
    ----------
    inertia : (3, 3), or (3,) principal moments
        Inertia about the centre of mass [kg m²].
    field : str
        Name of the argument in messages.

    Returns
    -------
    (3, 3) float64
        The tensor, symmetric bit for bit.

    Raises
    ------
    ValueError
        The tensor is not finite, symmetric and positive definite, or a principal moment
        exceeds the sum of the other two (it equals the sum for a flat body). Both rules hold
        up to `RELATIVE_TOLERANCE` of the largest moment. The message names field, value and rule.
    """
    try:
        flat = np.ndim(inertia) == 1
    except ValueError:
        flat = False
    tensor = np.diag(_floats(inertia, (3,), field)) if flat else _floats(inertia, (3, 3), field)
    if np.abs(tensor - tensor.T).max() > RELATIVE_TOLERANCE * np.abs(tensor).max():
        raise ValueError(f"{field} is {inertia!r}; allowed is a symmetric tensor")
    tensor = (tensor + tensor.T) / 2
    moments, R = principal_axes(tensor)
    a, b, c = np.sort(moments)
    rounding = 0.0 if np.array_equal(R, np.eye(3)) else RELATIVE_TOLERANCE * c
    if a <= rounding:
        raise ValueError(
            f"{field} is {inertia!r}; allowed are principal moments greater than 0, these are {a}, {b}, {c}"
        )
    if c > (a + b) * (1 + RELATIVE_TOLERANCE):
        raise ValueError(
            f"{field} is {inertia!r}; allowed are principal moments of which none exceeds the sum"
            f" of the other two (triangle inequality), these are {a}, {b}, {c}"
        )
    return tensor
