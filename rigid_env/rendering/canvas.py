"""A surface twice the picture's size, a camera, and shapes given in world coordinates."""

from __future__ import annotations

import numpy as np

from rigid_env.rendering.camera import NEAR
from rigid_env.rendering.geometry import point_lists

SUPERSAMPLING = 2
"""Pixels of the canvas for one of the picture, along each side."""

REFERENCE_HEIGHT = 600
"""[px]. Widths of lines and marks are given in units: pixels of a picture this high, else in proportion."""

LEAST_UNIT = 0.55
"""[px] of the picture. Below it lines would vanish in small pictures."""


class Canvas:
    """Draws world-frame shapes on a pygame surface.

    Parameters
    ----------
    surface : pygame.Surface
        `SUPERSAMPLING` times as large as the picture.
    camera : Camera
    pygame : module
        With `gfxdraw` imported.
    """

    def __init__(self, surface, camera, pygame):
        self.surface = surface
        self.camera = camera
        self.size = surface.get_size()
        self.scale = SUPERSAMPLING
        self.unit = SUPERSAMPLING * max(LEAST_UNIT, self.size[1] / (SUPERSAMPLING * REFERENCE_HEIGHT))
        self._weights = 1 << np.array(surface.get_shifts()[:3])
        self._draw = pygame.draw
        self._filled = pygame.gfxdraw.filled_polygon

    def project(self, points):
        """Canvas pixels (n, 2) and depths (n,) [m] of world points (n, 3) [m]."""
        return self.camera.project(points, self.size)

    def polygon(self, points, colour, alpha=255):
        """Fill a convex world polygon (n, 3) [m], clipped to the field of view; alpha 0..255."""
        self.fill(self.camera.project_polygon(points, self.size), colour, alpha)

    def loop(self, points, width, colour):
        """Closed line of `width` units through world points (n, 3) [m]."""
        self.segments(points, np.roll(points, -1, axis=0), width, colour)

    def segments(self, starts, ends, width, colour):
        """Lines of `width` units between world points (n, 3) and (n, 3) [m], clipped."""
        pixels, depths = self.project(np.concatenate([starts, ends]))
        if self.is_in_sight(pixels, depths):
            self.strokes(pixels[: len(starts)], pixels[len(starts) :], width, colour)
            return
        for segment in np.stack([starts, ends], axis=1):
            pair = self.camera.project_polygon(segment, self.size)
            if len(pair) == 2:
                self.strokes(pair[:1], pair[1:], width, colour)

    def is_in_sight(self, pixels, depths):
        """True if projected points can be drawn as they are: in front of the camera and not far off."""
        return bool(self.are_in_sight(pixels[None], depths[None])[0])

    def are_in_sight(self, pixels, depths):
        """(n,) bool: `is_in_sight` of n groups of points, pixels (n, k, 2) and depths (n, k)."""
        size = np.array(self.size)
        # a comparison with the place of a point behind the camera, which is not a number, is False
        is_near = (pixels < 1.5 * size) & (pixels > -0.5 * size)
        return is_near.all(axis=(1, 2)) & (depths > NEAR).all(axis=1)

    def stored(self, colours):
        """sRGB colours (n, 3) int as the surface stores them, (n,) int64, which is the fastest form to draw with."""
        return colours @ self._weights

    def fill(self, pixels, colour, alpha=255):
        """Fill a convex polygon given in canvas pixels (n, 2)."""
        if len(pixels) < 3:
            return
        if alpha == 255:
            self._draw.polygon(self.surface, colour, pixels.tolist())
        else:
            self._filled(self.surface, np.rint(pixels).astype(int).tolist(), (*colour, alpha))

    def fill_faces(self, pixels, corner_getters, colours):
        """Fill convex polygons: each takes its corners out of all vertices in canvas pixels (n, 2)."""
        draw, surface, points = self._draw.polygon, self.surface, list(zip(*pixels.T.tolist()))
        for corners, colour in zip(corner_getters, colours):
            draw(surface, colour, corners(points))

    def stroke(self, pixels, width, colour):
        """Line with round joints through canvas pixels (n, 2); `width` in units."""
        self.strokes(pixels[:-1], pixels[1:], width, colour)

    def strokes(self, starts, ends, widths, colours):
        """Lines between canvas pixels (n, 2) and (n, 2), with round ends, one after the other.

        `widths` in units and `colours` are one for all, or of each its own: (n,) float and a list of n.
        """
        half = np.broadcast_to(0.5 * self.unit * np.asarray(widths), len(starts))
        colours = colours if isinstance(colours, list) else [colours] * len(starts)
        along = ends - starts
        across = along[:, ::-1] * (half / np.maximum(np.hypot(along[:, 0], along[:, 1]), 1e-9))[:, None] * (-1.0, 1.0)
        quads = np.stack([starts + across, ends + across, ends - across, starts - across], axis=1)
        draw, surface = self._draw, self.surface
        for quad, radius, colour, *joints in zip(
            point_lists(quads), half.tolist(), colours, starts.tolist(), ends.tolist()
        ):
            draw.polygon(surface, colour, quad)
            if radius >= 1.0:
                for joint in joints:
                    draw.circle(surface, colour, joint, radius)

    def disc(self, pixel, radius, colour):
        """Disc of `radius` units around a canvas pixel (2,)."""
        self._draw.circle(self.surface, colour, pixel.tolist(), self.unit * radius)
