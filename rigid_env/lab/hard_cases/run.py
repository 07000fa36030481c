"""Run one hard case at one setting, in our engine or in another one."""

from __future__ import annotations

import itertools
import time
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

import physics
from physics.work_precision.contender import OURS
from rigid_env.hard_cases.case import Case, Check, Setting, UnsupportedError
from rigid_env.lab.measure.peers import Engine, Unsupported


class Status(Enum):
    """Status of a case at a setting: only `HOLDS` is a pass, and only `FAILS` is a failure."""

    HOLDS = "holds"
    FAILS = "fails"
    UNSUPPORTED = "not supported"


@dataclass(frozen=True)
class Outcome:
    """Outcome of one case at one setting.

    Attributes
    ----------
    case : Case
    engine, accuracy : str
        `OURS` and the preset, or another engine and the name of its setting.
    dt : float
        Step [s].
    status : Status
    checks : tuple of Check
        Checks that the case made.
    reason : str
        Reason for a missing check, or the error that ended the run.
    seconds : float
        Wall-clock time of the run, compilation included [s].
    """

    case: Case
    engine: str
    accuracy: str
    dt: float
    status: Status = Status.FAILS
    checks: tuple[Check, ...] = ()
    reason: str = ""
    seconds: float = 0.0

    @property
    def tightest(self) -> Check | None:
        """Check with the smallest margin, the first among equals; None if there are no checks."""
        return min(self.checks, key=lambda check: check.margin, default=None)

    @property
    def came_out(self) -> str:
        """Text of the tightest check. Without checks: the reason for having none."""
        return str(self.tightest) if self.checks else self.reason

    def to_dict(self) -> dict:
        """Outcome as a dict for JSON, with the number and the name of the case."""
        checks = [{**vars(check), "passes": check.passes, "margin": check.margin} for check in self.checks]
        rest = {**vars(self), "status": self.status.value, "checks": checks}
        case = rest.pop("case")
        return {"number": case.number, "name": case.name, **rest}


def run_case(case: Case, setting: Setting) -> Outcome:
    """Run one case at one setting; an exception in it becomes an outcome, too."""
    start, checks = time.perf_counter(), ()
    try:
        with np.errstate(all="ignore"):  # the checks report numbers that are not finite
            checks = tuple(case.run(setting))
        status = Status.HOLDS if checks and all(check.passes for check in checks) else Status.FAILS
        reason = "" if checks else "no check was made"
    except (UnsupportedError, Unsupported) as error:
        status, reason = Status.UNSUPPORTED, str(error)
    except Exception as error:  # an error in one case must not end the run of the others
        status, reason = Status.FAILS, f"{type(error).__name__}: {error}"
    return Outcome(case, OURS, str(setting.accuracy), setting.dt, status, checks, reason, time.perf_counter() - start)


class PeerWorld:
    """World of another engine for a hard case: only state, `time` and `step` of a `physics.World` of one world."""

    def __init__(self, engine: Engine, scene: physics.Scene, dt: float, **options):
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
    first, most = None, 1  # most: largest number of settings that a world of the case has
    for index in itertools.count():
        names = []  # of the settings of the case's worlds

        def make(scene: physics.Scene, dt: float, index=index, names=names) -> PeerWorld:
            nonlocal most
            known = engine.settings(scene)
            most = max(most, len(known))
            names.append(list(known)[min(index, len(known) - 1)])
            return PeerWorld(engine, scene, dt, **known[names[-1]])

        outcome = run_case(case, replace(setting, maker=make))
        outcome = replace(outcome, engine=engine.name, accuracy=names[0] if names else "default")
        first = first or outcome
        if outcome.status is not Status.FAILS or index + 1 >= most:
            return outcome if outcome.status is Status.HOLDS else first
