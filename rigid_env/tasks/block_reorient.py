"""BlockReorient: turn the block so that a given face is down, and leave it at rest."""

from __future__ import annotations

from typing import ClassVar

from rigid_env.tasks import block_entries as entries
from rigid_env.tasks import kernels
from rigid_env.tasks import layout as col
from rigid_env.tasks.block import BlockTask
from rigid_env.tasks.block_draws import OtherFace


class BlockReorient(BlockTask):
    """Task of `rigid_env.envs.block_reorient.BlockReorientEnv`, whose docstring describes it, in a batch of worlds."""

    observation = (
        *entries.GOAL_AXES,
        *entries.MOTION,
        *entries.GAPS,
        *entries.HOLD,
    )
    measures = ("angle", "speed", "spin")
    explanations: ClassVar = {
        "target_face": "face to be turned down: 0 to 5 for -x, +x, -y, +y, -z, +z",
        "angle": "angle between the target face's normal and straight down [rad]",
    }
    goal_draw = "target_face"
    error_name = "angle"
    compiled = staticmethod(kernels.observe_reorient)

    def goal(self):
        """Distribution of the target face: any face that is not on the floor at the start."""
        return OtherFace()

    def note_episodes(self, rows, values):
        self.record[rows, col.FACE] = values["target_face"]

    def goal_mark(self, world):
        return {"goal_face": int(self.record[world, col.FACE]), "reached": self.record[world, col.HOLD] > 0}
