"""BlockReorient: turn the block so that a given face is down, and leave it at rest."""

from __future__ import annotations

import numpy as np

from rigid_env.tasks import entries, kernels
from rigid_env.tasks import layout as col
from rigid_env.tasks.base import FACE_COUNT, Task, face_option


class BlockReorient(Task):
    """The batch behind `rigid_env.env.BlockReorientEnv`, which documents it."""

    observation = (
        *entries.GOAL_AXES,
        *entries.MOTION,
        *entries.GAPS,
        *entries.HOLD,
    )
    goal_options = ("target_face",)
    error_name = "angle"

    def _set_goals(self, record, shares, starts, size, options):
        other = 1.0 + np.floor((FACE_COUNT - 1) * shares[:, 0])
        faces = (starts[:, col.START_FACE] + other) % FACE_COUNT
        if "target_face" in options:
            faces = face_option("target_face", options.pop("target_face"), len(faces))
        record[:, col.FACE] = faces

    _kernel = staticmethod(kernels.observe_reorient)
