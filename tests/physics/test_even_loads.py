"""A block that slides and turns on another body moves as on a wall: loads are shared evenly at `precise`.

Friction of a block that turns depends on how its corners share the load, which the contact problem leaves open. The
truth is one body at a wall, event-driven at `reference`.
"""

from __future__ import annotations

import numpy as np
import pytest

import physics
from physics.accuracy import PRESETS
from physics.kernels.multibody.stepping.allowed_error import ERROR_PER_TOLERANCE
from tests.tiers.sweep import sweep

G, MU = 9.81, 0.3
UP = physics.HalfSpace((0, 1, 0))
CASES = {  # size, velocity, spin, duration
    "cube": ((1, 1, 1), (1.5, 0, 0.5), 3.0, 0.3),
    "brick": ((1, 0.5, 0.6), (2, 0, 0.3), 4.0, 0.3),
    "brick that stops": ((1, 0.5, 0.6), (1, 0, 0.3), 2.0, 0.6),
}


def block(case: str) -> physics.Block:
    size, velocity, spin, _ = CASES[case]
    return physics.Block(size, 1.0, pos=(0, size[1] / 2, 0), linvel=velocity, angvel=(0, spin, 0))


def run(bodies: list, walls: list, case: str, accuracy: str) -> tuple[np.ndarray, int]:
    """Place of the block, the last of `bodies`, at the end, and contact problems solved on the way."""
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(0.2), physics.Friction(MU)]
    world = physics.World(physics.Scene(bodies, walls, effects), dt=0.01, accuracy=accuracy)
    solves = 0
    for _ in range(round(CASES[case][3] / 0.01)):
        solves += int(world.step().solves[0])
    return world.pos[0, -1].copy(), solves


def slab() -> physics.Block:
    return physics.Block((40, 1, 40), pos=(0, -0.5, 0), fixed=True)


@pytest.mark.parametrize("case", sweep(CASES, ["brick"]))
@pytest.mark.parametrize(
    "company", sweep([False, True], [False]), ids=lambda company: "in company" if company else "alone"
)
def test_it_moves_as_on_a_wall(case, company):
    """In company every part, of three contact problems, errs by the allowed error of the body's speed and size at most.

    An error of the velocity goes on for the time T. A problem that is solved for an impact or tried in vain counts as a
    third of a part, too, so that the bound is a safe one. Parts of a lone body are extrapolated. What is left of their
    errors are residuals, a tolerance of the speed g h: g T²/2 tolerances of the place. Before loads were shared evenly,
    the place was 3e-4 to 1e-2 m off. A ball that lies elsewhere is the company.
    """
    truth, _ = run([block(case)], [UP], case, "reference")
    ball = [physics.Sphere(0.2, 1.0, pos=(8, 0.2, 8))] if company else []
    place, solves = run([slab(), *ball, block(case)], [], case, "precise")
    size, velocity, spin, duration = CASES[case]
    radius = np.linalg.norm(size) / 2
    speed = np.linalg.norm(velocity) + radius * spin + np.sqrt(radius * G)
    tolerance = PRESETS["precise"].tolerance
    allowed = solves / 3 * ERROR_PER_TOLERANCE * tolerance
    bound = allowed * (radius + speed * duration) if company else tolerance * G * duration**2 / 2
    miss = np.abs((place - truth)[[0, 2]]).max()
    print(case, company, "error [m]", miss, "bound", bound, "contact problems", solves)
    assert miss <= bound
    assert place[1] == pytest.approx(size[1] / 2, abs=allowed * radius)
