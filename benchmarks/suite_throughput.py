"""Steps per second of environments of the suite beside MuJoCo: ``python -m benchmarks.suite_throughput``.

A batch of 1,024 worlds on one thread steps in turns with 64 `MujocoEnv`s in a `SyncVectorEnv`, both with random actions
and resets. A ratio is taken turn by turn, and its median counts. `MujocoEnv`s of BlockStack and BallJuggle have our
observations, rewards and success; that of BlockReach has a smaller observation.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Annotated

import gymnasium
import typer

from benchmarks import machine, mujoco_env, mujoco_suite
from rigid_env.lab.measure import mujoco_scene
from rigid_env.lab.measure.environments import FULL, QUICK, UNIT, EnvPeer, EnvSizes, Vector
from rigid_env.lab.measure.rows import ACCURACIES, paired_rows
from rigid_env.lab.measure.table import make_table
from rigid_env.lab.measure.timing import Row, interleave
from rigid_env.terminal import make_console

TARGET = 10.0
REPEATS = 7
QUICK_REPEATS = 2

PEERS: dict[str, Callable[[], EnvPeer]] = {
    "BlockReach": mujoco_env.make_peer,
    "BlockStack": lambda: mujoco_suite.make_peer("BlockStack"),
    "BallJuggle": lambda: mujoco_suite.make_peer("BallJuggle"),
}


def throughput_rows(name: str, sizes: EnvSizes, repeats: int) -> list[Row]:
    """Rows of one environment, one for each of `ACCURACIES`, with the load of the machine before and after."""
    peer, before = PEERS[name](), os.getloadavg()
    make = {accuracy: Vector(_batch(name, sizes.envs, accuracy), sizes.vector_steps) for accuracy in ACCURACIES}
    runners = {**make, "peer": Vector(peer.make_vector(sizes.peer_envs), sizes.peer_steps)}
    spreads = interleave(runners, repeats)
    for runner in runners.values():
        runner.envs.close()
    notes = {"load_before": before, "load_after": os.getloadavg(), "processors": os.cpu_count()}
    return paired_rows(
        spreads, {"peer": f"{sizes.peer_envs} {peer.name} in SyncVectorEnv"}, dict.fromkeys(ACCURACIES, notes),
        key=name, what=f"{name}, {sizes.envs:,} worlds, 1 thread", unit=UNIT, target=TARGET,
    )  # fmt: skip


def _batch(name: str, worlds: int, accuracy: str) -> gymnasium.vector.VectorEnv:
    return gymnasium.make_vec(f"rigid_env/{name}-v0", worlds, accuracy=accuracy, threads=1)


def main(
    env: Annotated[list[str] | None, typer.Option(help=f"Some of {', '.join(PEERS)}.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Only see that it runs.")] = False,
    json: Annotated[Path | None, typer.Option(help="Where to write the result.")] = None,
) -> None:
    """Measure steps per second of environments beside those of MuJoCo."""
    unknown = sorted(set(env or ()) - set(PEERS))
    if unknown:
        raise typer.BadParameter(f"{', '.join(unknown)}; allowed are {', '.join(PEERS)}")
    path, console, rows = json.resolve() if json else None, make_console(), []
    with mujoco_scene.elsewhere():
        for name in env or PEERS:
            rows += throughput_rows(name, QUICK if quick else FULL, QUICK_REPEATS if quick else REPEATS)
    console.print(make_table(rows, machine.headline()))
    if quick and path is None:
        return
    path = machine.keep("suite_throughput", rows, path, is_quick=quick, repeats=QUICK_REPEATS if quick else REPEATS)
    console.print(f"written to {path}", soft_wrap=True)


if __name__ == "__main__":
    typer.run(main)
