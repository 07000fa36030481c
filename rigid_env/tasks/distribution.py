"""Base class of distributions that an episode draws from; each turns uniform numbers into values.

A distribution takes a fixed number of uniform numbers for one value. An episode first draws the uniform numbers of all
distributions from the random generator of its world. So with the same seed, a fixed value or a replaced distribution
does not change the values of the other distributions, if it takes as many uniform numbers.
"""

from __future__ import annotations

import reprlib
from abc import ABC, abstractmethod
from collections.abc import Mapping

import numpy as np

LAST = float(np.nextafter(1.0, 0.0))
"""Largest number below 1: the upper end of uniform numbers."""

Drawn = Mapping[str, np.ndarray]
"""Type of the values that an episode has drawn already, by name: (n,) or (n, k) float64."""


class Distribution(ABC):
    """Distribution that new episodes draw one named value from.

    Attributes
    ----------
    length : int
        Length k of one value: values are (n,) arrays for 1, else (n, k).
    uniforms : int
        Uniform numbers that one value takes.
    """

    length: int
    uniforms: int

    @abstractmethod
    def at(self, shares: np.ndarray, drawn: Drawn) -> np.ndarray:
        """Turn uniform numbers into values.

        Parameters
        ----------
        shares : (n, uniforms) float64
            Uniform numbers in [0, 1), a row for each value.
        drawn : mapping of str to array
            Values of the same episodes that are drawn earlier: physical parameters first, the rest in the order of the
            task's `draws`.

        Returns
        -------
        (n,) or (n, length) float64
        """

    @abstractmethod
    def describe(self) -> str:
        """Description of the distribution for a table, such as ``uniform from 0 to 1``."""

    @property
    def is_fixed(self) -> bool:
        """True if all episodes get the same value."""
        return False

    def ends(self) -> np.ndarray:
        """Values (2,) or (2, length) of the distribution where all uniform numbers are 0, and where all are `LAST`."""
        return np.stack([self.at(np.full((1, self.uniforms), share), {})[0] for share in (0.0, LAST)])

    def read(self, field: str, value, worlds: int) -> np.ndarray:
        """Check a value that a user gives instead of a draw.

        Parameters
        ----------
        field : str
            Name of the value in an error.
        value : array_like
            One value for all worlds, or one for each.
        worlds : int
            Number of worlds.

        Returns
        -------
        (worlds,) or (worlds, length) float64

        Raises
        ------
        ValueError
            The message names the field, its value and what is allowed.
        """
        return read_numbers(field, value, worlds, self.length)


def read_numbers(field: str, value, worlds: int, length: int) -> np.ndarray:
    """Check that a user's value has finite numbers, and repeat it for each world: (worlds,) or (worlds, length).

    `value` has `length` numbers for all worlds, or as many for each; a ValueError names `field`.
    """
    shape = (worlds,) if length == 1 else (worlds, length)
    try:
        array = np.asarray(value)
    except ValueError:  # rows of different lengths
        array = np.asarray(None)
    if array.dtype.kind not in "fiu" or array.shape not in (shape, shape[1:]):
        one = "a number" if length == 1 else f"{length} numbers"
        each = f", or as much for each of {worlds} worlds" if worlds > 1 else ""
        raise ValueError(f"{field} is {reprlib.repr(value)}; allowed is {one}{each}")
    array = array.astype(np.float64)
    if not np.isfinite(array).all():
        raise ValueError(f"{field} is {reprlib.repr(value)}; allowed are finite numbers")
    return np.broadcast_to(array, shape)


def is_of_user(distribution: Distribution) -> bool:
    """True if the distribution, or one that it contains, has a class from outside `rigid_env`, whose code may fail."""
    parts = (distribution, *(part for part in vars(distribution).values() if isinstance(part, Distribution)))
    return any(not str(type(part).__module__).startswith("rigid_env.") for part in parts)
