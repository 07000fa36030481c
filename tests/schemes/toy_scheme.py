"""A toy scheme, added by the rules of `physics.schemes.scheme`: bodies that fall, by explicit Euler."""

import numpy as np
import pytest

import physics
from physics import schemes
from physics.compiler.decorators import inlined, kernel
from physics.kernels.parallel.work_stealing import for_each_world
from physics.kernels.state import layout as at
from physics.kernels.state.body import clear_report
from physics.schemes.scheme import Scheme, records
from physics.schemes.wall_memory import WallMemory

DT, STEPS = 0.01, 10


@inlined
def advance_world(world, grid, bodies, records):
    """Advance each body of a world: x += h v, v += h g."""
    clear_report(world, records.report)
    count = bodies.shapes.shape[0]
    for _ in range(grid.steps * grid.substeps):
        for i in range(world * count, (world + 1) * count):
            for c in range(3):
                bodies.state[i, at.POS + c] += grid.h * bodies.state[i, at.LINVEL + c]
                bodies.state[i, at.LINVEL + c] += grid.h * bodies.gravity[world, c]


_advance_worlds = for_each_world(advance_world)


@kernel
def step_falling(queue, grid, bodies, records):
    """Advance the worlds that no other thread has taken."""
    _advance_worlds(queue, (grid, bodies, records))


class Falling(Scheme):
    name = "falling"
    kernel = staticmethod(step_falling)
    memory = WallMemory()

    def takes(self, needs, accuracy):
        return needs.gravity is not None and not needs.touching and accuracy.scheme == "explicit_euler"

    def objection(self, scene, needs, accuracy):
        return f"Scene.effects holds {needs.fields}; allowed is Gravity alone" if needs.fields else ""

    def make_scratch(self, scene, switches, walls, accuracy):
        return None

    def arguments(self, worlds, k):
        return (records(worlds),)


if __name__ == "__main__":
    schemes.SCHEMES = (Falling(), *schemes.SCHEMES)
    g = (0.0, -10.0, 0.0)
    accuracy = physics.Accuracy(scheme="explicit_euler")
    body = physics.Sphere(0.1, 1.0, linvel=(1, 0, 0))
    world = physics.World(physics.Scene([body], effects=[physics.Gravity(g)]), 2, dt=DT, accuracy=accuracy)
    world.step(steps=STEPS)
    assert repr(world.plan.scheme) == "falling", world.plan.scheme
    # Of n steps the sum of h² g k, k from 0 to n - 1.
    expected = (STEPS * DT, DT**2 * g[1] * STEPS * (STEPS - 1) / 2, 0.0)
    np.testing.assert_allclose(world.pos[:, 0], [expected] * 2, rtol=0, atol=1e-15)
    np.testing.assert_allclose(world.linvel[:, 0], [(1.0, STEPS * DT * g[1], 0.0)] * 2, rtol=0, atol=1e-15)
    assert world.report.ok
    assert len(world.contact_ends()) == 0
    with pytest.raises(ValueError, match="allowed is Gravity alone"):
        physics.World(physics.Scene([body], effects=[physics.Gravity(g), physics.Drag()]), accuracy=accuracy)
    print("falls as it should")
