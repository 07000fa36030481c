"""Compare the speed of two commits, in turns: ``python -m benchmarks.in_turns OTHER_CHECKOUT [--turns N]``.

A process over each checkout takes the same steps of a scene of `benchmarks.bit_scenes`, or of an environment, one after
the other (A B, B A, ...). A ratio is CPU time there over CPU time here, of one turn; its median counts. 1.05 says that
this checkout is 5 % faster.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

SCENES = (
    "tumble", "drop", "shoved", "elastic", "grain", "kick", "floats", "spring", "tower", "mixed", "sleeping-tower",
)  # fmt: skip
ENVIRONMENT = "BlockReach"
WORLDS = 64
WORKER = "--worker"  # an option of the process over a checkout, for this program alone
SAMPLE_SECONDS = 0.3  # CPU time of a sample, at least


# --- the process over a checkout; only names of the public contract ---------------------------------------------------


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

    import physics

    world = physics.World(bit_scenes.SCENES[name](), worlds=WORLDS, dt=bit_scenes.DT, threads=1)
    start = world.snapshot()

    def step(count):
        world.restore(start)
        world.step(steps=count)

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


# --- the comparison ---------------------------------------------------------------------------------------------------


class Checkout:
    """A process that steps scenes over one checkout."""

    def __init__(self, folder: Path):
        self._process = subprocess.Popen(
            [sys.executable, __file__, WORKER], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, cwd=folder,
            env={**os.environ, "PYTHONPATH": str(folder)},
        )  # fmt: skip

    def seconds(self, name: str, count: int) -> float:
        """CPU time of `count` steps of a scene [s]."""
        self._process.stdin.write(json.dumps([name, count]) + "\n")
        self._process.stdin.flush()
        line = self._process.stdout.readline()
        if not line:
            raise RuntimeError(f"the process over this checkout ended with {self._process.wait()}")
        return json.loads(line)

    def close(self) -> None:
        """End the process."""
        self._process.stdin.close()
        self._process.wait()


def steps_of(checkout: Checkout, name: str) -> int:
    """Steps that take `SAMPLE_SECONDS`."""
    count = 10
    while (spent := checkout.seconds(name, count)) < SAMPLE_SECONDS:
        count = round(count * min(10.0, 1.3 * SAMPLE_SECONDS / max(spent, 1e-3)))
    return count


def compare(here: Checkout, there: Checkout, name: str, turns: int) -> list[float]:
    """CPU time there over CPU time here, of each turn; who begins changes."""
    count, ratios = steps_of(here, name), []
    there.seconds(name, count)
    for turn in range(turns):
        pair = (here, there) if turn % 2 == 0 else (there, here)
        spent = {side: side.seconds(name, count) for side in pair}
        ratios.append(spent[there] / spent[here])
    return ratios


def main() -> None:
    """Print the median of each scene, and keep all samples."""
    import typer

    from benchmarks import machine
    from rigid_env.lab.measure.machine import write_json

    def measure(
        other: Annotated[Path, typer.Argument(help="A checkout of the commit to compare with.", exists=True)],
        turns: Annotated[int, typer.Option(min=1, help="Samples of each.")] = 11,
        scene: Annotated[list[str] | None, typer.Option(help=f"Some of {', '.join((*SCENES, ENVIRONMENT))}.")] = None,
        json: Annotated[Path | None, typer.Option(help="Where to write the result.")] = None,
    ) -> None:
        here, there = Checkout(Path(__file__).parents[1]), Checkout(other.resolve())
        found = {}
        for name in scene or (*SCENES, ENVIRONMENT):
            found[name] = compare(here, there, name, turns)
            low, *_, high = sorted(found[name])
            typer.echo(f"{name:16} {statistics.median(found[name]):6.3f}   {low:.3f} to {high:.3f}")
        here.close()
        there.close()
        if json is not None:
            write_json(json, {"name": "in_turns", "machine": machine.headline(), "ratios": found})

    typer.run(measure)


if __name__ == "__main__":
    if sys.argv[1:] == [WORKER]:
        serve()
    else:
        main()
