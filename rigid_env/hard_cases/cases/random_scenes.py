"""Hard case of random scenes, parameters, states and wrenches: many worlds at once, checked against laws.

What is drawn here is drawn by `benchmarks.soak` as well, for as long as one likes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

import physics
from physics.accuracy import resolve
from physics.annotations import Preset
from physics.kernels.state import layout as at
from rigid_env.hard_cases.case import Case, Check, Setting, none_of

HALF_WIDTH = 10.0  # of the closed box that all scenes are in [m]
CELL = 5.0  # distance of the places from which several bodies start [m]
LARGEST_EDGE = 2.7  # [m]: a block of it has a bounding radius of 2.34 m and turns within its cell

# Exponents of the strongest force by weight, and torque by weight and radius. Torques are weaker for the time a run
# takes, not for what comes out: the exact rotation is cut into parts of 0.06 rad, millions of them in a step at 1e7
# rad/s.
STRONGEST_FORCE, STRONGEST_TORQUE = 6, 3

# Share of its energy from which on a gain is gross.
GROSS = 1e-3

# Steps with one wrench, then with another, then without any.
PUSHED, FREE = 5, 20

WALLS = tuple(
    physics.HalfSpace(tuple(sign * (k == axis) for k in range(3)), -HALF_WIDTH) for axis in range(3) for sign in (1, -1)
)

BODIES = {
    "block": (physics.Block((1, 2, 3), 1.0),),
    "ellipsoid": (physics.Ellipsoid((0.5, 1, 1.5), 1.0),),
    "bodies": (
        physics.Block((1, 2, 3), 1.0, pos=(-CELL, 0, 0)),
        physics.Block((1, 2, 3), 1.0),
        physics.Block((1, 2, 3), 1.0, pos=(CELL, 0, 0)),
        physics.Sphere(1.0, 1.0, pos=(0, CELL, 0)),
        physics.Sphere(1.0, 1.0, pos=(0, -CELL, 0)),
    ),
}


def scene_of(family: str) -> physics.Scene:
    """Scene of a family of `BODIES`, which fixes the plan; all its numbers are drawn anew."""
    effects = [physics.Gravity(), physics.Contact(0.0), physics.Friction(0.0)]
    return physics.Scene(BODIES[family], WALLS, effects)


def log_uniform(rng: np.random.Generator, low: float, high: float, shape) -> np.ndarray:
    """10**x with x uniform between `low` and `high`."""
    return 10.0 ** rng.uniform(low, high, shape)


def directions(rng: np.random.Generator, shape: tuple[int, ...], size: int = 3) -> np.ndarray:
    """Unit vectors (..., size), uniform on the sphere."""
    v = rng.normal(size=(*shape, size))
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def begin(world: physics.World, rng: np.random.Generator) -> None:
    """Draw every parameter and state of a world of `scene_of` anew.

    Edges 0.1 to 2.7 m, masses 1e-3 to 1e3 kg, gravity 0.01 to 10 m/s² in any direction, speeds 0.01 to 100 m/s, spins
    0.01 to 1000 rad/s. A third of the worlds is smooth with any restitution, a third rough (μ up to 2) and plastic, a
    third both rough and bouncing.
    """
    bodies, shape = world.scene.bodies, (world.worlds, world.body_count)
    size = log_uniform(rng, -1.0, np.log10(LARGEST_EDGE), (*shape, 3))
    for b, body in enumerate(bodies):
        if body.kind == "sphere":
            size[:, b] = size[:, b, :1]
    kind = rng.integers(3, size=world.worlds)
    friction = np.where(kind == 0, 0.0, rng.uniform(0.0, 2.0, world.worlds))
    restitution = np.where(kind == 1, 0.0, rng.uniform(0.0, 1.0, world.worlds))
    gravity = log_uniform(rng, -2, 1, (world.worlds, 1)) * directions(rng, (world.worlds,))
    middle = np.broadcast_to([body.pos for body in bodies], (*shape, 3))
    world.set_state(pos=middle)  # where whatever size comes has room
    world.set_parameters(
        mass=log_uniform(rng, -3, 3, shape), size=size, gravity=gravity,
        friction=np.repeat(friction[:, None], world.body_count, 1),
        restitution=np.repeat(restitution[:, None], world.body_count, 1),
    )  # fmt: skip
    world.set_state(
        pos=_places(rng, world, size),
        quat=directions(rng, shape, 4),
        linvel=log_uniform(rng, -2, 2, (*shape, 1)) * directions(rng, shape),
        angvel=log_uniform(rng, -2, 3, (*shape, 1)) * directions(rng, shape),
    )


def _places(rng: np.random.Generator, world: physics.World, size: np.ndarray) -> np.ndarray:
    """Draw starts of bodies (worlds, bodies, 3): one anywhere in the box, several each in a cell of its own."""
    if world.body_count == 1:
        return (HALF_WIDTH - 0.5 * np.linalg.norm(size, axis=-1, keepdims=True)) * rng.uniform(-1, 1, size.shape)
    cells = CELL * (np.array(list(np.ndindex(3, 3, 3))) - 1.0)
    chosen = np.argsort(rng.random((world.worlds, len(cells))), axis=1)[:, : world.body_count]
    return cells[chosen]


def draw_wrench(world: physics.World, rng: np.random.Generator) -> np.ndarray:
    """Draw wrenches (worlds, bodies, 6): forces of 0.01 to 1,000,000 times the weight.

    Torques go up to 1,000 times the weight by the radius.
    Strong ones are rarer: the exponent is -2 + 8 u⁴ with u uniform, above 5 in 3 % of the draws.
    """
    shape = (world.worlds, world.body_count, 1)
    weight = (1.0 / world.params[:, at.INV_MASS]).reshape(shape) * np.linalg.norm(world.gravity, axis=-1)[:, None, None]
    radius = world.params[:, at.RADIUS].reshape(shape)
    force = weight * 10.0 ** (-2 + (STRONGEST_FORCE + 2) * rng.random(shape) ** 4) * directions(rng, shape[:2])
    torque = weight * radius * log_uniform(rng, -2, STRONGEST_TORQUE, shape) * directions(rng, shape[:2])
    return np.concatenate([force, torque], axis=-1)


# --- laws ------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Look:
    """Quantities of the laws at one moment, each (worlds,) but for `gap`."""

    kinetic: np.ndarray  # [J]
    energy: np.ndarray  # kinetic and potential [J]
    size: np.ndarray  # kinetic, and depth of gravity's potential over the box [J]: what an energy is rounded by
    escaped: np.ndarray  # depth of the deepest centre of mass behind a wall [bounding radii], 0 where inside
    is_finite: np.ndarray


def look(world: physics.World) -> Look:
    """Quantities of the laws in the present state of the worlds."""
    about = physics.diagnose(world)
    mass = (1.0 / world.params[:, at.INV_MASS]).reshape(world.worlds, -1)
    depth = np.abs(world.pos).max(axis=-1) - HALF_WIDTH
    kinetic, strength = about.kinetic_energy.sum(axis=1), np.linalg.norm(world.gravity, axis=-1)
    return Look(
        kinetic=kinetic,
        energy=about.energy.sum(axis=1),
        size=kinetic + HALF_WIDTH * strength * mass.sum(axis=1),
        escaped=np.maximum(depth / world.params[:, at.RADIUS].reshape(mass.shape), 0.0).max(axis=1),
        is_finite=np.isfinite(world.state).reshape(world.worlds, -1).all(axis=1),
    )


def push(world: physics.World, wrench: np.ndarray) -> np.ndarray:
    """Bound (worlds,) of the growth of √(2 K) by a second of these wrenches and gravity [√W·√s / s].

    With A² = Σ |F + m g|²/m + |τ|²/I_min, dK/dt = Σ (F + m g)·v + τ·ω <= A √(2 K) by Cauchy and Schwarz, as
    2 K = Σ m v² + ω·I ω. So d√(2 K)/dt <= A, whatever contacts do, which only take.
    """
    lightness = world.params[:, at.INV_MASS].reshape(world.worlds, -1)
    turning = world.params[:, at.INV_INERTIA : at.INV_INERTIA + 3].max(axis=1).reshape(lightness.shape)
    force = wrench[..., :3] + world.gravity[:, None, :] / lightness[..., None]
    square = (force**2).sum(axis=-1) * lightness + (wrench[..., 3:] ** 2).sum(axis=-1) * turning
    return np.sqrt(square.sum(axis=1))


def _put_away(world: physics.World, lost: np.ndarray) -> None:
    """Put these worlds at rest in the middle of the box, bodies apart."""
    shape = (len(lost), world.body_count, 3)
    places = np.broadcast_to([body.pos for body in world.scene.bodies], shape)
    world.set_state(pos=places, linvel=np.zeros(shape), angvel=np.zeros(shape), worlds=lost)


@dataclass
class Outcome:
    """Faults of each of the worlds so far, each (worlds,).

    Attributes
    ----------
    gain : float64
        Energy beyond what was put in, as a share of `Look.size`: of √(2 K) while pushed, of all energy while free.
    escaped : float64
        Deepest place of a centre of mass behind a wall [bounding radii].
    is_broken : bool
        A state that is not finite, a fault, or contacts left out.
    """

    gain: np.ndarray
    escaped: np.ndarray
    is_broken: np.ndarray

    @classmethod
    def start(cls, worlds: int) -> Outcome:
        """Outcome of worlds without any fault."""
        return cls(np.zeros(worlds), np.zeros(worlds), np.zeros(worlds, dtype=np.bool_))

    def broken_laws(self, limit: float) -> np.ndarray:
        """Worlds (worlds,) bool that broke a law, a gain above `limit` included."""
        return self.is_broken | (self.escaped > 0) | (self.gain > limit)

    def law(self, index: int, limit: float) -> str:
        """Name the law that one world broke; empty where it broke none."""
        if self.is_broken[index]:
            return "not finite, a fault, or contacts left out"
        if self.escaped[index] > 0:
            return f"escaped by {self.escaped[index]:.3g} bounding radii"
        return f"gained {self.gain[index]:.3g} of its energy" if self.gain[index] > limit else ""

    def note(self, world: physics.World, before: Look, push_now: np.ndarray | None, dt: float) -> Look:
        """Check a step against the laws, and return the state after it. `push_now`: see `push`; None: no wrench."""
        now, report = look(world), world.report
        self.is_broken |= ~now.is_finite | (report.faults > 0) | (report.left_out > 0)
        np.maximum(self.escaped, now.escaped, out=self.escaped)
        if push_now is None:
            gained = (now.energy - before.energy) / np.maximum(before.size, now.size)
        else:
            gained = np.sqrt(2 * now.kinetic) / (np.sqrt(2 * before.kinetic) + push_now * dt) - 1.0
        np.maximum(self.gain, gained, out=self.gain)
        return now


def gain_limit(accuracy: Preset | physics.Accuracy) -> float:
    """Share of the energy by which a step may be off; derived in `random_scenes`."""
    knobs = resolve(accuracy)
    return 4 * knobs.tolerance * (knobs.impacts + 1)


def drive(
    world: physics.World,
    rng: np.random.Generator,
    told: Callable[[int, str], None] = lambda index, law: None,
) -> Outcome:
    """Draw all worlds of a batch anew and run them under one wrench, another wrench, and none.

    Parameters
    ----------
    world : World
        Of `scene_of`.
    rng : numpy.random.Generator
    told : callable, optional
        Given each world that breaks a law, and the law, right after the step in which it first does.

    Notes
    -----
    A world that has gained more than `GROSS` is put to rest: it would go on gaining, and be slow.
    """
    begin(world, rng)
    outcome = Outcome.start(world.worlds)
    limit, seen = gain_limit(world.accuracy), np.zeros(world.worlds, dtype=np.bool_)
    for steps, is_pushed in ((PUSHED, True), (PUSHED, True), (FREE, False)):
        wrench = draw_wrench(world, rng) if is_pushed else None
        push_now = push(world, wrench) if is_pushed else None
        before = look(world)
        for _ in range(steps):
            world.step(wrench)
            before = outcome.note(world, before, push_now, world.dt)
            for index in np.flatnonzero(outcome.broken_laws(limit) & ~seen).tolist():
                told(index, outcome.law(index, limit))
            seen |= outcome.broken_laws(limit)
            lost = np.flatnonzero((outcome.gain > GROSS) & (before.kinetic > 0))
            if len(lost):
                _put_away(world, lost)
                before = look(world)
    return outcome


# Families, and how many worlds of each a thorough run has; a batch is one call of `drive`.
SHARES = {"block": 40_000, "ellipsoid": 40_000, "bodies": 20_000}
BATCH = 1000


def random_scenes(setting: Setting) -> list[Check]:
    """100,000 worlds with everything drawn at random (`begin`, `draw_wrench`), 30 steps each.

    Never: a state that is not finite, a fault, contacts left out, an exception (it would end the run), a centre of mass
    behind a wall. Energy: a contact problem is solved to the tolerance, relative to its largest free contact speed u,
    so that an impulse of at most 2 m u is off by that share of it, and the energy by 4 tolerances of ½ m u² at most. A
    step has as many as it may have impacts (`Accuracy.impacts`), and the resting stage. What overlaps is pushed apart
    without a velocity, which moves it by twice the slop in the field of gravity and so turns it by as much of a radian
    (body on body, where its energy is that of its angular momentum in the new attitude).

    To an error (`precise`, `reference`) a smooth step is off by a tolerance of speed, and by two of the energy, at most
    as much as a contact problem; a part of a step of several bodies has its own problems. The limit is for as many of
    them as a step may have impacts, 10,001. Most have hundreds; where a body rattles it is millions, and the limit the
    same.
    """
    limit = gain_limit(setting.accuracy)
    checks, scale = [], setting.pick(1.0, 0.004)
    for family, share in SHARES.items():
        count = int(share * scale)
        batch = min(BATCH, count)
        world = setting.world(scene_of(family), worlds=batch)
        rng = np.random.default_rng(len(family))
        broken = escaped = gainers = 0
        for _ in range(-(-count // batch)):
            outcome = drive(world, rng)
            broken += int(outcome.is_broken.sum())
            escaped += int((outcome.escaped > 0).sum())
            gainers += int((outcome.gain > limit).sum())
        what = f"{count:,} worlds, {family}"
        checks.append(none_of(f"{what}: not finite, faults, contacts left out", broken))
        checks.append(none_of(f"{what}: escaped", escaped))
        checks.append(none_of(f"{what}: energy above what was put in by more than {limit:.2g}", gainers))
    return checks


CASES = (
    Case(47, "random-scenes", "100,000 random scenes, forces up to 1,000,000 times the weight",
         "no NaN, no exception, no escape, energy never above what was put in", random_scenes),
)  # fmt: skip
