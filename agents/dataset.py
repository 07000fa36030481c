"""Write a Minari data set of a policy's episodes: ``python -m agents.dataset ID [--policy NAME] [--episodes N]``."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Annotated

import gymnasium as gym
import typer
from gymnasium.error import DependencyNotInstalled

from agents.baselines import Policy, baseline_policy
from agents.evaluate import evaluation_seeds
from agents.options import AccuracyOption, SeedOption
from rigid_env.envs.policy_files import act, load_policy
from rigid_env.envs.pretrained import PRETRAINED, pretrained_path
from rigid_env.extras import require
from rigid_env.terminal import make_console, progress_bar, run_program

BASELINES = ("random", "controller")


def find_policy(name: str, env_id: str, seed: int) -> Policy:
    """Return the policy of a name: ``pretrained``, a baseline, or a file of a policy.

    Raises
    ------
    ValueError
        If there is none.
    """
    if name == PRETRAINED:
        return load_policy(pretrained_path(env_id))
    if name in BASELINES:
        return baseline_policy(name, env_id, seed)
    return load_policy(name)


def record_episodes(env: gym.Env, policy: Policy, seeds: range, tick=lambda: None) -> int:
    """Run one episode for each seed in an environment that records, and return how many succeed."""
    successes = 0
    for seed in seeds:
        observation, _ = env.reset(seed=seed)
        is_over = False
        while not is_over:
            observation, _, terminated, truncated, info = env.step(act(policy, observation))
            is_over = terminated or truncated
        successes += bool(info["is_success"])
        tick()
    return successes


def default_name(env_id: str, policy: str) -> str:
    """Name of the data set of an environment and a policy, such as ``rigid_env/BlockReach/pretrained-v0``."""
    task, _, version = env_id.rpartition("-")
    return f"{task.rpartition(':')[2]}/{Path(policy).stem}-{version}"


def main(
    env: Annotated[str, typer.Argument(metavar="ID", help="Gymnasium id.", show_default=False)],
    policy: Annotated[str, typer.Option(help="pretrained, random, controller, or a file of a policy.")] = PRETRAINED,
    episodes: Annotated[int, typer.Option(min=1, help="How many, each with its own seed.")] = 100,
    seed: SeedOption = 0,
    accuracy: AccuracyOption = "balanced",
    name: Annotated[str | None, typer.Option(help="Of the data set.", show_default="by environment and policy")] = None,
) -> None:
    """Write a Minari data set, which `minari.load_dataset` reads by the name that is printed.

    Minari keeps it in the folder of the variable MINARI_DATASETS_PATH, or in its own.
    """
    console = make_console()
    try:
        require("minari", purpose="a data set")
        import minari

        chosen = find_policy(policy, env, seed)
        collector = minari.DataCollector(gym.make(env, accuracy=accuracy))
        with progress_bar(console) as bar:
            task = bar.add_task("episodes", total=episodes)
            seeds = evaluation_seeds(seed, episodes)
            successes = record_episodes(collector, chosen, seeds, lambda: bar.advance(task))
        made = name or default_name(env, policy)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of data about authors, which a user may add with Minari
            collector.create_dataset(made, algorithm_name=policy, description=f"{policy} on {env} at {accuracy}")
        collector.close()
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    except DependencyNotInstalled as error:
        console.print(f"Error: {error}", soft_wrap=True)
        raise typer.Exit(1) from None
    console.print(f"data set    {made}: {episodes} episodes, {successes / episodes:.0%} successes", soft_wrap=True)


if __name__ == "__main__":
    run_program(main)
