"""Parts of the panel without a page: plots, and the list of events."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from physics import Event
from rigid_env.viewer.history import Samples
from rigid_env.viewer.panel import ROWS, EventList, told
from rigid_env.viewer.plots import SMALLEST, Plot, drawn, line, thinned
from tests.viewer.conftest import Handle

NO_WALL = -1


def event(t: float, kind: str = "impact", wall: int = 0, other: int = -1) -> Event:
    return Event(t, kind, 0, wall, (0.0, 0.0, 0.0), other, (0.0, 0.0, 0.0), (0.0, 1.0, 0.0))


@given(count=st.integers(1, 5000), most=st.integers(2, 500))
def test_a_line_is_thinned_evenly_from_its_first_to_its_last_sample(count, most):
    chosen = thinned(count, most)
    assert len(chosen) <= most
    assert chosen[0] == 0
    assert chosen[-1] == count - 1
    gaps = np.diff(chosen)
    assert (gaps > 0).all()
    assert gaps.size == 0 or gaps.max() - gaps.min() <= 1  # rounding of equal parts


def test_a_line_has_the_unit_of_its_plot_and_powers_of_ten_a_bottom():
    values = np.array([0.0, 1e-3, np.nan])
    power, micro = Plot("a", ("residual",), is_power=True), Plot("b", ("penetration",), factor=1e6)
    assert line(values, power) == pytest.approx([np.log10(SMALLEST), -3.0, np.nan], nan_ok=True)
    assert line(values, micro) == pytest.approx([0.0, 1e3, np.nan], nan_ok=True)


def test_a_plot_has_the_columns_that_are_known_from_when_the_first_is():
    samples, plot = Samples(), Plot("distance", ("error", "error_of_reference"))
    for k in range(6):
        samples.append(time=0.1 * k, error=float(k) if k >= 2 else np.nan)
    columns, data = drawn(plot, samples, np.arange(6))
    assert columns == ("error",)
    assert [part.tolist() for part in data] == [pytest.approx([0.2, 0.3, 0.4, 0.5]), [2.0, 3.0, 4.0, 5.0]]
    samples.truncate(3)
    assert drawn(plot, samples, np.arange(3)) == ((), ())  # a single point is no line


def test_an_event_is_told_in_a_line():
    assert told(event(1.25)) == "1.250 s  impact: body 0, wall 0"
    assert told(event(0.5, other=3)) == "0.500 s  impact: body 0, body 3"
    assert told(event(0.5, "rest", NO_WALL)) == "0.500 s  rest: body 0"
    assert told(replace(event(0.5, other=3), name="cart", other_name="crate")) == "0.500 s  impact: cart, crate"


class Gui:
    """Controls that nobody sees."""

    def add_slider(self, label, low, high, step, value, visible=True):
        return Handle(max=high, value=value, visible=visible)

    def add_markdown(self, content):
        return Handle(content=content)

    def add_button(self, label, visible=True, color=None):
        return Handle(label=label, visible=visible)


def test_the_newest_events_are_in_sight_and_a_click_goes_to_their_time():
    went = []
    events = EventList(Gui(), went.append)
    events.show([event(0.1 * k) for k in range(20)])
    assert [row.label for row in events._rows] == [told(event(0.1 * k)) for k in range(19, 19 - ROWS, -1)]
    events._rows[2].acts[0](None)
    assert went == [pytest.approx(1.7)]
    events._back.value = 12  # the earliest
    events._back.acts[0](None)
    assert events._rows[-1].label == told(event(0.0))
    events.show([event(0.3)])  # after going back in time
    events.show([event(0.4)])  # and on, to as many
    assert events._rows[0].label == told(event(0.4))
    assert [row.visible for row in events._rows] == [True] + [False] * (ROWS - 1)
    events.show([])
    assert not any(row.visible for row in events._rows)
