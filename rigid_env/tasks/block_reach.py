"""BlockReach: bring the block's centre over a place on the floor and leave it at rest there."""

from __future__ import annotations

from rigid_env.tasks import entries, kernels
from rigid_env.tasks import layout as col
from rigid_env.tasks.base import Task, spread_option


class BlockReach(Task):
    """The batch behind `rigid_env.env.BlockReachEnv`, which documents it."""

    observation = (
        *entries.GOAL_OFFSET,
        *entries.MOTION,
        *entries.ROTATION,
        *entries.GAPS,
        *entries.HOLD,
    )
    goal_options = ("goal",)
    error_name = "distance"

    def _set_goals(self, record, shares, starts, size, options):
        goals = self.area.spread(shares, size)
        if "goal" in options:
            goals = spread_option("goal", options.pop("goal"), goals.shape)
        record[:, col.GOAL : col.GOAL + 2] = goals

    _kernel = staticmethod(kernels.observe_reach)
