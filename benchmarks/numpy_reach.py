"""BlockReach with NumPy functions in place of the compiled one: what a task written by a user costs.

``python -m benchmarks.numpy_reach [--turns N] [--json FILE]`` measures both in turns: steps per second of one
environment, and of 1,024 worlds on one thread, counted world by world.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Annotated

import numpy as np
import typer

from benchmarks import machine
from rigid_env.envs.env import RigidEnv
from rigid_env.envs.vector_env import RigidVectorEnv
from rigid_env.lab.measure.table import make_table
from rigid_env.lab.measure.timing import Row, Stopwatch, interleave
from rigid_env.tasks import BlockReach, Entry, kernels, observe
from rigid_env.tasks.block_draws import OnFloor
from rigid_env.terminal import make_console

WORLDS = 1024


def _offset(worlds):
    return worlds.drawn["goal"] - worlds.pos[:, 0, ::2]


def _length(vectors):
    return np.sqrt(np.einsum("ij,ij->i", vectors, vectors))


class NumpyReach(BlockReach):
    """`BlockReach`, written as a user would: its numbers are the same to rounding."""

    observation = (
        Entry(("goal x minus centre x", "goal z minus centre z"), "m", -10, 10, _offset, kernels.LENGTH_SCALE),
        Entry(("near x", "near z"), "1", -1, 1, lambda worlds: np.tanh(_offset(worlds))),
        observe.height(scale=kernels.HEIGHT_SCALE),
        observe.linvel(bound=kernels.RATE_BOUND),
        observe.angvel(bound=kernels.RATE_BOUND),
        observe.rotation(),
        observe.wall_gaps(),
        Entry("hold", "1", 0, 1, lambda worlds: np.minimum(worlds.memory["hold"] / kernels.HOLD_STEPS, 1.0)),
    )
    compiled = None
    memory = {"hold": 1, "potential": 1}  # noqa: RUF012 (declared, never changed)

    def goal(self):
        """Places on the floor."""
        return OnFloor(self.area)

    def measure(self, worlds):
        """Distance from the goal, speed and spin."""
        distance = _length(_offset(worlds))
        return {"distance": distance, "speed": _length(worlds.linvel[:, 0]), "spin": _length(worlds.angvel[:, 0])}

    def begin(self, worlds):
        """Remember the potential of the start."""
        worlds.memory["potential"][:] = self.potential(worlds)

    def potential(self, worlds):
        """Potential whose gain is rewarded."""
        found = worlds.measured
        hold = kernels.HOLD_VALUE * worlds.memory["hold"] / kernels.HOLD_STEPS
        brake = kernels.BRAKE_VALUE * found["speed"] * np.exp(found["distance"] / -kernels.BRAKE_RANGE)
        return hold - kernels.REACH_VALUE * found["distance"] - brake

    def update(self, worlds):
        """Count the steps at rest over the goal."""
        found = worlds.measured
        is_met = found["distance"] <= kernels.REACH_TOLERANCE
        is_met &= (found["speed"] <= kernels.REST_SPEED) & (found["spin"] <= kernels.REST_SPIN)
        hold = worlds.memory["hold"]
        hold += 1.0
        hold *= is_met

    def success(self, worlds):
        """Held for long enough."""
        return worlds.memory["hold"] >= kernels.HOLD_STEPS

    def rewards(self, worlds):
        """Gain of the potential, cost of acting, bonus of success."""
        now = self.potential(worlds)
        progress = now - worlds.memory["potential"]
        worlds.memory["potential"][:] = now
        effort = np.einsum("ij,ij->i", worlds.action, worlds.action)
        return {
            "progress": progress,
            "effort": -(kernels.STEP_COST + kernels.ACTION_COST * effort),
            "success": kernels.SUCCESS_BONUS * worlds.success,
        }


def batches_per_second(task: type[BlockReach], steps: int, actions: np.ndarray) -> float:
    """Steps per second of `WORLDS` worlds at once."""
    envs = RigidVectorEnv(task(WORLDS))
    envs.reset(seed=0)
    for k in range(3):
        envs.step(actions[k])
    with Stopwatch() as watch:
        for k in range(steps):
            envs.step(actions[k % len(actions)])
    return steps / watch.seconds


def steps_per_second(task: type[BlockReach], steps: int, actions: np.ndarray) -> float:
    """Steps per second of one environment, without resets."""
    env = RigidEnv(task(1))
    env.reset(seed=0)
    env.step(actions[0, 0])
    with Stopwatch() as watch:
        for k in range(steps):
            env.step(actions[k % len(actions), k % WORLDS])
    return steps / watch.seconds


def main(
    turns: Annotated[int, typer.Option(min=1)] = 5,
    json: Annotated[Path | None, typer.Option(help="Where to write the result.")] = None,
) -> None:
    """Measure BlockReach compiled and in NumPy, in turns."""
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (16, WORLDS, 6)).astype(np.float32)
    rows = [
        _row("one_env", "one environment", turns, lambda task: steps_per_second(task, 5000, actions)),
        _row("batch", f"{WORLDS:,} worlds", turns, lambda task: WORLDS * batches_per_second(task, 100, actions)),
    ]
    make_console().print(make_table(rows, machine.headline(), ("compiled", "NumPy")))
    if json is not None:
        machine.keep("numpy_reach", rows, json, turns=turns)


def _row(key: str, what: str, turns: int, rate: Callable[[type[BlockReach]], float]) -> Row:
    """The compiled task and that in NumPy, in turns."""
    tasks = {"compiled": BlockReach, "NumPy": NumpyReach}
    spreads = interleave({name: partial(rate, task) for name, task in tasks.items()}, turns)
    return Row(key, what, "env steps/s", spreads["compiled"], peer_name="NumPy", peer=spreads["NumPy"])


if __name__ == "__main__":
    typer.run(main)
