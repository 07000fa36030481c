"""Root of a gap: the parabola that shortens a stage, against exact fractions."""

from __future__ import annotations

from fractions import Fraction

from hypothesis import given
from hypothesis import strategies as st

from physics.compiler.decorators import kernel
from physics.kernels.math.parabolic_root import parabola_crossing_time

EPS = 2.0**-52


@kernel
def _crossing(low_gap, high_gap, width, bend):
    return parabola_crossing_time(low_gap, high_gap, width, bend)


magnitudes = st.floats(-12.0, 6.0).map(lambda e: 10.0**e)
signs = st.sampled_from((-1.0, 0.0, 1.0))


@given(low=magnitudes, high=magnitudes, width=magnitudes, sign=signs, bend=magnitudes)
def test_the_parabola_is_zero_where_it_is_said_to_be(low, high, width, sign, bend):
    """However it is bent; also where it rises a long way before it comes down."""
    c = sign * bend * (low + high) / width**2
    x = _crossing(low, -high, width, c)
    assert 0.0 <= x <= width
    exact, w, g = Fraction(x), Fraction(width), Fraction(low)
    slope, bends = -(Fraction(high) + g) / w, Fraction(c)
    value = bends * exact**2 + (slope - bends * w) * exact + g
    # A root of a quadratic whose two forms do not cancel is that of one with coefficients off by a few roundings: of B,
    # by three of each of its terms; of the discriminant, by four of each of its own, half of which the root of it has.
    terms = abs(bends) * exact**2 + (abs(slope) + abs(bends) * w) * exact + g
    assert abs(value) <= 16 * EPS * terms


@given(high=magnitudes, width=magnitudes, sign=signs, bend=magnitudes)
def test_what_is_in_the_wall_already_is_there_at_the_start(high, width, sign, bend):
    assert _crossing(0.0, -high, width, sign * bend) == 0.0
