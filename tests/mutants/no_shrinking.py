"""Plugin of pytest: Hypothesis reports the first example that fails, and looks for no smaller one."""

from __future__ import annotations

import pytest
from hypothesis import Phase, settings


@pytest.hookimpl(trylast=True)
def pytest_configure(config):
    """Let the settings that are loaded by now end with the first failing example."""
    settings.register_profile("mutants", settings(), phases=(Phase.explicit, Phase.reuse, Phase.generate))
    settings.load_profile("mutants")
