"""Hard case of random scenes, parameters, states and wrenches: many worlds at once, checked against laws.

`random_draws` draws them, also for `benchmarks.soak`, for as long as one likes.
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
from rigid_env.hard_cases.cases.random_draws import HALF_WIDTH, begin, draw_wrench, scene_of

# Share of its energy from which on a gain is gross.
GROSS = 1e-3

# Steps with one wrench, then with another, then without any.
PUSHED, FREE = 5, 20


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
