"""Shared fixtures. Kernels are cached on disk, so only the first run of a changed kernel compiles."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import settings

# Compiling inside the first example would count against its deadline.
settings.register_profile("rigid-env", deadline=None, max_examples=50, derandomize=True)
settings.load_profile("rigid-env")


@pytest.fixture
def rng() -> np.random.Generator:
    """A seeded generator."""
    return np.random.default_rng(20260101)
