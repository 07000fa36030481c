"""Layouts of the walls in the block's tasks, and the square of the floor in which episodes start and goals lie."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import physics
from physics import validation
from physics.annotations import Layout

LAYOUTS = ("three", "corner")

CLEARANCE = 0.25
"""[m] Gap that is kept between each wall and a block that turns about the vertical through its centre."""


@dataclass(frozen=True)
class Area:
    """A square of the floor with the side 2 `half_width`, and the walls around it.

    In the layout ``three`` the square is centred at the origin between the walls x = ±half_width. In the layout
    ``corner`` it extends from the walls x = 0 and z = 0 to x = z = 2 `half_width`. The floor is y = 0 in both.

    Parameters
    ----------
    walls : {"three", "corner"}
        Layout.
    half_width : float
        Half the side of the square [m].

    Raises
    ------
    ValueError
        An unknown layout, or a half width that is not positive.
    """

    walls: Layout
    half_width: float

    def __post_init__(self) -> None:
        if self.walls not in LAYOUTS:
            raise ValueError(f"walls is {self.walls!r}; allowed are {', '.join(map(repr, LAYOUTS))}")
        object.__setattr__(self, "half_width", float(validation.positive(self.half_width, (), "half_width")))

    @property
    def half_spaces(self) -> list[physics.HalfSpace]:
        """Walls of the layout as half-spaces, the floor first."""
        return physics.corner() if self.walls == "corner" else physics.three_walls(self.half_width)

    @property
    def centre(self) -> float:
        """Coordinate of the square's middle [m], the same for x and z."""
        return self.half_width if self.walls == "corner" else 0.0

    def check_room(self, size: np.ndarray, option: str | None = None) -> None:
        """Raise a ValueError if a block has no room to turn in the area.

        Parameters
        ----------
        size : (3,) float64
            Edges of the block [m].
        option : str, optional
            Option of `reset` that gave the size; the error names it instead of `half_width`.
        """
        radius = 0.5 * float(np.linalg.norm(size))
        if not self.half_width > radius + CLEARANCE:
            if option is not None:
                raise ValueError(
                    f"{option} is {size.tolist()}; allowed are edges with a diagonal below "
                    f"{2.0 * (self.half_width - CLEARANCE):.6g} m, the width of the box less {CLEARANCE} m on each side"
                )
            raise ValueError(
                f"half_width is {self.half_width}; allowed is more than {radius + CLEARANCE:.6g}, "
                f"half the diagonal of a block of size {size.tolist()} and {CLEARANCE} m more"
            )

    def spread(self, shares: np.ndarray, size: np.ndarray) -> np.ndarray:
        """Turn uniform numbers into places of blocks that keep clear of the walls at any turn about the vertical.

        Parameters
        ----------
        shares : (n, 2) float64
            Uniform numbers in [0, 1), for x and z; 0.5 is the middle.
        size : (n, 3) float64
            Edges of the blocks [m].

        Returns
        -------
        (n, 2) float64
            x and z of the blocks' centres [m].
        """
        square = size * size
        radius = 0.5 * np.sqrt(square[:, 0] + square[:, 1] + square[:, 2])
        reach = (self.half_width - CLEARANCE - radius)[:, None]
        return self.centre + reach * (2.0 * shares - 1.0)
