"""A field of a user's own: one short file, the engine untouched, compiled once for all processes."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import pytest

import physics
from physics.scene.force_field import digest

# The page's example is what is tested.
PAGE = Path(__file__).parents[2] / "docs" / "effects.md"

PROGRAM = """
import json, sys, physics
sys.path.insert(0, sys.argv[1])
from attraction import Attraction
from physics.kernels.time_stepping.step import step_worlds
body = physics.Sphere(0.1, 2.0, pos=(1.0, 0, 0), linvel=(0, 1.5, 0))
world = physics.World(physics.Scene([body], effects=[Attraction(4.5)]), dt=0.001)
world.step(steps=1000)
stats = step_worlds.stats
print(json.dumps({"hits": sum(stats.cache_hits.values()), "misses": sum(stats.cache_misses.values()),
                  "pos": world.pos[0, 0].tolist(), "energy": physics.diagnose(world).energy[0, 0]}))
"""


def example() -> str:
    """The file that the docs show."""
    text = PAGE.read_text(encoding="utf-8").split("<!-- attraction.py -->")[1]
    return text.split("```python\n")[1].split("```")[0]


def fresh_process(folder: Path, cache: Path) -> dict:
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, str(folder)], env={**os.environ, "NUMBA_CACHE_DIR": str(cache)},
        capture_output=True, text=True, check=True, timeout=600,
    )  # fmt: skip
    return json.loads(done.stdout)


def test_the_example_of_the_docs_is_right_and_compiled_once(tmp_path):
    """A circular orbit: v² = k/(m r) at r = 1 m, k = 4.5, m = 2: 1.5 rad/s. Then the file is edited: never stale."""
    file = tmp_path / "attraction.py"
    file.write_text(example())
    first, second = fresh_process(tmp_path, tmp_path), fresh_process(tmp_path, tmp_path)
    # Leapfrog with h = 1e-3: the angle is off by (ω h)² ω t/24, at most 2e-7.
    assert first["pos"] == pytest.approx([math.cos(1.5), math.sin(1.5), 0], abs=1e-6)
    assert first["energy"] == pytest.approx(2.0 * 1.5**2 / 2 - 4.5, abs=1e-6)
    assert (first["hits"], first["misses"]) == (0, 1)
    assert (second["hits"], second["misses"]) == (1, 0)
    assert second["pos"] == first["pos"]
    file.write_text(example().replace("-p[0] / (r * r * r)", "-0.0 * p[0] / (r * r * r)"))
    edited = fresh_process(tmp_path, tmp_path)
    assert edited["misses"] == 1
    assert edited["pos"] == pytest.approx([1.0, 1.5, 0], abs=1e-12)


FACTOR = 2.0


@physics.field_function
def helper(x):
    return FACTOR * x


@physics.field_function
def pull(state, p, t):
    return (helper(state.x[0]), 0.0, 0.0), (0.0, 0.0, 0.0)


def test_the_digest_follows_what_a_function_reads(monkeypatch):
    before = digest(pull)
    assert digest(pull) == before
    monkeypatch.setitem(globals(), "FACTOR", 3.0)
    assert digest(pull) != before


@dataclass(frozen=True)
class Plain(physics.Field):
    """Its function is not compiled."""

    function: ClassVar = math.sin


@dataclass(frozen=True)
class Empty(physics.Field):
    """It has none."""


@pytest.mark.parametrize("kind", [Plain, Empty])
def test_a_field_without_a_compiled_function_is_refused(kind):
    scene = physics.Scene([physics.Sphere(1, 1)], effects=[kind()])
    with pytest.raises(ValueError, match=f"{kind.__name__}.function is .*@physics.field_function"):
        physics.World(scene)
