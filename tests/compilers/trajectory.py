"""Trajectory of a scene, step by step, by the compiler of this process: the worker of the tests beside it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

import physics
from benchmarks import bit_scenes
from benchmarks.bit_scenes import DT
from physics.compiler.compiler_choice import VARIABLE


def workshop() -> physics.Scene:
    """A belt, a capsule, coefficients of one's own and groups: what no older scene has, in one kernel."""
    belt = physics.Motion(surface_velocity=(0.5, 0, 0))
    bodies = [
        physics.Block((6, 1, 6), fixed=True, pos=(0, -0.5, 0), motion=belt, friction=0.3, group=3),
        physics.Block((0.5, 0.3, 0.4), 2.0, pos=(0, 0.3, 0), linvel=(0, 0, 0.5), restitution=0.4),
        physics.Capsule(0.2, 0.6, 1.0, pos=(1, 0.35, 0), quat=(0.8, 0.36, 0.0, 0.48), friction=0.6),
        physics.Sphere(0.2, 1.0, pos=(0.1, 0.7, 0), group=2, mask=2),
    ]
    walls = [physics.HalfSpace((-1, 0, 0), -4.0, friction=0.2, restitution=0.5)]
    laws = [physics.Gravity(), physics.Contact(0.2), physics.Friction(0.5, rule="minimum", pairs={(0, 1): 0.4})]
    return physics.Scene(bodies, walls, laws)


SCENES = {**bit_scenes.SCENES, "workshop": workshop}


def trajectory(scene: str, preset: str, steps: int, threads: int = 1) -> dict:
    """States (steps, numbers) of a scene, and after each step its contacts, impacts, energy and deepest penetration.

    And whether a rollout (`physics.rollout`) has the same bits.
    """
    world = physics.World(SCENES[scene](), worlds=2, dt=DT, accuracy=preset, threads=threads)
    found: dict[str, list] = {name: [] for name in ("state", "solves", "impacts", "energy", "momentum", "depth")}
    start = world.snapshot()
    rolled = physics.rollout(world, np.zeros((2, steps, world.body_count, 6)))
    world.restore(start)
    for _ in range(steps):
        report = world.step()
        numbers = np.concatenate([world.pos, world.quat, world.linvel, world.angvel], axis=-1)
        measured = physics.diagnose(world)
        found["state"].append(numbers.ravel().tolist())
        found["solves"].append((report.solves > 0).tolist())
        found["impacts"].append(report.impacts.tolist())
        found["energy"].append(measured.energy.ravel().tolist())
        found["momentum"].append(measured.momentum.ravel().tolist())
        found["depth"].append(report.penetration.tolist())
    states = np.concatenate([rolled.pos, rolled.quat, rolled.linvel, rolled.angvel], axis=-1)
    found["is_rolled_out"] = np.array_equal(states.swapaxes(0, 1).reshape(steps, -1), found["state"])
    return found


# A program that runs this module where nobody may import the private part of the compilers.
WITHOUT_FUSED = """
import runpy, sys

class Refuse:
    def find_spec(self, name, path=None, target=None):
        if name.startswith("physics.compiler.fused"):
            raise ImportError(name)

sys.meta_path.insert(0, Refuse())
runpy.run_module("tests.compilers.trajectory", run_name="__main__")
"""


def by_compiler(compiler: str, jobs: list[tuple]) -> list[dict]:
    """Trajectories by another compiler than `fused`, in a process that may not import that.

    Parameters
    ----------
    compiler : str
    jobs : list of tuple
        Arguments of `trajectory`.
    """
    root = str(Path(__file__).parents[2])
    environment = {**os.environ, VARIABLE: compiler, "PYTHONPATH": root}
    command = [sys.executable, "-c", WITHOUT_FUSED]
    done = subprocess.run(
        command, input=json.dumps(jobs), capture_output=True, text=True, env=environment, cwd=root, timeout=1500
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]
    return json.loads(done.stdout)


if __name__ == "__main__":
    json.dump([trajectory(*job) for job in json.load(sys.stdin)], sys.stdout)
