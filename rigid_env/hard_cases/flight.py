"""Hard cases (to be filled)."""

from __future__ import annotations

from rigid_env.hard_cases.case import Case

CASES: tuple[Case, ...] = ()
