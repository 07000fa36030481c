"""The built-in force fields: one small frozen dataclass per effect. Sources and formulas stand with their functions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from physics import checks
from physics.field import Field
from physics.kernels.fields import angular_drag, buoyancy, drag, magnus, spring, wind

AIR_DENSITY = 1.225  # at sea level, 15 °C (ISO 2533, standard atmosphere) [kg/m³]
WATER_DENSITY = 1000.0  # [kg/m³]


def _check_body(effect, body_count: int) -> None:
    if effect.body >= body_count:
        raise ValueError(f"{type(effect).__name__}.body is {effect.body}; allowed are indices below {body_count}")


class _Checked(Field):
    """Sets checked values on a frozen dataclass."""

    def _set(self, name: str, check, shape: tuple = ()) -> None:
        value = check(getattr(self, name), shape, f"{type(self).__name__}.{name}")
        object.__setattr__(self, name, tuple(value.tolist()) if shape else float(value))


@dataclass(frozen=True)
class Drag(_Checked):
    """Drag of the air (or water) on every body: ``F = -(½ ρ C A |u| + c) u``, A the area of its shadow along u.

    u is the velocity of the body's geometric centre relative to the air (`Wind`), where the force acts.

    Parameters
    ----------
    coefficient : float
        C of the quadratic law, on the shadow's area; at least 0. 0.47: a sphere at Reynolds numbers of 10⁴ to 10⁵
        (Hoerner, *Fluid-Dynamic Drag*, 1965).
    density : float
        ρ [kg/m³].
    linear : float
        c [N s/m], whatever the shape.
    """

    coefficient: float = 0.47
    density: float = AIR_DENSITY
    linear: float = 0.0

    function: ClassVar = drag.drag

    def __post_init__(self):
        for name in ("coefficient", "density", "linear"):
            self._set(name, checks.non_negative)

    @property
    def takes_energy(self):
        return True

    def columns(self, body, worlds):
        return np.array([0.5 * self.density * self.coefficient, self.linear])


@dataclass(frozen=True)
class AngularDrag(_Checked):
    """Drag on the spin of every body: ``T = -(c + d |ω|) ω``.

    Parameters
    ----------
    linear : float
        c [N m s].
    quadratic : float
        d [N m s²].
    """

    linear: float = 0.01
    quadratic: float = 0.0

    function: ClassVar = angular_drag.angular_drag

    def __post_init__(self):
        self._set("linear", checks.non_negative)
        self._set("quadratic", checks.non_negative)

    @property
    def takes_energy(self):
        return True

    def columns(self, body, worlds):
        return np.array([self.linear, self.quadratic])


@dataclass(frozen=True)
class Magnus(_Checked):
    """Lift of every body that spins: ``F = ½ ρ C π r³ ω x u``, r the radius of the sphere of the same volume.

    Parameters
    ----------
    coefficient : float
        C; at least 0. About 1 for sports balls (Nathan, Am. J. Phys. 76, 2008), 2 in a very viscous fluid.
    density : float
        ρ [kg/m³].
    """

    coefficient: float = 1.0
    density: float = AIR_DENSITY

    function: ClassVar = magnus.magnus

    def __post_init__(self):
        self._set("coefficient", checks.non_negative)
        self._set("density", checks.non_negative)

    @property
    def takes_energy(self):
        return False

    def columns(self, body, worlds):
        return np.array([0.5 * self.density * self.coefficient])


@dataclass(frozen=True)
class Wind(_Checked):
    """Velocity of the air, the same everywhere, with gusts; it acts through `Drag`, `Magnus` and fields of your own.

    Parameters
    ----------
    velocity : (3,) array_like
        Mean, world frame [m/s].
    gust : float
        Standard deviation of each component [m/s].
    time_scale : float
        Over which gusts are correlated [s].
    seed : int
        Of the gusts; each world of a batch has its own.
    """

    velocity: tuple = (5.0, 0.0, 0.0)
    gust: float = 0.0
    time_scale: float = 1.0
    seed: int = 0

    function: ClassVar = wind.wind
    is_air: ClassVar[bool] = True

    def __post_init__(self):
        self._set("velocity", checks.finite, (3,))
        self._set("gust", checks.non_negative)
        self._set("time_scale", checks.positive)
        checks.count(self.seed, "Wind.seed", least=0)

    def columns(self, body, worlds):
        phases = np.zeros((len(worlds), wind.SIZE - wind.PHASES))
        if self.gust > 0:
            for row, world in zip(phases, worlds):
                row[:] = 2 * np.pi * np.random.default_rng([self.seed, int(world)]).random(len(row))
        head = np.array([*self.velocity, self.gust, self.time_scale])
        return np.concatenate((np.broadcast_to(head, (len(worlds), len(head))), phases), axis=1)


@dataclass(frozen=True)
class Buoyancy(_Checked):
    """Lift of a fluid at rest that fills a half-space: its weight where the body is, at the centre of that part.

    Parameters
    ----------
    density : float
        Of the fluid [kg/m³]; at least 0.
    normal : (3,) array_like
        Of the surface, upwards; any length but zero, it is normalised.
    offset : float
        The fluid is where normal·x <= offset [m].
    gravity : float
        Strength of gravity in the fluid [m/s²].
    """

    density: float = WATER_DENSITY
    normal: tuple = (0.0, 1.0, 0.0)
    offset: float = 0.0
    gravity: float = 9.81

    function: ClassVar = buoyancy.buoyancy
    energy: ClassVar = buoyancy.buoyancy_energy

    def __post_init__(self):
        self._set("density", checks.non_negative)
        self._set("offset", checks.finite)
        self._set("gravity", checks.non_negative)
        self._set("normal", checks.finite, (3,))
        length = float(np.linalg.norm(self.normal))
        if not 0 < length < np.inf:
            raise ValueError(f"Buoyancy.normal is {self.normal!r}; allowed is any vector but zero")
        object.__setattr__(self, "normal", tuple(checks.unit(np.array(self.normal), length).tolist()))

    @property
    def takes_energy(self):
        return False

    def columns(self, body, worlds):
        return np.array([*self.normal, self.offset, self.density * self.gravity])


@dataclass(frozen=True)
class Spring(_Checked):
    """Spring and damper from a point of a body to a fixed anchor: ``-(k (l - l0) + c dl/dt)`` along it. Any number.

    Parameters
    ----------
    anchor : (3,) array_like
        World frame [m].
    point : (3,) array_like
        Where it is fixed to the body: body frame, from the centre of mass [m].
    stiffness : float
        k [N/m].
    damping : float
        c [N s/m].
    length : float
        l0, without force [m].
    body : int
        Index in `Scene.bodies`.
    """

    anchor: tuple = (0.0, 0.0, 0.0)
    point: tuple = (0.0, 0.0, 0.0)
    stiffness: float = 100.0
    damping: float = 0.0
    length: float = 0.0
    body: int = 0

    function: ClassVar = spring.spring
    energy: ClassVar = spring.spring_energy
    has_many: ClassVar[bool] = True

    def __post_init__(self):
        self._set("anchor", checks.finite, (3,))
        self._set("point", checks.finite, (3,))
        for name in ("stiffness", "damping", "length"):
            self._set(name, checks.non_negative)
        checks.count(self.body, "Spring.body", least=0)

    def check(self, body_count):
        _check_body(self, body_count)

    @property
    def takes_energy(self):
        return self.damping > 0

    def columns(self, body, worlds):
        acts = float(body == self.body)
        return np.array([*self.point, *self.anchor, self.length, acts * self.stiffness, acts * self.damping])


@dataclass(frozen=True)
class Push(_Checked):
    """A constant force at a point of a body. Any number.

    Parameters
    ----------
    force : (3,) array_like
        [N].
    point : (3,) array_like
        Where it acts: body frame, from the centre of mass [m].
    frame : {"world", "body"}
        Of `force`; ``body``: it turns with the body, as the thrust of a rocket does.
    body : int
        Index in `Scene.bodies`.
    """

    force: tuple = (0.0, 0.0, 0.0)
    point: tuple = (0.0, 0.0, 0.0)
    frame: str = "world"
    body: int = 0

    function: ClassVar = spring.push
    has_many: ClassVar[bool] = True

    def __post_init__(self):
        self._set("force", checks.finite, (3,))
        self._set("point", checks.finite, (3,))
        if self.frame not in ("world", "body"):
            raise ValueError(f"Push.frame is {self.frame!r}; allowed are world, body")
        checks.count(self.body, "Push.body", least=0)

    def check(self, body_count):
        _check_body(self, body_count)

    def columns(self, body, worlds):
        acts = float(body == self.body)
        return np.array([*self.point, *(acts * np.array(self.force)), float(self.frame == "body")])


FIELDS = (Drag, AngularDrag, Magnus, Wind, Buoyancy, Spring, Push)
