"""Result of a ray cast over many worlds."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from physics.html_table import parts_table
from physics.summary import parts_repr


class RayHits(NamedTuple):
    """First bodies or walls that the rays of n worlds meet, from `physics.World.cast_rays`.

    Attributes
    ----------
    distance : (n, rays) float64
        Distance from the origin of the ray to the point hit [m]; inf where it hits nothing.
    hit : (n, rays) int64
        Index of the body hit, or -1 - k for wall k, as in `physics.Contacts.ends`; -2**31 where it hits nothing.
    normal : (n, rays, 3) float64
        Unit normal out of the body or wall at the point hit, world frame; zeros where it hits nothing.
    """

    distance: np.ndarray
    hit: np.ndarray
    normal: np.ndarray

    __repr__ = parts_repr
    _repr_html_ = parts_table

    def _parts(self) -> tuple[str, ...]:
        worlds, rays = self.distance.shape
        return f"worlds={worlds}", f"rays={rays}", f"hits={np.isfinite(self.distance).sum()}"


RayHits.INTEGERS = ("hit",)  # type: ignore[attr-defined]
