"""Checkpoints: everything that a run needs to continue as if it had never stopped.

A checkpoint is a folder named by its step. It contains the model and its optimiser (`model.zip`), the replay buffer of
SAC, and `state.pkl`: the environments in the middle of their episodes, all random generators, and the history of the
run. It is written under another name and then renamed, so that an incomplete one is never found.
"""

from __future__ import annotations

import pickle
import random
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.off_policy_algorithm import OffPolicyAlgorithm

from agents.algorithms import CLASSES
from agents.baselines import Policy
from agents.config import RunConfig, RunFolder
from rigid_env.envs.policy_files import WITHOUT_REPLAY, greedy, tell_code_runs

KEPT = 3  # number of newest checkpoints that are kept; older ones are deleted

MODEL, REPLAY, STATE = "model.zip", "replay_buffer.pkl", "state.pkl"


def save_checkpoint(folder: Path, model: BaseAlgorithm, history: Any) -> Path:
    """Write a checkpoint; call it between two updates of the policy, not within one.

    Parameters
    ----------
    folder : Path
        Folder of all checkpoints of the run.
    model : BaseAlgorithm
    history : object
        Any picklable object; `load_checkpoint` returns it.

    Returns
    -------
    Path
        Folder of the checkpoint.
    """
    place = folder / f"{model.num_timesteps:012d}"
    partial = folder / f"{place.name}.partial"
    shutil.rmtree(partial, ignore_errors=True)
    partial.mkdir(parents=True)
    model.save(partial / MODEL)
    if isinstance(model, OffPolicyAlgorithm):
        model.save_replay_buffer(partial / REPLAY)
    state = {
        "env": model.get_env(),
        "torch": torch.get_rng_state(),
        "numpy": np.random.get_bit_generator().state,
        "python": random.getstate(),
        "history": history,
    }
    with (partial / STATE).open("wb") as file:
        pickle.dump(state, file)
    shutil.rmtree(place, ignore_errors=True)
    partial.rename(place)
    for old in list_checkpoints(folder)[:-KEPT]:
        shutil.rmtree(old, ignore_errors=True)
    return place


def list_checkpoints(folder: Path) -> list[Path]:
    """Folders of the complete checkpoints, oldest first."""
    return sorted(path for path in folder.glob("*") if path.name.isdigit())


def load_checkpoint(run: RunFolder, config: RunConfig, *, is_trusted: bool = False) -> tuple[BaseAlgorithm, Any]:
    """Load the newest checkpoint of a run: model, environments and random generators as they were.

    Code in its files runs while they are read; a line on standard error says so. On the same computer, with the same
    versions and number of threads, training continues with the same bits.

    Parameters
    ----------
    run : RunFolder
    config : RunConfig
    is_trusted : bool
        Leave out the line about code.

    Returns
    -------
    model : BaseAlgorithm
    history : object
        Object that was given to `save_checkpoint`.

    Raises
    ------
    ValueError
        If there is no checkpoint.
    """
    found = list_checkpoints(run.checkpoints)
    if not found:
        raise ValueError(f"run is {str(run.path)!r}; allowed is one with a checkpoint")
    if not is_trusted:
        tell_code_runs(found[-1] / MODEL)
    with (found[-1] / STATE).open("rb") as file:
        state = pickle.load(file)
    model = CLASSES[config.algo].load(found[-1] / MODEL, env=state["env"], device="cpu", force_reset=False)
    if isinstance(model, OffPolicyAlgorithm):
        model.load_replay_buffer(found[-1] / REPLAY, truncate_last_traj=False)
    torch.set_rng_state(state["torch"])
    np.random.get_bit_generator().state = state["numpy"]
    random.setstate(state["python"])
    return model, state["history"]


def load_policy(run: RunFolder, *, is_trusted: bool = False) -> tuple[RunConfig, Policy]:
    """Load the configuration and the trained policy of a run, as `load_trained`; it acts without exploration."""
    config, model = load_trained(run, is_trusted=is_trusted)
    return config, greedy(model)


def load_trained(run: RunFolder, *, is_trusted: bool = False) -> tuple[RunConfig, BaseAlgorithm]:
    """Load the configuration and the trained model of a run, for acting.

    The policy is read from `model.zip`, or from the newest checkpoint if training has not ended. Code in the file runs
    while it is read; a line on standard error says so, unless `is_trusted`.

    Raises
    ------
    ValueError
        If the folder is not that of a run, or has no model yet.
    """
    config = run.read_config()
    found = [place / MODEL for place in list_checkpoints(run.checkpoints)]
    if run.model.is_file():
        found.append(run.model)
    if not found:
        raise ValueError(f"run is {str(run.path)!r}; allowed is one with a model.zip or a checkpoint")
    torch.set_num_threads(config.torch_threads)
    if not is_trusted:
        tell_code_runs(found[-1])
    return config, CLASSES[config.algo].load(found[-1], device="cpu", custom_objects=WITHOUT_REPLAY)
