"""Write a Minari data set of a policy's episodes: ``python -m agents.dataset ID [--policy NAME] [--episodes N]``.

It holds the infos of every step, too: `infos["is_success"]` of an episode is (steps + 1,) bool, the reset first.
"""

from __future__ import annotations

import re
import warnings
from pathlib import Path
from typing import Annotated

import gymnasium as gym
import typer
from gymnasium.error import DependencyNotInstalled

from agents.baselines import Policy, baseline_policy
from agents.evaluate import evaluation_seeds
from agents.options import AccuracyOption, SeedOption
from rigid_env.cli.common import at_least
from rigid_env.envs.policy_files import act, load_policy
from rigid_env.envs.pretrained import PRETRAINED, pretrained_path
from rigid_env.extras import require
from rigid_env.terminal import counted, make_console, progress_bar, run_program

BASELINES = ("random", "controller")

NAME = re.compile(r"([-\w][-\w/]*[-\w]/)?[-\w]+-v\d+")  # of a data set, as Minari reads it


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


def check_name(name: str, given: str | None) -> None:
    """Refuse a name that Minari would refuse after the last episode.

    Parameters
    ----------
    name : str
        Name of the data set.
    given : str or None
        Value of ``--name``; None: the name was made of environment and policy.

    Raises
    ------
    ValueError
        The name has another form than Minari's, or a data set has it already.
    """
    from minari.storage import get_dataset_path

    told = f"--name is {name!r}" if given is not None else f"without --name the data set is {name!r}"
    if not NAME.fullmatch(name):
        signs = "letters, digits, - and _, two at least before the /"
        raise ValueError(f"{told}; allowed is --name namespace/name-v0, of {signs}")
    if get_dataset_path(name).exists():
        stem, _, version = name.rpartition("-v")
        raise ValueError(
            f"{told}, which exists already; allowed is a new version, as --name {stem}-v{int(version) + 1}, or to "
            f"delete the old one: minari delete {name}"
        )


def main(
    env: Annotated[str, typer.Argument(metavar="ID", help="Gymnasium id.", show_default=False)],
    policy: Annotated[str, typer.Option(help="pretrained, random, controller, or a file of a policy.")] = PRETRAINED,
    episodes: Annotated[int, typer.Option(callback=at_least(1), help="How many, each with its own seed.")] = 100,
    seed: SeedOption = 0,
    accuracy: AccuracyOption = "balanced",
    name: Annotated[str | None, typer.Option(help="namespace/name-v0.", show_default="environment and policy")] = None,
) -> None:
    """Write a Minari data set, which `minari.load_dataset` reads by the name that is printed.

    It holds observations, actions, rewards and infos, such as is_success, of every step. Minari keeps it
    in the folder of the variable MINARI_DATASETS_PATH, or in its own.
    """
    console = make_console()
    try:
        require("minari", purpose="a data set")
        import minari

        made = name if name is not None else default_name(env, policy)
        check_name(made, name)
        chosen = find_policy(policy, env, seed)
        collector = minari.DataCollector(gym.make(env, accuracy=accuracy), record_infos=True)
        with progress_bar(console) as bar:
            task = bar.add_task("episodes", total=episodes)
            seeds = evaluation_seeds(seed, episodes)
            successes = record_episodes(collector, chosen, seeds, lambda: bar.advance(task))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", UserWarning)  # of data about authors, which a user may add with Minari
            collector.create_dataset(made, algorithm_name=policy, description=f"{policy} on {env} at {accuracy}")
        collector.close()
    except ValueError as error:
        raise typer.BadParameter(str(error)) from error
    except DependencyNotInstalled as error:
        console.print(f"Error: {error}", soft_wrap=True)
        raise typer.Exit(1) from None
    told = f"{counted(episodes, 'episode')}, {successes / episodes:.0%} successes"
    console.print(f"data set    {made}: {told}", soft_wrap=True)


if __name__ == "__main__":
    run_program(main)
