"""Pace and cost: laws that hold for any times that are told."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from rigid_env.viewer.pace import Cost, Pace


@given(st.lists(st.floats(1e-6, 1e-2), min_size=2, max_size=50))
def test_cost_lies_between_the_steps_that_it_is_the_mean_of(seconds):
    cost = Cost()
    cost.add(100.0, 0.01)  # compiles
    assert np.isnan(cost.value)
    for each in seconds:
        cost.add(each, 0.01)
    assert 1e8 * min(seconds) * (1 - 1e-9) <= cost.value <= 1e8 * max(seconds) * (1 + 1e-9)


@given(st.lists(st.floats(0.0, 0.1), max_size=100), st.floats(0.01, 10.0))
def test_all_time_that_is_owed_becomes_steps(seconds, speed):
    pace, interval, steps = Pace(), 0.01, 0
    pace.speed = speed
    for each in seconds:
        pace.owe(each)
        while pace.is_due(interval):
            pace.due -= interval
            steps += 1
        pace.keep_up()
    assert abs(steps * interval - sum(seconds) * speed) <= interval
    assert pace.message == ""
