"""Steps that the soak once found to break a law (`benchmarks.soak`), from the state that they start from."""

from __future__ import annotations

from pathlib import Path

import pytest

import physics
from benchmarks.shrink import law_broken

pytestmark = pytest.mark.interpreted

RECORDINGS = sorted((Path(__file__).parent / "data").glob("*.npz"))


@pytest.mark.parametrize("path", RECORDINGS, ids=lambda path: path.stem)
def test_a_step_that_broke_a_law_keeps_it(path):
    assert law_broken(physics.Recording.load(path)) == ""


def test_there_are_recordings():
    assert RECORDINGS
