"""Write the policy of a trained agent as plain arrays that need no torch: ``python -m agents.export RUN_DIR FILE``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import gymnasium as gym
import numpy as np
import torch
import typer
from stable_baselines3.common.base_class import BaseAlgorithm

from agents.checkpoint import load_trained
from agents.config import RunFolder
from agents.features import FINE, GoalDifference
from agents.options import RUN_HELP
from rigid_env.cli.files import checked, make_parents
from rigid_env.envs.policy_files import ARRAYS, Network
from rigid_env.terminal import make_console, run_program

FEATURES = ("FlattenExtractor", "CombinedExtractor", GoalDifference.__name__)
"""Classes that a policy may put before its network, by name; the second joins vectors in the order of their names."""


def network_of(model: BaseAlgorithm) -> Network:
    """Return the most likely actions of a model as a network of plain arrays, in single precision.

    Raises
    ------
    ValueError
        If the policy is no fully connected network of the observation, or its activation is unknown.
    """
    actor = getattr(model.policy, "actor", None)
    if actor is not None:
        parts, last, output = actor.latent_pi, actor.mu, "tanh"
    else:
        parts, last, output = model.policy.mlp_extractor.policy_net, model.policy.action_net, "linear"
    linear = [each for each in parts if isinstance(each, torch.nn.Linear)]
    others = {type(each).__name__.lower() for each in parts if not isinstance(each, torch.nn.Linear)}
    features = model.policy.features_extractor_class.__name__
    if features not in FEATURES or len(others) != 1:
        raise ValueError(
            f"policy has the layers {[type(each).__name__ for each in parts]} behind {features}; "
            f"allowed is a fully connected network of the observation, behind {' or '.join(FEATURES)}"
        )
    layers = [(_array(each.weight).T, _array(each.bias)) for each in [*linear, last]]
    squash = None
    if features == GoalDifference.__name__:
        layers[0], squash = _of_goals(layers[0], model.observation_space)
    return Network(layers, activation=others.pop(), output=output, squash=squash)


def _of_goals(
    layer: tuple[np.ndarray, np.ndarray], space: gym.spaces.Dict
) -> tuple[tuple[np.ndarray, np.ndarray], np.ndarray]:
    """First layer of the joined observation, and what it squashes, of the first layer behind `GoalDifference`.

    The features are linear but for tanh: with d the desired and a the achieved goal, w_a a + w_d (d - a) is
    (w_a - w_d) a + w_d d. The parts of the observation are joined in the order of their names: a, d, observation.
    """
    size, goal = (space[key].shape[0] for key in ("observation", "achieved_goal"))
    weights, biases = layer
    of_observation, of_achieved, of_way, of_squashed = np.split(weights, np.cumsum([size, goal, goal]))
    unit = np.eye(goal)
    squash = FINE * np.concatenate([-unit, unit, np.zeros((size, goal))])
    return (np.concatenate([of_achieved - of_way, of_way, of_observation, of_squashed]), biases), squash


def _array(parameter: torch.Tensor) -> np.ndarray:
    return parameter.detach().cpu().numpy().astype(np.float32)


def _checked_path(path: Path) -> Path:
    return checked(path, (ARRAYS,))


def main(
    run: Annotated[Path, typer.Argument(metavar="RUN_DIR", help=RUN_HELP, show_default=False)],
    path: Annotated[Path, typer.Argument(metavar="FILE", help="Of the arrays, .npz.", callback=_checked_path)],
) -> None:
    """Write the policy of a run as plain arrays."""
    _, model = load_trained(RunFolder(run))
    network = network_of(model)
    console = make_console()
    make_parents(path)
    network.save(path)
    console.print(f"written     {path}, {path.stat().st_size / 1e3:.1f} kB", soft_wrap=True)


if __name__ == "__main__":
    run_program(main)
