"""Steps of scenes and of an environment, timed: the worker of `in_turns`.

Only names of the public contract are used, so that the same file runs over an older commit.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable

ENVIRONMENT = "BlockReach"
WORLDS = 64
RUN = 200  # steps from the start of a scene until it begins anew, before all is asleep
DRAWN = "-drawn"  # end of the name of a scene whose worlds start at drawn places: many motions instead of one
APART = 0.05  # bodies start within this distance of their places along each axis [m]


def _stepper(name: str) -> Callable[[int], None]:
    """A function of a number of steps that takes them from the start, after the kernels are there."""
    if name == ENVIRONMENT:
        import gymnasium as gym

        import rigid_env  # noqa: F401  (registers)

        envs = gym.make_vec("rigid_env/BlockReach-v0", num_envs=WORLDS, vectorization_mode="vector_entry_point")
        envs.action_space.seed(0)
        action = envs.action_space.sample()

        def step(count):
            envs.reset(seed=0)
            for _ in range(count):
                envs.step(action)

        return step
    import bit_scenes
    import numpy as np

    import physics

    world = physics.World(bit_scenes.SCENES[name.removesuffix(DRAWN)](), worlds=WORLDS, dt=bit_scenes.DT, threads=1)
    if name.endswith(DRAWN):
        moved = np.random.default_rng(1).uniform(-APART, APART, world.pos.shape)
        world.set_state(pos=world.pos + moved + (0.0, APART, 0.0))
    start = world.snapshot()

    def step(count):
        for done in range(0, count, RUN):
            world.restore(start)
            world.step(steps=min(RUN, count - done))

    return step


def serve() -> None:
    """Answer lines [name, steps] with the CPU time of these steps [s]."""
    steppers: dict[str, Callable[[int], None]] = {}
    for line in sys.stdin:
        name, count = json.loads(line)
        if name not in steppers:
            steppers[name] = _stepper(name)
            steppers[name](2)
        begun = time.process_time()
        steppers[name](count)
        print(json.dumps(time.process_time() - begun), flush=True)


if __name__ == "__main__":
    serve()
