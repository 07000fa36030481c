"""Infos of native vector environments: arrays with masks, in the form of Gymnasium's `VectorEnv._add_info`."""

from __future__ import annotations

from typing import Any

import numpy as np

from rigid_env.envs.contact_infos import ContactInfos
from rigid_env.tasks import Task
from rigid_env.tasks import layout as col


def keys(task: Task, contacts: ContactInfos | None = None) -> tuple[str, ...]:
    """Keys of every info, both of a step and of a start."""
    told = () if contacts is None else contacts.keys
    return ("is_success", *task.info_names, "physics_status", *told, *task.own_draws)


class BatchInfos:
    """Maker of the infos of a batch. All arrays are new in each info; its keys share one mask, which is read-only.

    Numbers of one kind are rows of one array, so that few arrays are allocated. In a small batch, allocation takes as
    long as the rest of an info.

    Parameters
    ----------
    task : Task
    contacts : ContactInfos or None
    """

    def __init__(self, task: Task, contacts: ContactInfos | None):
        self._task, self._contacts = task, contacts
        self._numbers = [name for name in task.own_draws if task.drawn[name].ndim == 1]
        self._rows = [name for name in task.own_draws if task.drawn[name].ndim > 1]
        self._changes, self._drawn = -1, np.empty((0, task.worlds))
        self._masks = tuple(f"_{key}" for key in keys(task, contacts))
        self._all = np.ones(task.worlds, dtype=np.bool_)

    def __call__(self, mask: np.ndarray | None = None) -> dict[str, Any]:
        """Infos of the last step or start for the worlds of `mask` (worlds,) bool; zero in the others."""
        task = self._task
        outcome, drawn = task.outcome.T.copy(), task.drawn
        infos = {"is_success": outcome[col.SUCCESS] > 0.0}
        infos.update(zip(task.info_names, outcome[col.INFO :]))
        infos["physics_status"] = task.status.copy()
        if self._contacts is not None:
            infos.update(self._contacts.all())
        if self._changes != task.episodes.changes:
            self._changes = task.episodes.changes
            self._drawn = np.array([drawn[name] for name in self._numbers])
        infos.update(zip(self._numbers, self._drawn.copy()))
        for name in self._rows:
            infos[name] = drawn[name].copy()
        if mask is not None:
            for values in infos.values():
                values[~mask] = 0
        mask = (self._all if mask is None else mask).copy()
        mask.flags.writeable = False
        infos.update(dict.fromkeys(self._masks, mask))
        return infos

    def of_ended(self, source, mask: np.ndarray) -> dict[str, Any]:
        """`final_obs` and `final_info` of episodes that end where `mask` is True, taken before they restart."""
        final_obs = np.full(len(mask), None, dtype=object)
        for i in np.flatnonzero(mask):
            final_obs[i] = source.one(i)
        return {
            "final_obs": final_obs,
            "_final_obs": mask.copy(),
            "final_info": self(mask),
            "_final_info": mask.copy(),
        }
