"""Distributions that the block's tasks draw from: places on the floor, faces of the block, lengths of its edges."""

from __future__ import annotations

import reprlib

import numpy as np

from rigid_env.tasks.area import Area
from rigid_env.tasks.distribution import Distribution, read_numbers
from rigid_env.tasks.distributions import Choice, Uniform

FACE_COUNT = 6


class OnFloor(Distribution):
    """Places (x, z) on the floor at which a block of the episode's size has room to turn about the vertical [m].

    Parameters
    ----------
    area : Area
        Square of the floor that the places lie in.
    """

    length = uniforms = 2

    def __init__(self, area: Area):
        self.area = area

    def at(self, shares, drawn):
        return self.area.spread(shares, drawn["size"])

    def read(self, field, value, worlds):
        places = super().read(field, value, worlds)
        low, high = self.area.centre - self.area.half_width, self.area.centre + self.area.half_width
        if not ((places >= low) & (places <= high)).all():
            allowed = f"places inside the box, x and z from {low:g} to {high:g} m"
            raise ValueError(f"{field} is {reprlib.repr(value)}; allowed are {allowed}")
        return places

    def describe(self) -> str:
        return "uniform over the floor"


class Face(Choice):
    """A face of the block as an integer: 0 to 5 for -x, +x, -y, +y, -z, +z."""

    def __init__(self):
        super().__init__(range(FACE_COUNT))

    def read(self, field, value, worlds):
        faces = read_numbers(field, value, worlds, 1)
        if not np.isin(faces, self.values).all():
            allowed = f"integers from 0 to {FACE_COUNT - 1}, for -x, +x, -y, +y, -z, +z"
            raise ValueError(f"{field} is {reprlib.repr(value)}; allowed are {allowed}")
        return faces

    def describe(self) -> str:
        return "any face"


class OtherFace(Face):
    """A face of the block that differs from the draw `face`, which is the face on the floor at the start."""

    uniforms = 2  # only one is used; with the second, seeds of earlier versions give the same episodes

    def at(self, shares, drawn):
        return (drawn["face"] + 1.0 + np.floor((FACE_COUNT - 1) * shares[:, 0])) % FACE_COUNT

    def describe(self) -> str:
        return "any face but `face`"


class EdgesInside(Distribution):
    """Edges of a block that has room to turn in the area [m].

    Parameters
    ----------
    edges : Distribution
        Distribution of the three edges.
    area : Area
        Square of the floor that the block must fit in; a size from an option of `reset` is checked.
    """

    length = 3

    def __init__(self, edges: Distribution, area: Area):
        self.edges, self.area, self.uniforms = edges, area, edges.uniforms

    @property
    def is_fixed(self) -> bool:
        return self.edges.is_fixed

    def at(self, shares, drawn):
        return self.edges.at(shares, drawn)

    def read(self, field, value, worlds):
        edges = self.edges.read(field, value, worlds)
        if (edges > 0.0).all():  # `Draws.read` refuses edges that are not positive later, with a better message
            self.area.check_room(edges[np.argmax(np.linalg.norm(edges, axis=1))], field)
        return edges

    def describe(self) -> str:
        return self.edges.describe()


YAW = Uniform(0.0, 2.0 * np.pi)
"""Angle of the block about the vertical at the start [rad]."""
