"""The examples are modules here, as for a user in their folder."""

from __future__ import annotations

from pathlib import Path

import pytest

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.fixture(autouse=True)
def found(monkeypatch):
    """Find the examples."""
    monkeypatch.syspath_prepend(str(EXAMPLES))
