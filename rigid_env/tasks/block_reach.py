"""BlockReach: bring the block's centre over a place on the floor and leave it at rest there."""

from __future__ import annotations

from typing import ClassVar

from rigid_env.tasks import entries, kernels
from rigid_env.tasks import layout as col
from rigid_env.tasks.base import Task


class BlockReach(Task):
    """The batch behind `rigid_env.envs.block_reach.BlockReachEnv`, which documents it."""

    observation = (
        *entries.GOAL_OFFSET,
        *entries.MOTION,
        *entries.ROTATION,
        *entries.GAPS,
        *entries.HOLD,
    )
    goal_options: ClassVar = {"goal": "place"}
    error_name = "distance"

    def _set_goals(self, record, shares, starts, size, options):
        record[:, col.GOAL : col.GOAL + 2] = options["goal"] if "goal" in options else self.area.spread(shares, size)

    _kernel = staticmethod(kernels.observe_reach)
