"""Shared fixtures. Kernels are cached on disk, so only the first run of a changed kernel compiles."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings

from tests.tiers import plugin as tiers

# Compiling inside the first example would count against its deadline.
settings.register_profile("default tier", deadline=None, max_examples=20, derandomize=True)
settings.register_profile("exhaustive", settings.get_profile("default tier"), max_examples=50)


def pytest_addoption(parser):
    """Add the options of this suite."""
    tiers.add_options(parser)
    parser.addoption("--costs", metavar="FILE", help="append the cost of each test to FILE (tests/costs.py)")


def pytest_configure(config):
    """Choose the tier, and record costs where a file is given."""
    tiers.configure(config)
    settings.load_profile("exhaustive" if config.getoption("--exhaustive") else "default tier")
    if config.getoption("--costs"):
        from tests.costs import CostRecorder

        config.pluginmanager.register(CostRecorder(Path(config.getoption("--costs")).absolute()))


@pytest.fixture(scope="session")
def is_exhaustive(request) -> bool:
    """Answer whether `--exhaustive` is given: a test takes more worlds or steps then."""
    return request.config.getoption("--exhaustive")


@pytest.fixture(scope="session", autouse=True)
def _logs(tmp_path_factory):
    """Keep the folders that Stable-Baselines3 makes for its logs where pytest clears up, of programs, too."""
    os.environ.setdefault("SB3_LOGDIR", str(tmp_path_factory.mktemp("sb3")))


@pytest.fixture(scope="session", autouse=True)
def _no_second_process():
    """Leave compilation to the one process of a test, whose kernels the tests before have compiled."""
    os.environ.setdefault("RIGID_ENV_COMPILE_AHEAD", "0")


@pytest.fixture
def rng() -> np.random.Generator:
    """A seeded generator."""
    return np.random.default_rng(20260101)
