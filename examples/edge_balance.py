"""Balance a block on one of its edges: a task of one's own, with NumPy alone."""

import numpy as np

import physics
from rigid_env import Task, Uniform, Wrench, observe, register_task

EDGE = np.arctan2(3.0, 5.0)  # turn at which the 5 x 3 m face stands on an edge: the centre is above it [rad]


class EdgeBalance(Task):
    """Keep a block upright on its edge, with a force and a torque in the plane."""

    scene = physics.Scene(
        bodies=[physics.Block(size=(5, 3, 2), mass=6.0, pos=(0, 3, 0))],
        walls=[physics.HalfSpace((0, 1, 0), 0.0)],
        effects=[physics.Gravity(), physics.Contact(), physics.Friction(0.8)],
    )
    actions = Wrench(0, force=0.3, torque=0.3, force_axes="x", torque_axes="z")
    observation = [observe.height(), observe.linvel(), observe.rotation(), observe.angvel(), observe.wall_gaps(walls=1)]
    draws = {"lean": Uniform(-0.05, 0.05), "friction": (0.6, 1.0)}
    max_episode_steps = 400

    def place(self, drawn):
        turn = 0.5 * (np.pi / 2 - EDGE + drawn["lean"])
        zero, height = np.zeros_like(turn), np.hypot(5, 3) / 2 * np.cos(drawn["lean"])
        return {
            "pos": np.stack([zero, height, zero], axis=1),
            "quat": np.stack([np.cos(turn), zero, zero, np.sin(turn)], axis=1),
        }

    def failure(self, worlds):
        return worlds.pos[:, 0, 1] < 2.6  # on its end the centre is 2.5 m high

    def rewards(self, worlds):
        return {"upright": worlds.pos[:, 0, 1] / 3.0, "effort": -0.01 * (worlds.action**2).sum(axis=1)}


register_task("examples/EdgeBalance-v0", EdgeBalance)
