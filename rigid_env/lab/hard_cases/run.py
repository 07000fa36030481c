"""Run one hard case at one setting; an exception in it becomes an outcome, too."""

from __future__ import annotations

import time
from dataclasses import dataclass
from enum import Enum

import numpy as np

from rigid_env.hard_cases.case import Case, Check, Setting, UnsupportedError
from rigid_env.lab.measure.peers import Unsupported

OURS = "rigid-env"


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
    status: Status
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


def run_case(case: Case, setting: Setting, engine: str = OURS, accuracy: str | None = None) -> Outcome:
    """Run one case at one setting.

    Parameters
    ----------
    case : Case
    setting : Setting
    engine, accuracy : str
        Names for the outcome, as in `Outcome`; without `accuracy` the setting's preset.
    """
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
    seconds = time.perf_counter() - start
    return Outcome(case, engine, accuracy or str(setting.accuracy), setting.dt, status, checks, reason, seconds)
