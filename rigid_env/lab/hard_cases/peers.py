"""Run hard cases in other engines, through a class with the interface of `physics.World`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import physics
from rigid_env.hard_cases.case import Case, Setting, UnsupportedError
from rigid_env.lab.hard_cases.run import Outcome, Status, run_case
from rigid_env.lab.measure.peers import Engine, Unsupported


class PeerWorld:
    """World of another engine for a hard case: only state, `time` and `step` of a `physics.World` of one world."""

    def __init__(self, engine: Engine, scene: physics.Scene, dt: float, options: dict):
        try:
            self._run = engine.open(scene, dt, **options)
            self._run.restart()
        except Unsupported as error:
            raise UnsupportedError(str(error)) from error
        self.dt, self.time = dt, 0.0
        self._look()

    def _look(self) -> None:
        self.pos, self.quat, self.linvel, self.angvel = (np.asarray(part)[None] for part in self._run.state())

    def step(self, wrench=None, steps: int = 1) -> None:
        """Advance by `steps` steps; this interface cannot pass a wrench to the engine."""
        if wrench is not None:
            raise UnsupportedError("a wrench is not handed to this engine")
        self._run.advance(steps)
        self.time += steps * self.dt
        self._look()


def run_peer(case: Case, engine: Engine, setting: Setting) -> Outcome:
    """Run a case in another engine at the engine's settings, one after the other, until it holds or is not supported.

    Returns the outcome that holds; if there is none, the outcome at the first setting, the engine's defaults.
    """
    outcomes = []
    for index in range(_setting_count(engine)):
        used = ["default"]  # names of the settings used; the case adds one for each world that it makes

        def make(scene: physics.Scene, dt: float, index=index, used=used) -> PeerWorld:
            known = list(engine.settings(scene).items())
            name, options = known[min(index, len(known) - 1)]
            used.append(name)
            return PeerWorld(engine, scene, dt, dict(options))

        outcome = run_case(case, replace(setting, maker=make), engine.name, "default")
        outcomes.append(replace(outcome, accuracy=used[:2][-1]))
        if outcome.status in (Status.HOLDS, Status.UNSUPPORTED):
            break
    return next((one for one in outcomes if one.status is Status.HOLDS), outcomes[0])


def _setting_count(engine: Engine) -> int:
    """Number of settings that the engine has for a scene with contact, the kind of scene with most settings."""
    body = physics.Sphere(1.0, 1.0, pos=(0, 2, 0))
    touching = [physics.Contact(0.5), physics.Friction(0.5), physics.Gravity()]
    return len(engine.settings(physics.Scene([body], [physics.HalfSpace((0, 1, 0))], touching)))
