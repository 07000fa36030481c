"""Distributions that a task can draw from: uniform, log-uniform, normal, and a choice of values."""

from __future__ import annotations

import reprlib

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rigid_env.tasks.distribution import Distribution, Drawn

DEVIATIONS = 5.0
"""Standard deviations from the mean at which a normal distribution is cut off."""


class _Elementwise(Distribution):
    """Base of distributions whose values have independent elements: each element takes one uniform number."""

    def _set(self, name: str, **ends) -> None:
        """Check parameters given by name, and keep each as an attribute: arrays of one shape, () or (k,)."""
        arrays = {}
        for field, value in ends.items():
            try:
                array = np.asarray(value, dtype=np.float64)
            except (TypeError, ValueError):
                array = np.array(np.nan)
            if array.ndim > 1 or not np.isfinite(array).all():
                raise ValueError(f"{field} of {name} is {value!r}; allowed are a finite number and a row of such")
            arrays[field] = array
        try:
            spread = np.broadcast_arrays(*arrays.values())
        except ValueError:
            raise ValueError(f"{name} has {ends}; allowed are ends of one length") from None
        for field, array in zip(arrays, spread):
            setattr(self, field, np.array(array))
        self.length = self.uniforms = 1 if spread[0].ndim == 0 else len(spread[0])

    def _row(self, shares: np.ndarray) -> np.ndarray:
        return shares[:, 0] if self.length == 1 and self.is_scalar else shares

    @property
    def is_scalar(self) -> bool:
        """True if a value is a single number instead of a row."""
        return self._first.ndim == 0

    @property
    def _first(self) -> np.ndarray:
        return next(value for value in vars(self).values() if isinstance(value, np.ndarray))


class Uniform(_Elementwise):
    """Numbers from `low` to `high`, each with the same probability.

    Parameters
    ----------
    low, high : number or (k,) numbers
        Ends. With k numbers, a value is a row of k numbers that are drawn independently.

    Raises
    ------
    ValueError
        Ends that are not finite or of different lengths, or `low` above `high`.
    """

    low: NDArray[np.float64]
    high: NDArray[np.float64]

    def __init__(self, low: ArrayLike, high: ArrayLike) -> None:
        self._set("Uniform", low=low, high=high)
        if not (self.low <= self.high).all():
            raise ValueError(f"Uniform has low {low!r} and high {high!r}; allowed is low at most high")

    @property
    def is_fixed(self) -> bool:
        return bool((self.low == self.high).all())

    def at(self, shares: np.ndarray, drawn: Drawn) -> np.ndarray:
        return self.low + (self.high - self.low) * self._row(shares)

    def describe(self) -> str:
        return f"{_text(self.low)}" if self.is_fixed else f"uniform from {_text(self.low)} to {_text(self.high)}"

    def __repr__(self) -> str:
        return f"Uniform({_text(self.low)}, {_text(self.high)})"


class LogUniform(_Elementwise):
    """Positive numbers from `low` to `high` whose logarithm is uniform.

    Parameters
    ----------
    low, high : number or (k,) numbers
        Ends, above 0. With k numbers, a value is a row of k numbers that are drawn independently.

    Raises
    ------
    ValueError
        Ends that are not finite, not positive or of different lengths, or `low` above `high`.
    """

    low: NDArray[np.float64]
    high: NDArray[np.float64]

    def __init__(self, low: ArrayLike, high: ArrayLike) -> None:
        self._set("LogUniform", low=low, high=high)
        if not ((self.low > 0.0) & (self.low <= self.high)).all():
            raise ValueError(f"LogUniform has low {low!r} and high {high!r}; allowed is 0 < low <= high")

    @property
    def is_fixed(self) -> bool:
        return bool((self.low == self.high).all())

    def at(self, shares: np.ndarray, drawn: Drawn) -> np.ndarray:
        return self.low * (self.high / self.low) ** self._row(shares)

    def describe(self) -> str:
        return f"log-uniform from {_text(self.low)} to {_text(self.high)}"

    def __repr__(self) -> str:
        return f"LogUniform({_text(self.low)}, {_text(self.high)})"


class Normal(_Elementwise):
    """Numbers of a normal distribution that is cut off at two ends.

    A value is drawn by the inverse of the cumulative distribution between the ends.

    Parameters
    ----------
    mean : number or (k,) numbers
        Mean before the cut.
    deviation : number or (k,) numbers
        Standard deviation before the cut, above 0.
    low, high : number or (k,) numbers, optional
        Ends; by default five deviations from the mean, so that the value for each uniform number is finite.

    Raises
    ------
    ValueError
        Numbers that are not finite, a deviation that is not positive, or `low` not below `high`.
    """

    mean: NDArray[np.float64]
    deviation: NDArray[np.float64]

    def __init__(self, mean, deviation, low=None, high=None):
        ends = {"low": 0.0 if low is None else low, "high": 0.0 if high is None else high}
        self._set("Normal", mean=mean, deviation=deviation, **ends)
        if low is None:
            self.low = self.mean - DEVIATIONS * self.deviation
        if high is None:
            self.high = self.mean + DEVIATIONS * self.deviation
        if not (self.deviation > 0.0).all():
            raise ValueError(f"deviation of Normal is {deviation!r}; allowed are numbers above 0")
        if not (self.low < self.high).all():
            raise ValueError(f"Normal has low {low!r} and high {high!r}; allowed is low below high")
        from scipy.special import ndtr  # this import takes half a second, so only normal distributions pay for it

        self._ends = tuple(ndtr((end - self.mean) / self.deviation) for end in (self.low, self.high))

    def at(self, shares: np.ndarray, drawn: Drawn) -> np.ndarray:
        from scipy.special import ndtri

        low, high = self._ends
        values = self.mean + self.deviation * ndtri(low + (high - low) * self._row(shares))
        return np.clip(values, self.low, self.high)

    def describe(self) -> str:
        return (
            f"normal, mean {_text(self.mean)}, deviation {_text(self.deviation)}, "
            f"from {_text(self.low)} to {_text(self.high)}"
        )

    def __repr__(self) -> str:
        return f"Normal({', '.join(map(_text, (self.mean, self.deviation, self.low, self.high)))})"


class Choice(Distribution):
    """One of several values, each with the same probability.

    Parameters
    ----------
    values : sequence of numbers, or of rows of k numbers

    Raises
    ------
    ValueError
        No values, or values that are not finite numbers of one length.
    """

    uniforms = 1

    def __init__(self, values):
        try:
            array = np.asarray(list(values), dtype=np.float64)
        except (TypeError, ValueError):
            array = np.empty(0)
        if array.ndim not in (1, 2) or len(array) == 0 or not np.isfinite(array).all():
            raise ValueError(f"values of Choice is {values!r}; allowed are numbers, or rows of one length")
        self.values = array
        self.length = 1 if array.ndim == 1 else array.shape[1]

    @property
    def is_fixed(self) -> bool:
        return len(self.values) == 1

    def at(self, shares: np.ndarray, drawn: Drawn) -> np.ndarray:
        return self.values[(len(self.values) * shares[:, 0]).astype(np.int64)]

    def read(self, field, value, worlds):
        array = super().read(field, value, worlds)
        rows = array.reshape(worlds, -1)
        if not (rows[:, None] == self.values.reshape(len(self.values), -1)).all(axis=2).any(axis=1).all():
            raise ValueError(f"{field} is {reprlib.repr(value)}; allowed are {self.values.tolist()}")
        return array

    def describe(self) -> str:
        return f"one of {self.values.tolist()}"

    def __repr__(self) -> str:
        return f"Choice({self.values.tolist()})"


def is_elementwise(distribution: Distribution) -> bool:
    """True if the elements of a value are drawn independently, so that two elements are hardly ever equal."""
    return isinstance(distribution, _Elementwise) and not distribution.is_fixed


def as_distribution(field: str, value, length: int | None = None) -> Distribution:
    """Make a distribution from a user's value.

    Parameters
    ----------
    field : str
        Name of the value in an error.
    value : Distribution, number, row of numbers, or a pair (low, high) of either
        A pair is a uniform range. A row of two numbers means a pair, unless `length` is 2.
    length : int, optional
        Required length of one value; None: any.

    Raises
    ------
    ValueError
        The message names the field, its value and what is allowed.
    """
    if isinstance(value, Distribution):
        if length is not None and value.length != length:
            raise ValueError(f"{field} is {value!r}, of {value.length} numbers; allowed are {length}")
        return value
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.empty((0, 0, 0))
    row = () if length in (1, None) else (length,)
    if array.shape == (2, *row) or (length is None and array.ndim == 2 and len(array) == 2):
        if not (array[0] <= array[1]).all():
            raise ValueError(f"{field} is {value!r}; allowed is a pair (low, high) with low at most high")
        return Uniform(array[0], array[1])
    if array.shape == row or (length is None and array.ndim == 1):
        return Uniform(array, array)
    one = "a number" if row == () else f"{length} numbers"
    raise ValueError(f"{field} is {value!r}; allowed is {one}, a pair (low, high) of such, or a distribution")


def _text(value) -> str:
    array = np.asarray(value)
    return f"{float(array):g}" if array.ndim == 0 else "(" + ", ".join(f"{x:g}" for x in array) + ")"
