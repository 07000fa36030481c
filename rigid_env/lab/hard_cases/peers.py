"""Run hard cases in other engines, through a class with the interface of `physics.World`."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

import physics
from rigid_env.hard_cases.case import Case, Setting
from rigid_env.lab.hard_cases.run import Outcome, Status, run_case
from rigid_env.lab.measure.peers import Engine, Unsupported


class PeerWorld:
    """World of another engine for a hard case: only state, `time` and `step` of a `physics.World` of one world."""

    def __init__(self, engine: Engine, scene: physics.Scene, dt: float, options: Mapping):
        self._run = engine.open(scene, dt, **options)
        self._run.restart()
        self.dt, self.time = dt, 0.0
        self._look()

    def _look(self) -> None:
        self.pos, self.quat, self.linvel, self.angvel = (np.asarray(part)[None] for part in self._run.state())

    def step(self, wrench=None, steps: int = 1) -> None:
        """Advance by `steps` steps; this interface cannot pass a wrench to the engine."""
        if wrench is not None:
            raise Unsupported("a wrench is not handed to this engine")
        self._run.advance(steps)
        self.time += steps * self.dt
        self._look()


def run_peer(case: Case, engine: Engine, setting: Setting) -> Outcome:
    """Run a case in another engine at the engine's settings, one after the other, until it holds or is not supported.

    Returns the outcome that holds; if there is none, the outcome at the first setting, the engine's defaults. Its
    accuracy is the name of the setting in the first world that the case makes.
    """
    outcomes, most = [], 1  # most: largest number of settings that a world of the case has
    for index in itertools.count():
        names = []  # of the settings of the case's worlds

        def make(scene: physics.Scene, dt: float, index=index, names=names) -> PeerWorld:
            nonlocal most
            known = engine.settings(scene)
            most = max(most, len(known))
            names.append(list(known)[min(index, len(known) - 1)])
            return PeerWorld(engine, scene, dt, known[names[-1]])

        outcome = run_case(case, replace(setting, maker=make), engine.name, "default")
        outcomes.append(replace(outcome, accuracy=names[0]) if names else outcome)
        if outcome.status is not Status.FAILS or len(outcomes) == most:
            break
    return outcomes[-1] if outcomes[-1].status is Status.HOLDS else outcomes[0]
