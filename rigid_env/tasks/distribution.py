"""Base of distributions for the start of an episode; each turns uniform numbers into values.

A distribution takes a fixed number of uniform numbers, whatever the values are. An episode draws them all at once from
the generator of its world, so that fixing one value, or replacing one distribution, leaves the others of a seed alone.
"""

from __future__ import annotations

import reprlib
from abc import ABC, abstractmethod
from collections.abc import Mapping

import numpy as np

LAST = float(np.nextafter(1.0, 0.0))
"""Largest uniform number."""

Drawn = Mapping[str, np.ndarray]
"""Type of values drawn before, by name: (n,) or (n, k) float64."""


class Distribution(ABC):
    """Distribution of one named value over new episodes.

    Attributes
    ----------
    length : int
        Numbers in one value: 1 for (n,) arrays, else (n, length).
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
            In [0, 1).
        drawn : mapping of str to array
            Values that stand before this one in the task's `draws`; physical parameters stand before all others.

        Returns
        -------
        (n,) or (n, length) float64
        """

    @abstractmethod
    def describe(self) -> str:
        """Text for a table, such as ``uniform from 0 to 1``."""

    @property
    def is_fixed(self) -> bool:
        """True if the value is fixed."""
        return False

    def ends(self) -> np.ndarray:
        """Values (2,) or (2, length) at the least and the largest uniform numbers."""
        return np.stack([self.at(np.full((1, self.uniforms), share), {})[0] for share in (0.0, LAST)])

    def read(self, field: str, value, worlds: int) -> np.ndarray:
        """Check a user's value that takes the place of a draw.

        Parameters
        ----------
        field : str
            Name in an error.
        value : array_like
            One value for all worlds, or one for each.
        worlds : int

        Returns
        -------
        (worlds,) or (worlds, length) float64

        Raises
        ------
        ValueError
            Naming the field, the value and what is allowed.
        """
        return read_numbers(field, value, worlds, self.length)


def read_numbers(field: str, value, worlds: int, length: int) -> np.ndarray:
    """Finite numbers (worlds,) or (worlds, length), from one value for all worlds or one for each."""
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
    """True if a user's code draws, in the distribution or in one that it holds."""
    parts = (distribution, *(part for part in vars(distribution).values() if isinstance(part, Distribution)))
    return any(not str(type(part).__module__).startswith("rigid_env.") for part in parts)
