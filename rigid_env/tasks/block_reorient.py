"""BlockReorient: turn the block so that a given face is down, and leave it at rest."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from rigid_env.tasks import entries, kernels
from rigid_env.tasks import layout as col
from rigid_env.tasks.base import Task
from rigid_env.tasks.options import FACE_COUNT


class BlockReorient(Task):
    """The batch behind `rigid_env.envs.block_reorient.BlockReorientEnv`, which documents it."""

    observation = (
        *entries.GOAL_AXES,
        *entries.MOTION,
        *entries.GAPS,
        *entries.HOLD,
    )
    goal_options: ClassVar = {"target_face": "face"}
    error_name = "angle"

    def _set_goals(self, record, shares, starts, size, options):
        other = 1.0 + np.floor((FACE_COUNT - 1) * shares[:, 0])
        faces = (starts[:, col.START_FACE] + other) % FACE_COUNT
        record[:, col.FACE] = options.get("target_face", faces)

    _kernel = staticmethod(kernels.observe_reorient)
