"""Infos of the native vector environments: arrays with their masks, as `VectorEnv._add_info` makes them."""

from __future__ import annotations

from typing import Any

import numpy as np

from rigid_env.envs.contact_infos import ContactInfos
from rigid_env.tasks import Task
from rigid_env.tasks import layout as col


def keys(task: Task, contacts: ContactInfos | None = None) -> tuple[str, ...]:
    """Keys of every info, of a step and of a start."""
    told = () if contacts is None else contacts.keys
    return ("is_success", *task.info_names, "physics_status", *told, *task.own_draws)


def of_outcomes(task: Task, mask: np.ndarray | None = None, contacts: ContactInfos | None = None) -> dict[str, Any]:
    """Infos of the last step or start for the worlds of `mask` (worlds,) bool; zero in the others.

    The drawn values are read-only arrays, which all infos share until an episode begins. So is the mask, which the keys
    of one info share.
    """
    outcome = task.outcome
    infos = {"is_success": outcome[:, col.SUCCESS] > 0.0}
    for column, name in enumerate(task.info_names, col.INFO):
        infos[name] = outcome[:, column].copy()
    infos["physics_status"] = task.status.copy()
    if contacts is not None:
        infos.update(contacts.all())
    told = task.episodes.tell()
    for name in task.own_draws:
        infos[name] = told[name] if mask is None else told[name].copy()
    if mask is None:
        mask = np.ones(task.worlds, dtype=np.bool_)
    else:
        mask = mask.copy()
        for values in infos.values():
            values[~mask] = 0
    mask.flags.writeable = False
    infos.update({f"_{key}": mask for key in tuple(infos)})
    return infos


def of_ended(task: Task, source, mask: np.ndarray, contacts: ContactInfos | None = None) -> dict[str, Any]:
    """`final_obs` and `final_info` of episodes that end where `mask` is True, taken before they restart."""
    final_obs = np.full(task.worlds, None, dtype=object)
    for i in np.flatnonzero(mask):
        final_obs[i] = source.one(i)
    return {
        "final_obs": final_obs,
        "_final_obs": mask.copy(),
        "final_info": of_outcomes(task, mask, contacts),
        "_final_info": mask.copy(),
    }
