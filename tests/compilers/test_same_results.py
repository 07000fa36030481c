"""Compilers of kernels: `numba` and `python` give the same bits, and `fused` the same numbers but for roundings.

`fused` rounds a product and the sum that it is in once, the others twice. Until the contacts of a scene change the
states differ by roundings that the motion has made larger; from then on the contact solver, which ends at a residual,
may end elsewhere.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from physics.compiler.compiler_choice import NUMBA, PYTHON
from tests.compilers.trajectory import by_compiler, trajectory

# The block at three presets, a tower, and, exhaustively, a scene for each shape, law and field
# (`benchmarks.bit_scenes`); with the number of steps, enough for the first contact.
JOBS = [
    ("drop", "fast", 80), ("drop", "balanced", 80), ("drop", "precise", 80), ("tower", "balanced", 20),
    ("frictionless", "balanced", 80), ("superball", "balanced", 70), ("compliant", "balanced", 80),
    ("grain", "balanced", 40), ("sphere-rolls", "balanced", 40), ("ellipsoid", "balanced", 70),
    ("hull", "balanced", 70), ("kick", "balanced", 40), ("floats", "balanced", 40), ("spring", "balanced", 40),
    ("push", "balanced", 40), ("actuated", "balanced", 40), ("pendulum", "balanced", 40), ("mixed", "balanced", 60),
    ("sleeping-tower", "balanced", 30), ("workshop", "balanced", 40),
]  # fmt: skip

FEW = [*JOBS[:2], JOBS[3]]

# Roundings of 1e-16 in lengths and speeds of some units, over some dozen steps of stable motion.
ROUNDING = 1e-10

# The floating block: water of 5,000 times its density accelerates it by 5e4 m/s² where it is under, so that a rounding
# of the submerged volume becomes one of the velocity that is so much larger.
FLOATING = 1e-7

# Residual of a contact problem at `balanced`, 1e-6 of the free contact speed; the motion that follows may differ by
# some of these.
SOLVED = 1e-5


def differences(ours: dict, theirs: dict, name: str) -> np.ndarray:
    """Largest difference of some numbers in each step, relative to 1 and to themselves."""
    first, second = np.array(ours[name]), np.array(theirs[name])
    assert np.isfinite(second).all()
    return (np.abs(first - second) / (1.0 + np.abs(first))).reshape(len(first), -1).max(axis=1)


def first_change(found: dict) -> int:
    """The first step in which contacts begin, end or collide, as far as the report says so."""
    marks = list(zip(map(tuple, found["solves"]), map(tuple, found["impacts"])))
    changes = (k for k in range(len(marks)) if any(marks[k][1]) or (k > 0 and marks[k] != marks[k - 1]))
    return next(changes, len(marks))


def jobs():
    """All of them, few of them in the default tier."""
    for job in JOBS:
        yield pytest.param(job, id=f"{job[0]}-{job[1]}", marks=[] if job in FEW else [pytest.mark.exhaustive])


@cache
def interpreted_few() -> list[dict]:
    """Trajectories of the default tier without machine code, in one process."""
    return by_compiler(PYTHON, FEW)


@pytest.mark.parametrize("job", list(jobs()))
def test_python_gives_the_numbers_of_machine_code(job):
    compiled = trajectory(*job)
    interpreted = interpreted_few()[FEW.index(job)] if job in FEW else by_compiler(PYTHON, [job])[0]
    assert compiled["is_rolled_out"]
    assert interpreted["is_rolled_out"]
    change = first_change(compiled)
    assert first_change(interpreted) == change
    states = differences(compiled, interpreted, "state")
    assert states[:change].max(initial=0.0) <= (FLOATING if job[0] == "floats" else ROUNDING)
    assert states.max() <= SOLVED
    for law in ("energy", "momentum", "depth"):
        assert differences(compiled, interpreted, law).max() <= SOLVED


@pytest.mark.exhaustive
def test_plain_numba_gives_the_bits_of_python():
    """With one thread and with two, in a process that may not import `fused`."""
    alone, shared = ("drop", "fast", 80), ("drop", "fast", 80, 2)
    (one, two), (meant, of_threads) = (by_compiler(compiler, [alone, shared]) for compiler in (NUMBA, PYTHON))
    assert one["is_rolled_out"]
    assert one == meant
    assert two == meant
    assert of_threads == meant
