"""Pages name all that they say they list."""

from __future__ import annotations

import re
from pathlib import Path

import physics

PAGE = Path(__file__).parents[2] / "docs" / "reports.md"


def test_the_page_of_reports_lists_every_field_and_every_status_in_order():
    """Rows of the two tables against `StepReport` and `Status`."""
    rows = [line.split("|")[1] for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("| `")]
    named = [name for row in rows for name in re.findall(r"`(\w+)`", row)]
    fields = {name for name, value in vars(physics.StepReport).items() if isinstance(value, property)}
    statuses = sorted(physics.Status, key=physics.Status.severity)
    assert {name for name in named if name.islower()} == fields
    assert [name for name in named if name.isupper()] == [status.name for status in statuses]
