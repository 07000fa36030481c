"""Built-in force fields: a small frozen dataclass for each. Formulas and sources are in `physics.kernels.forces`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from physics import validation
from physics.annotations import Vector
from physics.kernels.forces import angular_drag, buoyancy, drag, magnus, wind
from physics.kernels.forces import buoyancy_of_shapes as wet_shapes
from physics.kernels.forces import drag_of_shapes as shadows
from physics.keywords import known_keywords
from physics.scene.force_field import Checked, OfShapes
from physics.scene.springs import Push, Spring

AIR_DENSITY = 1.225  # at sea level, 15 °C (ISO 2533, standard atmosphere) [kg/m³]
WATER_DENSITY = 1000.0  # [kg/m³]


@known_keywords
@dataclass(frozen=True)
class Drag(Checked):
    """Drag of the air (or water) on every body: ``F = -(½ ρ C A |u| + c) u``, A the area of its shadow along u.

    u is the velocity of the body's geometric centre relative to the air (`Wind`). The force acts at that centre. Each
    part of a compound has a drag of its own; parts do not shelter each other.

    Parameters
    ----------
    coefficient : float
        C of the quadratic law, for the area of the shadow; at least 0. A sphere at Reynolds numbers of 10⁴ to 10⁵ has
        0.47 (Hoerner, *Fluid-Dynamic Drag*, 1965).
    density : float
        ρ of the air or water [kg/m³].
    linear : float
        c of the linear law [N s/m], the same for all shapes.
    """

    coefficient: float = 0.47
    density: float = AIR_DENSITY
    linear: float = 0.0

    function: ClassVar[Any] = drag.drag
    _rates: ClassVar[Any] = drag.drag_rates
    _soften: ClassVar[Any] = drag.soften_drag
    needs_axes: ClassVar[bool] = True
    _of_shapes: ClassVar[OfShapes | None] = OfShapes(
        shadows.drag_of_shapes, shadows.rates_of_shapes, shadows.soften_drag_of_shapes
    )

    def __post_init__(self) -> None:
        for name in ("coefficient", "density", "linear"):
            self._set(name, validation.non_negative)

    @property
    def takes_energy(self) -> bool | None:
        return True

    def columns(self, body: int, worlds: NDArray[np.int64]) -> NDArray[np.float64]:
        return np.array([0.5 * self.density * self.coefficient, self.linear])


@known_keywords
@dataclass(frozen=True)
class AngularDrag(Checked):
    """Drag on the spin of every body: ``T = -(c + d |ω|) ω``.

    Parameters
    ----------
    linear : float
        c of the linear law [N m s].
    quadratic : float
        d of the quadratic law [N m s²].
    """

    linear: float = 0.01
    quadratic: float = 0.0

    function: ClassVar[Any] = angular_drag.angular_drag
    _rates: ClassVar[Any] = angular_drag.angular_drag_rates
    _soften: ClassVar[Any] = angular_drag.soften_angular_drag

    def __post_init__(self) -> None:
        self._set("linear", validation.non_negative)
        self._set("quadratic", validation.non_negative)

    @property
    def takes_energy(self) -> bool | None:
        return True

    def columns(self, body: int, worlds: NDArray[np.int64]) -> NDArray[np.float64]:
        return np.array([self.linear, self.quadratic])


@known_keywords
@dataclass(frozen=True)
class Magnus(Checked):
    """Magnus lift of every body that spins: ``F = ½ ρ C π r³ ω x u``, r the radius of the sphere of the same volume.

    u is the velocity relative to the air, ω the angular velocity.

    Parameters
    ----------
    coefficient : float
        C; at least 0. About 1 for sports balls (Nathan, Am. J. Phys. 76, 2008), 2 in a very viscous fluid.
    density : float
        ρ of the air [kg/m³].
    """

    coefficient: float = 1.0
    density: float = AIR_DENSITY

    function: ClassVar[Any] = magnus.magnus
    _rates: ClassVar[Any] = magnus.magnus_rates
    _soften: ClassVar[Any] = magnus.soften_magnus
    needs_axes: ClassVar[bool] = True

    def __post_init__(self) -> None:
        self._set("coefficient", validation.non_negative)
        self._set("density", validation.non_negative)

    @property
    def takes_energy(self) -> bool | None:
        return False

    def columns(self, body: int, worlds: NDArray[np.int64]) -> NDArray[np.float64]:
        return np.array([0.5 * self.density * self.coefficient])


@known_keywords
@dataclass(frozen=True)
class Wind(Checked):
    """Velocity of the air, the same everywhere, with gusts; it acts through `Drag`, `Magnus` and fields of your own.

    Parameters
    ----------
    velocity : (3,) array_like
        Mean velocity, world frame [m/s].
    gust : float
        Standard deviation of each component of the velocity [m/s]; 0: no gusts.
    time_scale : float
        Correlation time of the gusts [s].
    seed : int
        Seed of the gusts. The worlds of a batch have different gusts.
    """

    velocity: Vector = (5.0, 0.0, 0.0)
    gust: float = 0.0
    time_scale: float = 1.0
    seed: int = 0

    if TYPE_CHECKING:

        def __init__(
            self,
            velocity: ArrayLike = ...,
            gust: float = 0.0,
            time_scale: float = 1.0,
            seed: int = 0,
        ) -> None: ...

    function: ClassVar[Any] = wind.wind
    is_air: ClassVar[bool] = True

    def __post_init__(self) -> None:
        self._set("velocity", validation.finite, (3,))
        self._set("gust", validation.non_negative)
        self._set("time_scale", validation.positive)
        validation.count(self.seed, "Wind.seed", least=0, most=None)

    @property
    def is_steady(self) -> bool:
        return self.gust == 0

    def columns(self, body: int, worlds: NDArray[np.int64]) -> NDArray[np.float64]:
        phases = np.zeros((len(worlds), wind.WIND_SIZE - wind.WIND_PHASES))
        if self.gust > 0:
            for row, world in zip(phases, worlds):
                row[:] = 2 * np.pi * np.random.default_rng([self.seed, int(world)]).random(len(row))
        head = np.array([*self.velocity, self.gust, self.time_scale])
        return np.concatenate((np.broadcast_to(head, (len(worlds), len(head))), phases), axis=1)


@known_keywords
@dataclass(frozen=True)
class Buoyancy(Checked):
    """Lift of a fluid at rest that fills a half-space: the weight of the fluid displaced by a body.

    The force acts at the centre of the submerged part of the body. Where parts of a compound overlap, they count twice.

    Parameters
    ----------
    density : float
        Density of the fluid [kg/m³]; at least 0.
    normal : (3,) array_like
        Upward normal of the surface, world frame; any vector but zero, it is normalised.
    offset : float
        Place of the surface: the fluid is where normal·x <= offset [m].
    gravity : float
        Strength of gravity in the fluid [m/s²].
    """

    density: float = WATER_DENSITY
    normal: Vector = (0.0, 1.0, 0.0)
    offset: float = 0.0
    gravity: float = 9.81

    if TYPE_CHECKING:

        def __init__(
            self,
            density: float = ...,
            normal: ArrayLike = ...,
            offset: float = 0.0,
            gravity: float = 9.81,
        ) -> None: ...

    function: ClassVar[Any] = buoyancy.buoyancy
    _rates: ClassVar[Any] = buoyancy.buoyancy_rates
    _soften: ClassVar[Any] = buoyancy.soften_buoyancy
    needs_axes: ClassVar[bool] = True
    _of_shapes: ClassVar[OfShapes | None] = OfShapes(
        wet_shapes.buoyancy_of_shapes,
        wet_shapes.buoyancy_rates_of_shapes,
        wet_shapes.soften_buoyancy_of_shapes,
        wet_shapes.energy_of_shapes,
    )
    energy: ClassVar[Any] = buoyancy.buoyancy_energy

    def __post_init__(self) -> None:
        self._set("density", validation.non_negative)
        self._set("offset", validation.finite)
        self._set("gravity", validation.non_negative)
        self._set("normal", validation.finite, (3,))
        length = float(np.linalg.norm(self.normal))
        if not 0 < length < np.inf:
            raise ValueError(f"Buoyancy.normal is {self.normal!r}; allowed is any vector but zero")
        object.__setattr__(self, "normal", tuple(validation.unit(np.array(self.normal), length).tolist()))

    @property
    def takes_energy(self) -> bool | None:
        return False

    def columns(self, body: int, worlds: NDArray[np.int64]) -> NDArray[np.float64]:
        return np.array([*self.normal, self.offset, self.density * self.gravity])


FIELDS = (Drag, AngularDrag, Magnus, Wind, Buoyancy, Spring, Push)
