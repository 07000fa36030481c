"""Plans per second beside MuJoCo: ``python -m benchmarks.planning [--mjbatch-python PATH] [--quick] [--json FILE]``.

The same planner (`agents.planner`, MPPI) plans BlockReach with our engine, with `mujoco.rollout` and `mujoco.batch`,
and with mjbatch, in turns and in closed loop. Samples, horizon and physics steps are equal, and each has two threads.
MuJoCo has its default solver settings. mjbatch needs a MuJoCo of its own: ``--mjbatch-python`` names the Python of a
virtual environment that has it. Only planning is timed. A peer rolls out in a process of its own; the time of actions
and returns on their way to it and back does not count. At the end each side plans whole episodes, and must solve them.
"""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated

import gymnasium as gym
import typer
from rich.progress import Progress

from agents.planner import ENV_ID, Planner, PlannerSettings, solve
from benchmarks import machine
from benchmarks.planning_peers import ENGINES, PeerPlanner, Worker, make_setup
from rigid_env.lab.measure import mujoco_scene
from rigid_env.lab.measure.table import make_table
from rigid_env.lab.measure.timing import Row, Spread, Stopwatch, interleave
from rigid_env.tasks.block_reach import BlockReach
from rigid_env.tasks.kernels import REST_SPEED, REST_SPIN
from rigid_env.tasks.layout import SPEED, SPIN
from rigid_env.terminal import make_console, run_program

TARGETS = {"balanced": 3.5, "fast": 5.0}  # presets of ours, and the least ratio to each peer
THREADS = 2  # of each side
SEED = 1000  # of the first episode
LEAST_SUCCESS = 0.8  # share of the episodes that each side must solve: else it does not plan this task
SKIPPED = {
    "mujoco": "mujoco is not installed",
    "batch": "this MuJoCo has no mujoco.batch, which is there since 4.0",
    "mjbatch": "--mjbatch-python is not given",
}  # reasons


@dataclass(frozen=True)
class Sizes:
    """Episodes of a turn, plans of each, turns, episodes for the success, and settings of the planner."""

    seeds: int = 3
    plans: int = 15
    repeats: int = 7
    episodes: int = 20
    settings: PlannerSettings = field(default_factory=PlannerSettings)


FULL = Sizes()
QUICK = Sizes(seeds=1, plans=2, repeats=1, episodes=1, settings=PlannerSettings(samples=8, horizon=6))


class Side:
    """A planner in closed loop with the environment, timed.

    Parameters
    ----------
    env : gymnasium.Env
    planner : Planner
    sizes : Sizes

    Attributes
    ----------
    moving : list of bool
        Whether the block moved when a plan was made.
    """

    def __init__(self, env: gym.Env, planner: Planner, sizes: Sizes):
        self.env, self.planner, self.sizes = env, planner, sizes
        self.moving: list[bool] = []

    def __call__(self) -> float:
        """Plans per second over the starts of episodes."""
        before, seconds = len(self.moving), 0.0
        for seed in range(SEED, SEED + self.sizes.seeds):
            self.env.reset(seed=seed)
            self.planner.reset()
            for _ in range(self.sizes.plans):
                actions, took = self._plan()
                seconds += took
                if any(self._ends(action) for action in actions):
                    break
        return (len(self.moving) - before) / seconds

    def success(self) -> float:
        """Share of whole episodes that it solves."""
        solved = solve(self.env, self.planner, self.sizes.episodes, SEED).is_success
        return sum(solved) / len(solved)

    def _plan(self):
        """Next actions, and the seconds that planning them took."""
        task = self.env.unwrapped.task
        state, before = self.env.unwrapped.get_state(), self._on_the_way
        with Stopwatch() as watch:
            actions = self.planner.plan(state)
        self.moving.append(bool(task.outcome[0, SPEED] > REST_SPEED or task.outcome[0, SPIN] > REST_SPIN))
        return actions, watch.seconds - (self._on_the_way - before)

    @property
    def _on_the_way(self) -> float:
        return getattr(self.planner, "on_the_way", 0.0)

    def _ends(self, action) -> bool:
        _, _, terminated, truncated, _ = self.env.step(action)
        return terminated or truncated


def pythons(mjbatch_python: Path | None) -> tuple[dict[str, str], dict[str, str]]:
    """Interpreters of the engines that are there, and reasons of the others."""
    if not mujoco_scene.is_installed():
        return {}, {ENGINES[engine]: SKIPPED["mujoco"] for engine in ENGINES}
    given = {
        "rollout": sys.executable,
        "batch": sys.executable if mujoco_scene.has_batch() else None,
        "mjbatch": str(mjbatch_python.absolute()) if mjbatch_python else None,
    }
    missing = {ENGINES[engine]: SKIPPED[engine] for engine, python in given.items() if python is None}
    return {engine: python for engine, python in given.items() if python is not None}, missing


@contextlib.contextmanager
def workers(where: dict[str, str], settings: PlannerSettings) -> Iterator[dict[str, Worker]]:
    """Workers of these engines; they end with the block."""
    with contextlib.ExitStack() as stack:
        started = {}
        for engine, python in where.items():
            try:
                started[engine] = stack.enter_context(Worker(python, make_setup(engine, settings, THREADS)))
            except ValueError as error:
                raise typer.BadParameter(str(error), param_hint="--mjbatch-python") from None
        yield started


def make_sides(sizes: Sizes, peers: dict[str, Worker]) -> dict[str, Side]:
    """Ours, under their presets, and the peers, under their engines."""
    env = gym.make(ENV_ID)
    planners = {
        accuracy: Planner(BlockReach, sizes.settings, SEED, accuracy=accuracy, threads=THREADS) for accuracy in TARGETS
    }
    planners |= {engine: PeerPlanner(worker, sizes.settings, SEED) for engine, worker in peers.items()}
    return {name: Side(env, planner, sizes) for name, planner in planners.items()}


def make_rows(sizes: Sizes, spreads: dict[str, Spread], notes: dict[str, dict]) -> list[Row]:
    """Each preset of ours against each peer, or alone.

    Parameters
    ----------
    sizes : Sizes
    spreads : dict of Spread
        Plans per second of each side.
    notes : dict of dict
        Notes on each, ``success`` among them.
    """
    what = f"{sizes.settings.samples} samples of {sizes.settings.horizon} control steps"
    peers: list[str | None] = [name for name in spreads if name in ENGINES]
    return [
        Row(
            key=f"plans_{peer or 'alone'}", what=what, unit="plans/s", ours=spreads[accuracy], accuracy=accuracy,
            peer_name=ENGINES[peer] if peer else "", peer=spreads[peer] if peer else None, target=target,
            is_valid=all(notes[side]["success"] >= LEAST_SUCCESS for side in (accuracy, peer) if side),
            notes={"ours": notes[accuracy], **({"peer": notes[peer]} if peer else {})},
        )
        for peer in peers or [None]
        for accuracy, target in TARGETS.items()
    ]  # fmt: skip


def measure(sizes: Sizes, peers: dict[str, Worker], progress: Progress) -> list[Row]:
    """Plan in turns, then whole episodes with each side."""
    sides = make_sides(sizes, peers)
    bar = progress.add_task("planning", total=len(sides) * (sizes.repeats + 2))

    def tick(name: str) -> None:
        progress.update(bar, advance=1, description=f"planning: {ENGINES.get(name, name)}", refresh=True)

    spreads = interleave(sides, sizes.repeats, tick)
    notes = {}
    for name, side in sides.items():
        share = sum(side.moving) / len(side.moving)
        tick(name)
        notes[name] = {"success": side.success(), "episodes": sizes.episodes, "share_in_motion": share}
        if name in peers:
            notes[name]["versions"] = peers[name].versions
    return make_rows(sizes, spreads, notes)


def main(
    json: Annotated[Path | None, typer.Option(help="Where to write the result.")] = None,
    quick: Annotated[bool, typer.Option("--quick", help="Only see that it runs.")] = False,
    mjbatch_python: Annotated[Path | None, typer.Option(help="Python that has mjbatch.")] = None,
) -> None:
    """Measure plans per second beside MuJoCo."""
    sizes, console = QUICK if quick else FULL, make_console()
    where, missing = pythons(mjbatch_python)
    # a progress bar with a thread of its own would disturb what is measured
    with Progress(console=console, transient=True, auto_refresh=False) as bar, workers(where, sizes.settings) as peers:
        rows = measure(sizes, peers, bar)
    console.print(make_table(rows, machine.headline()))
    shares = {row.accuracy: row.notes["ours"]["success"] for row in rows}
    shares |= {row.peer_name: row.notes["peer"]["success"] for row in rows if row.peer}
    console.print("success: " + ", ".join(f"{side} {share:.2f}" for side, share in shares.items()))
    for name, reason in missing.items():
        console.print(f"without {name}: {reason}")
    if quick and json is None:
        return
    settings = {**asdict(sizes), "is_quick": quick, "threads": THREADS, "missing": missing}
    console.print(f"written to {machine.keep('planning', rows, json, **settings)}")


if __name__ == "__main__":
    run_program(main)
