"""Push one block with another: a task of two bodies."""

import numpy as np

import physics
from rigid_env import Task, Uniform, Wrench, observe, register_task


class TwoBlocks(Task):
    """Push the heavy block to a place on the floor with the light one, the only one that is driven."""

    scene = physics.Scene(
        bodies=[physics.Block((2, 1, 2), 3.0, pos=(-4, 0.5, 0)), physics.Block((3, 2, 3), 6.0, pos=(0, 1, 0))],
        walls=physics.three_walls(half_width=10.0),
        effects=[physics.Gravity(), physics.Contact(), physics.Friction(0.3)],
    )
    actions = Wrench(0, force=2.0, torque=0.5, force_axes="xz", torque_axes="y")
    observation = [read(body) for body in (0, 1) for read in (observe.pos, observe.linvel, observe.rotation)]
    observation += [observe.drawn("goal", 2, "m", 5.0)]
    draws = {"goal": Uniform((1, -4), (6, 4)), "start": Uniform((-7, -3), (-4, 3)), "mass[1]": (4.0, 8.0)}
    max_episode_steps = 400

    def place(self, drawn):
        pos = np.tile([[-4.0, 0.5, 0.0], [0.0, 1.0, 0.0]], (len(drawn["start"]), 1, 1))
        pos[:, 0, ::2] = drawn["start"]
        return {"pos": pos}

    def measure(self, worlds):
        return {"distance": np.linalg.norm(worlds.drawn["goal"] - worlds.pos[:, 1, ::2], axis=1)}

    def success(self, worlds):
        return (worlds.measured["distance"] < 0.3) & (np.abs(worlds.linvel[:, 1]).max(axis=1) < 0.2)

    def rewards(self, worlds):
        return {"near": -0.01 * worlds.measured["distance"], "success": 5.0 * worlds.success}


register_task("examples/TwoBlocks-v0", TwoBlocks)
