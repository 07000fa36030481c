"""Plan without training: sample sequences of actions, roll them out in copies of the environment, keep the best.

``python -m agents.planner --env rigid_env/BlockReach-v0 --episodes 20`` plans episodes, and prints the success rate and
the time of an episode. There are two methods to improve a plan. MPPI averages the sequences with weights exponential in
their return. The cross-entropy method fits a normal distribution to the best sequences.

References
----------
Williams, Aldrich and Theodorou, *Model predictive path integral control*, JGCD 40, 2017. Rubinstein and Kroese, *The
cross-entropy method*, 2004. Pinneri et al., *Sample-efficient cross-entropy method*, CoRL 2020, for coloured noise and
kept elites.
"""

from __future__ import annotations

import statistics
import time
from dataclasses import dataclass, replace
from json import dumps
from pathlib import Path
from typing import Annotated

import gymnasium as gym
import numpy as np
import typer
from rich.progress import Progress

from agents.interval import wilson
from physics import validation
from rigid_env.cli.common import at_least
from rigid_env.cli.files import output_option
from rigid_env.cli.names import checked_preset
from rigid_env.envs.making import make_task
from rigid_env.envs.named import make_named
from rigid_env.tasks.restoring import reinstate
from rigid_env.tasks.rollout import rollout
from rigid_env.tasks.state import TaskState
from rigid_env.terminal import Column, Table, make_console, number_columns, run_program

ENV_ID = "rigid_env:rigid_env/BlockReach-v0"
METHODS = ("mppi", "cem")

INTERRUPTED = 130
"""Exit status after Ctrl-C."""


@dataclass(frozen=True)
class PlannerSettings:
    """Settings of a planner.

    Parameters
    ----------
    method : {"mppi", "cem"}
    samples : int
        Sequences in one iteration, at least 2; one of them is the plan itself.
    horizon : int
        Control steps of a sequence.
    knots : int
        Number of actions of a sequence that are drawn; the others are interpolated.
    iterations : int
        Improvements of the plan each time that it is made.
    noise : float
        Standard deviation of the noise that is added to knots.
    temperature : float
        MPPI: difference of returns for which a weight decreases by the factor e, in standard deviations of the returns.
    elites : int
        Cross-entropy method: number of best sequences that the distribution is fitted to.
    replan : int
        Control steps that are taken of a plan before the next one is made.

    Raises
    ------
    ValueError
        The message names the field, its value and what is allowed.
    """

    method: str = "mppi"
    samples: int = 128
    horizon: int = 24
    knots: int = 4
    iterations: int = 1
    noise: float = 0.5
    temperature: float = 0.3
    elites: int = 4
    replan: int = 4

    def __post_init__(self):
        validation.one_of(self.method, METHODS, "method")
        validation.count(self.samples, "samples", least=2)
        for field in ("horizon", "knots", "iterations", "elites", "replan"):
            validation.count(getattr(self, field), field)
        for field in ("noise", "temperature"):
            validation.positive(getattr(self, field), (), field)
        if not 2 <= self.knots <= self.horizon:
            raise ValueError(f"knots is {self.knots}; allowed are 2 to the horizon, {self.horizon}")
        if self.method == "cem" and self.elites > self.samples:
            raise ValueError(f"elites is {self.elites}; allowed are at most the samples, {self.samples}")
        if self.replan > self.horizon:
            raise ValueError(f"replan is {self.replan}; allowed is at most the horizon, {self.horizon}")


class Planner:
    """Planner of actions for a task, by rollouts of random sequences in a model.

    The model knows the state and the drawn values of the episode, but no future random number. Pushes and gusts in it,
    and the time of the next one, come from its own generators; a current gust is known up to its end. All sequences of
    an iteration get the same disturbances, so that their returns differ only by their actions.

    Parameters
    ----------
    task : class of Task, or str
        Task of the model.
    settings : PlannerSettings
    seed : int
        Seed of the sequences.
    **of_task
        Arguments of the model's task, such as ``accuracy`` and ``threads``; it may be coarser than the environment.
    """

    def __init__(self, task, settings: PlannerSettings | None = None, seed: int = 0, **of_task):
        self.settings = PlannerSettings() if settings is None else settings
        self.model = make_task(task, self.settings.samples, of_task)
        self._rng = np.random.default_rng(seed)
        self._weights = _interpolation(self.settings.knots, self.settings.horizon)
        self.reset()

    def reset(self) -> None:
        """Forget the last plan, since another episode begins."""
        self._mean = np.zeros((self.settings.knots, self.model.action_size))
        self._spread = np.full_like(self._mean, self.settings.noise)

    def plan(self, state: TaskState) -> np.ndarray:
        """Improve the plan from a state, and return its next actions.

        Parameters
        ----------
        state : TaskState
            State of one world, from `get_state` of an environment.

        Returns
        -------
        (replan, numbers) float64

        Raises
        ------
        ValueError
            An object that is no state, a state of several worlds, of another task or of other settings.
        """
        validation.instance(state, TaskState, "state", "what get_state of an environment gives")
        if state.worlds != 1:
            raise ValueError(f"state is {state!r}; allowed are states of one world, such as get_state([0]) of a batch")
        s = self.settings
        for _ in range(s.iterations):
            noise = self._rng.standard_normal((s.samples, s.knots, self.model.action_size))
            noise[0] = 0.0  # the first sample is the plan itself
            knots = np.clip(self._mean + self._spread * noise, -1.0, 1.0)
            returns = self.returns(state, np.einsum("tk,nka->nta", self._weights, knots))
            self._improve(knots, returns)
        actions = self._weights @ self._mean
        self._shift()
        return actions[: s.replan]

    def returns(self, state: TaskState, actions: np.ndarray) -> np.ndarray:
        """Returns (samples,) of sequences of actions (samples, horizon, numbers), each up to the end of its episode."""
        is_disturbed = self.model.disturbed is not None
        own = np.random.PCG64(self._rng.integers(2**63)).state if is_disturbed else None
        state = replace(state, generators=(own,) * state.worlds)  # the environment's own would reveal future pushes
        if not is_disturbed:
            return rollout(self.model, actions, initial=state).returns
        reinstate(self.model, {}, state)
        self.model.disturbed.wait_anew()
        return rollout(self.model, actions).returns

    def _improve(self, knots: np.ndarray, returns: np.ndarray) -> None:
        s = self.settings
        if s.method == "cem":
            best = knots[np.argsort(-returns)[: s.elites]]
            self._mean, self._spread = best.mean(axis=0), np.maximum(best.std(axis=0), 0.1 * s.noise)
            return
        scale = max(returns.std(), 1e-9) * s.temperature
        weights = np.exp((returns - returns.max()) / scale)
        self._mean = np.einsum("n,nka->ka", weights / weights.sum(), knots)

    def _shift(self) -> None:
        """Move the plan ahead: drop the `replan` control steps that are executed now, and repeat the last one."""
        s = self.settings
        times = np.linspace(0, s.horizon - 1, s.knots) + s.replan
        plan = self._weights @ self._mean
        last = np.minimum(times, s.horizon - 1)
        for k in range(self._mean.shape[1]):
            self._mean[:, k] = np.interp(last, np.arange(s.horizon), plan[:, k])
        self._spread = np.full_like(self._mean, s.noise)


def _interpolation(knots: int, horizon: int) -> np.ndarray:
    """Weights (horizon, knots) of linear interpolation from knots to control steps."""
    times = np.linspace(0.0, knots - 1.0, horizon)
    return np.maximum(0.0, 1.0 - np.abs(times[:, None] - np.arange(knots)))


@dataclass(frozen=True)
class Solved:
    """Outcomes of planned episodes.

    Attributes
    ----------
    is_success : list of bool
    steps : list of int
        Control steps of each episode.
    seconds : list of float
        CPU time of each, planning and environment together [s].
    """

    is_success: list[bool]
    steps: list[int]
    seconds: list[float]

    def add(self, others: Solved) -> None:
        """Append the outcomes of further episodes."""
        self.is_success.extend(others.is_success)
        self.steps.extend(others.steps)
        self.seconds.extend(others.seconds)


def solve(env: gym.Env, planner: Planner, episodes: int, seed: int = 0) -> Solved:
    """Plan whole episodes.

    Parameters
    ----------
    env : gymnasium.Env
        Environment of this package, with the task of the planner's model.
    planner : Planner
    episodes : int
    seed : int
        Seed of the first episode; each further one adds 1.
    """
    found = Solved([], [], [])
    for episode in range(episodes):
        start = time.process_time()
        _, info = env.reset(seed=seed + episode)
        planner.reset()
        steps, is_over = 0, False
        while not is_over:
            for action in planner.plan(env.unwrapped.get_state()):
                _, _, terminated, truncated, info = env.step(action)
                steps, is_over = steps + 1, terminated or truncated
                if is_over:
                    break
        found.is_success.append(bool(info["is_success"]))
        found.steps.append(steps)
        found.seconds.append(time.process_time() - start)
    return found


def main(
    env: Annotated[str, typer.Option(help="Id of an environment of this package, or module:Class of a task.")] = ENV_ID,
    episodes: Annotated[int, typer.Option(callback=at_least(1), help="Episodes to plan.")] = 100,
    method: Annotated[str, typer.Option(help=f"One of {', '.join(METHODS)}.")] = METHODS[0],
    samples: Annotated[
        int, typer.Option(callback=at_least(2), help="Sequences in one iteration.")
    ] = PlannerSettings.samples,
    accuracy: Annotated[
        str, typer.Option(help="Preset of the model; the environment has its default.", callback=checked_preset)
    ] = "fast",
    seed: Annotated[int, typer.Option(callback=at_least(0), help="Of the first episode, and of the noise.")] = 1000,
    json: Annotated[Path | None, output_option("--json", ".json", help="Write the numbers here, too.")] = None,
) -> None:
    """Solve episodes by planning, without training."""
    try:
        world = make_named(env)
        settings = PlannerSettings(method=method, samples=samples, elites=min(samples, PlannerSettings.elites))
        planner = Planner(type(world.unwrapped.task), settings, seed, accuracy=accuracy)
    except (ValueError, TypeError) as error:
        raise typer.BadParameter(str(error)) from error
    console, found = make_console(), Solved([], [], [])
    try:
        with Progress(console=console, transient=True) as progress:
            task = progress.add_task("episodes", total=episodes)
            for episode in range(episodes):
                found.add(solve(world, planner, 1, seed + episode))
                progress.advance(task)
    except KeyboardInterrupt:
        console.print(f"interrupted after {len(found.steps)} of {episodes} episodes")
        if not found.steps:
            raise typer.Exit(INTERRUPTED) from None
    count = len(found.steps)
    low, high = wilson(sum(found.is_success), count)
    row = {
        "env": env, "method": method, "episodes": count, "success": sum(found.is_success) / count,
        "interval": [low, high], "steps": statistics.fmean(found.steps), "seconds": statistics.median(found.seconds),
    }  # fmt: skip
    table = Table([Column("environment"), Column("method"), *number_columns("success", "steps", "CPU s an episode")])
    table.add_row(env, method, f"{row['success']:.2f}", f"{row['steps']:.0f}", f"{row['seconds']:.2f}")
    console.print(table)
    if json is not None:
        json.write_text(dumps(row, indent=2) + "\n", encoding="utf-8")
    if count < episodes:
        raise typer.Exit(INTERRUPTED)


if __name__ == "__main__":
    run_program(main)
