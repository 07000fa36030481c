"""The two layouts of walls, and the part of the floor for starts and goals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

import physics
from physics import validation
from physics.annotations import Layout

LAYOUTS = ("three", "corner")

CLEARANCE = 0.25
"""[m] Gap between a wall and a block that turns about its centre on the floor."""


@dataclass(frozen=True)
class Area:
    """A square of the floor, 2 `half_width` wide.

    In the layout ``three`` it is centred at the origin between the walls x = ±half_width; in the layout
    ``corner`` it reaches from the walls x = 0 and z = 0 to 2 `half_width`.

    Parameters
    ----------
    walls : {"three", "corner"}
    half_width : float
        [m].

    Raises
    ------
    ValueError
        On an unknown layout or a half width that is not positive.
    """

    walls: Layout
    half_width: float

    def __post_init__(self) -> None:
        if self.walls not in LAYOUTS:
            raise ValueError(f"walls is {self.walls!r}; allowed are {', '.join(map(repr, LAYOUTS))}")
        object.__setattr__(self, "half_width", float(validation.positive(self.half_width, (), "half_width")))

    @property
    def half_spaces(self) -> list[physics.HalfSpace]:
        """The walls, the floor first."""
        return physics.corner() if self.walls == "corner" else physics.three_walls(self.half_width)

    @property
    def centre(self) -> float:
        """Both x and z of the middle [m]."""
        return self.half_width if self.walls == "corner" else 0.0

    def check_room(self, size: np.ndarray, option: str | None = None) -> None:
        """Raise a ValueError, which names an `option` if there is one, if a block of edges `size` (3,) does not fit."""
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
        """Places (x, z) at which a block is clear of the walls at any turn about the vertical.

        Parameters
        ----------
        shares : (n, 2) float64
            In [0, 1); 0.5 is the middle.
        size : (n, 3) float64
            Edges of the blocks [m].

        Returns
        -------
        (n, 2) float64
            [m].
        """
        square = size * size
        radius = 0.5 * np.sqrt(square[:, 0] + square[:, 1] + square[:, 2])
        reach = (self.half_width - CLEARANCE - radius)[:, None]
        return self.centre + reach * (2.0 * shares - 1.0)
