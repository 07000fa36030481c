"""Fixtures of this folder."""

from __future__ import annotations

import sys

import pytest


@pytest.fixture
def without_mujoco(monkeypatch):
    """Hide MuJoCo as if it were not installed."""
    monkeypatch.setitem(sys.modules, "mujoco", None)


@pytest.fixture(params=["compiled", "plain"])
def reader(request):
    """Read MJCF with MuJoCo, and without."""
    if request.param == "plain":
        request.getfixturevalue("without_mujoco")
    else:
        pytest.importorskip("mujoco", minversion="3.3.7")
    return request.param
