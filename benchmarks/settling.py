"""A pile of cubes in a shaft, ours and MuJoCo's: what a step costs while it falls and settles, and once it lies."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

import physics
from rigid_env.lab.measure.workloads import STEP

LIES = 1e-3  # a pile lies once no body of it has been faster than this [m/s] ...
LIES_FOR = 400  # ... for so many steps; and so many are measured then
PARTS = 5  # of what is measured; the median part counts


@dataclass(frozen=True)
class Sample:
    """Cost of one size.

    Attributes
    ----------
    bodies : int
    found : float
        Contacts of a step, or near pairs.
    seconds : float
        Of a step, or of one broad phase [s].
    unconverged : float or None
        Share of the solves that did not reach the tolerance; None: there was none, or it does not say.
    steps : int
        That it took.
    fastest : float
        Speed of the fastest body at the end [m/s].
    deepest : float
        Of parts of so many steps the deepest that a contact was in one, the median over the parts [m].
    residual : float or None
        The same of the residual of the solves, relative as `Accuracy.tolerance` is; None: it does not say.
    """

    bodies: int
    found: float
    seconds: float
    unconverged: float | None = None
    steps: int = 0
    fastest: float = 0.0
    deepest: float = 0.0
    residual: float | None = None


class Ours:
    """A pile of our engine."""

    def __init__(self, scene: physics.Scene, accuracy: str) -> None:
        self.world = physics.World(scene, dt=STEP, accuracy=accuracy)
        self.world.step(dt=STEP * 1e-3)  # compiled
        self.solves, self.failed, self.residual = 0, 0, 0.0

    def advance(self, steps: int) -> None:
        """Step it."""
        report = self.world.step(steps=steps)
        self.solves, self.failed = self.solves + int(report.solves[0]), self.failed + int(report.unconverged[0])
        self.residual, self._depth = float(report.residual[0]), float(report.penetration[0])

    def contacts(self) -> int:
        """Contacts of the last step."""
        return len(self.world.contact_ends(0))

    def depth(self) -> float:
        """Deepest that a contact was since before the last `advance` [m]."""
        return self._depth

    def fastest(self) -> float:
        """Speed of the fastest body [m/s]."""
        return float(np.linalg.norm(self.world.linvel[0], axis=-1).max())


class Theirs:
    """The same pile in MuJoCo, at its defaults but for the solver."""

    solves, failed, residual = 0, 0, None  # it does not say

    def __init__(self, scene: physics.Scene, solver: str) -> None:
        from rigid_env.lab.measure.peers.mujoco import MuJoCo

        self.run = MuJoCo().open(scene, STEP, solver=solver)
        self.run.restart()

    def advance(self, steps: int) -> None:
        """As `Ours.advance`."""
        self.run.advance(steps)

    def contacts(self) -> int:
        """As `Ours.contacts`."""
        return int(self.run.data.ncon)

    def depth(self) -> float:
        """Deepest contact of the last step [m]."""
        return max(0.0, -float(self.run.data.contact.dist.min(initial=0.0)))

    def fastest(self) -> float:
        """As `Ours.fastest`."""
        return float(np.linalg.norm(self.run.state()[2], axis=-1).max())


class Watch:
    """A pile as it is stepped: parts of so many steps, what they cost and how fast it was at the end of each."""

    def __init__(self, pile: Ours | Theirs) -> None:
        self.pile, self.steps, self.times, self.contacts, self.speeds = pile, 0, [], [], []
        self.depths, self.residuals = [], []
        self.solves, self.failed = pile.solves, pile.failed

    def part(self, steps: int) -> None:
        """Step the pile."""
        start = time.perf_counter()
        self.pile.advance(steps)
        self.times.append((time.perf_counter() - start) / steps)
        self.contacts.append(self.pile.contacts())
        self.speeds.append(self.pile.fastest())
        self.depths.append(self.pile.depth())
        self.residuals.append(self.pile.residual)
        self.steps += steps

    def lies(self, parts: int) -> bool:
        """True if nothing was fast at the end of any of the last parts."""
        return len(self.speeds) >= parts and max(self.speeds[-parts:]) <= LIES

    def sample(self, bodies: int, seconds: float) -> Sample:
        """Return the sample of a run with a step at `seconds`."""
        solves, failed = self.pile.solves - self.solves, self.pile.failed - self.failed
        share = failed / solves if solves else None
        depth = float(np.median(self.depths))
        residual = None if None in self.residuals else float(np.median(self.residuals))
        contacts = float(np.mean(self.contacts))
        return Sample(bodies, contacts, seconds, share, self.steps, self.speeds[-1], depth, residual)


def settle(count: int, pile: Ours | Theirs, limit: int, until_it_lies: bool = True) -> tuple[Sample, Sample]:
    """Let a pile of `count` cubes settle for `limit` steps, or less if it lies before, then go on: what both cost."""
    size = LIES_FOR // (10 * PARTS)
    falling = Watch(pile)
    while falling.steps < limit and not (until_it_lies and falling.lies(LIES_FOR // size)):
        falling.part(size)
    lying = Watch(pile)
    for _ in range(PARTS):
        lying.part(LIES_FOR // PARTS)
    return falling.sample(count, float(np.mean(falling.times))), lying.sample(count, float(np.median(lying.times)))
