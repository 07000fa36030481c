"""One hard case at one setting: whatever goes wrong inside it is an outcome."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass
from enum import Enum

import numpy as np

from rigid_env.hard_cases.case import Case, Check, Setting, UnsupportedError

OURS = "rigid-env"


class Status(Enum):
    """Status of a case. Only `HOLDS` is a pass; only `FAILS` is a failure."""

    HOLDS = "holds"
    FAILS = "fails"
    UNSUPPORTED = "not supported"


@dataclass(frozen=True)
class Outcome:
    """Outcome of a case.

    Attributes
    ----------
    case : Case
    engine, accuracy : str
        `OURS` and the preset, or another engine and the name of its setting.
    dt : float
        Step [s].
    status : Status
    checks : tuple of Check
    reason : str
        Why there are no checks, or what went wrong while it ran.
    seconds : float
        Wall clock, with compiling if there was any.
    """

    case: Case
    engine: str
    accuracy: str
    dt: float
    status: Status
    checks: tuple[Check, ...]
    reason: str
    seconds: float

    @property
    def tightest(self) -> Check | None:
        """The check with the least margin, the first of equals; None where there are none."""
        return min(self.checks, key=lambda check: check.margin, default=None)

    def to_dict(self) -> dict:
        """JSON-able: numbers that are not finite become null."""
        return {
            "number": self.case.number, "name": self.case.name, "engine": self.engine, "accuracy": self.accuracy,
            "dt": self.dt, "status": self.status.value, "reason": self.reason, "seconds": self.seconds,
            "checks": [_check_to_dict(check) for check in self.checks],
        }  # fmt: skip


def _check_to_dict(check: Check) -> dict:
    numbers = {name: getattr(check, name) for name in ("value", "limit", "expected", "margin")}
    finite = {name: number if math.isfinite(number) else None for name, number in numbers.items()}
    return {"what": check.what, "kind": check.kind, "unit": check.unit, "passes": check.passes, **finite}


def run_case(case: Case, setting: Setting, engine: str = OURS, accuracy: str | None = None) -> Outcome:
    """Run one case at one setting.

    Parameters
    ----------
    case : Case
    setting : Setting
    engine, accuracy : str
        As in `Outcome`; None: the setting's preset.
    """
    start, checks = time.perf_counter(), ()
    try:
        with np.errstate(all="ignore"):  # what has blown up is for the checks to say
            checks = tuple(case.run(setting))
        status = Status.HOLDS if checks and all(check.passes for check in checks) else Status.FAILS
        reason = "" if checks else "no check was made"
    except UnsupportedError as error:
        status, reason = Status.UNSUPPORTED, str(error)
    except Exception as error:  # of one case: the others are still to be run
        status, reason = Status.FAILS, f"{type(error).__name__}: {error}"
    seconds = time.perf_counter() - start
    return Outcome(case, engine, accuracy or str(setting.accuracy), setting.dt, status, checks, reason, seconds)
