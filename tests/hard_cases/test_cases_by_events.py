"""Every hard case at `precise`, event-driven, and 10 ms: each check derives its own limit."""

from __future__ import annotations

import pytest

from tests.hard_cases import tier


@pytest.mark.parametrize("case", tier.cases("precise"))
def test_the_case_comes_out_as_it_must(case):
    tier.check(case, "precise")
