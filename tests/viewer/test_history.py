"""History and samples: laws that hold for any use of them."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigid_env.viewer.history import UNITS, History, Samples, size_of

STATE = np.zeros(100)  # 800 bytes


@given(steps=st.integers(1, 3000), room=st.integers(0, 20_000), wanted=st.integers(0, 3000))
def test_memory_is_bounded_and_an_earlier_state_is_always_there(steps, room, wanted):
    history = History(0.0, room)
    for k in range(steps):
        if history.is_due(k):
            history.keep(k, STATE)
        history.add(0.01 * (k + 1), None, 0)
    assert history.size <= max(room, 2 * STATE.nbytes)
    entry = history.before(wanted)
    assert entry.index <= wanted
    later = [k for k in range(entry.index + 1, min(wanted, steps - 1) + 1) if history.is_due(k)]
    assert not later or entry.index >= later[0] - 1 or entry.index == later[0]
    assert history.index_at(history.times[min(wanted, steps)]) == min(wanted, steps)


@given(steps=st.integers(1, 200), back=st.integers(0, 200))
def test_what_is_forgotten_is_gone(steps, back):
    history, back = History(0.0), min(steps, back)
    for k in range(steps):
        if history.is_due(k):
            history.keep(k, k)
        history.inputs[k] = [k]
        history.add(float(k + 1), k, k)
    history.forget(back)
    assert history.last == back
    assert history.times[-1] == back
    assert history.before(steps).index <= back
    assert max(history.inputs) <= back


def test_size_counts_arrays_wherever_they_are():
    assert size_of((STATE, {"a": [STATE]})) >= 2 * STATE.nbytes


@given(st.integers(0, 5000), st.integers(0, 5000))
def test_samples_keep_their_order(count, kept):
    samples = Samples()
    for k in range(count):
        samples.append(time=float(k), energy=2.0 * k)
    samples.truncate(kept)
    kept = min(count, kept)
    assert len(samples) == len(samples.time) == kept
    assert np.array_equal(samples.energy, 2.0 * np.arange(kept))
    assert np.isnan(samples.error).all()


def test_columns_are_named_and_cannot_be_written():
    samples = Samples()
    samples.append(time=1.0)
    assert {len(getattr(samples, name)) for name in UNITS} == {1}
    with pytest.raises(ValueError, match="read-only"):
        samples.time[0] = 2.0
    with pytest.raises(AttributeError, match="'heat'; allowed are time"):
        samples.heat  # noqa: B018
