"""Arrows, line segments and coils of springs in viser's scene."""

from __future__ import annotations

import numpy as np

from rigid_env.rendering.geometry import plane_axes
from rigid_env.viewer.scenery import Placement, vivid

SHAFT, HEAD, HEAD_LENGTH = 0.013, 0.036, 0.11
"""Radii of an arrow's shaft and head, and length of its head, in extents of the largest body."""

SHORTEST = 0.6
"""Shortest arrow that is drawn, in lengths of an arrow's head."""

LONGEST = 1.6
"""Longest arrow that is drawn, in extents of the largest body; the force of an impact is cut to this length."""

LINE = 0.011
"""Width of a line, in extents of the largest body."""

COILS, COIL_POINTS, COIL_RADIUS = 9, 12, 0.03
"""Turns of a spring's coil, points of each turn, and radius of the coil in extents of the largest body."""


class Nodes:
    """Base of objects that own nodes of viser's scene, which are added by the first drawing and can be hidden.

    Parameters
    ----------
    scene : viser.SceneApi
    placement : Placement
        Scale and origin of the drawing.
    name : str, optional
        Name of the node, or of the parent of several nodes; by default the class attribute `name`.
    """

    name = ""

    def __init__(self, scene, placement: Placement, name: str = ""):
        self._scene, self._placement, self._name = scene, placement, name or self.name
        self._nodes: list = []

    def hide(self) -> None:
        """Make the nodes invisible until they are drawn again."""
        for node in self._nodes:
            node.visible = False

    def _move(self, **values) -> None:
        """Set attributes of all nodes to new values, and make the nodes visible."""
        for node in self._nodes:
            for name, value in {**values, "visible": True}.items():
                setattr(node, name, value)


class Arrows(Nodes):
    """Arrows in one node of viser's scene.

    Attributes
    ----------
    unit : float
        Length that scales arrow heads and the shortest and longest arrow [m]; at first the extent of the largest body.
    """

    def __init__(self, scene, placement: Placement, name: str = ""):
        super().__init__(scene, placement, name)
        self.unit = placement.unit

    def draw(self, starts, vectors, colours) -> None:
        """Draw arrows from points `starts` (n, 3) along `vectors` (n, 3), as long as the vectors; world frame [m].

        `colours` is one RGB colour for all, or (n, 3).
        """
        starts, vectors = (np.asarray(each, dtype=float).reshape(-1, 3) for each in (starts, vectors))
        unit = self.unit
        lengths = np.sqrt(np.sum(vectors * vectors, axis=1))
        kept = np.isfinite(lengths) & (lengths > SHORTEST * HEAD_LENGTH * unit)
        if not kept.any():
            self.hide()
            return
        vectors = vectors[kept] * np.minimum(1.0, LONGEST * unit / lengths[kept])[:, None]
        ends = self._placement.drawn(np.stack([starts[kept], starts[kept] + vectors], axis=1))
        colours = vivid(colours)
        colours = np.broadcast_to(colours if colours.ndim == 1 else colours[kept], (len(ends), 3))
        if self._nodes:
            self._move(points=ends, colors=colours)
            return
        size = unit * self._placement.scale
        sizes = {"shaft_radius": SHAFT * size, "head_radius": HEAD * size, "head_length": HEAD_LENGTH * size}
        self._nodes = [self._scene.add_arrows(self._name, ends, colours, **sizes)]


class Lines(Nodes):
    """Line segments of one colour in one node of viser's scene."""

    colour = (0, 0, 0)

    def draw(self, segments) -> None:
        """Draw line segments (n, 2, 3), world frame [m]."""
        if len(segments) == 0:
            self.hide()
            return
        drawn = self._placement.drawn(segments)
        if self._nodes:
            self._move(points=drawn)
            return
        width = LINE * self._placement.unit * self._placement.scale
        self._nodes = [self._scene.add_line_segments(self._name, drawn, vivid(self.colour), thickness=width)]


def path(points) -> np.ndarray:
    """Line segments (n - 1, 2, 3) that join points (n, 3) in their order."""
    points = np.asarray(points, dtype=float)
    return np.stack([points[:-1], points[1:]], axis=1)


def spring(start, end, unit: float) -> np.ndarray:
    """Line segments (n, 2, 3) of a coil between two points (3,) [m]; `unit` is the extent of the largest body [m]."""
    start, end = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
    along = end - start
    length = float(np.linalg.norm(along))
    if not 0.0 < length < np.inf:
        return np.zeros((0, 2, 3))
    u, v = plane_axes(along / length)
    share = np.linspace(0.0, 1.0, COILS * COIL_POINTS + 1)
    angle = 2.0 * np.pi * COILS * share
    radius = COIL_RADIUS * unit * np.minimum(1.0, 8.0 * np.minimum(share, 1.0 - share))
    circle = np.cos(angle)[:, None] * u + np.sin(angle)[:, None] * v
    return path(start + share[:, None] * along + radius[:, None] * circle)
