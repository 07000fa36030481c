"""Two blocks that stand on a floor and push each other keep their contacts under error control.

Slops are tiny there, and must not decide whether a contact of two faces is the one of the part before.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import physics
from physics.accuracy import PRESETS
from tests.tiers.sweep import sweep

G = 9.81
PUSHER, CRATE = 20.0, 8.0  # kg


def make_world(tolerance: float) -> physics.World:
    bodies = [
        physics.Block((1.0, 0.5, 0.5), PUSHER, pos=(0, 0.25, 0)),
        physics.Block((1.0, 1.0, 1.0), CRATE, pos=(0.1, 0.5, 0.75)),
    ]
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(0.2), physics.Friction(0.3)]
    scene = physics.Scene(bodies, [physics.HalfSpace((0, 1, 0))], effects)
    return physics.World(scene, dt=0.01, accuracy=replace(PRESETS["precise"], tolerance=tolerance))


@pytest.mark.parametrize("tolerance", sweep([1e-9, 3e-10, 1e-10], [1e-10]))
def test_no_part_is_above_the_allowed_error(tolerance):
    """Both slide, turn to and fro, and are pressed on each other, while loads leave corners and come back.

    Contacts of two faces that lie on each other changed their ids with rounding, and a corner whose load came back had
    to close its gap first. Each was a jump that no part is short enough for (decision 67).
    """
    world, wrench, coarse, solves = make_world(tolerance), np.zeros((1, 2, 6)), 0, 0
    wrench[0, 0, 2] = 0.8 * PUSHER * G
    for k in range(60):
        wrench[0, 0, 4] = 20 * np.sin(0.3 * k)
        report = world.step(wrench)
        coarse, solves = coarse + int(report.fallbacks[0]), solves + int(report.solves[0])
    print(
        tolerance, "parts above the allowed error", coarse, "contact problems", solves, world.pos[0].round(7).tolist()
    )
    assert coarse == 0
