"""Wrong input to what is made: bodies, walls, effects, scenes, worlds."""

from __future__ import annotations

import physics
from tests.wrong_input.case import Case

CASES = [
    Case("mass-zero", lambda: physics.Sphere(1.0, 0.0), ("mass", "0", "greater than 0")),
    Case("world-acuracy", lambda: physics.World(None, acuracy="fast"), ("acuracy", "'fast'", "allowed are accuracy,")),
]
