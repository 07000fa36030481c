"""Write the policy of a trained agent as plain arrays that need no torch: ``python -m agents.export RUN_DIR FILE``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import torch
import typer
from stable_baselines3.common.base_class import BaseAlgorithm

from agents.checkpoint import load_trained
from agents.config import RunFolder
from agents.evaluate import RUN_HELP
from rigid_env.cli.files import checked, make_parents
from rigid_env.envs.policy_files import ARRAYS, Network
from rigid_env.terminal import make_console, run_program


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
    if model.policy.features_extractor_class.__name__ != "FlattenExtractor" or len(others) != 1:
        raise ValueError(
            f"policy has the layers {[type(each).__name__ for each in parts]} behind "
            f"{model.policy.features_extractor_class.__name__}; allowed is a fully connected network of the observation"
        )
    layers = [(_array(each.weight).T, _array(each.bias)) for each in [*linear, last]]
    return Network(layers, activation=others.pop(), output=output)


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
