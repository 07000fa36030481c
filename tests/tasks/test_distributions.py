"""Distributions against their closed forms, and what they refuse."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import stats

import physics
from rigid_env import Distribution, TaskEnv
from rigid_env.tasks import Choice, LogUniform, Normal, Uniform
from rigid_env.tasks.distribution import LAST
from rigid_env.tasks.distributions import as_distribution
from tests.tasks.conftest import Slide, started

DRAWS = 20_000

LAWS = {
    "uniform": (Uniform(-2.0, 3.0), stats.uniform(-2.0, 5.0)),
    "log-uniform": (LogUniform(0.1, 20.0), stats.loguniform(0.1, 20.0)),
    "normal": (Normal(1.0, 0.5), stats.truncnorm(-5.0, 5.0, 1.0, 0.5)),
    "cut normal": (Normal(1.0, 0.5, low=0.8, high=3.0), stats.truncnorm(-0.4, 4.0, 1.0, 0.5)),
}


@pytest.mark.parametrize("name", LAWS)
def test_draws_follow_the_law(name):
    ours, law = LAWS[name]
    shares = np.random.default_rng(3).random((DRAWS, 1))
    # Kolmogorov and Smirnov: a right sample of this fixed seed passes at p = 1e-3.
    assert stats.kstest(ours.at(shares, {}), law.cdf).pvalue > 1e-3


@pytest.mark.parametrize("name", LAWS)
def test_the_value_is_the_quantile_of_the_uniform_number(name):
    ours, law = LAWS[name]
    shares = np.linspace(0.0, 1.0, 101)[1:-1]
    # Both go through the inverse of the normal distribution or a power: a few rounding errors, of values up to 20.
    np.testing.assert_allclose(ours.at(shares[:, None], {}), law.ppf(shares), rtol=1e-12, atol=1e-12)


def test_a_choice_takes_each_value_for_an_equal_share():
    chosen = Choice([3.0, 1.0, 2.0]).at(np.array([[0.0], [0.34], [0.66], [0.67], [LAST]]), {})
    assert chosen.tolist() == [3.0, 1.0, 1.0, 2.0, 2.0]
    assert Choice([(1, 2), (3, 4)]).at(np.array([[0.6]]), {}).tolist() == [[3.0, 4.0]]


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_values_stay_between_the_ends(data):
    numbers = st.floats(-1e3, 1e3)
    low, high = sorted([data.draw(numbers), data.draw(numbers)])
    share = np.array([[data.draw(st.floats(0.0, 1.0, exclude_max=True))]])
    # low + (high - low) share may pass `high` by the rounding of the sum, half an ulp of the larger end.
    slack = np.spacing(max(abs(low), abs(high)))
    assert low - slack <= Uniform(low, high).at(share, {})[0] <= high + slack
    if high > low + 1e-6:
        assert low <= Normal(low, 1.0, low, high).at(share, {})[0] <= high


def test_rows_are_drawn_number_by_number():
    place = Uniform((0.0, 10.0), (1.0, 20.0))
    assert place.length == place.uniforms == 2
    assert place.at(np.array([[0.5, 0.25]]), {}).tolist() == [[0.5, 12.5]]
    assert Uniform(2.0, 2.0).is_fixed
    assert not place.is_fixed


def test_numbers_and_pairs_are_distributions():
    assert as_distribution("mass", (4.0, 8.0), 1).at(np.array([[0.5]]), {}).tolist() == [6.0]
    assert as_distribution("mass", 4.0, 1).is_fixed
    assert as_distribution("goal", (1.0, 2.0, 3.0)).length == 3
    assert as_distribution("goal", ((0, 0), (1, 1))).length == 2
    law = Normal(0.0, 1.0)
    assert as_distribution("goal", law) is law


REFUSED = {
    "uniform-order": (lambda: Uniform(2.0, 1.0), ("Uniform", "low 2.0", "high 1.0", "low at most high")),
    "uniform-lengths": (lambda: Uniform((0, 0), (1, 1, 1)), ("Uniform", "one length")),
    "uniform-nan": (lambda: Uniform(0.0, np.nan), ("high of Uniform", "nan", "finite")),
    "log-zero": (lambda: LogUniform(0.0, 1.0), ("LogUniform", "low 0.0", "0 < low")),
    "normal-deviation": (lambda: Normal(0.0, -1.0, -1, 1), ("deviation of Normal", "-1.0", "above 0")),
    "normal-ends": (lambda: Normal(0.0, 1.0, 2.0, 1.0), ("Normal", "low 2.0", "high 1.0")),
    "choice-empty": (lambda: Choice([]), ("values of Choice", "[]")),
    "choice-words": (lambda: Choice(["a"]), ("values of Choice", "'a'")),
    "as-word": (
        lambda: as_distribution("draws mass", "heavy", 1),
        ("draws mass", "'heavy'", "a number", "(low, high)"),
    ),
    "as-length": (lambda: as_distribution("draws size", Uniform(0, 1), 3), ("draws size", "1 numbers", "3")),
    "read-outside": (lambda: Choice([1.0, 2.0]).read("options k", 3.0, 1), ("options k", "3.0", "[1.0, 2.0]")),
    "read-shape": (lambda: Uniform(0, 1).read("options k", [1.0, 2.0], 3), ("options k", "a number", "3 worlds")),
    "read-nan": (lambda: Uniform(0, 1).read("options k", np.inf, 1), ("options k", "inf", "finite")),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refusals_name_field_value_and_what_is_allowed(name):
    make, words = REFUSED[name]
    with pytest.raises(ValueError, match="allowed") as error:
        make()
    assert all(word in str(error.value) for word in words), str(error.value)


# --- a distribution of one's own --------------------------------------------------------------------------------------


class Triangle(Distribution):
    """Numbers from 0 to 2, as likely as a triangle over them is high: the sum of two uniform numbers."""

    length, uniforms = 1, 2

    def at(self, shares, drawn):
        return shares[:, 0] + shares[:, 1]

    def describe(self):
        return "a triangle from 0 to 2"

    def read(self, field, value, worlds):
        values = super().read(field, value, worlds)
        if not ((values >= 0.0) & (values <= 2.0)).all():
            raise ValueError(f"{field} is {value!r}; allowed are numbers from 0 to 2")
        return values


class Drawing(Slide):
    """A task that draws with it."""

    draws = {"before": (0.0, 1.0), "height": Triangle(), "after": (0.0, 1.0), "friction": (0.1, 0.5)}  # noqa: RUF012
    scene = physics.Scene(Slide.scene.bodies, Slide.scene.walls, (*Slide.scene.effects, physics.Friction(0.3)))


class Direction(Distribution):
    """Unit vectors: four numbers, normalised, which have no value in their middle."""

    length = uniforms = 4

    def at(self, shares, drawn):
        numbers = 2.0 * shares - 1.0
        return numbers / np.linalg.norm(numbers, axis=1, keepdims=True)

    def describe(self):
        return "any direction"


def test_a_distribution_without_a_value_in_its_middle_is_drawn_from():
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        task = started(type("Directed", (Slide,), {"draws": {"towards": Direction()}})(3))
    np.testing.assert_allclose(np.linalg.norm(task.drawn["towards"], axis=1), 1.0)


@pytest.mark.parametrize(
    ("gave", "told"),
    [
        (lambda n: np.full((n, 4), np.inf), "gave inf; allowed are finite numbers"),
        (lambda n: np.zeros(4), r"gave float64 of shape \(4,\); allowed are numbers of shape \(\d, 4\)"),
        (lambda n: [[0.0] * 4] * n, r"gave \[\[0.0, 0.0, 0.0, 0.0\].*\]; allowed are numbers of shape \(\d, 4\)"),
        (lambda n: np.full((n, 4), "a"), r"gave <U1 of shape \(\d, 4\); allowed are numbers of shape \(\d, 4\)"),
    ],
)
@pytest.mark.parametrize("is_late", [False, True])
def test_what_a_distribution_of_ones_own_may_not_give_is_told(gave, told, is_late):
    """Not by an error of NumPy's, and not by what follows from it; when the task is made, and at a start."""

    class Odd(Direction):
        is_odd = not is_late

        def at(self, shares, drawn):
            return gave(len(shares)) if self.is_odd else super().at(shares, drawn)

    def make():
        task = type("Directed", (Slide,), {"draws": {"towards": Odd()}})(2)
        Odd.is_odd = True
        started(task)

    with pytest.raises(ValueError, match=rf"at of Odd, draws towards, {told}"):
        make()


def test_a_distribution_of_ones_own_draws_in_its_task():
    task = started(Drawing(2000))
    assert stats.kstest(task.drawn["height"], stats.triang(0.5, 0.0, 2.0).cdf).pvalue > 1e-3
    assert "a triangle from 0 to 2" in TaskEnv(Drawing).describe()


@given(seed=st.integers(0, 1000), value=st.floats(0.0, 2.0))
@settings(max_examples=20)
def test_its_options_fix_it_and_leave_the_other_draws_of_the_seed_alone(seed, value):
    env = TaskEnv(Drawing)
    drawn = env.reset(seed=seed)[1]
    fixed = env.reset(seed=seed, options={"height": value})[1]
    assert fixed["height"] == value
    for name in ("before", "after", "friction"):
        assert fixed[name] == drawn[name]


def test_its_own_refusals_are_told():
    env = TaskEnv(Drawing)
    with pytest.raises(ValueError, match=r"options height is 2.5; allowed are numbers from 0 to 2"):
        env.reset(seed=0, options={"height": 2.5})
    with pytest.raises(ValueError, match=r"draws height is Uniform.*, of 2 numbers; allowed are 1"):
        TaskEnv(Drawing, draws={"height": Uniform((0, 0), (1, 1))})
