"""A block among ten fixed boxes, here and in MuJoCo: CPU time of a step, in turns.

``python -m benchmarks.fixed_boxes``: the block is thrown onto a floor of boxes, hits others and comes to rest. Both
engines step one world, with the same boxes and step. MuJoCo reads the file that `physics.save_mjcf` makes.
"""

from __future__ import annotations

import time
from typing import Annotated

import numpy as np
import typer

import physics
from physics.io.mjcf.writer import to_mjcf

DT = 0.005  # [s]
STEPS = 400  # of a run: 2 s


def scene() -> physics.Scene:
    """Make the scene: four flush boxes as a floor, six others on it, and a block of 2 kg above."""
    floor = [physics.Block((2, 1, 2), fixed=True, pos=(x, -0.5, z)) for x in (-1, 1) for z in (-1, 1)]
    angles = np.linspace(0.0, 2.0 * np.pi, 6, endpoint=False)
    others = [
        physics.Block((0.4, 0.6, 0.4), fixed=True, pos=(1.2 * np.cos(a), 0.3, 1.2 * np.sin(a))) for a in angles.tolist()
    ]
    block = physics.Block((0.5, 0.3, 0.4), 2.0, pos=(-0.4, 0.8, 0), linvel=(1.5, 0, 0.3), angvel=(0, 1, 2))
    return physics.Scene(
        [block, *floor, *others], effects=[physics.Gravity(), physics.Contact(), physics.Friction(0.5)]
    )


class Here:
    """World of this engine, which a `physics.Stepper` steps."""

    def __init__(self, preset: str):
        self._world = physics.World(scene(), dt=DT, accuracy=preset)
        self._start, self._step = self._world.snapshot(), physics.Stepper(self._world, 1)

    def run(self) -> float:
        """CPU time of one run from the start [s]."""
        self._world.restore(self._start)
        begin = time.process_time()
        for _ in range(STEPS):
            self._step()
        return time.process_time() - begin


class MuJoCo:
    """Model of MuJoCo with its defaults, at the same step."""

    def __init__(self):
        import mujoco

        self._mujoco, self._model = mujoco, mujoco.MjModel.from_xml_string(to_mjcf(scene()))
        self._model.opt.timestep = DT
        self._data = mujoco.MjData(self._model)

    def run(self) -> float:
        """CPU time of one run from the start [s]."""
        self._mujoco.mj_resetDataKeyframe(self._model, self._data, 0)
        step, begin = self._mujoco.mj_step, time.process_time()
        for _ in range(STEPS):
            step(self._model, self._data)
        return time.process_time() - begin


def main(
    runs: Annotated[int, typer.Option(min=1, help="Runs of each engine, in turns.")] = 20,
    preset: Annotated[str, typer.Option(help="Preset of this engine.")] = "balanced",
) -> None:
    """Measure the median CPU time of a step of both engines, and print their ratio."""
    engines = {"here": Here(preset), "MuJoCo": MuJoCo()}
    for engine in engines.values():
        engine.run()
    times = {name: [] for name in engines}
    for _ in range(runs):
        for name, engine in engines.items():
            times[name].append(engine.run() / STEPS)
    medians = {name: float(np.median(found)) for name, found in times.items()}
    for name, median in medians.items():
        print(f"{name}: {1e6 * median:.2f} us a step")
    print(f"ratio: {medians['MuJoCo'] / medians['here']:.2f}")


if __name__ == "__main__":
    typer.run(main)
