"""Infos of native vector environments: arrays with masks, in the form of Gymnasium's `VectorEnv._add_info`."""

from __future__ import annotations

from typing import Any

import numpy as np

from rigid_env.envs.contact_infos import ContactInfos
from rigid_env.tasks import Task
from rigid_env.tasks import layout as col


def keys(task: Task, contacts: ContactInfos | None = None) -> tuple[str, ...]:
    """Keys of the infos of every step and start."""
    return ("is_success", *task.info_names, "physics_status", *(() if contacts is None else contacts.keys))


def of_outcomes(task: Task, mask: np.ndarray | None = None, contacts: ContactInfos | None = None) -> dict[str, Any]:
    """Infos of the last step or start, with zeros for worlds outside of `mask` (worlds,) bool."""
    outcome = task.outcome
    infos = {"is_success": outcome[:, col.SUCCESS] > 0.0}
    for column, name in enumerate(task.info_names, col.INFO):
        infos[name] = outcome[:, column].copy()
    infos["physics_status"] = task.status.copy()
    if contacts is not None:
        infos.update(contacts.all())
    if mask is None:
        mask = np.ones(task.worlds, dtype=np.bool_)
    else:
        for values in infos.values():
            values[~mask] = 0
    infos.update({f"_{key}": mask.copy() for key in tuple(infos)})
    return infos


def add_drawn(infos: dict[str, Any], task: Task, rows: np.ndarray) -> None:
    """Add the drawn values of episodes that begin in the worlds `rows` (n,) to infos, with zeros for other worlds."""
    mask = np.zeros(task.worlds, dtype=np.bool_)
    mask[rows] = True
    for name in task.own_draws:
        now = task.drawn[name]
        told = np.zeros_like(now)
        told[rows] = now[rows]
        infos[name], infos[f"_{name}"] = told, mask.copy()


def of_ended(task: Task, source, mask: np.ndarray, contacts: ContactInfos | None = None) -> dict[str, Any]:
    """Make `final_obs` and `final_info` of the episodes that end where `mask` is True, before they restart."""
    final_obs = np.full(task.worlds, None, dtype=object)
    for i in np.flatnonzero(mask):
        final_obs[i] = source.one(i)
    return {
        "final_obs": final_obs,
        "_final_obs": mask.copy(),
        "final_info": of_outcomes(task, mask, contacts),
        "_final_info": mask.copy(),
    }
