"""HTML tables of a task's states and rollouts, for notebooks."""

from __future__ import annotations

import numpy as np

from rigid_env import BlockReach, rollout
from rigid_env.tasks.restoring import capture
from tests.physics.test_html_table import rows_of
from tests.tasks.conftest import started


def test_states_and_rollouts_have_tables():
    task = started(BlockReach(2))
    state = capture(task, {}, [None, None])
    assert rows_of(state._repr_html_()) == [["TaskState"], ["BlockReach"], ["2 worlds"], ["time", "0 s"]]
    rows = rows_of(rollout(task, np.zeros((2, 3, 6)))._repr_html_())
    assert rows[:3] == [["TaskRollout"], ["2 worlds"], ["3 control steps"]]
