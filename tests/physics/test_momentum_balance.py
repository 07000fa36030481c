"""Contact forces of a step, logged impacts and weight make up the change of momentum of a body."""

from __future__ import annotations

import numpy as np
import pytest

import physics
from physics.kernels.state.layout import SPLITS

G, EPS = 9.81, 2.0**-52
FLOOR = physics.HalfSpace((0, 1, 0))
TURNED = np.array((0.95, 0.1, 0.05, 0.28))
BODIES = {
    "ellipsoid": physics.Ellipsoid(
        (0.4, 0.2, 0.3), 2.0, pos=(0, 0.2, 0), linvel=(1, 0, 0.3), angvel=(0.4, 0.2, -4)
    ),
    "block": physics.Block(
        (0.5, 0.3, 0.2), 1.5, pos=(0, 0.4, 0), linvel=(0.5, 0, 0), quat=tuple(TURNED / np.linalg.norm(TURNED))
    ),
    "sphere": physics.Sphere(0.2, 1.0, pos=(0, 0.21, 0), linvel=(1, 0, 0)),
}  # fmt: skip


@pytest.mark.parametrize("dt", [0.005, 0.01])
@pytest.mark.parametrize(("name", "friction", "restitution"), [
    ("ellipsoid", 0.0, 0.0), ("ellipsoid", 0.0, 0.5), ("block", 0.0, 0.0), ("sphere", 0.0, 0.5), ("sphere", 0.4, 0.5),
])  # fmt: skip
def test_forces_and_impacts_make_up_the_change_of_momentum(name, friction, restitution, dt):
    """At `fast`, whose steps of one stage these are; impulses that bring back to rest what goes on are forces.

    A step adds weight and impulses, and each of these sums is rounded: some ten of them, of the largest velocity. Left
    out are steps that an impact has split, whose forces are those of the last part.
    """
    body = BODIES[name]
    effects = [physics.Gravity((0, -G, 0)), physics.Contact(restitution), physics.Friction(friction)]
    world = physics.World(physics.Scene([body], [FLOOR], effects), accuracy="fast", dt=dt)
    world.make_event_room(16)
    weight, counted = np.array([0, -body.mass * G * dt, 0]), 0
    for _ in range(400):
        before = world.linvel[0, 0].copy()
        world.step()
        if world.report_table[0, SPLITS] > 0:
            continue
        forces = world.contacts()[1]
        events = world.event_log[0, : world.event_counts[0], 4:7]
        change = body.mass * (world.linvel[0, 0] - before)
        size = np.abs(world.linvel[0, 0]).max() + np.abs(before).max() + G * dt
        np.testing.assert_allclose(
            change, forces.sum(axis=0) * dt + events.sum(axis=0) + weight, rtol=0, atol=20 * EPS * body.mass * size
        )
        assert (forces[:, 1] >= 0).all()
        counted += 1
    assert counted > 380
