"""Worlds with drawn effects: check that no parameter and no step creates energy.

Each draw is a scene of a sphere, a block and an ellipsoid that do not meet, in flight or on a floor, with one effect
of the catalogue or two; parameters are drawn over twelve decades about their defaults, the step from 1 ms to 0.1 s.
After every step the energy is held to

    E_n <= E_0 + Σ W_k + (share of the largest energy at hand) + rounding.

*Work of loads.* A load of force F and torque T changes √(2 E_kin) by at most p = h √(F²/m + T² J), J the largest
inverse moment: the norm of its impulse in the kinetic metric. So W <= p √(2 E_kin) + p².

*Work of the wind.* With κ the coefficient of the drag F = -κ (v - e) in air of velocity e, F·v <= κ e²/4, κ at speeds
up to 2 |e|. Lift F = s ω x u has the power s (ω x u)·e <= s |ω| |u| |e|.

*Share.* A spring or a fluid with h Ω <= 1 is stepped by leapfrog, which keeps ½ k x² + ½ m v² (1 - (h Ω)²/4): E_n <=
E_0/(1 - 1/4), a share of 1/3 of the energy of the motion and its potential. Contact is solved to the tolerance of the
preset and may gain `ENERGY_GAIN_TOLERANCE` of the kinetic energy in a stage.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import physics

DECADES = 6.0  # on either side of a default
STEPS = 30
BODIES = 3

# Energy of the motion and its potential that leapfrog may show beyond what there is, at h Ω = 1.
LEAPFROG_SHARE = 1.0 / 3.0

# Per stage, by which contact may gain (`physics.kernels.contact_law.compliance.ENERGY_GAIN_TOLERANCE`), and stages of a
# step: impacts cut it.
CONTACT_SHARE = 2.0e-5
STAGES = 8.0

# Of everything that was added up.
ROUNDING = 1.0e-10


def _decades(rng: np.random.Generator, value: float) -> float:
    return value * 10.0 ** rng.uniform(-DECADES, DECADES)


def _direction(rng: np.random.Generator) -> np.ndarray:
    n = rng.normal(size=3)
    return n / np.linalg.norm(n)


def _axis(rng: np.random.Generator) -> tuple:
    return tuple(_direction(rng))


def _spring(rng: np.random.Generator, other: int | None) -> physics.Spring:
    near = tuple(0.3 * rng.normal(size=3))
    anchor = near if other is not None else tuple(3.0 * rng.normal(size=3) + (0.0, 3.0, 0.0))
    return physics.Spring(
        anchor, tuple(0.3 * rng.normal(size=3)), stiffness=_decades(rng, 100.0),
        damping=_decades(rng, 1.0) * rng.integers(2), length=_decades(rng, 1.0) * rng.integers(2),
        body=int(rng.integers(BODIES)) if other is None else 0, other=other,
    )  # fmt: skip


def _push(rng: np.random.Generator) -> physics.Push:
    """Draw a push whose torque is at most about 1 N m: a body that spins at 10⁶ rad/s is right, but slow to compute."""
    force = _decades(rng, 10.0)
    point = rng.normal(size=3) * min(0.3, 1.0 / force)
    return physics.Push(tuple(force * _direction(rng)), tuple(point), str(rng.choice(["world", "body"])))


EFFECTS = {
    "gravity": lambda rng: [physics.Gravity((0.0, -_decades(rng, 9.81), 0.0))],
    "drag": lambda rng: [physics.Drag(_decades(rng, 0.47), linear=_decades(rng, 1.0) * rng.integers(2))],
    "angular drag": lambda rng: [physics.AngularDrag(_decades(rng, 0.01), _decades(rng, 0.01) * rng.integers(2))],
    "magnus": lambda rng: [physics.Magnus(_decades(rng, 1.0))],
    "wind": lambda rng: [physics.Wind(tuple(_decades(rng, 5.0) * _direction(rng))), physics.Drag(_decades(rng, 0.47))],
    "gusts": lambda rng: [
        physics.Wind(gust=_decades(rng, 5.0), time_scale=_decades(rng, 1.0), seed=int(rng.integers(1000))),
        physics.Drag(_decades(rng, 0.47)),
    ],
    "buoyancy": lambda rng: [physics.Buoyancy(_decades(rng, 1000.0), offset=float(rng.normal()))],
    "spring": lambda rng: [_spring(rng, None)],
    "spring between bodies": lambda rng: [_spring(rng, 1)],
    "push": lambda rng: [_push(rng)],
    "actuator": lambda rng: [
        physics.Actuator(_decades(rng, 10.0), _decades(rng, 10.0), _decades(rng, 0.1), 0.1 * rng.integers(2))
    ],
}
ON_FLOOR = {
    "plastic contact": lambda rng: [physics.Contact(between_bodies=False)],
    "restitution": lambda rng: [physics.Contact(float(rng.random()), between_bodies=False)],
    "compliance": lambda rng: [
        physics.Contact(
            between_bodies=False, stiffness=_decades(rng, 1e4), damping=_decades(rng, 10.0) * rng.integers(2)
        )
    ],
    "friction": lambda rng: [physics.Friction(_decades(rng, 0.5))],
    "friction of two coefficients": lambda rng: [
        physics.Friction((_decades(rng, 0.5), _decades(rng, 0.5)), _axis(rng))
    ],
    "rolling friction": lambda rng: [physics.RollingFriction(_decades(rng, 0.001)), physics.Friction()],
    "spin friction": lambda rng: [physics.SpinFriction(_decades(rng, 0.001)), physics.Friction()],
    "sleeping": lambda rng: [physics.Sleeping()],
}  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    """Result of one draw.

    Attributes
    ----------
    excess : (worlds,) float64
        Largest energy beyond what the law allows, by the energy at hand; at most 0 where it holds.
    is_finite, is_told : (worlds,) bool
        Whether every number stayed finite, and whether some report was not OK.
    """

    excess: np.ndarray
    is_finite: np.ndarray
    is_told: np.ndarray


def pairs() -> list[tuple[str, ...]]:
    """Every effect, and every pair of effects."""
    names = [*EFFECTS, *ON_FLOOR]
    return [(a,) for a in names] + [(a, b) for i, a in enumerate(names) for b in names[i + 1 :]]


def draw_scene(rng: np.random.Generator, names: tuple[str, ...], on_floor: bool) -> physics.Scene | None:
    """Draw a scene with these effects; None where they exclude each other, or do not act in flight."""
    if not on_floor and any(name in ON_FLOOR for name in names):
        return None
    found: dict[type, object] = {}
    for name in names:
        for effect in {**EFFECTS, **ON_FLOOR}[name](rng):
            found.setdefault(type(effect) if not isinstance(effect, physics.Spring) else name, effect)
    walls = []
    if on_floor:
        walls = [physics.HalfSpace((0.0, 1.0, 0.0))]
        found.setdefault(physics.Contact, physics.Contact(between_bodies=False))
        found.setdefault(physics.Gravity, physics.Gravity())
    bodies = [
        kind(mass=10.0 ** rng.uniform(-1, 1), pos=(3.0 * b, 10.0 ** rng.uniform(0, 0.5), 0.0), quat=_axis4(rng),
             linvel=tuple(rng.normal(size=3)), angvel=tuple(3.0 * rng.normal(size=3)), **size)
        for b, (kind, size) in enumerate(_shapes(rng))
    ]  # fmt: skip
    return physics.Scene(bodies, walls, list(found.values()))


def _axis4(rng: np.random.Generator) -> tuple:
    q = rng.normal(size=4)
    return tuple(q / np.linalg.norm(q))


def _shapes(rng: np.random.Generator) -> list[tuple[type, dict]]:
    return [
        (physics.Sphere, {"radius": rng.uniform(0.1, 0.5)}),
        (physics.Block, {"size": tuple(rng.uniform(0.1, 1.0, 3))}),
        (physics.Ellipsoid, {"semi_axes": tuple(rng.uniform(0.1, 0.5, 3))}),
    ]


def run(rng: np.random.Generator, scene: physics.Scene, accuracy: str, worlds: int) -> Outcome:
    """Step some worlds of a scene, each with its own starts and wrenches, and check their energy."""
    dt = 10.0 ** rng.uniform(-3.0, -1.0)
    world = physics.World(scene, worlds=worlds, dt=dt, accuracy=accuracy)
    world.set_state(
        linvel=rng.normal(size=(worlds, BODIES, 3)) * 10.0 ** rng.uniform(-1, 1, (worlds, 1, 1)),
        angvel=rng.normal(size=(worlds, BODIES, 3)) * 10.0 ** rng.uniform(-1, 1, (worlds, 1, 1)),
    )
    wrench = _wrenches(rng, scene, worlds)
    law = EnergyLaw(world, scene, wrench)
    is_told = np.zeros(worlds, bool)
    for _ in range(STEPS):
        report = world.step(wrench)
        is_told |= report.status != physics.Status.OK
        law.add_step()
    is_finite = np.isfinite(world.state).reshape(worlds, -1).all(axis=1) & np.isfinite(law.excess)
    return Outcome(law.excess, is_finite, is_told)


def _wrenches(rng: np.random.Generator, scene: physics.Scene, worlds: int) -> np.ndarray:
    wrench = np.zeros((worlds, BODIES, 6))
    if scene.effect(physics.Actuator) is not None:
        wrench[:] = rng.normal(size=wrench.shape) * 10.0 ** rng.uniform(-3, 0, (worlds, 1, 1))
    return wrench


class EnergyLaw:
    """Bound of the energy for the worlds of one scene, step by step; see the module."""

    def __init__(self, world: physics.World, scene: physics.Scene, wrench: np.ndarray):
        self.world = world
        self.has_floor = bool(scene.walls)
        self.kick = self._kick(scene, wrench)
        self.drag, self.magnus, self.air = self._air(scene)
        now = physics.diagnose(world)
        self.start, self.kinetic = now.energy.sum(axis=1), now.kinetic_energy
        self.low = self.high = self._potential(now)
        self.has_springs = any(isinstance(effect, physics.Spring) for effect in scene.effects)
        self.work = np.zeros(world.worlds)
        self.size = np.abs(self.start)
        self.excess = np.full(world.worlds, -np.inf)
        self.steps = 0

    @property
    def mass(self) -> np.ndarray:
        """(bodies,) [kg]."""
        return np.array([body.mass for body in self.world.scene.bodies])

    @property
    def J(self) -> np.ndarray:
        """(bodies,) largest inverse moments [1/(kg m²)]."""
        return np.array([1.0 / np.linalg.eigvalsh(body.inertia)[0] for body in self.world.scene.bodies])

    def _kick(self, scene, wrench) -> np.ndarray:
        """(worlds, bodies) norm of a step's impulse of pushes and wrenches in the kinetic metric [√J]."""
        force, torque = np.linalg.norm(wrench[..., :3], axis=-1), np.linalg.norm(wrench[..., 3:], axis=-1)
        for effect in scene.effects:
            if isinstance(effect, physics.Push):
                f = np.linalg.norm(effect.force)
                force[:, effect.body] += f
                torque[:, effect.body] += f * np.linalg.norm(effect.point)
        return self.world.dt * np.sqrt(force**2 / self.mass + torque**2 * self.J)

    def _air(self, scene) -> tuple[np.ndarray, np.ndarray, float]:
        """Drag κ at twice the air's speed (bodies,), lift by spin and speed (bodies,), and the air's speed."""
        wind, drag, magnus = (scene.effect(kind) for kind in (physics.Wind, physics.Drag, physics.Magnus))
        speed = 0.0
        if wind is not None:
            speed = np.linalg.norm(wind.velocity) + wind.gust * np.sqrt(3 * 16)  # √(2/N) N, N = 8 waves
        reach = np.array([_reach(body) for body in scene.bodies])
        kappa, gamma = np.zeros(BODIES), np.zeros(BODIES)
        if drag is not None:
            kappa = 0.5 * drag.density * drag.coefficient * np.pi * reach**2 * 2 * speed + drag.linear
        if magnus is not None:
            gamma = 0.5 * magnus.density * magnus.coefficient * np.pi * reach**3
        return kappa, gamma, speed

    def _gravity(self, now) -> np.ndarray:
        """(worlds,) energy of gravity [J]."""
        return -np.sum(self.mass * np.sum(self.world.gravity[:, None] * self.world.pos, axis=-1), axis=1)

    def _potential(self, now) -> np.ndarray:
        """(worlds,) energy of springs and fluids [J]."""
        return now.potential_energy.sum(axis=1) - self._gravity(now)

    def add_step(self) -> None:
        """Add the largest gain that a step may have, and compare the energy after it."""
        now, h = physics.diagnose(self.world), self.world.dt
        kinetic = np.maximum(self.kinetic, now.kinetic_energy)
        gained = self.kick * np.sqrt(2 * kinetic) + self.kick**2
        spin = np.linalg.norm(self.world.angvel, axis=-1)
        speed = np.sqrt(2 * kinetic / self.mass) + self.air
        gained = gained + h * (0.25 * self.drag * self.air + self.magnus * spin * speed) * self.air
        energy, self.kinetic = now.energy.sum(axis=1), now.kinetic_energy
        self.work += gained.sum(axis=1)
        self.steps += 1
        own = self._potential(now)
        self.low, self.high = np.minimum(self.low, own), np.maximum(self.high, own)
        spread = self.high - (0.0 if self.has_springs else self.low)
        g = np.linalg.norm(self.world.gravity, axis=-1)[:, None]
        motion = (kinetic + 0.5 * self.mass * (g * h) ** 2).sum(axis=1)
        allowed = LEAPFROG_SHARE * (spread + motion) + ROUNDING * (self.size + np.abs(energy) + self.work)
        if self.has_floor:
            allowed += CONTACT_SHARE * STAGES * self.steps * motion
        self.size = np.maximum(self.size, np.abs(energy) + np.abs(self._gravity(now)))
        self.excess = np.maximum(self.excess, (energy - self.start - self.work - allowed) / (self.size + 1e-300))


def _reach(body) -> float:
    """Radius of a sphere around the body [m]."""
    for name in ("radius", "semi_axes", "size"):
        if hasattr(body, name):
            value = np.max(getattr(body, name))
            return float(np.linalg.norm(body.size) / 2 if name == "size" else value)
    raise TypeError(f"body is {body!r}; allowed are spheres, ellipsoids and blocks")
