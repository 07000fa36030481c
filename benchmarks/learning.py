"""Time to learn a task, beside a user of MuJoCo: ``python -m benchmarks.learning [--env ID] [--seeds N]``.

Stable-Baselines3's PPO trains until a share of the last 500 training episodes succeeds. Ours trains as `agents.train`
does, with its hyperparameters. The user of MuJoCo has 64 twins (`benchmarks.twins`) of one world each in a
`DummyVecEnv`, the same network, and a rollout and minibatches that suit 64 environments. Observations, rewards, success
and seeds are the same. Both are trained in turns in one process, and one callback reads the clocks of both.

Making the environments is not in the times. Writing checkpoints, which `agents.train` does every ten seconds, is not
either. CPU time counts all threads; on a machine that others use it says more than the clock. The result is written
after each seed, so that an interrupted measurement keeps the seeds before.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import gymnasium as gym
import numpy as np
import typer
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.vec_env import DummyVecEnv

from agents.algorithms import make_model, make_training_env, set_up_torch
from agents.config import RunConfig, make_config
from agents.curve import WINDOW
from benchmarks import machine
from benchmarks.twins import SETTINGS, twin_id
from rigid_env.lab.measure.machine import write_json
from rigid_env.lab.measure.timing import Spread
from rigid_env.terminal import Column, Table, make_console, number_columns, run_program

PEER_ENVS = 64
PEER_ROLLOUT = {"n_steps": 128, "batch_size": 1024}
RATE = 0.95
OURS = "ours"


@dataclass(frozen=True)
class Training:
    """Cost of one training.

    Attributes
    ----------
    seconds, cpu_seconds : float
        Wall clock and CPU time of all threads until the success rate was reached, or until the limit [s].
    steps, episodes : int
        Environment steps, and episodes that have ended.
    rate : float
        Success rate of the last episodes.
    is_reached : bool
        False if training ended at its limit of steps.
    """

    seconds: float
    cpu_seconds: float
    steps: int
    episodes: int
    rate: float
    is_reached: bool


class Watch(BaseCallback):
    """Callback that ends training with the episode at which the last `WINDOW` episodes reach a success rate.

    Parameters
    ----------
    rate : float
        Success rate, in (0, 1].
    """

    def __init__(self, rate: float):
        super().__init__()
        self.rate, self.episodes, self.is_reached = rate, 0, False
        self.window: deque[bool] = deque(maxlen=WINDOW)

    def _on_training_start(self) -> None:
        self._wall, self._cpu = time.perf_counter(), time.process_time()

    def _on_step(self) -> bool:
        for world in np.flatnonzero(self.locals["dones"]):
            self.episodes += 1
            self.window.append(bool(self.locals["infos"][world]["is_success"]))
            if len(self.window) == WINDOW and sum(self.window) >= self.rate * WINDOW:
                self.is_reached = True
                return False
        return True

    def result(self) -> Training:
        """Cost of the training until now; call it when training has ended."""
        seconds, cpu = time.perf_counter() - self._wall, time.process_time() - self._cpu
        rate = sum(self.window) / len(self.window) if self.window else 0.0
        return Training(round(seconds, 3), round(cpu, 3), self.num_timesteps, self.episodes, rate, self.is_reached)


def run(config: RunConfig, make_envs: Callable[[RunConfig], Any], rate: float) -> Training:
    """Train a new model until the success rate or `config.max_steps` is reached.

    Parameters
    ----------
    config : RunConfig
    make_envs : callable
        Function from the configuration to environments for Stable-Baselines3.
    rate : float
        Success rate at which training ends.
    """
    set_up_torch(config)
    envs, watch = make_envs(config), Watch(rate)
    try:
        make_model(config, envs).learn(config.max_steps, callback=watch)
        return watch.result()
    finally:
        envs.close()


def peer_config(config: RunConfig) -> RunConfig:
    """Configuration of the user of MuJoCo: ours, with 64 environments and `PEER_ROLLOUT`."""
    return replace(config, num_envs=PEER_ENVS, algorithm={**config.algorithm, **PEER_ROLLOUT})


def make_peer_envs(setting: str, config: RunConfig) -> DummyVecEnv:
    """Twins of one world each at a setting of MuJoCo, in a `DummyVecEnv`; environment i has the seed of the run + i."""
    envs = DummyVecEnv([partial(gym.make, twin_id(config.env), setting=setting)] * config.num_envs)
    envs.seed(config.seed)
    return envs


def measure(
    configs: list[RunConfig], peer: str, rate: float, say: Callable[[str], None]
) -> Iterator[dict[str, list[Training]]]:
    """Train ours and the peer in turns, once for each configuration; gives all trainings after each turn.

    Parameters
    ----------
    configs : list of RunConfig
        Configurations of ours, which differ in their seeds.
    peer : str
        Setting of MuJoCo, a key of `benchmarks.twins.SETTINGS`.
    rate : float
        Success rate at which training ends.
    say : callable
        Told a line after each training.
    """
    found: dict[str, list[Training]] = {OURS: [], peer: []}
    for config in configs:
        both = {OURS: (config, make_training_env), peer: (peer_config(config), partial(make_peer_envs, peer))}
        for name, (own, make_envs) in both.items():
            done = run(own, make_envs, rate)
            found[name].append(done)
            goal = f"{rate:.0%} reached" if done.is_reached else f"limit reached at {done.rate:.1%}"
            say(f"seed {config.seed}  {name:<8} {goal}: {done.seconds:.1f} s, {done.cpu_seconds:.1f} s of CPU")
        yield found


def summarise(found: dict[str, list[Training]], peer: str) -> dict[str, Any]:
    """Medians and all values of both sides, and the ratio of the peer's to ours, seed by seed."""
    kept: dict[str, Any] = {}
    for name in ("seconds", "cpu_seconds", "steps"):
        ours, theirs = (Spread(tuple(getattr(each, name) for each in found[side])) for side in (OURS, peer))
        kept[name] = {"ours": ours.to_dict(), "peer": theirs.to_dict(), "ratio": (theirs / ours).to_dict()}
    return kept


def make_result_table(summary: dict[str, Any], env: str, peer: str) -> Table:
    """Table of the medians of `summarise`, with the range of the ratio."""
    columns = [Column("until learned", is_whole=True), *number_columns("ours", f"MuJoCo,\n{peer}", "ratio", "range")]
    table = Table(columns, f"{env}\n{machine.headline()}")
    for name, what, scale in (
        ("seconds", "wall clock, s", 1.0), ("cpu_seconds", "CPU time, s", 1.0), ("steps", "million steps", 1e6),
    ):  # fmt: skip
        row = summary[name]
        ratio = row["ratio"]
        table.add_row(
            what, f"{row['ours']['median'] / scale:.3g}", f"{row['peer']['median'] / scale:.3g}",
            f"{ratio['median']:.2f}", f"{ratio['min']:.2f}..{ratio['max']:.2f}",
        )  # fmt: skip
    return table


def main(
    env: Annotated[str, typer.Option(help="Gymnasium id of an environment with a twin.")] = "rigid_env/BlockReach-v0",
    seeds: Annotated[int, typer.Option(min=1, help="Trainings of each side, with seeds from 0 on.")] = 2,
    peer: Annotated[str, typer.Option(help=f"Setting of MuJoCo: {', '.join(SETTINGS)}.")] = "default",
    rate: Annotated[float, typer.Option(min=0.0, max=1.0, help="Success rate that ends training.")] = RATE,
    threads: Annotated[int | None, typer.Option(help="Of our engine.", show_default="as agents.train")] = None,
    max_steps: Annotated[int | None, typer.Option(help="Steps that end training.")] = None,
    json_file: Annotated[Path | None, typer.Option("--json", help="Where to write the result.")] = None,
) -> None:
    """Time until PPO has learned a task: ours, and a user of MuJoCo."""
    console = make_console()
    try:
        twin_id(env)
        if peer not in SETTINGS:
            raise ValueError(f"peer is {peer!r}; allowed are {', '.join(SETTINGS)}")
        configs = [make_config(env, "ppo", seed, threads=threads, max_steps=max_steps) for seed in range(seeds)]
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    path = json_file or machine.RESULTS / "learning.json"
    for found in measure(configs, peer, rate, lambda line: console.print(line, highlight=False)):
        summary = summarise(found, peer)
        console.print(make_result_table(summary, env, peer))
        write_json(path, {
            "name": "learning", "env": env, "peer": peer, "rate": rate,
            "ours_config": asdict(configs[0]), "peer_config": asdict(peer_config(configs[0])), "summary": summary,
            "trainings": {side: [asdict(each) for each in rows] for side, rows in found.items()},
        })  # fmt: skip
    console.print(f"written to {path}", soft_wrap=True)


if __name__ == "__main__":
    run_program(main)
