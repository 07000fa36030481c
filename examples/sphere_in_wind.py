"""Hold a sphere against drag and gusts: another shape, and a field of force."""

import numpy as np

import physics
from rigid_env import Gust, Task, Uniform, Wrench, observe, register_task


class SphereInWind(Task):
    """Keep a sphere at a place in the air that drags it, while gusts push it away."""

    scene = physics.Scene(
        bodies=[physics.Sphere(radius=0.5, mass=1.0, pos=(0, 3, 0))],
        walls=[physics.HalfSpace((0, 1, 0), 0.0)],
        effects=[physics.Gravity(), physics.Contact(restitution=0.5), physics.Friction(0.3), physics.Drag()],
    )
    actions = Wrench(0, force=2.0, torque=0.0)
    observation = [observe.pos(), observe.linvel(), observe.drawn("goal", 3, "m", 5.0)]
    draws = {"goal": Uniform((-3, 1, -3), (3, 5, 3))}
    disturbances = [Gust(0, force=(0.2, 0.8), lasts=(0.2, 0.6), every=1.0)]
    max_episode_steps = 400

    def failure(self, worlds):
        return np.abs(worlds.pos[:, 0]).max(axis=1) > 20.0

    def rewards(self, worlds):
        distance = np.linalg.norm(worlds.pos[:, 0] - worlds.drawn["goal"], axis=1)
        return {"near": np.exp(-distance), "effort": -0.01 * (worlds.action**2).sum(axis=1)}


register_task("examples/SphereInWind-v0", SphereInWind)
