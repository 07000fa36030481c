"""Fields of users without `fused`: they act, and what is wrong with one is said before anything moves."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import physics
from physics.compiler.compiler_choice import COMPILERS, FUSED, PYTHON, VARIABLE
from tests.tiers.sweep import sweep

PROGRAM = """
import json
from dataclasses import dataclass
from typing import ClassVar

import physics


@physics.field_function
def pull(state, p, t):
    return (-p[0] * state.x[0], 0.0, 0.0), (0.0, 0.0, 0.0)


@physics.field_function
def beyond(state, p, t):
    return (p[3], 0.0, 0.0), (0.0, 0.0, 0.0)


@physics.field_function
def writes(state, p, t):
    p[0] = 1.0
    return (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)


@physics.field_function
def short(state, p, t):
    return 0.0, 0.0, 0.0


@physics.field_function
def unknown(state, p, t):
    return (state.mood, 0.0, 0.0), (0.0, 0.0, 0.0)


@physics.field_function
def infinite(state, p, t):
    return (1.0 / (state.x[0] - state.x[0]), 0.0, 0.0), (0.0, 0.0, 0.0)


found = {}
for given in (pull, beyond, writes, short, unknown, infinite):

    @dataclass(frozen=True)
    class Trough(physics.Field):
        stiffness: float = 2.0
        function: ClassVar = given

    try:
        scene = physics.Scene([physics.Sphere(0.5, 1.0, pos=(1, 0, 0))], [], [Trough()])
        world = physics.World(scene, accuracy="fast", dt=0.01)
        report = world.step(steps=10)
        found[given.py_func.__name__] = [float(world.pos[0, 0, 0]), int(report.faults[0])]
    except ValueError as error:
        found[given.py_func.__name__] = str(error)
print(json.dumps(found))
"""


@pytest.mark.parametrize("compiler", sweep([name for name in COMPILERS if name != FUSED], [PYTHON]))
def test_fields_act_and_faults_are_told(compiler, tmp_path):
    file = tmp_path / "fields.py"
    file.write_text(PROGRAM, encoding="utf-8")
    environment = {**os.environ, VARIABLE: compiler, "PYTHONPATH": str(Path(physics.__file__).parents[1])}
    done = subprocess.run([sys.executable, str(file)], env=environment, capture_output=True, text=True, check=True)
    found = json.loads(done.stdout)
    # The midpoint rule of a spring of ω² = 2 over n = 10 steps of h = 0.01: x falls by ω² t² / 2 up to (ω t)^4 / 24.
    assert found["pull"][0] == pytest.approx(np.cos(np.sqrt(2.0) * 0.1), abs=1e-5)
    assert found["beyond"].startswith("Trough.function reads beyond the end of p; allowed is p[0]")
    assert found["writes"].startswith("Trough.function writes to p; allowed is to read it")
    assert found["short"].startswith("Trough.function returns a tuple of 3 numbers; allowed is ((fx, fy, fz)")
    assert "state has no 'mood'; allowed are x, v, w, R" in found["unknown"]
    assert found["infinite"] == [1.0, 1], "a load that is not finite leaves the body where it was, and is a fault"
    for name in ("beyond", "writes", "short", "unknown"):
        assert f"{file}" in found[name]
