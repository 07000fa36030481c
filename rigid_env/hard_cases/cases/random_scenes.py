"""Hard case of random scenes, parameters, states and wrenches in many worlds at once, checked against laws.

The functions that draw are in `random_draws`. The program `benchmarks.soak` runs such scenes for as long as the user
likes.
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
from rigid_env.hard_cases.cases import driven_supports as supports
from rigid_env.hard_cases.cases.random_draws import HALF_WIDTH, begin, draw_wrench, scene_of

# Relative energy gain beyond which a world is stopped.
GROSS = 1e-3

# Number of steps with each of two wrenches, and of steps without a wrench after them.
PUSHED, FREE = 5, 20


@dataclass(frozen=True)
class Look:
    """Quantities at one moment that the checked laws are about, each an array (worlds,) but for `poses`.

    Energies are those in the frame of everything that can be touched, nan where it has none (`driven_supports`).
    """

    kinetic: np.ndarray  # [J]
    energy: np.ndarray  # kinetic and potential [J]
    size: np.ndarray  # scale of the energy's rounding: kinetic energy, and gravity's potential over the box [J]
    escaped: np.ndarray  # depth of the deepest centre of mass behind a wall [bounding radii], 0 where inside
    is_finite: np.ndarray
    poses: np.ndarray  # of fixed bodies (worlds, fixed bodies, 7)


def look(world: physics.World) -> Look:
    """Compute the quantities that the laws are about, for the present state of the worlds."""
    about, mass = physics.diagnose(world), supports.free_masses(world)
    depth = (np.abs(supports.places_in_room(world)).max(axis=-1) - HALF_WIDTH) * (mass > 0.0)
    V, whole, momentum = supports.frame_velocity(world), mass.sum(axis=1), about.momentum.sum(axis=1)
    kinetic = about.kinetic_energy.sum(axis=1) + ((0.5 * whole[:, None] * V - momentum) * V).sum(axis=1)
    potential = about.potential_energy.sum(axis=1) + whole * (world.gravity * V).sum(axis=1) * world.time
    return Look(
        kinetic=kinetic,
        energy=kinetic + potential,
        size=kinetic + HALF_WIDTH * np.linalg.norm(world.gravity, axis=-1) * whole,
        escaped=np.maximum(depth / world.params[:, at.RADIUS].reshape(mass.shape), 0.0).max(axis=1),
        is_finite=np.isfinite(world.state).reshape(world.worlds, -1).all(axis=1),
        poses=supports.poses(world),
    )


def push(world: physics.World, wrench: np.ndarray) -> np.ndarray:
    """Upper bound (worlds,) of the growth of √(2 K) per second under these wrenches and gravity [√W/√s].

    With A² = Σ |F + m g|²/m + |τ|²/I_min, dK/dt = Σ (F + m g)·v + τ·ω <= A √(2 K) by the Cauchy-Schwarz inequality, as
    2 K = Σ m v² + ω·I ω. So d√(2 K)/dt <= A, with any contacts, which only take energy.
    """
    lightness = world.params[:, at.INV_MASS].reshape(world.worlds, -1)
    turning = world.params[:, at.INV_INERTIA : at.INV_INERTIA + 3].max(axis=1).reshape(lightness.shape)
    force = wrench[..., :3] + world.gravity[:, None, :] * supports.free_masses(world)[..., None]
    square = (force**2).sum(axis=-1) * lightness + (wrench[..., 3:] ** 2).sum(axis=-1) * turning
    return np.sqrt(square.sum(axis=1))


def _put_away(world: physics.World, lost: np.ndarray) -> None:
    """Put the worlds with the indices `lost` at rest: bodies in the middle of the box, apart from each other."""
    shape = (len(lost), world.body_count, 3)
    is_fixed = np.array([body.fixed for body in world.scene.bodies])
    places = np.where(is_fixed[:, None], world.pos[lost], [body.pos for body in world.scene.bodies])
    if supports.ROOM in world.names:
        room = world.names.index(supports.ROOM)
        places = places + ~is_fixed[:, None] * (world.pos[lost, room] - world.scene.bodies[room].pos)[:, None]
    world.set_state(pos=places, linvel=np.zeros(shape), angvel=np.zeros(shape), worlds=lost)


@dataclass
class Outcome:
    """Violations of laws in each world so far, as arrays (worlds,).

    Attributes
    ----------
    gain : float64
        Largest energy gain beyond the work of wrenches, as a share: of √(2 K) under a wrench, of `Look.size` without
        one.
    escaped : float64
        Largest depth of a centre of mass behind a wall, or behind a side of a room [bounding radii]. Among fixed bodies
        it does not count once a report told that a step had more impacts or turns than could be followed.
    told : bool
        A report told so (`Status.UNRESOLVED`).
    has_left : bool
        A centre of mass behind a wall or a side of a room, after a report told so.
    is_broken : bool
        A state that is not finite, a fault, or contacts left out.
    has_strayed : bool
        A fixed body that moved by a bit, or a driven one that left its line.
    """

    gain: np.ndarray
    escaped: np.ndarray
    told: np.ndarray
    has_left: np.ndarray
    is_broken: np.ndarray
    has_strayed: np.ndarray

    @classmethod
    def start(cls, worlds: int) -> Outcome:
        """Outcome without violations, for this number of worlds."""
        flags = (np.zeros(worlds, dtype=np.bool_) for _ in range(4))
        return cls(np.zeros(worlds), np.zeros(worlds), *flags)

    def broken_laws(self, limit: float) -> np.ndarray:
        """Flags (worlds,) bool of the worlds that have violated a law; a gain counts above `limit`."""
        return self.is_broken | self.has_strayed | (self.escaped > 0) | (self.gain > limit)

    def law(self, index: int, limit: float) -> str:
        """Name of the law that one world has violated; empty if it has violated none."""
        if self.is_broken[index]:
            return "not finite, a fault, or contacts left out"
        if self.escaped[index] > 0:
            return f"escaped by {self.escaped[index]:.3g} bounding radii"
        if self.has_strayed[index]:
            return "strayed: a fixed or driven body is not at its place"
        return f"gained {self.gain[index]:.3g} of its energy" if self.gain[index] > limit else ""

    def note(self, world: physics.World, before: Look, push_now: np.ndarray | None, dt: float) -> Look:
        """Check the last step against the laws, note violations, and return the quantities after the step.

        Parameters
        ----------
        world : World
        before : Look
            Quantities before the step.
        push_now : (worlds,) float64 or None
            Upper bound of the growth of √(2 K) under the step's wrench, which `push` returns; None: no wrench acted.
        dt : float
            Length of the step [s].
        """
        now, report = look(world), world.report
        self.is_broken |= ~now.is_finite | (report.faults > 0) | (report.left_out > 0)
        self.has_strayed |= supports.has_strayed(world, before.poses, dt)
        self.told |= report.unresolved > 0
        is_excused = self.told & bool(supports.fixed_bodies(world.scene))
        self.has_left |= is_excused & (now.escaped > 0)
        np.maximum(self.escaped, np.where(is_excused, 0.0, now.escaped), out=self.escaped)
        if push_now is None:
            gained = (now.energy - before.energy) / np.maximum(before.size, now.size)
        else:
            gained = np.sqrt(2 * now.kinetic) / (np.sqrt(2 * before.kinetic) + push_now * dt) - 1.0
        np.fmax(self.gain, gained, out=self.gain)  # no law of energy where `gained` is nan
        return now


def gain_limit(accuracy: Preset | physics.Accuracy) -> float:
    """Largest relative energy gain that a step at this accuracy may have; derived in `random_scenes`."""
    knobs = resolve(accuracy)
    return 4 * knobs.tolerance * (knobs.impacts + 1)


def drive(
    world: physics.World,
    rng: np.random.Generator,
    told: Callable[[int, str], None] = lambda index, law: None,
    start: Callable[[physics.World, np.random.Generator], None] = begin,
    load: Callable[[physics.World, np.random.Generator], np.ndarray] = draw_wrench,
) -> Outcome:
    """Draw all worlds of a batch and run them under one wrench, then another wrench, then none.

    Parameters
    ----------
    world : World
        Worlds of a scene from `scene_of`, or of one for which `start` draws.
    rng : numpy.random.Generator
    told : callable, optional
        Called with the index of each world that violates a law and the name of the law, after the first step in which
        it does.
    start : callable, optional
        Draws parameters and states of all worlds.
    load : callable, optional
        Draws wrenches (worlds, bodies, 6).

    Returns
    -------
    Outcome

    Notes
    -----
    A world that has gained more than `GROSS` is put at rest: it would keep gaining energy and take long to step.
    """
    start(world, rng)
    outcome = Outcome.start(world.worlds)
    limit, seen = gain_limit(world.accuracy), np.zeros(world.worlds, dtype=np.bool_)
    for steps, is_pushed in ((PUSHED, True), (PUSHED, True), (FREE, False)):
        wrench = load(world, rng) if is_pushed else None
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


# Number of worlds of each family in a thorough run, and number of worlds in one call of `drive`.
SHARES = {"block": 40_000, "ellipsoid": 40_000, "bodies": 20_000}
BATCH = 1000


def random_scenes(setting: Setting) -> list[Check]:
    """100,000 worlds with everything drawn at random (`begin`, `draw_wrench`) violate no law in 30 steps each.

    Forbidden are a state that is not finite, a fault, contacts left out, an exception (which would end the run), and a
    centre of mass behind a wall.

    Limit for the energy: a contact problem is solved to the tolerance, relative to its largest free contact speed u. So
    an impulse of at most 2 m u is off by this share of it, and the energy by at most 4 tolerances of ½ m u². A step has
    at most `Accuracy.impacts` such problems, and one in the resting stage. Overlapping bodies are pushed apart without
    a velocity. This moves them by twice the slop in the field of gravity, and rotates them by as much of a radian. (For
    body on body, the energy after that is that of the angular momentum in the new attitude.)

    With error control (`precise`, `reference`) a smooth step is off by a tolerance of the speed, and by two of the
    energy, at most as much as a contact problem. A part of a step of several bodies has contact problems of its own.
    The limit is for as many of them as a step may have impacts, 10,001. Most steps have hundreds. A rattling body has
    millions, and the limit is still the same.
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
